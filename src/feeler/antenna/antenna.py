"""An antenna: a chain of rigid segments joined by damped hinge springs, in one plane."""

from typing import Annotated, Any

import numpy as np

from feeler.antenna.beam import Along, compute_beam
from feeler.antenna.profile import sample_quantity
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.record import Ge, Gt, Record, Unit, freeze
from feeler.svg import make_picture

MAX_SEGMENTS = 1000
_QUANTITIES = ("segment_mass", "radius", "stiffness", "damping", "rest_angle")
N_SENSORS = 56  # [P] recorded points along the flagellum


@checked
def make_even_sensors(
    n_segments: Annotated[int, "> 0"], n_sensors: Annotated[int, "> 0"] = N_SENSORS
) -> np.ndarray:
    """Hinge numbers (sensor,) spread evenly from hinge 1 to the last; all hinges where there are
    fewer [C].
    """
    if n_sensors >= n_segments:
        return np.arange(1, n_segments + 1)
    return np.unique(np.round(np.linspace(1, n_segments, n_sensors)).astype(int))


class Antenna(Record):
    """An antenna as data, base to tip; segment n hangs on hinge n, hinge 1 sits at the clamped
    base.

    Each array holds one value per segment; a single number stands for the same value in every
    segment.

    Attributes
    ----------
    segment_length : np.ndarray
        Length of each segment [mm], > 0.
    segment_mass : np.ndarray
        Mass of each segment [g], > 0, spread evenly over its length (a thin rod).
    radius : np.ndarray
        Collision radius of each segment [mm], > 0; it enters contact, not inertia.
    stiffness : np.ndarray
        Stiffness of each segment's proximal hinge [N·mm/rad], ≥ 0, not all zero.
    damping : np.ndarray
        Damping of each hinge [N·mm·ms/rad], ≥ 0.
    rest_angle : np.ndarray
        Angle of each hinge at which its spring is slack [rad], positive towards +x.
    sensors : np.ndarray
        Numbers (1 = base) of the hinges that carry a sensor, rising; default 56 spread evenly.
    name : str
        Name that labels its tensors.

    Raises
    ------
    InvalidInput
        An array of the wrong length, not finite, or outside its range, or sensors that name no
        hinge.
    """

    segment_length: Annotated[np.ndarray, "segment?", Gt(0), Unit("mm")]
    segment_mass: Annotated[np.ndarray, "segment?", Gt(0), Unit("g")]
    radius: Annotated[np.ndarray, "segment?", Gt(0), Unit("mm")]
    stiffness: Annotated[np.ndarray, "segment?", Ge(0), Unit("N·mm/rad")]
    damping: Annotated[np.ndarray, "segment?", Ge(0), Unit("N·mm·ms/rad")]
    rest_angle: Annotated[np.ndarray, "segment?", Unit("rad")] = 0.0  # type: ignore[assignment]  # one number stands for as many as segments
    sensors: Annotated[np.ndarray, "sensor?"] = None  # type: ignore[assignment]  # chosen when the segments are known
    name: str = "custom"

    def _check(self) -> None:
        n = self.segment_length.size
        if not 1 <= n <= MAX_SEGMENTS:
            raise InvalidInput(
                f"an antenna has 1 to {MAX_SEGMENTS} segments, got segment_length with {n} values."
            )
        for name in ("segment_length", *_QUANTITIES):
            values = getattr(self, name)
            if values.ndim and values.size != n:
                raise InvalidInput(
                    f"{name} must be one number or {n} numbers (one per segment), got an array of"
                    f" shape {values.shape}."
                )
            vars(self)[name] = freeze(np.broadcast_to(values, n))
        if not np.any(self.stiffness > 0):
            raise InvalidInput(
                "stiffness is 0 in every hinge: nothing holds the antenna. Give at least one hinge"
                " > 0."
            )
        if np.any(np.abs(self.rest_angle) > np.pi):
            raise InvalidInput(
                f"rest_angle must lie within ±π rad, got up to {np.abs(self.rest_angle).max():.3g}."
            )
        vars(self)["sensors"] = _check_sensors(self.sensors, n)

    @classmethod
    def from_beam(
        cls,
        *,
        length: float,
        modulus: Along,
        density: Along,
        radius: Along | None = None,
        width: Along | None = None,
        thickness: Along | None = None,
        n_segments: int = 60,
        damping_time: Along = 0.0,
        **fields: Any,
    ) -> "Antenna":
        """An antenna by its making: k = E·I/ℓ in each hinge (twice that in hinge 1, which stands
        for half a segment), m = ρ·A·ℓ.

        ``radius``, ``width``, ``thickness`` [mm], ``modulus`` [MPa], ``density`` [g/mm³] and
        ``damping_time`` [ms] are numbers, or functions or formulas of the place x, 0 at the base
        and 1 at the tip: ``lambda x: 0.2 - 0.15 * x`` or ``"0.2 - 0.15 * x"``. The section is a
        full circle of ``radius``, or a strip that bends across its ``thickness``. Damping is
        ``damping_time`` times stiffness. Other ``fields`` (sensors, rest_angle, name) are the
        antenna's own.

        Raises
        ------
        InvalidInput
            No section or two, or a quantity that is not > 0 all along.
        """
        beam = compute_beam(
            length, n_segments, radius, width, thickness, modulus, density, damping_time
        )
        return cls(**{**beam, **fields})

    @classmethod
    def from_profile(
        cls, n_segments: int, *, length: float | None = None, **fields: Any
    ) -> "Antenna":
        """An antenna by its profiles: each quantity a number, an array, a profile, or a formula.

        ``stiffness="37.78 * exp(-0.0827 * (n - 1))"`` is ``Exponential(base=37.78, rate=-0.0827)``;
        what a formula may use is in :mod:`feeler.antenna.formula`. Without ``segment_length`` all
        segments share ``length`` [mm] evenly.

        Raises
        ------
        InvalidInput
            Both or none of ``length`` and ``segment_length``, or a formula that is not understood.
        """
        if (length is None) == ("segment_length" not in fields):
            raise InvalidInput("give either length [mm], for even segments, or segment_length.")
        lengths = sample_quantity(fields.pop("segment_length", f"{length!r} / N"), n_segments)
        quantities = {
            k: sample_quantity(v, n_segments, lengths)
            for k, v in fields.items()
            if k in _QUANTITIES
        }
        return cls(segment_length=lengths, **{**fields, **quantities})

    def __repr__(self) -> str:
        mass, sensors = 1e3 * self.segment_mass.sum(), self.sensors.size
        return (
            f"Antenna {self.name!r}: {self.n_segments} segments, {self.length:.4g} mm, {mass:.4g}"
            f" mg, {sensors} sensors,\n  stiffness {_span(self.stiffness)} N·mm/rad, damping"
            f" {_span(self.damping)} N·mm·ms/rad"
        )

    def _repr_html_(self) -> str:
        return make_picture(repr(self), [(self.shape(), 2 * float(self.radius.mean()))])

    @property
    def n_segments(self) -> int:
        """Number of segments, which is the number of hinges."""
        return self.segment_length.size

    @property
    def length(self) -> float:
        """Length of the straight antenna [mm]."""
        return float(self.segment_length.sum())

    @property
    def hinge_position(self) -> np.ndarray:
        """Arc length (segment,) of each hinge from the base [mm]; the first is 0."""
        return np.concatenate(([0.0], np.cumsum(self.segment_length)[:-1]))

    def shape(self, angle: np.ndarray | None = None, base_angle: float = 0.0) -> np.ndarray:
        """Points (…, n_segments + 1, 2) [mm] of base, hinges and tip for hinge angles (…, segment)
        [rad].

        Segment n points along (sin φ_n, cos φ_n) with φ_n the sum of the angles up to hinge n and
        ``base_angle``; ``angle=None`` is the posture at rest.

        Raises
        ------
        InvalidInput
            Not one angle per segment.
        """
        heading = self._find_heading(angle, base_angle)
        steps = self.segment_length[:, None] * np.stack([np.sin(heading), np.cos(heading)], axis=-1)
        points = np.zeros((*steps.shape[:-2], self.n_segments + 1, 2))
        np.cumsum(steps, axis=-2, out=points[..., 1:, :])
        return points

    def tip(self, angle: np.ndarray | None = None, base_angle: float = 0.0) -> np.ndarray:
        """The last of the points of :meth:`shape`, (…, 2) [mm], in a third of the time."""
        heading = self._find_heading(angle, base_angle)
        across = np.einsum("...n,n->...", np.sin(heading), self.segment_length)
        return np.stack(
            [across, np.einsum("...n,n->...", np.cos(heading), self.segment_length)], axis=-1
        )

    def _find_heading(self, angle: np.ndarray | None, base_angle: float) -> np.ndarray:
        angle = self.rest_angle if angle is None else np.asarray(angle, dtype=float)
        if angle.ndim == 0 or angle.shape[-1] != self.n_segments:
            raise InvalidInput(
                f"shape needs the angles of all {self.n_segments} hinges (…, segment), got shape"
                f" {angle.shape}. A Dataset holds the sensors' hinges only; simulate with"
                " all_hinges=True to draw it."
            )
        return base_angle + np.cumsum(angle, axis=-1)


def _span(values: np.ndarray) -> str:
    """First and last value, base to tip."""
    return (
        f"{values[0]:.3g}" if np.all(values == values[0]) else f"{values[0]:.3g} … {values[-1]:.3g}"
    )


def _check_sensors(sensors: np.ndarray | None, n: int) -> np.ndarray:
    if sensors is None:
        return freeze(make_even_sensors(n), int)
    numbers = np.atleast_1d(sensors)
    if numbers.size == 0 or np.any(numbers % 1):
        raise InvalidInput(f"sensors must be whole hinge numbers from 1 to {n}, got {sensors!r}.")
    if numbers.min() < 1 or numbers.max() > n or np.any(np.diff(numbers) <= 0):
        raise InvalidInput(
            f"sensors must rise from base to tip within 1…{n}, got {sensors.tolist()}."
        )
    return freeze(numbers, int)
