"""What touches an antenna: features, and trials that say where, how fast and from which side."""

from feeler.stimulus.convex import split_convex
from feeler.stimulus.feature import SHAPES, Feature, make_feature
from feeler.stimulus.outline import Outline
from feeler.stimulus.placement import Placement, place
from feeler.stimulus.shapes import Ball, Box, Triangle
from feeler.stimulus.trial import Trial, make_grid
from feeler.stimulus.wall import Wall

__all__ = [
    "SHAPES",
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
    "split_convex",
]
