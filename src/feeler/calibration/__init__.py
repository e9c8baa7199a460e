"""Calibration: find the mechanics that fit an animal or a robot, and how far to trust the fit."""

from feeler.calibration.films import Film, join_films, load_film, make_film
from feeler.calibration.fitting import (
    METHODS,
    EigenParameters,
    Fit,
    Minimum,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    make_starts,
    search,
    walk_sloppy_direction,
)
from feeler.calibration.hinges import FAMILIES, Band, Hinges, compute_band, make_hinges
from feeler.calibration.joint import (
    MeasurementFit,
    Measurements,
    Prediction,
    Ratios,
    fit_measurements,
    make_factors,
    measure_impulse_film,
    predict_release,
)
from feeler.calibration.measurements import (
    ForceCurve,
    compute_force,
    load_forces,
    load_microscope,
)
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
    "Film",
    "Fit",
    "ForceCurve",
    "Hinges",
    "Measured",
    "MeasurementFit",
    "Measurements",
    "Minimum",
    "Prediction",
    "Problem",
    "Protocol",
    "Ratios",
    "Target",
    "Targets",
    "TraceFit",
    "Traces",
    "analyse_directions",
    "bootstrap",
    "compute_band",
    "compute_distance",
    "compute_force",
    "compute_profiles",
    "compute_residuals",
    "compute_symmetric_accuracy",
    "find_release",
    "find_rest",
    "fit",
    "fit_measurements",
    "fit_traces",
    "join_films",
    "load_film",
    "load_forces",
    "load_microscope",
    "load_targets",
    "load_traces",
    "make_factors",
    "make_film",
    "make_hinges",
    "make_starts",
    "make_synthetic_traces",
    "make_targets",
    "measure_impulse_film",
    "measure_trace",
    "predict_release",
    "search",
    "walk_sloppy_direction",
]

__getattr__ = find_renamed(__name__)

__dir__ = __all__.copy
