"""A wall beside the body: from the point of greatest curvature to its distance, and following it."""

from feeler.wall.distance_map import DistanceMap, bootstrap_median, fit_distance, map_distance
from feeler.wall.peak import Peak, compute_curvature, compute_smooth_curvature, find_peak, find_sweep_peak
from feeler.wall.posture import Posture
from feeler.wall.sensitivity import Case, compare, count_orderings, make_postures, summarise
from feeler.wall.sweep import DISTANCES, Sweep, approach

__all__ = [
    "DISTANCES",
    "Case",
    "DistanceMap",
    "Peak",
    "Posture",
    "Sweep",
    "approach",
    "bootstrap_median",
    "compare",
    "compute_curvature",
    "compute_smooth_curvature",
    "count_orderings",
    "find_peak",
    "find_sweep_peak",
    "fit_distance",
    "make_postures",
    "map_distance",
    "summarise",
]
