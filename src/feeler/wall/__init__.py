"""A wall beside the body: from the point of greatest curvature to its distance, and following
it.
"""

from feeler.wall.approach import (
    DISTANCES,
    NEAREST,
    Approach,
    Peak,
    Posture,
    WallTouch,
    approach,
    drive,
    find_peak,
    find_sweep_peak,
    slide,
)
from feeler.wall.distance import (
    Case,
    DistanceMap,
    compare,
    count_orderings,
    explain_bending,
    make_postures,
    map_distance,
    predict_peak,
    range_r2,
    summarise,
)
from feeler.wall.following import (
    FOLLOWING,
    Controller,
    Course,
    Run,
    calibrate,
    follow,
    make_turn,
)

__all__ = [
    "DISTANCES",
    "FOLLOWING",
    "NEAREST",
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
    "calibrate",
    "compare",
    "count_orderings",
    "drive",
    "explain_bending",
    "find_peak",
    "find_sweep_peak",
    "follow",
    "make_postures",
    "make_turn",
    "map_distance",
    "predict_peak",
    "range_r2",
    "slide",
    "summarise",
]


__dir__ = __all__.copy
