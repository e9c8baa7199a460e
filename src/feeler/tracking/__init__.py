"""Antennal kinematics from tracked landmarks: how fast an animal moves its antennae while it
explores.
"""

from feeler.tensors.table import Table, parse_table, read_table
from feeler.tracking.angle import SIDES, compute_antenna_angle
from feeler.tracking.exploration import Exploration, measure_exploration
from feeler.tracking.nwb import save_poses
from feeler.tracking.posture import measure_posture
from feeler.tracking.speed import Sweeps, find_sweeps
from feeler.tracking.synthetic import make_synthetic_tracks, save_dltdv
from feeler.tracking.tracks import LANDMARKS, Tracks, load_tracks

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
