"""What a file holds, and what is wrong with it, in words."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.disk.guard import Limits, find_limits
from feeler.errors import FeelerError, InvalidInput
from feeler.tensors.contract import find_breaches
from feeler.tensors.formats import Format, find_formats

_MAX_VALUES = 6
_LARGE = 64 * 2**20  # bytes; the extremes of a larger variable are not looked up


def describe_file(
    path: str | os.PathLike,
    limits: Limits | None = None,
    also: Mapping[str, Format] | None = None,
    advice: Mapping[str, str] | None = None,
) -> list[str]:
    """Lines that say what a file holds: kind, sizes, variables with units, labels, configuration,
    versions, licence; ``also`` are formats of other rooms, beside ``FORMATS``. ``advice`` says what
    to do next with each kind of content, where the format has no words of its own.
    """
    path = Path(path)
    refused: list[str] = []
    form, content = open_file(path, limits, also, refused=refused)
    lines = [f"{path}: {form.words}", *(form.describe(path) if form.describe else [])]
    lines += (form.tell or _describe_dataset)(content)
    lines += [f"because     {words}" for words in refused] if form.kind == "table" else []
    if form.tell is not list and (words := find_advice(form, content, path.name, advice or {})):
        lines.append(f"next        {words}")
    return lines


def find_advice(form: Format, content: Any, name: str, advice: Mapping[str, str]) -> str:
    """What to do next with a file: in its format's own words, which know more, or ``advice``."""
    if form.tell is list:
        return next((line[12:] for line in reversed(content) if line[:5] == "next "), "")
    if form.kind == "tensors" and "sensor" not in content.dims:
        return ""
    return advice.get(form.kind, "").format(name)


def open_file(
    path: str | os.PathLike,
    limits: Limits | None,
    also: Mapping[str, Format] | None,
    whole: bool = False,
    refused: list[str] | None = None,
) -> tuple[Format, Any]:
    """The first of the file's likely formats that can read it, and the content; ``whole``: all of
    a large file. A Dataset without sensors is taken if no other format can read the file. What the
    others say is put into ``refused``.
    """
    refused = [] if refused is None else refused
    other = None
    path = Path(path)
    for form in find_formats(path, also).values():
        try:
            glance = None if whole else form.glance
            content = glance(path) if glance else form.load(path, find_limits(limits), False)
        except InvalidInput as error:
            refused.append(str(error))
            continue
        if not isinstance(content, xr.Dataset) or "sensor" in content.dims:
            return form, content
        other = form, content
    if other is None:
        raise InvalidInput(refused[0])
    return other


def _describe_dataset(dataset: xr.Dataset) -> list[str]:
    lines = [
        "sizes       " + ", ".join(f"{name} {size}" for name, size in dataset.sizes.items())
    ]
    for name, item in dataset.data_vars.items():
        unit = item.attrs.get("units", "no unit")
        dims = ", ".join(map(str, item.dims))
        lines.append(f"{name:11} ({dims}) [{unit}] {_find_spread(item)}".rstrip())
    for name, item in dataset.coords.items():
        unit = f" [{item.attrs['units']}]" if "units" in item.attrs else ""
        lines.append(f"{name:11} {_summarise(item.values)}{unit}")
    return lines + [f"{name:11} {shorten(value)}" for name, value in dataset.attrs.items()]


def _find_spread(item: xr.DataArray) -> str:
    if not item.size or item.nbytes > _LARGE or item.dtype.kind not in "fiu":
        return ""
    values = item.values  # of a store this reads, each time
    return (
        "" if np.isnan(values).all() else f"{np.nanmin(values):.3g} … {np.nanmax(values):.3g}"
    )


def _summarise(values: np.ndarray) -> str:
    distinct, first = np.unique(values, return_index=True)
    if distinct.size <= _MAX_VALUES:
        return ", ".join(
            f"{value:g}" if values.dtype.kind == "f" else str(value)
            for value in values.ravel()[np.sort(first)]  # in the file's order
        )
    return f"{distinct[0]} … {distinct[-1]} ({distinct.size} values)"


def shorten(value: object) -> str:
    """A value as text of one line, cut where it is long."""
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    return text if len(text) <= 160 else f"{text[:150]}… ({len(text):,} characters)"


def find_problems(
    path: str | os.PathLike,
    limits: Limits | None = None,
    also: Mapping[str, Format] | None = None,
) -> list[str]:
    """What is wrong with a file, one line each; empty where nothing is.

    Tensors are held against the data contract; of other kinds (``also`` as in
    :func:`describe_file`) it is said whether they can be read.
    """
    try:
        for form in find_formats(path, also).values():
            if form.find_damage and (damage := form.find_damage(Path(path))):
                return damage
        refused: list[str] = []
        form, content = open_file(path, limits, also, whole=True, refused=refused)
        if form.kind == "table":
            return [f"{Path(path).name} is {form.words}", *refused]
        touches = form.kind == "tensors" and not _holds_posture(content)
        return find_breaches(content) if touches else []
    except FeelerError as error:
        return [str(error)]


def _holds_posture(dataset: xr.Dataset) -> bool:
    """Whether it is what ``feeler tracks --points`` writes, which holds no touches."""
    return {"bend", "piece_length"} <= {*dataset.data_vars} and "angle" not in dataset
