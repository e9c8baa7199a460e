"""The robotic antenna as an :class:`~feeler.antenna.Antenna` of eight hinges."""

from typing import Annotated

import numpy as np

from feeler.antenna import Antenna
from feeler.records.checked import checked
from feeler.robot.hinge import ROBOT_FACTS, Flexures, make_flexures

MOUNT = ROBOT_FACTS["mount"].number
"""Rigid part before hinge 1 [mm]. The model starts at hinge 1: a clamped rigid mount does not move,
so it has no place in the dynamics, and ``location`` and ``length`` count from hinge 1. Add it to
get places on the device.
"""


@checked
def make_robot(
    *,
    hinges: Flexures | None = None,
    stiffness_factor: Annotated[float, "> 0"] = ROBOT_FACTS["stiffness_factor"].number,
    damping_factor: Annotated[float, "> 0"] = ROBOT_FACTS["damping_factor"].number,
    mass: Annotated[float, "> 0"] = ROBOT_FACTS["mass"].number,
    radius: float = ROBOT_FACTS["radius"].number,
    name: str = "robot",
) -> Antenna:
    """The robotic antenna: k = p1·k_th and c = p2·k_th, k_th from each flexure's geometry.

    The antenna's length counts from hinge 1 (62.45 mm); the 6.2 mm mount before it is rigid and not
    part of the model. The sheet's thickness, its free length, the share of mass in each link and
    the unit of p2 are not published [C], so absolute frequencies and forces of the real robot must
    not be read off this preset: fit p1 and p2 to a recording with :func:`feeler.robot.fit_factors`.

    Parameters
    ----------
    hinges
        Flexure geometry; default :func:`make_flexures`.
    stiffness_factor, damping_factor
        p1 [1] and p2 [ms].
    mass
        Mass of the whole device [g]; link masses are its share by area, width × length, the rest is
        mount [C].
    radius
        Collision radius [mm].

    Returns
    -------
    Antenna
        8 segments, every hinge a sensor.
    """
    hinges = make_flexures() if hinges is None else hinges
    n = hinges.stiffness.size
    segment_length = np.append(
        np.full(n - 1, ROBOT_FACTS["spacing"].number), ROBOT_FACTS["last_link"].number
    )
    return Antenna(
        segment_length=segment_length,
        segment_mass=_share_mass(mass, segment_length, hinges.width),
        radius=np.full(n, radius),
        stiffness=stiffness_factor * hinges.stiffness,
        damping=damping_factor * hinges.stiffness,
        sensors=np.arange(1, n + 1),
        name=name,
    )


def _share_mass(mass: float, segment_length: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Mass (segment,) [g] of links of one areal density.

    The mount takes the device's remaining length at full width.
    """
    length, body_width, _ = ROBOT_FACTS["body"].numbers
    link_area = segment_length * width
    mount_area = max(length - segment_length.sum(), MOUNT) * body_width
    return mass * link_area / (link_area.sum() + mount_area)
