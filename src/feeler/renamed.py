"""Old names, for one release: each use warns and says what to write instead."""

import sys
import warnings
from collections.abc import Callable
from functools import wraps
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

PACKAGES = {
    "stimulus": "feeler.objects",
    "task": "feeler.objects",
    "experiment": "feeler",
    "paper": "feeler.presets",
    "dispersion": "feeler.analysis",
    "information": "feeler.analysis",
    "response": "feeler.analysis",
}
"""Where the names of each old package are now."""

NAMES = {
    "feeler.errors": {
        "Doubtful": "ModelValidityWarning",
        "Inaccurate": "AccuracyWarning",
        "MissingExtra": "MissingDependencyError",
        "SimulationDiverged": "SimulationDivergedError",
    },
    "feeler.active": {"Known": "Belief"},
    "feeler.analysis": {"compute_told": "compute_information_known_noise"},
    "feeler.calibration": {
        "Directions": "EigenParameters",
        "walk_loose": "walk_sloppy_direction",
    },
    "feeler.decoding": {
        "IdealReader": "IdealObserver",
        "READERS": "CLASSIFIERS",
        "Reader": "Classifier",
        "TemplateReader": "TemplateClassifier",
        "measure_reader": "measure_classifier",
    },
    "feeler.presets": {"trials": "paper_trials"},
    "feeler.robot": {"Lessons": "TrainingSet", "draw_lessons": "draw_training_set"},
    "feeler.spikes": {"PoissonReader": "PoissonObserver", "SpikeReader": "SpikeClassifier"},
    "feeler.studio": {
        "AntennaWish": "AntennaRequest",
        "ObjectWish": "ObjectRequest",
        "TouchWish": "TouchRequest",
    },
    "feeler.tensors": {"find_breaches": "find_errors"},
}
"""By module, its old names and the new ones."""

ANTENNAS = {"constant": "uniform"}
"""Old names of antennas and the new ones."""


def rename_antenna(name: str) -> str:
    """What an antenna, or a family of hinges, is called now; an old name is answered with a line
    that says so.
    """
    if (new := ANTENNAS.get(name, name)) != name:
        warnings.warn(
            f"the antenna {name!r} is now {new!r}; the old name is read until feeler 0.5.",
            FutureWarning,
            stacklevel=2,
        )
    return new


def find_renamed(module: str) -> Callable[[str], Any]:
    """``__getattr__`` of a module: what an old name of it is called now, with a warning."""

    def find(name: str) -> Any:
        if name not in NAMES[module]:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        new = NAMES[module][name]
        words = f"{module}.{name} is renamed: write {new}."
        warnings.warn(words, DeprecationWarning, stacklevel=2)
        return getattr(sys.modules[module], new)

    return find


def rename_arguments(**names: str) -> Callable[[Callable], Callable]:
    """A function that still takes its arguments by their old names, with a warning."""

    def wrap(function: Callable) -> Callable:
        @wraps(function)
        def call(*args: Any, **given: Any) -> Any:
            for old in names.keys() & given.keys():
                words = f"{function.__name__}({old}=) is renamed: write {names[old]}=."
                warnings.warn(words, DeprecationWarning, stacklevel=2)
                given[names[old]] = given.pop(old)
            return function(*args, **given)

        return call

    return wrap


class _Renamed(MetaPathFinder, Loader):
    def find_spec(self, fullname: str, *_: Any) -> ModuleSpec | None:
        """An old package, or any module that was in one."""
        root, _dot, rest = fullname.partition(".")
        old = root == "feeler" and rest.partition(".")[0] in PACKAGES
        return ModuleSpec(fullname, self, is_package=True) if old else None

    def exec_module(self, module: ModuleType) -> None:
        """Its names, each fetched where it is now."""
        old = module.__name__
        new = PACKAGES[old.split(".")[1]]

        def fetch(name: str) -> Any:
            if name.startswith("__"):
                raise AttributeError(f"module {old!r} has no attribute {name!r}")
            now = NAMES.get(new, {}).get(name, name)
            words = f"{old} is renamed: write `from {new} import {now}`."
            warnings.warn(words, DeprecationWarning, stacklevel=2)
            return getattr(import_module(new), now)

        module.__dict__["__getattr__"] = fetch


# first, since folders of old packages may still lie there with what was compiled in them
sys.meta_path.insert(0, _Renamed())
