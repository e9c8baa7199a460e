"""What touches an antenna: features, and trials that say where, how fast and from which side."""

from feeler.stimulus.feature import Ball, Box, Feature, Outline, Triangle, Wall, make_feature
from feeler.stimulus.placement import Placement, place
from feeler.stimulus.trial import Trial, make_grid

__all__ = [
    "Ball",
    "Box",
    "Feature",
    "Outline",
    "Placement",
    "Trial",
    "Triangle",
    "Wall",
    "make_feature",
    "make_grid",
    "place",
]
