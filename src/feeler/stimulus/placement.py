"""Placement: from a trial to where its feature stands at time 0 and how it moves."""

from dataclasses import dataclass

import numpy as np
import scipy

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.stimulus.clearance import compute_clearance
from feeler.stimulus.trial import Trial


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A feature frame's origin at time 0 [mm], its unit forward axis, and its velocity [mm/ms], each (2,)."""

    origin: np.ndarray
    forward: np.ndarray
    velocity: np.ndarray


def place(antenna: Antenna, trial: Trial) -> Placement:
    """Where the trial's feature starts so that contact begins ``trial.lead`` ms after time 0.

    The feature is drawn back along its motion until it just touches the antenna at rest (perpendicular approach of a
    straight antenna: the foremost point is one collision radius away from the axis), and further by speed · lead.

    Raises
    ------
    InvalidInput
        The feature is bigger than the antenna, cannot avoid touching it, or would start in contact.
    """
    _check_size(antenna, trial)
    points = antenna.shape()
    target, forward = _aim(antenna, trial, points)
    touching = _touching_offset(antenna, trial, points, target, forward)
    back = touching + trial.speed * trial.lead
    origin = target - back * forward
    if compute_clearance(points, antenna.radius, trial.shape, origin, forward) <= 0:
        raise InvalidInput(
            f"the feature starts in contact with the antenna ({trial.label}, approach {trial.approach:g}°). "
            "Choose an approach nearer to 90°, a shorter lead, or a straighter antenna."
        )
    return Placement(origin=origin, forward=forward, velocity=trial.speed * forward)


def _check_size(antenna: Antenna, trial: Trial) -> None:
    size = trial.feature.size
    if not trial.feature.wide and 2 * size > antenna.length:
        raise InvalidInput(
            f"the feature is bigger than the antenna: {trial.feature.name} of half-width {size:g} mm, "
            f"antenna {antenna.length:g} mm long. Use a half-width up to {antenna.length / 2:g} mm, or Wall()."
        )


def _aim(antenna: Antenna, trial: Trial, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The touched point of the axis and the unit direction of motion."""
    arc = trial.location * antenna.length
    ends = np.cumsum(antenna.segment_length)
    n = min(int(np.searchsorted(ends, arc * (1 - 1e-12))), antenna.n_segments - 1)
    along = (points[n + 1] - points[n]) / antenna.segment_length[n]
    target = points[n] + (arc - (ends[n] - antenna.segment_length[n])) * along
    turn = np.radians(trial.approach) * (-1.0 if trial.side == "left" else 1.0)
    c, s = np.cos(turn), np.sin(turn)
    if trial.approach == 90.0:
        c, s = 0.0, np.sign(s)  # exact, so that mirrored trials are mirror images to the last bit
    return target, np.array([c * along[0] - s * along[1], s * along[0] + c * along[1]])


def _touching_offset(
    antenna: Antenna, trial: Trial, points: np.ndarray, target: np.ndarray, forward: np.ndarray
) -> float:
    """Distance from the target back to the origin at which the feature just touches."""

    def gap(offset: float) -> float:
        return compute_clearance(points, antenna.radius, trial.shape, target - offset * forward, forward)

    low, high = 0.0, float(antenna.radius.max())
    while gap(high) <= 0:
        low, high = high, 2 * high
        if high > 10 * antenna.length:
            raise InvalidInput(
                f"the feature cannot be placed clear of the antenna ({trial.label}); change the approach."
            )
    return float(scipy.optimize.brentq(gap, low, high, xtol=1e-12, rtol=1e-14)) if gap(low) < 0 else low
