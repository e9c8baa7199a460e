"""Antenna files: an antenna as TOML, with units and sources, read without executing anything."""

import itertools
import math
import os
import re
from collections.abc import Callable
from dataclasses import field, fields
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from feeler.antenna.profiles import PROFILES, compute_beam, evaluate, sample_quantity
from feeler.antenna.segments import HINGE, MAX_SEGMENTS, Antenna, Follicle
from feeler.errors import InvalidInput
from feeler.files import MAX_TOML, parse_toml, read_text, save_toml, write_toml
from feeler.records import Record
from feeler.validation import Choice, checked

# Facts: numbers that carry their unit, their source tag and their reference.

SOURCE_TAGS = {
    "P": "stated in the paper",
    "A": "read off the first author's public poster and video",
    "D": "derived by inverse simulation or digitising; not stated by the authors",
    "B": "another public source, named",
    "C": "not stated anywhere that could be read: our choice",
}
PAPER = "Meng, McDonnell, Jayaram, Mongeau 2025, doi:10.1101/2025.10.20.683587"


SourceTag = Annotated[str, Choice(SOURCE_TAGS, joined=True)]


class Fact(Record):
    """A number (or short tuple) of a model: value, unit, source tag, reference, what it means."""

    value: float | tuple[float, ...]
    unit: str
    tag: SourceTag
    reference: str = PAPER
    note: str = ""

    @property
    def number(self) -> float:
        """The value of a fact that is one number."""
        if isinstance(self.value, tuple):
            raise TypeError(f"this fact holds {len(self.value)} numbers, not one: {self.value}")
        return float(self.value)

    @property
    def numbers(self) -> tuple[float, ...]:
        """All numbers of the fact."""
        return self.value if isinstance(self.value, tuple) else (self.value,)


# Parsing antenna files: TOML turned into an antenna, with line and key of whatever is wrong.

ANTENNA_SCHEMA = "feeler.antenna/1"
_MAX_NAME, _MAX_NOTE = 200, 2000  # [C] characters
FILE_UNITS: dict[str, dict[str, float]] = {
    "segment_length": {"mm": 1.0, "cm": 10.0, "m": 1e3, "µm": 1e-3},
    "segment_mass": {"g": 1.0, "kg": 1e3, "mg": 1e-3, "µg": 1e-6},
    "radius": {"mm": 1.0, "cm": 10.0, "m": 1e3, "µm": 1e-3},
    "stiffness": {"N·mm/rad": 1.0, "mN·m/rad": 1.0, "N·m/rad": 1e3, "µN·m/rad": 1e-3},
    "damping": {"N·mm·ms/rad": 1.0, "µN·m·s/rad": 1.0, "mN·m·s/rad": 1e3, "N·m·s/rad": 1e6},
    "rest_angle": {"rad": 1.0, "deg": math.pi / 180},
    "taper": {"1": 1.0},
}
"""Units that a file may use, with the factor to feeler's own, which comes first."""
BEAM_UNITS: dict[str, dict[str, float]] = {
    "length": FILE_UNITS["radius"],
    "radius": FILE_UNITS["radius"],
    "width": FILE_UNITS["radius"],
    "thickness": FILE_UNITS["radius"],
    "modulus": {"MPa": 1.0, "GPa": 1e3, "kPa": 1e-3, "Pa": 1e-6},
    "density": {"g/mm³": 1.0, "mg/mm³": 1e-3, "kg/m³": 1e-6, "g/cm³": 1e-3},
    "damping_time": {"ms": 1.0, "s": 1e3, "µs": 1e-3},
    "shear_modulus": {"MPa": 1.0, "GPa": 1e3, "kPa": 1e-3, "Pa": 1e-6},
}
"""The same for the tables of a beam, [beam.radius] and so on."""
FOLLICLE_UNITS: dict[str, dict[str, float]] = {
    "stiffness": {"N/mm": 1.0, "N/m": 1e-3, "mN/mm": 1e-3, "µN/mm": 1e-6},
    "damping": {"N·ms/mm": 1.0, "N·s/m": 1.0, "mN·s/m": 1e-3, "µN·ms/mm": 1e-6},
}
"""The same for [follicle.stiffness] and [follicle.damping], three values each."""
OF_BEAM = ("segment_length", "segment_mass", "radius", "stiffness", "damping", "taper")
_OPTIONAL = ("rest_angle", "taper")
SOURCE_KEYS = ("tag", "reference", "note")


class Source(Record):
    """Where the numbers of one quantity come from.

    Attributes
    ----------
    tag : SourceTag | Literal[]
        One of P, A, D, B, C, joined by + where several apply; empty where unknown.
    formula : str
        The formula that gives the numbers, in feeler's own unit; empty where a file lists them.
    """

    tag: SourceTag | Literal[""] = ""
    reference: str = ""
    note: str = ""
    formula: str = ""


class AntennaFile(Record):
    """An antenna and the sources of its quantities, as one file holds them."""

    antenna: Antenna
    sources: dict[str, Source] = field(default_factory=dict)


def make_beam(
    sources: dict[str, Source], n_segments: int, planes: int = 1
) -> dict[str, np.ndarray]:
    """The quantities that the formulas of a beam's tables give.

    Raises
    ------
    InvalidInput
        A length, modulus or density is missing, or a formula is not understood.
    """
    given = {
        name.removeprefix("beam."): source.formula
        for name, source in sources.items()
        if name.startswith("beam.")
    }
    missing = [key for key in ("length", "modulus", "density") if key not in given]
    if missing:
        raise InvalidInput(
            f"a beam needs length, modulus and density; missing: {', '.join(missing)}"
        )
    optional: dict[str, Any] = {
        "radius": None,
        "width": None,
        "thickness": None,
        "damping_time": 0.0,
        "shear_modulus": None,
    }
    return compute_beam(
        **{
            **optional,
            **given,
            "length": float(evaluate(given["length"], {})),
            "n_segments": n_segments,
            "planes": planes,
        }
    )


def parse_antenna(text: str, source: str = "text") -> AntennaFile:
    """The antenna in a TOML text and the sources of its numbers; ``source`` names the text in
    errors.

    Raises
    ------
    InvalidInput
        Not TOML of this schema; the message names the line and the key.
    """
    return _Reader(text, source).read(parse_toml(text, source))


class _Reader:
    """Turns parsed TOML into an antenna, naming line and key of whatever is wrong."""

    def __init__(self, text: str, source: str) -> None:
        self._lines, self._source = text.split("\n"), source

    def read(self, content: dict[str, Any]) -> AntennaFile:
        if content.get("schema") != ANTENNA_SCHEMA:
            self.fail(
                "",
                "schema",
                f"must be {ANTENNA_SCHEMA!r}, got {str(content.get('schema'))[:60]!r}",
            )
        known = (
            "schema",
            "name",
            "n_segments",
            "planes",
            "beam",
            *FILE_UNITS,
            "follicle",
            "sensors",
        )
        self.check_keys("", content, known)
        self._planes = self.whole("", "planes", content.get("planes", 1), 1, 3)
        n = self.whole("", "n_segments", content.get("n_segments"), 1, MAX_SEGMENTS)
        name = self.text("", "name", content.get("name", "custom"))
        values: dict[str, Any] = {}
        sources: dict[str, Source] = {}
        if "beam" in content:
            values, sources = self.beam(self.table("beam", content["beam"]), content, n)
        for quantity in FILE_UNITS:
            if quantity in content:
                table = self.table(quantity, content[quantity])
                values[quantity], formula = self.quantity(
                    quantity, table, n, values.get("segment_length")
                )
                sources[quantity] = self.source(quantity, table, formula)
            elif quantity in values:
                continue
            elif quantity not in _OPTIONAL:
                self.fail(
                    "",
                    quantity,
                    f"is missing; a file has the tables {', '.join(FILE_UNITS)} and sensors",
                )
        if "follicle" in content:
            values["follicle"] = self.follicle(self.table("follicle", content["follicle"]))
        sensors = self.table("sensors", content.get("sensors", {}))
        self.check_keys("sensors", sensors, ("hinges", *SOURCE_KEYS))
        values["sensors"] = self.hinges(sensors.get("hinges"), n)
        if sensors:
            sources["sensors"] = self.source("sensors", sensors)
        antenna = self.attempt("", "", lambda: Antenna(**values, name=name))
        return AntennaFile(
            antenna=antenna,
            sources={key: item for key, item in sources.items() if item != Source()},
        )

    def fail(self, table: str, key: str, words: str, cause: Exception | None = None) -> None:
        place = self.line(table, key)
        where = f" line {place}" if place else ""
        name = ".".join(part for part in (table, key) if part)
        raise InvalidInput(
            f"{self._source}{where}{', ' + name if name else ''}: {words}."
        ) from cause

    def line(self, table: str, key: str) -> int:
        """Line of ``key`` in ``[table]``, or of the table's header; 0 where there is neither."""
        header, present = 0, ""
        for number, line in enumerate(self._lines, 1):
            found = re.match(r"\s*\[\s*([^\[\]]{1,80}?)\s*\]", line)
            if found:
                present = found[1].strip("\"'")
                header = number if present == (table or key) else header
            elif present == table and re.match(
                rf"\s*[\"']?{re.escape(key)}[\"']?\s*[=.]", line
            ):
                return number
            elif not present and table and re.match(rf"\s*{re.escape(table)}\s*[=.]", line):
                header = number
        return header

    def attempt(self, table: str, key: str, make: Callable[[], Any]) -> Any:
        try:
            with np.errstate(all="ignore"):
                return make()
        except InvalidInput as error:
            words = str(error).rstrip(".").removeprefix("Antenna.").removeprefix("Source.")
            quantity = next(
                (name for name in FILE_UNITS if not table and words.startswith(f"{name} ")), ""
            )
            self.fail(table or quantity, key, words, error)
        except (TypeError, ValueError, OverflowError) as error:
            self.fail(table, key, str(error)[:120], error)

    def check_keys(self, table: str, content: dict[str, Any], valid: tuple[str, ...]) -> None:
        for key in content:
            if key not in valid:
                self.fail(table, key, f"unknown key; valid here: {', '.join(valid)}")

    def table(self, name: str, value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            self.fail("", name, f"must be a table [{name}], got {type(value).__name__}")
        return value

    def text(self, table: str, key: str, value: Any) -> str:
        most = _MAX_NAME if key == "name" else _MAX_NOTE
        if not isinstance(value, str) or len(value) > most:
            self.fail(
                table,
                key,
                f"must be a text of at most {most} characters, got {str(value)[:40]!r}",
            )
        return value

    def whole(self, table: str, key: str, value: Any, low: int, high: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            self.fail(
                table,
                key,
                f"must be a whole number from {low} to {high}, got {str(value)[:40]}",
            )
        return value

    def number(self, table: str, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.fail(table, key, f"must be a number, got {str(value)[:40]!r}")
        return self.attempt(table, key, lambda: float(value))

    def numbers(self, table: str, key: str, value: Any, most: int) -> list[float]:
        if not isinstance(value, list) or len(value) > most:
            self.fail(
                table, key, f"must be a list of at most {most} numbers, got {str(value)[:40]}"
            )
        return [self.number(table, key, item) for item in value]

    def source(self, table: str, content: dict[str, Any], formula: str = "") -> Source:
        texts = {key: self.text(table, key, content.get(key, "")) for key in SOURCE_KEYS}
        return self.attempt(table, "tag", lambda: Source(**texts, formula=formula))

    def beam(
        self, tables: dict[str, Any], content: dict[str, Any], n: int
    ) -> tuple[dict[str, Any], dict[str, Source]]:
        """What [beam.length], [beam.radius] … make, and their sources."""
        self.check_keys("beam", tables, tuple(BEAM_UNITS))
        for quantity in OF_BEAM:
            if quantity in content:
                self.fail(
                    "",
                    quantity,
                    "is given twice, by [beam] and by its own table; leave one out",
                )
        sources = {}
        for key, raw in tables.items():
            name = f"beam.{key}"
            table = self.table(name, raw)
            form = "value" if "value" in table else "formula"
            self.check_keys(name, table, ("unit", form, *SOURCE_KEYS))
            factor = self.unit(name, table, BEAM_UNITS[key])
            if form == "value":
                formula = repr(self.number(name, form, table[form]) * factor)
            else:
                formula = self.scale(self.text(name, form, table.get(form)), factor)
            sources[name] = self.source(name, table, formula)
        return self.attempt("beam", "", lambda: make_beam(sources, n, self._planes)), sources

    def follicle(self, tables: dict[str, Any]) -> Follicle:
        """What [follicle.stiffness] and [follicle.damping] say."""
        self.check_keys("follicle", tables, tuple(FOLLICLE_UNITS))
        found = {}
        for key, raw in tables.items():
            name = f"follicle.{key}"
            table = self.table(name, raw)
            self.check_keys(name, table, ("unit", "values"))
            factor = self.unit(name, table, FOLLICLE_UNITS[key])
            numbers = self.numbers(name, "values", table.get("values"), 3)
            found[key] = tuple(factor * number for number in numbers)
        return self.attempt("follicle", "", lambda: Follicle(**found))  # type: ignore[arg-type]  # the record says what is wrong

    @staticmethod
    def scale(formula: str, factor: float) -> str:
        return formula if factor == 1.0 else f"({formula}) * {factor!r}"

    def quantity(
        self, name: str, table: dict[str, Any], n: int, lengths: np.ndarray | None
    ) -> tuple[np.ndarray, str]:
        """The values, in space of each plane, and the formula that gave them."""
        key = next((key for key in ("formula", "values") if key in table), "")
        if self._planes == 1 or name not in HINGE or not key:
            values, formula = self.row(name, table, n, lengths)
            if self._planes > 1 and name == "stiffness":  # alike in all planes
                return np.tile(values, (self._planes, 1)), ""
            return values, formula
        rows = [{**table, key: row} for row in self.list_rows(name, key, table[key])]
        return np.array([self.row(name, row, n, lengths)[0] for row in rows]), ""

    def row(
        self, name: str, table: dict[str, Any], n: int, lengths: np.ndarray | None
    ) -> tuple[np.ndarray, str]:
        """The values of one plane, and the formula that gave them."""
        factor = self.unit(name, table, FILE_UNITS[name])
        forms = [key for key in ("value", "values", "profile", "formula") if key in table]
        forms = ["profile"] if "profile" in forms else forms  # which may have a value itself
        if len(forms) != 1:
            self.fail(
                name,
                "",
                "needs exactly one of value, values, profile, formula; got"
                f" {', '.join(forms) or 'none'}",
            )
        if forms == ["formula"]:
            self.check_keys(name, table, ("unit", "formula", *SOURCE_KEYS))
            formula = self.scale(self.text(name, "formula", table["formula"]), factor)
            return (
                self.attempt(name, "formula", lambda: sample_quantity(formula, n, lengths)),
                formula,
            )
        if forms == ["profile"]:
            values = self.profile(name, table, n)
        else:
            self.check_keys(name, table, ("unit", forms[0], *SOURCE_KEYS))
            values = table[forms[0]]
            if forms == ["value"]:
                values = np.full(n, self.number(name, "value", values))
            else:
                values = np.array(
                    self.numbers(name, "values", values, MAX_SEGMENTS), dtype=float
                )
        if values.shape != (n,):
            self.fail(
                name,
                "values",
                f"must be {n} numbers, one per segment (n_segments), got {values.size}",
            )
        with np.errstate(over="ignore"):
            return (values if factor == 1.0 else values * factor), ""

    def list_rows(self, name: str, key: str, value: Any) -> list[Any]:
        """What stands for each plane; where it is one and the same, once."""
        per_plane = isinstance(value, list) and all(
            isinstance(row, list | str) for row in value
        )
        if not per_plane:
            return [value] * self._planes
        if len(value) != self._planes:
            self.fail(
                name, key, f"must be {self._planes} rows, one per plane, got {len(value)}"
            )
        return value

    def unit(self, name: str, table: dict[str, Any], valid: dict[str, float]) -> float:
        unit = (
            self.text(name, "unit", table.get("unit", ""))
            .replace("*", "·")
            .replace("μ", "µ")
            .replace("m3", "m³")
        )
        unit = re.sub(r"^u(?=[mNg])", "µ", unit)
        if unit not in valid:
            self.fail(name, "unit", f"must be one of {', '.join(valid)}, got {unit[:40]!r}")
        return valid[unit]

    def profile(self, name: str, table: dict[str, Any], n: int) -> np.ndarray:
        kind = self.text(name, "profile", table["profile"])
        if kind not in PROFILES:
            self.fail(
                name, "profile", f"must be one of {', '.join(PROFILES)}, got {kind[:40]!r}"
            )
        keys = [item.name for item in fields(PROFILES[kind])]
        self.check_keys(name, table, ("unit", "profile", *SOURCE_KEYS, *keys))
        missing = [key for key in keys if key not in table]
        if missing:
            self.fail(
                name,
                "profile",
                f"{kind} needs {', '.join(keys)}; missing: {', '.join(missing)}",
            )
        values: dict[str, Any] = {key: self.number(name, key, table[key]) for key in keys}
        return self.attempt(name, "profile", lambda: PROFILES[kind](**values).sample(n))

    def hinges(self, value: Any, n: int) -> list[int] | None:
        if value is None:
            return None
        if not isinstance(value, list) or not 1 <= len(value) <= n:
            self.fail(
                "sensors",
                "hinges",
                f"must be a list of 1 to {n} hinge numbers, got {str(value)[:40]}",
            )
        hinges = [self.whole("sensors", "hinges", item, 1, n) for item in value]
        if any(b <= a for a, b in itertools.pairwise(hinges)):
            self.fail("sensors", "hinges", "must rise from base to tip")
        return hinges


# Antenna files: an antenna as TOML, with units and sources, read without executing anything.
#
#     schema = "feeler.antenna/1"
#     name = "my antenna"
#     n_segments = 140
#
#     [stiffness]
#     unit = "N·mm/rad"
#     tag = "P"
#     profile = "exponential"     # or value = 1.0, or values = [ … one per segment … ]
#     base = 37.78
#     rate = -0.0827
#
# and likewise [segment_length], [segment_mass], [radius], [damping] and, if need be,
# [rest_angle]; [sensors] has ``hinges = [1, 4, …]``. In the place of a profile, ``formula =
# "37.78 * exp(-0.0827 * (n - 1))"`` may use the segment's number n of N, x = (n − ½) / N, its
# length l and the place s of its middle (0 base, 1 tip). An antenna in space says ``planes =
# 2``, or 3 with torsion, before its first table; values or formulas of its hinges may then be
# lists of one for each plane, and [taper] may stand beside them. An antenna by its making has,
# in the place of these, [beam.length], [beam.radius] (or width and thickness), [beam.modulus],
# [beam.density], [beam.damping_time] and, for torsion, [beam.shear_modulus], each with ``unit``
# and ``value`` or a ``formula`` of the place x; see :meth:`feeler.Antenna.from_beam`.
#
# An antenna in space may stand on a follicle: [follicle.stiffness] and [follicle.damping], each
# with ``unit`` and three ``values``; see :class:`feeler.antenna.segments.Follicle`.


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
    return parse_antenna(read_text(path, MAX_TOML), Path(path).name)


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
