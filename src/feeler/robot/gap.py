"""The reality gap as numbers: how far a surrogate robot may differ from the model that trains the
classifier.
"""

from dataclasses import dataclass, fields

import numpy as np

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.stimulus import Trial
from feeler.task.nuisances import NAMES as NUISANCES
from feeler.task.nuisances import Nuisances


@dataclass(frozen=True, kw_only=True)
class Gap:
    """Standard deviations and sizes of every difference; all are choices [C], none was measured on
    the real robot.

    ``Gap()`` is one reality gap; ``Gap().scaled(2)`` doubles every entry and ``Gap().scaled(0)``
    removes them all.
    """

    stiffness: float = 0.10
    """sd of the stiffness of all hinges together, as a share."""
    stiffness_each: float = 0.08
    """sd of each hinge's own stiffness, as a share."""
    damping: float = 0.25
    """sd of the damping of all hinges together, as a share."""
    mass: float = 0.08
    """sd of each link's mass, as a share."""
    length: float = 0.01
    """sd of each link's length, as a share."""
    rest_angle: float = 0.015
    """sd of each hinge's rest angle [rad]."""
    play: float = 0.10
    """Compliance of the mount at the base, as a share of hinge 1's; its angle is not sensed."""
    location: float = 0.01
    """sd of the place of contact, as a fraction of the length."""
    speed: float = 0.02
    """sd of the feature's speed, as a share."""
    size: float = 0.03
    """sd of the feature's size, as a share."""
    approach: float = 2.0
    """sd of the feature's direction [degrees]."""
    friction: float = 0.3
    """sd of the logarithm of friction."""
    noise: float = 0.004
    """sd of each reading [rad]; the paper's device resolves less than 1° = 0.017 rad."""
    quantum: float = 0.002
    """Step of the converter [rad]."""
    gain: float = 0.03
    """sd of each channel's change of gain since its calibration, as a share."""
    drift: float = 0.010
    """sd of each channel's wander over one second [rad]."""
    crosstalk: float = 0.02
    """Share of each neighbour's signal in a channel."""
    bend: float = 0.03
    """Departure of the capacitance's characteristic from a straight line at 0.35 rad, as a share.
    """
    hysteresis: float = 0.006
    """Half-width of the sensing hysteresis [rad]."""
    jitter: float = 0.05
    """sd of each sample's time [ms]."""
    dropped: float = 0.01
    """Share of samples lost."""

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not (np.isfinite(value) and value >= 0):
                raise InvalidInput(f"Gap.{entry.name} must be finite and ≥ 0, got {value}.")
        if self.dropped >= 0.5:
            raise InvalidInput(
                f"Gap.dropped must be < 0.5, got {self.dropped}: half of a recording cannot be"
                " mended."
            )

    def scaled(self, factor: float) -> "Gap":
        """Every entry times ``factor``; the share of dropped samples stays below 0.4."""
        if not (np.isfinite(factor) and factor >= 0):
            raise InvalidInput(f"the size of a gap must be finite and ≥ 0, got {factor}.")
        values = {entry.name: factor * getattr(self, entry.name) for entry in fields(self)}
        return Gap(**{**values, "dropped": min(values["dropped"], 0.4)})


def draw_antenna(antenna: Antenna, gap: Gap, rng: np.random.Generator) -> Antenna:
    """The same antenna with its mechanics drawn around the nominal; shares are log-normal, so all
    stay positive.
    """
    n = antenna.n_segments
    shares = {
        "stiffness": np.exp(
            gap.stiffness * rng.standard_normal() + gap.stiffness_each * rng.standard_normal(n)
        ),
        "damping": np.exp(gap.damping * rng.standard_normal()),
        "segment_mass": np.exp(gap.mass * rng.standard_normal(n)),
        "segment_length": np.exp(gap.length * rng.standard_normal(n)),
    }
    changes = {name: getattr(antenna, name) * share for name, share in shares.items()}
    return antenna.replace(
        **changes, rest_angle=antenna.rest_angle + gap.rest_angle * rng.standard_normal(n)
    )


def draw_trial(trial: Trial, gap: Gap, rng: np.random.Generator) -> Trial:
    """The same touch as an experimenter would carry it out: place, speed, size, direction and
    friction drawn.
    """
    named = {name: getattr(gap, name) for name in NUISANCES}
    return Nuisances(kind="normal", **named).jitter([trial], rng)[0]
