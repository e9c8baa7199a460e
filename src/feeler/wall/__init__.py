"""A wall beside the body: from the point of greatest curvature to its distance, and following
it.
"""

from feeler.wall.course import Course, make_turn
from feeler.wall.distance_map import DistanceMap, bootstrap_median, fit_distance, map_distance
from feeler.wall.following import FOLLOWING, Controller, Run, calibrate, follow
from feeler.wall.peak import (
    Peak,
    compute_curvature,
    compute_smooth_curvature,
    find_peak,
    find_sweep_peak,
)
from feeler.wall.posture import Posture
from feeler.wall.sensitivity import Case, compare, count_orderings, make_postures, summarise
from feeler.wall.sliding import WallTouch, drive, slide
from feeler.wall.sweep import DISTANCES, Approach, approach

__all__ = [
    "DISTANCES",
    "FOLLOWING",
    "Approach",
    "Case",
    "Controller",
    "Course",
    "DistanceMap",
    "Peak",
    "Posture",
    "Run",
    "WallTouch",
    "approach",
    "bootstrap_median",
    "calibrate",
    "compare",
    "compute_curvature",
    "compute_smooth_curvature",
    "count_orderings",
    "drive",
    "find_peak",
    "find_sweep_peak",
    "fit_distance",
    "follow",
    "make_postures",
    "make_turn",
    "map_distance",
    "slide",
    "summarise",
]
