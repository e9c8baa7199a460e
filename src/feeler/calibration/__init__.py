"""Calibration: find the mechanics that fit an animal or a robot, and how far to trust the fit."""

from feeler.calibration.fitting import (
    METHODS,
    EigenParameters,
    Fit,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    make_starts,
    search,
    walk_sloppy_direction,
)
from feeler.calibration.hinges import FAMILIES, Hinges, make_hinges
from feeler.calibration.joint import (
    MeasurementFit,
    Measurements,
    Prediction,
    Ratios,
    fit_measurements,
    fit_traces,
    make_factors,
    measure_impulse_film,
    predict_release,
)
from feeler.calibration.measurements import (
    Film,
    ForceCurve,
    compute_force,
    join_films,
    load_film,
    load_forces,
    load_microscope,
)
from feeler.calibration.problem import (
    Measured,
    Problem,
    Protocol,
    Target,
    Targets,
    load_targets,
    make_targets,
)
from feeler.calibration.traces import (
    Traces,
    load_traces,
    make_synthetic_traces,
)
from feeler.renamed import find_renamed

__all__ = [
    "FAMILIES",
    "METHODS",
    "EigenParameters",
    "Film",
    "Fit",
    "ForceCurve",
    "Hinges",
    "Measured",
    "MeasurementFit",
    "Measurements",
    "Prediction",
    "Problem",
    "Protocol",
    "Ratios",
    "Target",
    "Targets",
    "Traces",
    "analyse_directions",
    "bootstrap",
    "compute_force",
    "compute_profiles",
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
    "make_hinges",
    "make_starts",
    "make_synthetic_traces",
    "make_targets",
    "measure_impulse_film",
    "predict_release",
    "search",
    "walk_sloppy_direction",
]

__getattr__ = find_renamed(__name__)

__dir__ = __all__.copy
