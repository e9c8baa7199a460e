"""Parsing antenna files: TOML turned into an antenna, with line and key of whatever is wrong."""

import itertools
import math
import re
from collections.abc import Callable
from dataclasses import field, fields
from typing import Any, Literal

import numpy as np

from feeler.antenna.antenna import HINGE, MAX_SEGMENTS, Antenna
from feeler.antenna.beam import compute_beam
from feeler.antenna.fact import SourceTag
from feeler.antenna.follicle import Follicle
from feeler.antenna.formula import evaluate
from feeler.antenna.profile import PROFILES, sample_quantity
from feeler.disk.toml import parse_toml
from feeler.errors import InvalidInput
from feeler.records.record import Record

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
        self.check_keys("", content, (*known, "sensors"))
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
            return self.row(name, table, n, lengths)
        rows = [{**table, key: row} for row in self.list_rows(name, key, table[key])]
        return np.array([self.row(name, row, n, lengths)[0] for row in rows]), ""

    def row(
        self, name: str, table: dict[str, Any], n: int, lengths: np.ndarray | None
    ) -> tuple[np.ndarray, str]:
        """The values of one plane, and the formula that gave them."""
        factor = self.unit(name, table, FILE_UNITS[name])
        forms = [key for key in ("value", "values", "profile", "formula") if key in table]
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
        values: dict[str, Any] = {}
        for key in keys:
            values[key] = (
                tuple(self.numbers(name, key, table[key], 10_000))
                if kind == "tabulated"
                else self.number(name, key, table[key])
            )
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
