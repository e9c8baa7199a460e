"""Antenna files: an antenna as TOML, with units and sources, read without executing anything.

    schema = "feeler.antenna/1"
    name = "my antenna"
    n_segments = 140

    [stiffness]
    unit = "N·mm/rad"
    tag = "P"
    profile = "exponential"     # or value = 1.0, or values = [ … one per segment … ]
    base = 37.78
    rate = -0.0827

and likewise [segment_length], [segment_mass], [radius], [damping] and, if need be, [rest_angle];
[sensors] has ``hinges = [1, 4, …]``. In the place of a profile, ``formula = "37.78 * exp(-0.0827 *
(n - 1))"`` may use the segment's number n of N, x = (n − ½) / N, its length l and the place s of
its middle (0 base, 1 tip). An antenna by its making has, in the place of these, [beam.length],
[beam.radius] (or width and thickness), [beam.modulus], [beam.density] and [beam.damping_time], each
with ``unit`` and ``value`` or a ``formula`` of the place x; see :meth:`feeler.Antenna.from_beam`.
"""

import json
import os
import stat
from pathlib import Path

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.parse import (
    BEAM_UNITS,
    OF_BEAM,
    SCHEMA,
    SOURCE_KEYS,
    UNITS,
    AntennaFile,
    Source,
    make_beam,
    parse_antenna,
)
from feeler.antenna.profile import sample_quantity
from feeler.checked import checked
from feeler.errors import InvalidInput

MAX_BYTES = 4 * 2**20  # [C] 1000 segments with 17 digits take 150 KB


@checked
def load_antenna(path: str | os.PathLike) -> Antenna:
    """The antenna in a TOML file; see :func:`read_antenna_file` for the sources of its numbers."""
    return read_antenna_file(path).antenna


def read_antenna_file(path: str | os.PathLike) -> AntennaFile:
    """The antenna in a TOML file and the sources of its numbers.

    Raises
    ------
    InvalidInput
        Not a TOML file of this schema; the message names the file, the line and the key.
    """
    return parse_antenna(read_toml_text(path), Path(path).name)


@checked
def save_antenna(
    antenna: Antenna, path: str | os.PathLike, sources: dict[str, Source] | None = None
) -> None:
    """Write an antenna as TOML; :func:`load_antenna` gives back each number to the last bit.

    Where a source holds a formula, and the formula gives the antenna's numbers to the last bit, it
    is written in their place.

    Raises
    ------
    InvalidInput
        ``sources`` names no quantity, or the file cannot be written.
    """
    text = write_antenna(antenna, sources)
    path = Path(path)
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InvalidInput(f"cannot write {path}: {error.strerror}. Check the folder.") from error


def write_antenna(antenna: Antenna, sources: dict[str, Source] | None = None) -> str:
    """The TOML text of an antenna."""
    sources = sources or {}
    unknown = sources.keys() - UNITS.keys() - {"sensors", *(f"beam.{key}" for key in BEAM_UNITS)}
    if unknown:
        raise InvalidInput(
            f"no quantity {min(unknown)!r}; sources may name {', '.join(UNITS)}, sensors."
        )
    lines = [
        f"schema = {_quote(SCHEMA)}",
        f"name = {_quote(antenna.name)}",
        f"n_segments = {antenna.n_segments}",
    ]
    beam = _find_beam(antenna, sources)
    tables = {name: BEAM_UNITS[name.removeprefix("beam.")] for name in beam}
    tables |= {name: units for name, units in UNITS.items() if not (beam and name in OF_BEAM)}
    for name, units in tables.items():
        lines += [
            "",
            f"[{name}]",
            f"unit = {_quote(next(iter(units)))}",
            *_write_source(sources.get(name)),
        ]
        formula = (
            beam[name].formula if name in beam else _find_formula(antenna, name, sources.get(name))
        )
        lines += (
            [f"formula = {_quote(formula)}"] if formula else _write_values(getattr(antenna, name))
        )
    lines += [
        "",
        "[sensors]",
        *_write_source(sources.get("sensors")),
        f"hinges = {antenna.sensors.tolist()}",
    ]
    return "\n".join(lines) + "\n"


def _find_beam(antenna: Antenna, sources: dict[str, Source]) -> dict[str, Source]:
    """The beam's sources if they make this antenna to the last bit."""
    beam = {name: source for name, source in sources.items() if name.startswith("beam.")}
    if not beam:
        return {}
    made = make_beam(beam, antenna.n_segments)
    return (
        beam if all(np.array_equal(made[name], getattr(antenna, name)) for name in OF_BEAM) else {}
    )


def _find_formula(antenna: Antenna, name: str, source: Source | None) -> str:
    """The source's formula if it gives the antenna's numbers to the last bit."""
    if source is None or not source.formula:
        return ""
    lengths = None if name == "segment_length" else antenna.segment_length
    found = sample_quantity(source.formula, antenna.n_segments, lengths)
    return source.formula if np.array_equal(found, getattr(antenna, name)) else ""


def _write_source(source: Source | None) -> list[str]:
    values = {} if source is None else {key: getattr(source, key) for key in SOURCE_KEYS}
    return [f"{key} = {_quote(value)}" for key, value in values.items() if value]


def _write_values(values: np.ndarray) -> list[str]:
    texts = [repr(float(value)) for value in values]
    if len(set(texts)) == 1:
        return [f"value = {texts[0]}"]
    if np.array_equal(values, np.linspace(values[0], values[-1], values.size)):
        return ['profile = "linear"', f"base = {texts[0]}", f"tip = {texts[-1]}"]
    rows = [", ".join(texts[start : start + 5]) for start in range(0, len(texts), 5)]
    return ["values = [", *(f"  {row}," for row in rows), "]"]


def _quote(text: str) -> str:
    """A TOML basic string; JSON's escapes are a part of TOML's."""
    try:
        text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise InvalidInput(f"{text[:40]!r} is no valid Unicode text.") from error
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def read_toml_text(path: str | os.PathLike) -> str:
    """The text of a small UTF-8 file; refuses what is no regular file or too large."""
    try:
        descriptor = os.open(
            path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC
        )  # a pipe must not make us wait
    except (OSError, ValueError) as error:
        raise InvalidInput(
            f"cannot read {path!s}: {getattr(error, 'strerror', None) or error}. Check the path."
        ) from error
    info = os.fstat(descriptor)
    if not stat.S_ISREG(info.st_mode) or info.st_size > MAX_BYTES:
        os.close(descriptor)
        raise InvalidInput(f"{path} must be a regular file of at most {MAX_BYTES:,} bytes.")
    with os.fdopen(descriptor, "rb") as file:
        raw = file.read(MAX_BYTES)
    try:
        return raw.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise InvalidInput(
            f"{path} is not UTF-8 text (byte {error.start}). Save it as UTF-8."
        ) from error
