"""One front end for three hosts: its modules as they are, as one module, and as one page with the
engine in it.
"""

import json
import re
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import Any

PAGE = files("feeler.studio").joinpath("page")
_ENTRY = "studio.js"
SPACE_SCRIPT = "turn.js"
"""How a touch in space is drawn: the report's file, up to what starts its own views."""
_IMPORT = re.compile(r'^import\s[^;]*?from\s+"\./([\w-]+\.js)";\n', re.M)
_EXPORT = re.compile(r"^export (\{.*\n|(?=(async function|function|const|class|let)\b))", re.M)
_REMARK = re.compile(r"^ *(/\*\*((?!\*/)[\s\S])*\*/|// .*)\n", re.M)
_INDENT = re.compile(r"^ +", re.M)
_CSP = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
    " blob:; worker-src blob:"
)
_SHELL = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, \
initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{csp}">
<link rel="icon" href="data:,"><title>feeler: drag this ball</title><style>{css}</style></head>
<body><main id="studio"></main><noscript>This page computes touches with JavaScript, which this \
browser does not run.</noscript><script type="application/json" id="config">{config}</script>
<script type="text/plain" id="engine">{engine}</script>
<script type="module">{script}
startAlone(document.getElementById("studio"));
</script></body></html>
"""


def read_page(name: str) -> str:
    """One file of the front end."""
    if name != SPACE_SCRIPT:
        return PAGE.joinpath(name).read_text(encoding="utf-8")
    text = files("feeler").joinpath("report", name).read_text(encoding="utf-8")
    return text[: text.index("const startTurnable")] + "export { drawScene };\n"


@lru_cache(maxsize=4)
def bundle(entry: str = _ENTRY) -> str:
    """A module and all that it imports as one: each stands before those that import it, ``import``
    lines, ``export`` words, remarks and most of the indents taken out.

    So no module may rename what it imports, and no two may use one name at their top level.
    """
    done: dict[str, str] = {}
    _add(entry, done)
    return "\n".join(done.values())


def _add(name: str, done: dict[str, str]) -> None:
    text = read_page(name)
    for needed in _IMPORT.findall(text):
        if needed not in done:
            _add(needed, done)
    done[name] = _INDENT.sub(" ", _REMARK.sub("", _EXPORT.sub("", _IMPORT.sub("", text))))


def write_module() -> str:
    """The module that a notebook loads: it hands out ``render``."""
    return bundle() + "\nexport default { render };\n"


def fill_page(config: Mapping[str, Any]) -> str:
    """A page of HTML that computes by itself; ``config`` is what feeler.studio.alone puts together.

    Its engine is text that a worker runs, or the page itself where workers are not allowed.
    """
    data = json.dumps(config, allow_nan=False).replace("<", "\\u003c")
    parts = {"script": bundle("alone.js"), "engine": bundle("worker.js")}
    code = {name: text.replace("</", "<\\/") for name, text in parts.items()}
    return _SHELL.format(csp=_CSP, css=read_page("studio.css"), config=data, **code)
