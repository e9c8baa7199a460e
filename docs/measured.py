"""Measured numbers in the pages, each between marks: ``<!-- key:.1f -->23.5<!-- / -->``.

python -m docs.measured             fills every page of docs/ from the results
python -m docs.measured --check        exit code 1 if a page differs from the results
python -m docs.measured --examples  runs the examples that measure something, and fills
"""

import contextlib
import io
import json
import math
import re
import runpy
import sys
import tempfile
from pathlib import Path
from typing import Any

import pandas as pd

from paper.table import Results

ROOT = Path(__file__).parent.parent
TABLE = ROOT / "paper" / "kept" / "results.csv"
MEASURED = ROOT / "benchmarks" / "results"
OTHERS = ("design", "examples", "presets", "readings")  # more results
MEASURING = ("rat_whiskers", "where_was_i_touched")  # examples whose numbers stand in a page
TABLES = re.compile(r"(<!-- (findings|challenge) -->\n).*?(<!-- end of \2 -->)", re.S)
PLACE = re.compile(r"<!-- (?P<key>[\w.+-]+?):(?P<form>[^ ]*) -->(?P<text>.*?)<!-- / -->")


def read_values() -> dict[str, Any]:
    """All measured numbers by key, those of another file than the paper's table by ``file.key``."""
    results = Results.read(TABLE)
    pages = "".join(page.read_text(encoding="utf-8") for page in list_pages())
    keys = {place["key"] for place in PLACE.finditer(pages)}
    known = {key: results.get(key) for key in keys}
    values: dict[str, Any] = {key: one._asdict() for key, one in known.items() if one}
    for name in OTHERS:
        own = json.loads((MEASURED / f"{name}.json").read_text())["values"]
        prefix = "" if name == "examples" else f"{name}."
        values |= {prefix + key: value for key, value in own.items()}
    return values


def write_findings() -> str:
    """A table of the paper's sentences: figure, sentence, verdict, on what it depends."""
    found = json.loads((MEASURED / "readings.json").read_text())["findings"]
    lines = ["| figure | sentence | verdict | on what it depends |", "|---|---|---|---|"]
    lines += ["| {figure} | {says} | {verdict} | {line} |".format(**one) for one in found]
    return "\n".join(lines)


def write_challenge() -> str:
    """A table of the benchmark task: a method a row, best first, a noise a column."""
    found = pd.read_csv(MEASURED / "challenge.csv")
    found["text"] = [
        f"{one.accuracy:.1%} ({one.low:.1%} to {one.high:.1%})" for one in found.itertuples()
    ]
    means = found.groupby(["method", "by"])["accuracy"].mean().sort_values(ascending=False)
    table = found.pivot(index=["method", "by"], columns="noise", values="text")
    lines = [f"| method | by | {' | '.join(table)} |", "|---" * (2 + len(table.columns)) + "|"]
    rows = ((*names, *table.loc[names].fillna("–")) for names in means.index)
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


WRITERS = {"findings": write_findings, "challenge": write_challenge}


def fill(markdown: str, values: dict[str, Any]) -> str:
    """The page with each number between marks put there anew; a ``±`` before the format gives its
    interval too. A key that was not measured is a KeyError.
    """

    def show(found: re.Match) -> str:
        one, form = values[found["key"]], found["form"].removeprefix("±")
        value = one["value"] if isinstance(one, dict) else one
        words = format(int(value) if form == "d" else value, form)
        words += write_interval(one, form) if form != found["form"] else ""
        return f"<!-- {found['key']}:{found['form']} -->{words}<!-- / -->"

    def write(found: re.Match) -> str:
        return f"{found[1]}{WRITERS[found[2]]()}\n{found[3]}"

    return PLACE.sub(show, TABLES.sub(write, markdown))


def write_interval(one: dict[str, float], form: str) -> str:
    """`` ± half`` of an interval, or its ends where it is not even; nothing where it is a point."""
    below, above = one["value"] - one["low"], one["high"] - one["value"]
    if max(below, above) == 0:
        return ""
    if not math.isclose(below, above, rel_tol=1e-6):
        return f" ({one['low']:{form}} to {one['high']:{form}})"
    words = format(above, form)
    digits, unit = words.rstrip("%"), "%" if words.endswith("%") else ""
    return f" ± {words}" if float(digits) else f" ± <{digits[:-1]}1{unit}"


def run_examples() -> None:
    """Run the measuring examples and keep their numbers in benchmarks/results/examples.json."""
    found = {}
    for name in MEASURING:
        with tempfile.TemporaryDirectory() as place, contextlib.redirect_stdout(io.StringIO()):
            own = runpy.run_path(str(ROOT / "examples" / f"{name}.py"))["main"](Path(place))
        found |= {f"{name}.{key}": float(f"{value:.6g}") for key, value in own.items()}
    path = MEASURED / "examples.json"
    path.write_text(json.dumps({"values": found}, indent=1, sort_keys=True) + "\n")


def list_pages() -> list[Path]:
    """Pages with numbers or tables between marks."""
    texts = {page: page.read_text("utf-8") for page in sorted((ROOT / "docs").rglob("*.md"))}
    return [page for page, text in texts.items() if PLACE.search(text) or TABLES.search(text)]


def main(options: list[str]) -> int:
    if "--examples" in options:
        run_examples()
    values, differ = read_values(), []
    for page in list_pages():
        old = page.read_text(encoding="utf-8")
        new = fill(old, values)
        if new != old:
            differ.append(page.relative_to(ROOT).as_posix())
            if "--check" not in options:
                page.write_text(new, encoding="utf-8")
    if differ and "--check" in options:
        print(
            f"numbers differ from the results in {', '.join(differ)}; python docs/measured.py"
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
