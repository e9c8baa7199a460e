"""What a result depends on: plain data that describe it, the versions of packages, and the code
that made it.
"""

import dataclasses
import hashlib
import json
import math
import os
import platform
import time
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Any

import numpy as np

from feeler.disk import sources
from feeler.errors import InvalidInput, StoreError

LICENCE = (  # of data made by simulation; change it in the file's attributes if yours is another
    "CC0-1.0"
)
_PACKAGES = (
    "feeler",
    "mujoco",
    "numpy",
    "scipy",
    "numba",
    "xarray",
    "scikit-learn",
)  # said in each file feeler writes
_list_distributions = cache(packages_distributions)  # looks through all that is installed


def tick() -> float:
    """Seconds of a clock that nobody sets."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


_LOADED = tick()  # s; a file changed later is not the code that runs


@cache
def list_versions() -> dict[str, str]:
    """Versions of Python and of the packages that can change a number."""
    return {
        "python": platform.python_version(),
        **{name: find_version(name) for name in _PACKAGES},
    }


def describe_versions() -> str:
    """The same in words, for the foot of a page."""
    return ", ".join(f"{name} {version}" for name, version in list_versions().items())


@cache
def find_version(package: str) -> str:
    """Version of a package by the name that it is installed or imported under; "" if it is not
    installed.
    """
    try:
        return version(package)
    except PackageNotFoundError:
        return ",".join(
            sorted({version(name) for name in _list_distributions().get(package, ())})
        )


def make_plain(value: Any) -> Any:
    """``value`` in JSON's types: arrays become lists, dataclasses dictionaries (or what their
    ``to_plain`` says), infinities and NaN words.
    """
    if isinstance(value, np.ndarray | list | tuple):
        items = value.tolist() if isinstance(value, np.ndarray) else value
        return [
            item if type(item) is float and math.isfinite(item) else make_plain(item)
            for item in items
        ]
    if isinstance(value, np.generic):
        return make_plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if isinstance(value, dict):
        return {str(key): make_plain(item) for key, item in value.items()}
    if hasattr(value, "to_plain"):
        return make_plain(value.to_plain())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: make_plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
        }
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise InvalidInput(
        f"a configuration holds numbers, texts, lists and dictionaries; got {type(value).__name__}."
    )


def write_canonical(configuration: Any) -> str:
    """The configuration as JSON with sorted keys: equal configurations give equal texts."""
    return write_plain(make_plain(configuration))


def write_plain(plain: Any) -> str:
    """The canonical text of what is in JSON's types already."""
    return json.dumps(plain, sort_keys=True, ensure_ascii=False, separators=(",", ":"))


def compute_digest(configuration: Any) -> str:
    """SHA-256 of the canonical text, in hexadecimal."""
    return hashlib.sha256(write_canonical(configuration).encode()).hexdigest()


def make_key(configuration: Any, *modules: str) -> str:
    """A short name for a result: another one where the configuration, a version or the code of
    ``modules`` differs.

    Parameters
    ----------
    configuration
        What the result is made with; numbers, texts, lists, dictionaries, arrays and dataclasses.
    modules
        Full names of the modules that make it, e.g. ``"feeler.experiment.touch"``.
    """
    made_by = {"versions": list_versions(), "code": describe_code(*modules)}
    return compute_digest({"configuration": configuration, **made_by})[:16]


def describe_code(*modules: str) -> dict[str, str]:
    """Fingerprints of all that ``modules`` can run: modules and data files by name, others'
    packages by version.

    Raises
    ------
    StoreError
        A file was changed after Python had loaded it, so that the code on disk is not the code that
        runs.
    """
    found = sources.find_modules(*modules)
    data = {
        path.relative_to(sources.SOURCE).as_posix(): path
        for path in sorted(sources.find_data(found))
    }
    now = time.time()
    loaded = now - (tick() - _LOADED)  # as the clock would have said it that now goes
    for path in (*(Path(module.path) for module in found.values()), *data.values()):
        if loaded < path.stat().st_mtime <= now:
            raise StoreError(
                f"feeler's own code changed while it was running ({_shorten(path)}): results would"
                " be stored as those of code that did not make them. Start Python again and repeat"
                " the command."
            )
    packages = {
        package
        for module in found.values()
        for package in module.packages
        if package not in found
    }
    return {
        **{name: module.digest for name, module in found.items()},
        **{name: sources.compute_hash(path.read_bytes()) for name, path in data.items()},
        **{package: find_version(package) for package in sorted(packages)},
    }


def _shorten(path: Path) -> str:
    return (
        path.relative_to(sources.SOURCE).as_posix()
        if path.is_relative_to(sources.SOURCE)
        else path.name
    )
