"""The reality gap as numbers: how far a surrogate robot may differ from the model."""

from dataclasses import fields
from typing import Annotated

import numpy as np

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.record import Ge, Lt, Record
from feeler.stimulus import Trial
from feeler.task.nuisances import NAMES as NUISANCES
from feeler.task.nuisances import Nuisances

_Size = Annotated[float, Ge(0)]


class Gap(Record):
    """Standard deviations and sizes of every difference.

    All are choices [C]; none was measured on the real robot.

    ``Gap()`` is one reality gap; ``Gap().scaled(2)`` doubles every entry and ``Gap().scaled(0)``
    removes them all.

    Attributes
    ----------
    stiffness : float
        sd of the stiffness of all hinges together, as a share.
    stiffness_each : float
        sd of each hinge's own stiffness, as a share.
    damping : float
        sd of the damping of all hinges together, as a share.
    mass : float
        sd of each link's mass, as a share.
    length : float
        sd of each link's length, as a share.
    rest_angle : float
        sd of each hinge's rest angle [rad].
    play : float
        Compliance of the mount at the base, as a share of hinge 1's; its angle is not sensed.
    location : float
        sd of the place of contact, as a fraction of the length.
    speed : float
        sd of the feature's speed, as a share.
    size : float
        sd of the feature's size, as a share.
    approach : float
        sd of the feature's direction [degrees].
    friction : float
        sd of the logarithm of friction.
    noise : float
        sd of each reading [rad]; the paper's device resolves less than 1° = 0.017 rad.
    quantum : float
        Step of the converter [rad].
    gain : float
        sd of each channel's change of gain since its calibration, as a share.
    drift : float
        sd of each channel's wander over one second [rad].
    crosstalk : float
        Share of each neighbour's signal in a channel.
    bend : float
        Departure of the capacitance's characteristic from a straight line at 0.35 rad, as a share.
    hysteresis : float
        Half-width of the sensing hysteresis [rad].
    jitter : float
        sd of each sample's time [ms].
    dropped : float
        Share of samples lost.
    """

    stiffness: _Size = 0.10
    stiffness_each: _Size = 0.08
    damping: _Size = 0.25
    mass: _Size = 0.08
    length: _Size = 0.01
    rest_angle: _Size = 0.015
    play: _Size = 0.10
    location: _Size = 0.01
    speed: _Size = 0.02
    size: _Size = 0.03
    approach: _Size = 2.0
    friction: _Size = 0.3
    noise: _Size = 0.004
    quantum: _Size = 0.002
    gain: _Size = 0.03
    drift: _Size = 0.010
    crosstalk: _Size = 0.02
    bend: _Size = 0.03
    hysteresis: _Size = 0.006
    jitter: _Size = 0.05
    dropped: Annotated[float, Ge(0), Lt(0.5)] = 0.01

    def scaled(self, factor: float) -> "Gap":
        """Every entry times ``factor``; the share of dropped samples stays below 0.4."""
        if not (np.isfinite(factor) and factor >= 0):
            raise InvalidInput(f"the size of a gap must be finite and ≥ 0, got {factor}.")
        values = {entry.name: factor * getattr(self, entry.name) for entry in fields(self)}
        return Gap(**{**values, "dropped": min(values["dropped"], 0.4)})


def draw_antenna(antenna: Antenna, gap: Gap, rng: np.random.Generator) -> Antenna:
    """The same antenna with its mechanics drawn around the nominal.

    Shares are log-normal, so all stay positive.
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
    """The same touch as an experimenter would carry it out.

    Place, speed, size, direction and friction are drawn.
    """
    named = {name: getattr(gap, name) for name in NUISANCES}
    return Nuisances(kind="normal", **named).jitter([trial], rng)[0]
