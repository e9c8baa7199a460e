"""Families of hinges: few numbers that give stiffness and damping along an antenna; and the
interval that a fit leaves these.
"""

from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna, Constant, Exponential, Linear
from feeler.errors import InvalidInput
from feeler.records import Record, Registry, freeze
from feeler.renamed import rename_antenna
from feeler.validation import checked, show

# [C] the exponential antenna's last hinge; else a fit runs to a limp tip
_TIP_STIFFNESS, _TIP_DAMPING = 3.85e-4, 0.0153
_K, _C, _RATE = "N·mm/rad", "N·mm·ms/rad", "1/joint"
FAMILIES: Registry[Callable[[Antenna], "Hinges"]] = Registry("family of hinges")


class Hinges(Record):
    """A family of hinges on a given antenna.

    ``x`` is the searched vector (logarithms where ``positive``), ``p`` the parameters themselves.

    Attributes
    ----------
    start : np.ndarray
        Parameters to start from.
    low : np.ndarray
        Lower bounds of the parameters.
    high : np.ndarray
        Upper bounds.
    """

    name: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    positive: tuple[bool, ...]
    start: Annotated[np.ndarray, "parameter"]
    low: Annotated[np.ndarray, "parameter"]
    high: Annotated[np.ndarray, "parameter"]
    build: Callable[[np.ndarray], Antenna]

    def _check(self) -> None:
        several = ("names", "units", "positive", "start", "low", "high")
        if len({len(getattr(self, name)) for name in several}) > 1:
            sizes = ", ".join(f"{name} {len(getattr(self, name))}" for name in several)
            raise InvalidInput(f"Hinges need one of each for every parameter, got {sizes}.")
        outside = (self.start < self.low) | (self.start > self.high)
        if np.any(outside) or np.any(self.low >= self.high):
            k = int(np.argmax(outside | (self.low >= self.high)))
            raise InvalidInput(
                f"{self.names[k]} starts at {self.start[k]:g}, outside its bounds {self.low[k]:g}"
                f" to {self.high[k]:g}. Widen the bounds or move the start."
            )
        if np.any(self.low[list(self.positive)] <= 0):
            raise InvalidInput(
                "the lower bound of a positive parameter must be > 0: it is searched as a"
                " logarithm."
            )

    def _read(self, values: Any) -> np.ndarray:
        """Numbers of which the last axis has one for each parameter."""
        found = freeze(values)
        if found.shape[-1:] != self.start.shape or not np.isfinite(found).all():
            raise InvalidInput(
                f"{self.name} has the parameters {', '.join(self.names)}: {self.start.size} finite"
                f" numbers are needed, got {show(values)}."
            )
        return found

    def to_x(self, p: Sequence[float] | np.ndarray) -> np.ndarray:
        """Searched vector of parameters ``p``."""
        p = self._read(p)
        return np.where(self.positive, np.log(np.where(self.positive, p, 1.0)), p)

    def to_p(self, x: Sequence[float] | np.ndarray) -> np.ndarray:
        """Parameters of a searched vector, or of several (vector, parameter)."""
        x = self._read(x)
        return np.where(self.positive, np.exp(np.where(self.positive, x, 0.0)), x)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the searched vector."""
        return self.to_x(self.low), self.to_x(self.high)

    @property
    def scale(self) -> np.ndarray:
        """A typical change of each searched number: 1 for logarithms, else an eighth of its range.

        For rates of 140 joints that is 0.02 per joint, a factor of 16 along the antenna.
        """
        return np.where(self.positive, 1.0, (self.high - self.low) / 8)


def _make(name, antenna, fields, build) -> Hinges:
    names, units, start, low, high, positive = zip(*fields, strict=True)
    return Hinges(
        name=name,
        names=names,
        units=units,
        positive=positive,
        start=np.array(start),
        low=np.array(low),
        high=np.array(high),
        build=lambda p: antenna.replace(
            **build(np.asarray(p, dtype=float), antenna.n_segments), name=name
        ),
    )


def _read_ends(values: np.ndarray) -> tuple[float, float]:
    """First value and mean rate per joint of a profile that is nowhere 0."""
    if values.min() <= 0:
        raise InvalidInput(
            "an exponential profile starts from hinges that are all > 0; this antenna has some"
            " at 0."
        )
    return float(values[0]), round(
        float(np.log(values[-1] / values[0])) / max(values.size - 1, 1), 12
    )


@FAMILIES.register("exponential")
def _make_exponential(antenna: Antenna) -> Hinges:
    """p1…p4 of the paper: stiffness and damping at the base, then their rates per joint.

    Starts at the antenna's own ends; bounds are those of the cockroach, as multiples of where it
    starts.
    """
    joints = antenna.n_segments / 140
    (k, k_rate), (c, c_rate) = (
        _read_ends(values) for values in (antenna.stiffness, antenna.damping)
    )
    steepest = -0.16 / joints
    return _make(
        "exponential",
        antenna,
        [
            ("p1", _K, k, 0.4 * (k / 37.78), 4000.0 * (k / 37.78), True),
            ("p2", _C, c, 0.25 * (c / 25.24), 2500.0 * (c / 25.24), True),
            ("p3", _RATE, np.clip(k_rate, steepest, 0.0), steepest, 0.0, False),
            ("p4", _RATE, np.clip(c_rate, steepest, 0.0), steepest, 0.0, False),
        ],
        lambda p, n: {
            "stiffness": Exponential(base=p[0], rate=p[2]).sample(n),
            "damping": Exponential(base=p[1], rate=p[3]).sample(n),
        },
    )


@FAMILIES.register("linear")
def _make_linear(antenna: Antenna) -> Hinges:
    """Stiffness and damping at the base and at the tip.

    The tip is kept from being softer than the cockroach's.
    """
    return _make(
        "linear",
        antenna,
        [
            ("stiffness_base", _K, 0.57, 1e-2, 1e3, True),
            ("stiffness_tip", _K, 4e-4, _TIP_STIFFNESS, 1e3, True),
            ("damping_base", _C, 4.44, 1e-2, 1e4, True),
            ("damping_tip", _C, 0.02, _TIP_DAMPING, 1e4, True),
        ],
        lambda p, n: {
            "stiffness": Linear(base=p[0], tip=p[1]).sample(n),
            "damping": Linear(base=p[2], tip=p[3]).sample(n),
        },
    )


@FAMILIES.register("uniform")
def _make_constant(antenna: Antenna) -> Hinges:
    """One stiffness and one damping for all hinges."""
    return _make(
        "uniform",
        antenna,
        [("stiffness", _K, 0.395, 1e-2, 1e3, True), ("damping", _C, 3.17, 1e-2, 1e4, True)],
        lambda p, n: {
            "stiffness": Constant(value=p[0]).sample(n),
            "damping": Constant(value=p[1]).sample(n),
        },
    )


@FAMILIES.register("scale")
def make_scale(antenna: Antenna) -> Hinges:
    """Two factors on the antenna's own hinges (the robot's fit): p1 on stiffness, p2 on damping."""
    return _make(
        "scale",
        antenna,
        [("p1", "1", 1.0, 1e-3, 1e3, True), ("p2", "1", 1.0, 1e-3, 1e3, True)],
        lambda p, n: {"stiffness": p[0] * antenna.stiffness, "damping": p[1] * antenna.damping},
    )


@FAMILIES.register("tilt")
def _make_tilt(antenna: Antenna) -> Hinges:
    """The antenna's own hinges times p1 (stiffness) and p2 (damping), each tilted.

    A tilt multiplies by exp(tilt · (x − ½)), x the place of the hinge.
    """
    x = antenna.hinge_position / antenna.length - 0.5
    return _make(
        "tilt",
        antenna,
        [
            ("p1", "1", 1.0, 1e-3, 1e3, True),
            ("p2", "1", 1.0, 1e-3, 1e3, True),
            ("stiffness_tilt", "1", 0.0, -8.0, 8.0, False),
            ("damping_tilt", "1", 0.0, -8.0, 8.0, False),
        ],
        lambda p, n: {
            "stiffness": p[0] * antenna.stiffness * np.exp(p[2] * x),
            "damping": p[1] * antenna.damping * np.exp(p[3] * x),
        },
    )


@checked
def make_hinges(name: str, antenna: Antenna) -> Hinges:
    """The family called ``name`` on ``antenna``; the error lists the valid names."""
    return FAMILIES[rename_antenna(name)](antenna)
