"""Objects that touch an antenna, trials that say where, how fast and from which side, and tasks."""

from feeler.objects.bodies import (
    Object,
    Wall,
    check_clear,
    load_objects,
    make_object,
    make_objects,
)
from feeler.objects.meshes import Mesh
from feeler.objects.motion import BaseMotion, Flow
from feeler.objects.noise import NOISES, Common, Mixed, Noise, Relative, parse_noise
from feeler.objects.outlines import Outline
from feeler.objects.shapes import (
    SHAPES,
    Ball,
    Box,
    Feature,
    Peg,
    Triangle,
    make_feature,
    parse_feature,
    split_convex,
)
from feeler.objects.task import Nuisances, SampledTrials, Task, sample_trials
from feeler.objects.trials import Placement, Trial, make_grid, place

__all__ = [
    "NOISES",
    "SHAPES",
    "Ball",
    "BaseMotion",
    "Box",
    "Common",
    "Feature",
    "Flow",
    "Mesh",
    "Mixed",
    "Noise",
    "Nuisances",
    "Object",
    "Outline",
    "Peg",
    "Placement",
    "Relative",
    "SampledTrials",
    "Task",
    "Trial",
    "Triangle",
    "Wall",
    "check_clear",
    "load_objects",
    "make_feature",
    "make_grid",
    "make_object",
    "make_objects",
    "parse_feature",
    "parse_noise",
    "place",
    "sample_trials",
    "split_convex",
]

__dir__ = __all__.copy
