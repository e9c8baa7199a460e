"""Calibration: find the mechanics that fit an animal or a robot, and how far to trust the fit."""

from feeler.calibration.fitting import (
    METHODS,
    EigenParameters,
    Fit,
    Minimum,
    Profiles,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    make_starts,
    search,
    walk_sloppy_direction,
)
from feeler.calibration.hinges import FAMILIES, Band, Hinges, compute_band, make_hinges
from feeler.calibration.problem import (
    Measured,
    Problem,
    Protocol,
    Target,
    Targets,
    compute_distance,
    compute_residuals,
    compute_symmetric_accuracy,
    load_targets,
    make_targets,
)
from feeler.calibration.traces import (
    TraceFit,
    Traces,
    find_release,
    find_rest,
    fit_traces,
    load_traces,
    make_synthetic_traces,
    measure_trace,
)
from feeler.renamed import find_renamed

__all__ = [
    "FAMILIES",
    "METHODS",
    "Band",
    "EigenParameters",
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
    "walk_sloppy_direction",
]

__getattr__ = find_renamed(__name__)


def __dir__() -> list[str]:
    return sorted(__all__)
