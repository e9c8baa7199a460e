"""Formats: every kind of file that feeler reads or writes, and what a file holds."""

import inspect
import json
import os
import re
from codecs import BOM_UTF8
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.files import AntennaFile, read_antenna_file
from feeler.errors import FeelerError, InvalidInput, require_extra
from feeler.files import NAME, parse_json, read_start, sniff_file_type, writing
from feeler.provenance import to_jsonable
from feeler.records import Registry
from feeler.sandbox import Limits, find_limits, open_guarded
from feeler.tables import Table, read_table, sniff_columns
from feeler.tensors.schema import find_errors, raise_if_invalid
from feeler.tensors.writers import (
    MAGIC,
    check_savable,
    restore,
    save_csv,
    save_mat,
    save_netcdf,
    save_nwb,
    save_parquet,
)
from feeler.validation import checked

# Model files: what an encoder, a decoder or a network has learned, as safetensors with a JSON
# header; never pickle.

_FORMAT = "feeler.model/1"


@dataclass(frozen=True, kw_only=True)
class Model:
    """The content of a model file.

    Attributes
    ----------
    kind : str
        The class, for example ``ConvolutiveNMF``.
    version : int
        Version of this kind's content, raised whenever older files would be misread.
    arrays : dict[str, np.ndarray]
        Everything that is a number and may be NaN belongs here.
    settings : dict[str, Any]
        Parameters, class names and the like, in JSON's types.
    versions : dict[str, str]
        What wrote it.
    """

    kind: str
    version: int
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(
        default_factory=lambda: {name: version(name) for name in ("feeler", "numpy")}
    )


def save_model(model: Model, path: str | os.PathLike) -> None:
    """Write a model, whole or not at all; the file's notes hold format, kind, version, settings,
    versions.
    """
    require_extra("safetensors", "models", "a model's file")
    from safetensors.numpy import save

    notes = {"format": _FORMAT, "kind": model.kind, "version": str(model.version)}
    notes |= {
        name: json.dumps(to_jsonable(getattr(model, name))) for name in ("settings", "versions")
    }
    arrays = {name: np.asarray(values, order="C") for name, values in model.arrays.items()}
    with writing(path) as part:
        part.write_bytes(save(arrays, metadata=notes))


def load_model(
    path: str | os.PathLike, *, kind: str, version: int, trusted: bool = False
) -> Model:
    """The model in a file, which must be of this kind and version.

    Raises
    ------
    InvalidInput
        No model file, damaged, or of another kind or version (the message says which it is and what
        to do).
    """
    model = _read_model(path, trusted=trusted)
    if model.kind != kind:
        raise InvalidInput(
            f"{path} holds a model of kind {model.kind!r}, not {kind!r}. Load it with the reader of"
            " its kind."
        )
    if model.version != version:
        advice = (
            "Update feeler"
            if model.version > version
            else "Fit it again, or use the older feeler"
        )
        raise InvalidInput(
            f"{path} holds version {model.version} of {kind!r}; this feeler reads {version}."
            f" {advice}."
        )
    return model


def _read_model(
    path: str | os.PathLike, limits: Limits | None = None, *, trusted: bool = False
) -> Model:
    """The model in a file, of whatever kind and version; ``trusted=True`` skips the guard."""
    if not Path(path).is_file():
        raise InvalidInput(
            f"cannot read {path}: no such file, or not a regular one. Check the path."
        )
    require_extra("safetensors", "models", f"reading {Path(path).name}")
    notes, arrays = open_guarded(
        "feeler.tensors.readers:read_safetensors", path, limits, trusted=trusted
    )
    name = Path(path).name
    if notes.get("format") != _FORMAT:
        raise InvalidInput(
            f"{name} is no model of feeler (format {str(notes.get('format'))[:40]!r}, not"
            f" {_FORMAT!r})."
        )
    number, kind = notes.get("version", ""), notes.get("kind", "")
    if not (
        number.isascii() and number.isdigit() and len(number) < 10 and NAME.fullmatch(kind)
    ):
        raise InvalidInput(
            f"{name} is damaged: its kind is {kind[:40]!r}, its version {number[:40]!r}."
        )
    settings, versions = (
        parse_json(notes.get(key, "{}").encode("utf-8", "replace"), f"the {key} in {name}")
        for key in ("settings", "versions")
    )
    return Model(
        kind=kind, version=int(number), arrays=arrays, settings=settings, versions=versions
    )


# Formats: every kind of file that feeler knows, one record each; ``load``, ``save`` and
# ``info`` go through them.
#
# A new one is one entry here, or one ``FORMATS.register(name, Format(...))`` from outside the
# package.

START = 512  # bytes by which a file is recognised
_UNKNOWN = (
    "of a kind that feeler does not know. It reads touches (Zarr, NetCDF-4, NWB, MATLAB 5,"
    " Parquet), tracks (DeepLabCut, SLEAP, Anipose, movement, ndx-pose, DLTdv, CSV), recordings"
    " of robots (CSV, ROS bags) and feeler's own TOML files"
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


FORMATS: Registry[Format] = Registry("format")


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
    start = b"" if path.is_dir() else read_start(path, START).removeprefix(BOM_UTF8)
    known = {**FORMATS, **(also or {})}
    if found := {name: form for name, form in known.items() if form.detect(path, start)}:
        return found
    if path.is_dir():
        inside = ", ".join(sorted(entry.name for entry in path.iterdir())[:6]) or "nothing"
        raise InvalidInput(
            f"{path} is a folder, no store of touches: name a file ({inside}, …)."
        )
    hint = (
        sniff_file_type(start) if start.strip() else "empty: nothing but blanks was found in it"
    )
    raise InvalidInput(f"{path.name} is {hint or _UNKNOWN}.")


@checked
def load(
    path: str | os.PathLike, limits: Limits | None = None, *, trusted: bool = False
) -> xr.Dataset:
    """A Dataset from a store, Zarr v3 group, NetCDF-4, NWB, MATLAB, CSV or Parquet file.

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
    return raise_if_invalid(
        find_errors(dataset, whole=False, numbers=form.find_damage is None), dataset
    )


@checked
def save(dataset: xr.Dataset, path: str | os.PathLike, **options: object) -> None:
    """Write a Dataset; the ending chooses ``.zarr``, ``.nc``, ``.mat``, ``.csv``, ``.parquet``,
    ``.nwb`` or a registered one.

    CSV holds one tensor (``variable=``, ``trial=``), NWB of recordings asks for
    ``session_start=`` and ``identifier=``. Every kind carries configuration, units, versions and
    licence.

    Raises
    ------
    InvalidInput
        Another ending, options that the kind lacks or does not know, or a Dataset that it cannot
        hold or that :func:`load` would refuse, as it breaks the data contract.
    """
    suffix = Path(path).suffix.lower()
    form = _find_writer(suffix)
    write: Any = form.save
    try:
        inspect.signature(write).bind(dataset, path, **options)
    except TypeError as error:
        wanted = ", ".join(f"{name}=" for name in list_options(suffix)) or "no options"
        raise InvalidInput(
            f"cannot write {suffix} with these options ({error}); it takes {wanted}."
        ) from None
    check_savable(dataset)
    read = form.find_damage is None and form.load is not _refuse_csv  # with all its numbers
    raise_if_invalid(find_errors(dataset, whole=False, numbers=read), dataset)
    write(dataset, path, **options)


def _find_writer(suffix: str) -> Format:
    """The format that is written with this ending."""
    writers = {form.suffix: form for form in FORMATS.values() if form.suffix and form.save}
    if suffix not in writers:
        raise InvalidInput(f"unknown ending {suffix!r}; valid: {', '.join(writers)}.")
    return writers[suffix]


def list_options(suffix: str) -> list[str]:
    """Names of the options that the writer of an ending takes."""
    write: Any = _find_writer(suffix).save
    return list(inspect.signature(write).parameters)[2:]


# What a file holds, and what is wrong with it, in words.

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
    return lines + [f"{name:11} {_shorten(value)}" for name, value in dataset.attrs.items()]


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


def _shorten(value: object) -> str:
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
        if form.kind != "tensors":
            return []
        # what ``feeler tracks --points`` writes holds no touches
        posture = {"bend", "piece_length"} <= {*content.data_vars} and "angle" not in content
        return [] if posture else find_errors(content)
    except FeelerError as error:
        return [str(error)]


# The formats that feeler ships, as records for the registry.

_ZARR = (
    "zarr.json",
    ".zgroup",
    ".zarray",
)  # of Zarr 3, and of Zarr 2, which is refused by name
HDF5 = b"\x89HDF\r\n\x1a\n"


def _guarded(
    function: str, library: str = "", extra: str = ""
) -> Callable[[Path, Limits, bool], xr.Dataset]:
    """A loader that lets the guard call ``function`` (``"module:name"``), which gives what
    ``plain.describe`` gives; ``library`` and ``extra`` name what it needs beside the core.
    """

    def load(path: Path, limits: Limits, trusted: bool) -> xr.Dataset:
        if library:
            require_extra(library, extra, f"reading {path.name}")
        return restore(*open_guarded(function, path, limits, trusted=trusted), path.name)

    return load


def _starts(*magic: bytes) -> Callable[[Path, bytes], bool]:
    return lambda path, start: start.startswith(magic)


def _is_antenna(path: Path, start: bytes) -> bool:
    other = re.search(rb'schema\s*=\s*"feeler\.(?!antenna/)', start)
    return b"feeler.antenna/" in start or (path.suffix.lower() == ".toml" and not other)


def _describe_antenna(file: AntennaFile) -> list[str]:
    antenna = file.antenna
    flat = antenna.flatten()
    lines = [
        f"name        {antenna.name}" + (", in space" if antenna.spatial else ""),
        (
            f"segments    {antenna.n_segments}, {antenna.length:g} mm,"
            f" {antenna.segment_mass.sum() * 1e3:g} mg"
        ),
        f"stiffness   {flat.stiffness[0]:g} (base) … {flat.stiffness[-1]:g} (tip) N·mm/rad",
        f"damping     {flat.damping[0]:g} (base) … {flat.damping[-1]:g} (tip) N·mm·ms/rad",
        f"sensors     {antenna.sensors.size}",
    ]
    return lines + [
        f"source      {name}: [{item.tag}] {item.reference} {item.note}"
        for name, item in file.sources.items()
    ]


def _describe_model(model: Model) -> list[str]:
    arrays = [
        f"  {name} {values.shape} {values.dtype}" for name, values in model.arrays.items()
    ]
    made = ", ".join(f"{name} {version}" for name, version in model.versions.items())
    return [
        f"kind {model.kind}, version {model.version}, by {made}",
        *arrays,
        f"settings {_shorten(model.settings)}",
    ]


def is_store(path: Path) -> bool:
    """Whether a folder is a store."""
    try:
        return is_old_store(path) or b'"feeler_store"' in (path / "zarr.json").read_bytes()
    except OSError:
        return False


def is_old_store(path: Path) -> bool:
    """Whether a folder is a store of feeler 0.3."""
    return (path / "progress" / "store.json").is_file()


def _store() -> Any:
    from feeler.tensors import store  # loads zarr, which is an extra

    return store


def _refuse_csv(path: Path, limits: Limits, trusted: bool) -> xr.Dataset:
    raise InvalidInput(
        f"{path.name} is one tensor as text, for other programs: feeler writes it, and reads"
        " NetCDF (.nc), Zarr, MATLAB, Parquet and NWB. Write one of these beside it."
    )


for _name, _format in {
    "store": Format(
        words="store of trials (Zarr v3)",
        suffix=".zarr",
        detect=lambda path, start: is_store(path),
        load=lambda path, limits, trusted: _store().read_store(path),
        save=lambda *args, **options: _store()._save_store(*args, **options),
        describe=lambda path: _store()._describe_store(path),
        glance=lambda path: _store().read_store(path).isel(trial=slice(_store().GLANCE)),
        find_damage=lambda path: _store()._find_damage(path),
    ),
    "zarr": Format(
        words="Zarr v3 group",
        detect=lambda path, start: any((path / name).exists() for name in _ZARR),
        load=_guarded("feeler.tensors.readers:read_zarr", "zarr", "store"),
    ),
    "netcdf": Format(
        words="NetCDF-4 file (HDF5)",
        suffix=".nc",
        detect=lambda path, start: start.startswith(HDF5) and path.suffix.lower() != ".nwb",
        load=_guarded("feeler.tensors.readers:read_hdf5"),
        save=save_netcdf,
    ),
    "nwb": Format(
        words="NWB file (HDF5)",
        suffix=".nwb",
        detect=lambda path, start: start.startswith(HDF5) and path.suffix.lower() == ".nwb",
        load=_guarded("feeler.tensors.readers:read_hdf5"),
        save=save_nwb,
    ),
    "mat": Format(
        words="MATLAB 5 file",
        suffix=".mat",
        detect=_starts(b"MATLAB 5.0 MAT-file"),
        load=_guarded("feeler.tensors.readers:read_mat"),
        save=save_mat,
    ),
    "csv": Format(
        words="one tensor as CSV",
        suffix=".csv",
        detect=_starts(MAGIC.encode(), b"\xef\xbb\xbf" + MAGIC.encode()),
        load=_refuse_csv,
        save=save_csv,
    ),
    "parquet": Format(
        words="one touch a row (Parquet)",
        suffix=".parquet",
        detect=_starts(b"PAR1"),
        load=_guarded("feeler.tensors.readers:read_parquet", "pyarrow", "parquet"),
        save=save_parquet,
    ),
    "antenna": Format(
        words="antenna (TOML)",
        kind="antenna",
        detect=_is_antenna,
        load=lambda path, limits, trusted: read_antenna_file(path),
        tell=_describe_antenna,
    ),
    "model": Format(
        words="model (safetensors)",
        kind="model",
        detect=lambda path, start: start[8:9] == b"{" and len(start) > 9,
        load=lambda path, limits, trusted: _read_model(path, limits, trusted=trusted),
        tell=_describe_model,
    ),
}.items():
    FORMATS.register(_name, _format)


_MOST = 12  # columns that are listed
_ADVICE = (
    "a robot's recording needs time_ms and hinge1_deg, hinge2_deg …: feeler robot check",
    "tracks need head_x, head_y, left_tip_x, left_tip_y …: feeler tracks",
    "a trace to calibrate with needs time_ms and displacements: feeler calibrate --data",
    "a force–deflection curve needs deflection_um and force_uN (any units): the same",
    "an antenna's segments need length_um and diameter_um: feeler antenna NEW.toml --from",
)


def _is_table(path: Path, start: bytes) -> bool:
    if sniff_file_type(start) or path.suffix.lower() not in _ENDINGS:
        return False
    return len(sniff_columns(start)) > 1


_ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".asc", ".log", "")


def _describe(table: Table) -> list[str]:
    lines = [f"rows        {len(table.values)}"]
    for name, values in list(zip(table.columns, table.values.T, strict=True))[:_MOST]:
        seen = values[~np.isnan(values)]
        span = f"{seen.min():.4g} … {seen.max():.4g}" if seen.size else "empty"
        if name in table.words:
            span = f"text ({table.first_word(name)!r} …)"
        lines.append(f"column      {name}: {span}")
    if len(table.columns) > _MOST:
        lines.append(f"            … {len(table.columns)} columns in all")
    return lines + [f"next        {words}" for words in _ADVICE]


PLAIN_TABLES = {
    "table": Format(
        words="a table that no command of feeler reads as it is",
        kind="table",
        detect=_is_table,
        load=lambda path, limits, trusted: read_table(path, words=True),
        tell=_describe,
    ),
}
