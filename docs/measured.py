"""Hook of the documentation site: ``{{ key:.1f }}`` in a page becomes that number of benchmarks/results/beyond.json."""

import json
import re
from pathlib import Path

RESULTS = Path(__file__).parent.parent / "benchmarks" / "results" / "beyond.json"
PLACE = re.compile(r"\{\{ *(?P<key>[\w.+-]+?):(?P<form>[^} ]*) *\}\}")
PAGES = ("slow_and_graded.md",)


def on_page_markdown(markdown, page, **_):
    """The page with its numbers, where it is one that has any."""
    return insert_numbers(markdown) if page.file.src_uri in PAGES else markdown


def insert_numbers(markdown: str) -> str:
    """Every place filled; a key that was not measured is a KeyError, which ends the build."""
    values = json.loads(RESULTS.read_text())

    def show(found: re.Match) -> str:
        value = values[found["key"]]
        value = value["value"] if isinstance(value, dict) else value
        return format(int(value) if found["form"] == "d" else value, found["form"])

    return PLACE.sub(show, markdown)
