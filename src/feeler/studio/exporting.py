"""One front end for three hosts: its modules as they are, as one module, and as one page with what
was recorded.
"""

import base64
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

import numpy as np

PAGE = files("feeler.studio").joinpath("page")
ENTRY = "studio.js"
LEVELS = 4000  # an array is kept in whole numbers of its greatest magnitude over this
_IMPORT = re.compile(r'^import\s[^;]*?from\s+"\./([\w-]+\.js)";\n', re.M)
_EXPORT = re.compile(r"^export (?=(async function|function|const|class|let)\b)", re.M)
CSP = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
    " blob:; media-src blob:"
)
SHELL = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, \
initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{csp}">
<link rel="icon" href="data:,"><title>feeler studio, a recording</title><style>{css}</style></head>
<body><main id="studio"></main><script type="application/json" id="recorded">{data}</script>
<script type="module">{script}
startRecorded(document.getElementById("studio"), \
JSON.parse(document.getElementById("recorded").textContent));
</script></body></html>
"""


def read_page(name: str) -> Traversable:
    """One file of the front end."""
    return PAGE.joinpath(name)


@lru_cache(maxsize=1)
def bundle() -> str:
    """All modules as one: each stands before those that import it, ``import`` lines and ``export``
    words taken out.

    So no module may rename what it imports, and no two may use one name at their top level.
    """
    done: dict[str, str] = {}
    _add(ENTRY, done)
    return "\n".join(done.values())


def _add(name: str, done: dict[str, str]) -> None:
    text = read_page(name).read_text(encoding="utf-8")
    for needed in _IMPORT.findall(text):
        if needed not in done:
            _add(needed, done)
    done[name] = _EXPORT.sub("", _IMPORT.sub("", text))


def read_style() -> str:
    """The style sheet."""
    return read_page("studio.css").read_text(encoding="utf-8")


def write_module() -> str:
    """The module that a notebook loads: it hands out ``render``."""
    return bundle() + "\nexport default { render };\n"


def write_player(records: Sequence[tuple[Mapping[str, Any], Mapping[str, np.ndarray]]]) -> str:
    """A page of HTML that plays records, headers and arrays in the order in which a page hears
    them.
    """
    data = json.dumps(
        [squeeze(header, arrays) for header, arrays in records], allow_nan=False
    ).replace("<", "\\u003c")
    script = bundle().replace("</", "<\\/")
    return SHELL.format(csp=CSP, css=read_style(), data=data, script=script)


def squeeze(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """A record as JSON: arrays in whole numbers, changes along the first axis, deflated; NaN is
    kept apart.

    Off by at most half a level: the greatest magnitude of the array over 8,000, some 1e-5 rad.
    """
    packed = {name: _squeeze(np.asarray(values, dtype=float)) for name, values in arrays.items()}
    return {"header": dict(header), "arrays": packed}


def _squeeze(values: np.ndarray) -> dict[str, Any]:
    known = np.isfinite(values)
    largest = float(np.abs(values[known]).max(initial=0.0)) or 1.0
    levels = np.where(
        known, np.round(np.where(known, values, 0.0) / largest * LEVELS), -LEVELS - 1
    ).astype("<i2")
    table = levels.reshape(len(levels), -1) if levels.size else levels.reshape(0, 0)
    change = np.diff(
        table, axis=0, prepend=np.zeros_like(table[:1])
    )  # wraps around like the page's own sums
    raw = (
        change.astype("<i2").view(np.uint8).reshape(-1, 2).T.tobytes() if change.size else b""
    )  # low bytes, high bytes
    text = base64.b64encode(zlib.compress(raw, 9)).decode()
    return {
        "shape": list(values.shape),
        "unit": largest / LEVELS,
        "none": -LEVELS - 1,
        "data": text,
    }
