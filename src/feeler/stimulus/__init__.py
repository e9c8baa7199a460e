"""What touches an antenna: features, and trials that say where, how fast and from which side."""

from feeler.stimulus.base import BaseMotion
from feeler.stimulus.catalogue import load_objects
from feeler.stimulus.convex import split_convex
from feeler.stimulus.feature import SHAPES, Feature, make_feature, parse_feature
from feeler.stimulus.flow import Flow
from feeler.stimulus.mesh import Mesh
from feeler.stimulus.object import Object, check_clear, make_object, make_objects
from feeler.stimulus.outline import Outline
from feeler.stimulus.placement import Placement, place
from feeler.stimulus.sample import SampledTrials, sample_trials
from feeler.stimulus.shapes import Ball, Box, Peg, Triangle
from feeler.stimulus.trial import Trial, make_grid
from feeler.stimulus.wall import Wall

__all__ = [
    "SHAPES",
    "Ball",
    "BaseMotion",
    "Box",
    "Feature",
    "Flow",
    "Mesh",
    "Object",
    "Outline",
    "Peg",
    "Placement",
    "SampledTrials",
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
    "place",
    "sample_trials",
    "split_convex",
]
