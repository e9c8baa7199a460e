"""Formats: every kind of file that feeler knows, one record each; ``load``, ``save`` and ``info``
go through them.

A new one is one entry here, or one ``FORMATS.register(name, Format(...))`` from outside the
package.
"""

import inspect
import os
from codecs import BOM_UTF8
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from feeler.disk.files import read_start
from feeler.disk.foreign import name_start
from feeler.disk.guard import Limits, find_limits
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.registry import Registry
from feeler.tensors.contract import find_breaches, refuse

_START = 512  # bytes by which a file is recognised
_UNKNOWN = (
    "of a kind that feeler does not know. It reads touches (Zarr, NetCDF-4, NWB, MATLAB 5, CSV),"
    " tracks (DeepLabCut, SLEAP, Anipose, movement, ndx-pose, DLTdv, CSV), recordings of robots"
    " (CSV, ROS bags) and feeler's own TOML files"
)


@dataclass(frozen=True, kw_only=True)
class Format:
    """One kind of file.

    Attributes
    ----------
    words : str
        What ``feeler info`` calls it.
    kind : str
        What is in it: ``tensors``, ``model``, ``antenna``, or what another room reads.
    suffix : str
        The ending by which ``save`` chooses it; empty where ``save`` does not write it.
    detect : Callable[[Path, bytes], bool]
        Whether the file, or folder, at the path is one; the second argument is how a file begins.
    load : Callable[..., Any]
        ``load(path, limits, trusted)`` gives the content; feeler's own readers go through the guard
        unless trusted.
    save : Callable[..., None] | None
        ``save(dataset, path, **options)``.
    tell : Callable[[Any], list[str]] | None
        What ``feeler info`` says of the content; None for a Dataset of tensors.
    describe : Callable[[Path], list[str]] | None
        More lines for ``feeler info`` that need not read the whole file.
    glance : Callable[[Path], Any] | None
        As much of a large file as ``feeler info`` tells; default: all.
    find_damage : Callable[[Path], list[str]] | None
        What is damaged, for ``feeler validate``; loading must be safe where nothing is.
    """

    words: str
    kind: str = "tensors"
    suffix: str = ""
    detect: Callable[[Path, bytes], bool]
    load: Callable[..., Any]
    save: Callable[..., None] | None = None
    tell: Callable[[Any], list[str]] | None = None
    describe: Callable[[Path], list[str]] | None = None
    glance: Callable[[Path], Any] | None = None
    find_damage: Callable[[Path], list[str]] | None = None


FORMATS: Registry[Format] = Registry(
    "format",
    {
        "store": "feeler.tensors.kinds:STORE",
        "zarr": "feeler.tensors.kinds:ZARR",
        "netcdf": "feeler.tensors.kinds:NETCDF",
        "nwb": "feeler.tensors.kinds:NWB",
        "mat": "feeler.tensors.kinds:MAT",
        "csv": "feeler.tensors.kinds:CSV",
        "antenna": "feeler.tensors.kinds:ANTENNA",
        "model": "feeler.tensors.kinds:MODEL",
    },
)


def detect(path: str | os.PathLike) -> str:
    """Name of a file's likeliest format, by its content; see :func:`find_formats`."""
    return next(iter(find_formats(path)))


def find_formats(
    path: str | os.PathLike, also: Mapping[str, Format] | None = None
) -> dict[str, Format]:
    """The formats that a file may have by how it begins, the likeliest first.

    They are looked for in ``FORMATS``, then in ``also``.

    Raises
    ------
    InvalidInput
        There is none; the message says what the file is.
    """
    path = Path(path)
    start = b"" if path.is_dir() else read_start(path, _START).removeprefix(BOM_UTF8)
    known = {**FORMATS, **(also or {})}
    if found := {name: form for name, form in known.items() if form.detect(path, start)}:
        return found
    if path.is_dir():
        inside = ", ".join(sorted(entry.name for entry in path.iterdir())[:6]) or "nothing"
        raise InvalidInput(
            f"{path} is a folder, no store of touches: name a file ({inside}, …)."
        )
    hint = name_start(start) if start.strip() else "empty: nothing but blanks was found in it"
    raise InvalidInput(f"{path.name} is {hint or _UNKNOWN}.")


@checked
def load(
    path: str | os.PathLike, limits: Limits | None = None, *, trusted: bool = False
) -> xr.Dataset:
    """A Dataset from a store, Zarr v3 group, NetCDF-4, NWB, MATLAB or CSV file.

    A store is opened lazily: its labels must keep the data contract now, its numbers are read when
    they are used (``feeler validate`` holds them against their digests). Every other file is read
    by its library in a process of its own, with limits on memory and time, and what comes back must
    keep the data contract in all that the contract knows.

    Parameters
    ----------
    limits
        What may be read at most; default 4 GiB and 10 s, or FEELER_MAX_GIB and FEELER_MAX_SECONDS.
    trusted
        Read in this process and without limits: for files that you made yourself.

    Raises
    ------
    InvalidInput
        Unreadable, of another kind, damaged, or over the limits.
    """
    form = FORMATS[detect(path)]
    if form.kind != "tensors":
        models = "a model: use load_encoder, StreamDecoder.load or TouchNetwork.load"
        other = {"antenna": "an antenna: use load_antenna", "model": models}
        raise InvalidInput(
            f"{path} holds no tensors but {other.get(form.kind, 'a ' + form.kind)}."
        )
    dataset = form.load(Path(path), find_limits(limits), trusted)
    return refuse(
        find_breaches(dataset, whole=False, numbers=form.find_damage is None), dataset
    )


@checked
def save(dataset: xr.Dataset, path: str | os.PathLike, **options: object) -> None:
    """Write a Dataset; the ending chooses ``.zarr``, ``.nc``, ``.mat``, ``.csv``, ``.nwb`` or a
    registered one.

    CSV holds one tensor (``variable=``, ``trial=``), NWB of recordings asks for
    ``session_start=`` and ``identifier=``. Every kind carries configuration, units, versions and
    licence.

    Raises
    ------
    InvalidInput
        Another ending, options that the kind lacks or does not know, or a Dataset that it cannot
        hold.
    """
    suffix = Path(path).suffix.lower()
    write = find_writer(suffix)
    try:
        inspect.signature(write).bind(dataset, path, **options)
    except TypeError as error:
        wanted = ", ".join(f"{name}=" for name in list_options(suffix)) or "no options"
        raise InvalidInput(
            f"cannot write {suffix} with these options ({error}); it takes {wanted}."
        ) from None
    write(dataset, path, **options)


def find_writer(suffix: str) -> Callable[..., None]:
    """What writes files with this ending."""
    writers = {form.suffix: form.save for form in FORMATS.values() if form.suffix and form.save}
    if suffix not in writers:
        raise InvalidInput(f"unknown ending {suffix!r}; valid: {', '.join(writers)}.")
    return writers[suffix]


def list_options(suffix: str) -> list[str]:
    """Names of the options that the writer of an ending takes."""
    return list(inspect.signature(find_writer(suffix)).parameters)[2:]
