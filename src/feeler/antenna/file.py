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
its middle (0 base, 1 tip). An antenna in space says ``planes = 2``, or 3 with torsion, before its
first table; values or formulas of its hinges may then be lists of one for each plane, and [taper]
may stand beside them. An antenna by its making has, in the place of these, [beam.length],
[beam.radius] (or width and thickness), [beam.modulus], [beam.density], [beam.damping_time] and, for
torsion, [beam.shear_modulus], each with ``unit`` and ``value`` or a ``formula`` of the place x; see
:meth:`feeler.Antenna.from_beam`.

An antenna in space may stand on a follicle: [follicle.stiffness] and [follicle.damping], each with
``unit`` and three ``values``; see :class:`feeler.antenna.follicle.Follicle`.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.parse import (
    ANTENNA_SCHEMA,
    BEAM_UNITS,
    FILE_UNITS,
    FOLLICLE_UNITS,
    OF_BEAM,
    SOURCE_KEYS,
    AntennaFile,
    Source,
    make_beam,
    parse_antenna,
)
from feeler.antenna.profile import sample_quantity
from feeler.disk.toml import read_toml_text, save_toml, write_toml
from feeler.errors import InvalidInput
from feeler.records.checked import checked


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
    save_toml(_describe(antenna, sources or {}), path)


def write_antenna(antenna: Antenna, sources: dict[str, Source] | None = None) -> str:
    """The TOML text of an antenna."""
    return write_toml(_describe(antenna, sources or {}))


def _describe(antenna: Antenna, sources: dict[str, Source]) -> dict[str, Any]:
    """What the file of an antenna holds."""
    unknown = (
        sources.keys() - FILE_UNITS.keys() - {"sensors", *(f"beam.{key}" for key in BEAM_UNITS)}
    )
    if unknown:
        raise InvalidInput(
            f"no quantity {min(unknown)!r}; sources may name {', '.join(FILE_UNITS)}, sensors."
        )
    beam = _find_beam(antenna, sources)
    content: dict[str, Any] = {
        "schema": ANTENNA_SCHEMA,
        "name": antenna.name,
        "n_segments": antenna.n_segments,
        **({"planes": len(antenna.planes)} if antenna.spatial else {}),
    }
    if beam:
        content["beam"] = {
            name.removeprefix("beam."): {
                "unit": next(iter(BEAM_UNITS[name.removeprefix("beam.")])),
                **_describe_source(source),
                "formula": source.formula,
            }
            for name, source in beam.items()
        }
    for name, units in FILE_UNITS.items():
        if (beam and name in OF_BEAM) or (name == "taper" and not antenna.spatial):
            continue
        formula = _find_formula(antenna, name, sources.get(name))
        values = {"formula": formula} if formula else _describe_values(getattr(antenna, name))
        unit = {"unit": next(iter(units))}
        content[name] = unit | _describe_source(sources.get(name)) | values
    for name, units in FOLLICLE_UNITS.items() if antenna.follicle else ():
        values = {"values": list(getattr(antenna.follicle, name))}
        content.setdefault("follicle", {})[name] = {"unit": next(iter(units)), **values}
    hinges = {"hinges": antenna.sensors.tolist()}
    return content | {"sensors": _describe_source(sources.get("sensors")) | hinges}


def _find_beam(antenna: Antenna, sources: dict[str, Source]) -> dict[str, Source]:
    """The beam's sources if they make this antenna to the last bit."""
    beam = {name: source for name, source in sources.items() if name.startswith("beam.")}
    if not beam:
        return {}
    made = make_beam(beam, antenna.n_segments, len(antenna.planes))
    return (
        beam if all(np.array_equal(made[name], getattr(antenna, name)) for name in made) else {}
    )


def _find_formula(antenna: Antenna, name: str, source: Source | None) -> str:
    """The source's formula if it gives the antenna's numbers to the last bit."""
    if source is None or not source.formula or getattr(antenna, name).ndim == 2:
        return ""
    lengths = None if name == "segment_length" else antenna.segment_length
    found = sample_quantity(source.formula, antenna.n_segments, lengths)
    return source.formula if np.array_equal(found, getattr(antenna, name)) else ""


def _describe_source(source: Source | None) -> dict[str, str]:
    texts = {} if source is None else {key: getattr(source, key) for key in SOURCE_KEYS}
    return {key: text for key, text in texts.items() if text}


def _describe_values(values: np.ndarray) -> dict[str, Any]:
    if values.ndim == 2:
        return {"values": values.tolist()}
    numbers = [float(value) for value in values]
    if len(set(map(repr, numbers))) == 1:
        return {"value": numbers[0]}
    if np.array_equal(values, np.linspace(values[0], values[-1], values.size)):
        return {"profile": "linear", "base": numbers[0], "tip": numbers[-1]}
    return {"values": numbers}
