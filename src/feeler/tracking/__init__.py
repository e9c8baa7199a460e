"""Antennal kinematics from tracked landmarks: how fast an animal moves its antennae while it
explores.
"""

from feeler.tables import Table, parse_table, read_table
from feeler.tracking.kinematics import (
    SIDES,
    Exploration,
    Sweeps,
    compute_antenna_angle,
    find_sweeps,
    measure_exploration,
)
from feeler.tracking.posture import (
    find_contacts,
    make_base_motion,
    measure_clearance,
    measure_posture,
)
from feeler.tracking.quality import make_synthetic_tracks
from feeler.tracking.rhythm import (
    Groups,
    compare_groups,
    compare_sides,
    measure_base,
    measure_rhythm,
)
from feeler.tracking.tracks import LANDMARKS, Tracks, load_tracks, save_poses

__all__ = [
    "LANDMARKS",
    "SIDES",
    "Exploration",
    "Groups",
    "Sweeps",
    "Table",
    "Tracks",
    "compare_groups",
    "compare_sides",
    "compute_antenna_angle",
    "find_contacts",
    "find_sweeps",
    "load_tracks",
    "make_base_motion",
    "make_synthetic_tracks",
    "measure_base",
    "measure_clearance",
    "measure_exploration",
    "measure_posture",
    "measure_rhythm",
    "parse_table",
    "read_table",
    "save_poses",
]

__dir__ = __all__.copy
