"""What the base does to an antenna, from how the antenna moves: Newton's and Euler's laws over all
segments.
"""

import numpy as np

from feeler.antenna.antenna import Antenna


def compute_reaction(
    antenna: Antenna,
    angle: np.ndarray,
    rate: np.ndarray,
    acceleration: np.ndarray,
    base: np.ndarray,
    gravity: np.ndarray,
    point: np.ndarray,
    force: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Force [N] and moment [N·mm] (about the base, positive as angles are) of the base on the
    antenna.

    F = Σ m (a − g) − Σ f and M = Σ (I α + m (a − g) · P(r)) − Σ f · P(r), with P(r) = (r_y, −r_x).

    Parameters
    ----------
    angle, rate, acceleration
        Of every hinge (segment,) [rad, rad/ms, rad/ms²].
    base
        (3, 3): x, y, heading of the base; their rates; their accelerations.
    gravity
        (2,) [mm/ms²].
    point, force
        Contacts' places [mm] and forces on the antenna [N], (contact, 2).
    """
    heading, omega, alpha = (
        row[2] + np.cumsum(hinge)
        for row, hinge in zip(base, (angle, rate, acceleration), strict=True)
    )
    along = antenna.segment_length[:, None] * np.stack(
        [np.sin(heading), np.cos(heading)], axis=1
    )
    step = alpha[:, None] * _turn(along) - (omega**2)[:, None] * along
    arm = np.cumsum(along, axis=0) - 0.5 * along
    push = antenna.segment_mass[:, None] * (
        base[2, :2] + np.cumsum(step, axis=0) - 0.5 * step - gravity
    )
    own = antenna.segment_mass * antenna.segment_length**2 / 12 * alpha
    moment = own.sum() + np.sum(push * _turn(arm)) - np.sum(force * _turn(point - base[0, :2]))
    return push.sum(axis=0) - force.sum(axis=0), float(moment)


def _turn(r: np.ndarray) -> np.ndarray:
    return np.stack([r[..., 1], -r[..., 0]], axis=-1)
