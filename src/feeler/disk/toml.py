"""The one door for TOML, in and out: what a file holds becomes a dictionary or a record.

::

    plan = make_record(Plan, read_toml("plan.toml", schema="feeler.plan/1"), "plan.toml")
    save_toml(plan.to_plain(), "plan.toml")

``[task]`` fills the field ``task`` of the plan, which is a record itself. What does not fit is
named: ``plan.toml: [task] speed must be > 0 m/s, got -1.``
"""

import json
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from feeler.disk.files import read_bytes, temporary_folder, writing
from feeler.errors import InvalidInput
from feeler.records.record import Record

_MAX_BYTES = 4 * 2**20  # [C] 1000 segments with 17 digits take 150 KB
# characters; tomllib needs a second for the worst text of this length, and for longer ones hours
_SMALL = 16_000
_IN_A_ROW = 5  # numbers of a long list in a line
_R = TypeVar("_R", bound=Record)


def read_toml(path: str | os.PathLike, *, schema: str = "") -> dict[str, Any]:
    """What a TOML file holds.

    Parameters
    ----------
    schema
        What the file's first key ``schema`` must say; it is left out of what is returned.

    Raises
    ------
    InvalidInput
        No small file, not TOML, or another schema; the message names the file.
    """
    name = Path(path).name
    content = parse_toml(read_toml_text(path), name)
    if schema and (found := content.pop("schema", None)) != schema:
        raise InvalidInput(f"{name}: schema must be {schema!r}, got {str(found)[:40]!r}.")
    return content


def make_record(kind: type[_R], content: Mapping[str, Any], source: str) -> _R:
    """A record from the content of a file called ``source``.

    Raises
    ------
    InvalidInput
        Unknown or missing keys, or values that do not fit; the message names file and table.
    """
    try:
        return kind.from_plain(content)
    except InvalidInput as error:
        words = str(error).removeprefix(error.subject).removeprefix(".").strip()
        where = f": [{'.'.join(map(str, error.tables))}]" if error.tables else ""
        about_a_field = not words.startswith(("has no ", "needs "))
        colon = ":" if about_a_field and not where else ""
        raise InvalidInput(f"{source}{where}{colon} {words}") from error


def read_toml_text(path: str | os.PathLike) -> str:
    """The text of a small UTF-8 file; refuses what is no regular file or too large."""
    raw = read_bytes(path, _MAX_BYTES)
    try:
        return raw.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        words = f"{os.fspath(path)} is not UTF-8 text (byte {error.start}). Save it as UTF-8."
        raise InvalidInput(words) from error


def parse_toml(text: str, source: str = "text") -> dict[str, Any]:
    """The content of a TOML text of unknown origin; a long one is parsed by the guard.

    Raises
    ------
    InvalidInput
        Not TOML; ``source`` is named.
    """
    try:
        if len(text) <= _SMALL:
            return tomllib.loads(text)
        from feeler.disk.guard import open_guarded

        with temporary_folder() as folder:
            path = folder / "TOML"
            path.write_text(text, encoding="utf-8")
            return open_guarded("feeler.disk.toml:_parse_file", path)[0]
    except (ValueError, RecursionError) as error:
        words = str(error)[:300].rstrip(".")
        raise InvalidInput(f"{source} is not valid TOML: {words}.") from error


def _parse_file(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does for :func:`parse_toml`."""
    return tomllib.loads(Path(path).read_text(encoding="utf-8")), {}


def save_toml(content: Mapping[str, Any], path: str | os.PathLike) -> None:
    """Write plain data as TOML; the file is whole or stays as it was.

    Raises
    ------
    InvalidInput
        The file cannot be written.
    """
    text = write_toml(content)
    with writing(path) as part:
        part.write_text(text, encoding="utf-8")


def write_toml(content: Mapping[str, Any]) -> str:
    """Plain data as a TOML text: values first, then a table for each dictionary; None is left
    out.
    """
    return "\n".join(_write_table(content, "")) + "\n"


def _write_table(content: Mapping[str, Any], name: str) -> list[str]:
    given = {key: value for key, value in content.items() if value is not None}
    tables = {key: value for key, value in given.items() if isinstance(value, Mapping)}
    lines = [f"{key} = {_write_value(given[key])}" for key in given if key not in tables]
    for key, table in tables.items():
        inner = f"{name}.{key}".removeprefix(".")
        rows = _write_table(table, inner)
        has_values = not rows or not all(isinstance(value, Mapping) for value in table.values())
        lines += ["", f"[{inner}]", *rows] if has_values else rows
    return lines


def _write_value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _quote(value)
    if isinstance(value, Mapping):
        given = (f"{key} = {_write_value(v)}" for key, v in value.items() if v is not None)
        return f"{{{', '.join(given)}}}"
    if isinstance(value, list | tuple):
        texts = [_write_value(item) for item in value]
        if len(texts) <= _IN_A_ROW or all(isinstance(item, int) for item in value):
            return f"[{', '.join(texts)}]"
        starts = range(0, len(texts), _IN_A_ROW)
        rows = [f"  {', '.join(texts[start : start + _IN_A_ROW])}," for start in starts]
        return "\n".join(["[", *rows, "]"])
    return repr(value)


def _quote(text: str) -> str:
    """A TOML basic string; JSON's escapes are a part of TOML's."""
    try:
        text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise InvalidInput(f"{text[:40]!r} is no valid Unicode text.") from error
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
