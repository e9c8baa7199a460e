"""TOML texts of unknown origin: short ones are parsed here, long ones by the guard."""

import tempfile
import tomllib
from pathlib import Path
from typing import Any

# characters; tomllib needs a second for the worst text of this length, and for longer ones hours
SMALL = 16_000


def parse_toml(text: str) -> dict[str, Any]:
    """The content of a TOML text.

    Raises
    ------
    tomllib.TOMLDecodeError, ValueError, RecursionError
        From a short text; from a long one it is an InvalidInput with the same words.
    """
    if len(text) <= SMALL:
        return tomllib.loads(text)
    from feeler.guard import open_guarded

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "TOML"
        path.write_text(text, encoding="utf-8")
        return open_guarded("feeler.toml:read_toml", path)[0]


def read_toml(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does for :func:`parse_toml`."""
    return tomllib.loads(Path(path).read_text(encoding="utf-8")), {}
