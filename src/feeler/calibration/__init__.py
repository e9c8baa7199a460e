"""Calibration: find the mechanics that fit an animal or a robot, and how far to trust the fit."""

from feeler.calibration.fitting import Fit, fit, make_starts
from feeler.calibration.hinges import FAMILIES, Band, Hinges, compute_band, make_hinges
from feeler.calibration.identify import (
    Directions,
    Profiles,
    analyse_directions,
    bootstrap,
    compute_profiles,
    walk_loose,
)
from feeler.calibration.optimise import METHODS, Minimum, search
from feeler.calibration.own import TraceFit, fit_traces, make_synthetic_traces
from feeler.calibration.problem import (
    Problem,
    compute_distance,
    compute_residuals,
    compute_symmetric_accuracy,
)
from feeler.calibration.protocol import Measured, Protocol
from feeler.calibration.recording import Traces, load_traces
from feeler.calibration.targets import Target, Targets, load_targets, make_targets
from feeler.calibration.trace import find_release, find_rest, measure_trace

__all__ = [
    "FAMILIES",
    "METHODS",
    "Band",
    "Directions",
    "Fit",
    "Hinges",
    "Measured",
    "Minimum",
    "Problem",
    "Profiles",
    "Protocol",
    "Target",
    "Targets",
    "TraceFit",
    "Traces",
    "analyse_directions",
    "bootstrap",
    "compute_band",
    "compute_distance",
    "compute_profiles",
    "compute_residuals",
    "compute_symmetric_accuracy",
    "find_release",
    "find_rest",
    "fit",
    "fit_traces",
    "load_targets",
    "load_traces",
    "make_hinges",
    "make_starts",
    "make_synthetic_traces",
    "make_targets",
    "measure_trace",
    "search",
    "walk_loose",
]
