"""What was declared before a study and what it has found, as these files ship with feeler."""

import json
from importlib.resources import files
from typing import Any

from feeler.files import parse_toml


def read_shipped(study: str, name: str) -> dict[str, Any]:
    """What a TOML or JSON file in the folder of a study holds."""
    text = files(f"feeler.studies.{study}").joinpath(name).read_text(encoding="utf-8")
    return json.loads(text) if name.endswith(".json") else parse_toml(text, name)
