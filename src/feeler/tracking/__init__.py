"""Antennal kinematics from tracked landmarks: how fast an animal moves its antennae while it
explores.
"""

from feeler.tensors.table import Table, parse_table, read_table
from feeler.tracking.kinematics import (
    SIDES,
    Exploration,
    Sweeps,
    compute_antenna_angle,
    find_sweeps,
    measure_exploration,
    measure_posture,
)
from feeler.tracking.quality import make_synthetic_tracks, save_dltdv
from feeler.tracking.tracks import LANDMARKS, Tracks, load_tracks, save_poses

__all__ = [
    "LANDMARKS",
    "SIDES",
    "Exploration",
    "Sweeps",
    "Table",
    "Tracks",
    "compute_antenna_angle",
    "find_sweeps",
    "load_tracks",
    "make_synthetic_tracks",
    "measure_exploration",
    "measure_posture",
    "parse_table",
    "read_table",
    "save_dltdv",
    "save_poses",
]


def __dir__() -> list[str]:
    return sorted(__all__)
