"""Make the pages ready in build/docs (numbers, equations, tutorials, guides and examples run) and
let Zensical set them in site/.

python -m docs.build
"""

import ast
import contextlib
import io
import json
import math
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from feeler.plotting.style import style
from feeler.studio import write_touch_page
from paper.table import Results

ROOT = Path(__file__).parent.parent
KEPT = ROOT / "paper" / "kept"
MEASURED = ROOT / "benchmarks" / "results"
OTHERS = {room: MEASURED / f"{room}.json" for room in ("design", "presets", "readings")}
EXAMPLES = ROOT / "examples"
READY = ROOT / "build" / "docs"
PLACE = re.compile(r"\{\{ *(?P<key>[\w.+-]+?):(?P<form>[^} ]*) *\}\}")
EQUATION = re.compile(r"^\$\$(.+?)\$\$$", re.DOTALL | re.MULTILINE)
LEFT_OUT = r"^\*\*Not run here\*\*:(?:[^\n]+\n)+\n"
"""Says above a block of Python what it needs that a page has not; such a block isn't run."""
CODE = re.compile(
    rf"(?P<needs>{LEFT_OUT})?^```python\n(?P<code>.*?)^```\n", re.DOTALL | re.MULTILINE
)
RUN = ("tutorial", "guide")  # folders of pages whose Python is run
PAGES = (
    "receptor_noise.md",
    "unseen.md",
    "slow_and_graded.md",
    "searched.md",
    "presets.md",
    "whiskers.md",
    "space.md",
    "spikes.md",
    "guide/robot.md",
    "readings.md",
    "known.md",
)
CARD = "- [![{title}]({name}/{name}.png)]({name}/index.md)\n\n    **{title}**. {words}\n"
GALLERY = (
    '# Gallery\n\nEach example was run when this page was built.\n\n<div class="grid cards"'
    " markdown>\n"
)


def insert_findings(markdown: str) -> str:
    """Each sentence of the paper with its verdict and what it depends on, in place of
    ``<!-- table -->``.
    """
    found = json.loads(OTHERS["readings"].read_text())["findings"]
    lines = ["| figure | sentence | verdict | on what it depends |", "|---|---|---|---|"]
    lines += ["| {figure} | {says} | {verdict} | {line} |".format(**one) for one in found]
    return markdown.replace("<!-- table -->", "\n".join(lines))


def insert_numbers(markdown: str, more: dict[str, float] = {}) -> str:  # noqa: B006
    """``{{ key:.1f }}`` becomes that measured number, or what an example found just now, and
    ``{{ key:±.1f }}`` has its interval too; a key that was not measured is a KeyError, which ends
    the build.
    """
    results, values = Results.read(KEPT / "results.csv"), dict(more)
    for room, path in OTHERS.items():
        values |= {
            f"{room}.{key}": value
            for key, value in json.loads(path.read_text())["values"].items()
        }

    def show(found: re.Match) -> str:
        known, form = results.get(found["key"]), found["form"].removeprefix("±")
        one: Any = known._asdict() if known else values[found["key"]]
        value = one["value"] if isinstance(one, dict) else one
        words = format(int(value) if form == "d" else value, form)
        return words + (write_interval(one, form) if form != found["form"] else "")

    return PLACE.sub(show, markdown)


def write_interval(one: dict[str, float], form: str) -> str:
    """`` ± half`` of an interval, or its ends where it is not even; nothing where it is a point."""
    below, above = one["value"] - one["low"], one["high"] - one["value"]
    if max(below, above) == 0:
        return ""
    if not math.isclose(below, above, rel_tol=1e-6):
        return f" ({one['low']:{form}} to {one['high']:{form}})"
    words = format(above, form)
    return f" ± {words}" if float(words) else f" ± <{words[:-1]}1"


def set_equations(markdown: str) -> str:
    """``$$…$$`` on lines of its own becomes MathML, which every browser draws by itself."""
    from latex2mathml.converter import convert

    return EQUATION.sub(lambda found: convert(found[1].strip(), display="block"), markdown)


def run_pieces(markdown: str, folder: Path) -> str:
    """The page with what its Python printed below each piece; the pieces run one after the other,
    from a fresh start, and the pictures that they write go to ``folder``. A piece below a line
    that begins with "**Not run here**:" stays as it is.
    """
    names: dict = {"__name__": "page"}

    def run(found: re.Match) -> str:
        if found["needs"]:
            return found[0]
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(found["code"], "page", "exec"), names)
        words = printed.getvalue().strip()
        return found[0] + (f"\n```text\n{words}\n```\n" if words else "")

    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        page = CODE.sub(run, markdown)
        for picture in Path(place).glob("*.png"):
            shutil.copy(picture, folder)
    return page


def write_gallery(folder: Path) -> dict[str, float]:
    """A page for each example with its picture in feeler's look, what it printed and its code, and
    thumbnails of all; the numbers that examples return, by ``example.name``.
    """
    cards, values = [GALLERY], {}
    for path in sorted(EXAMPLES.glob("*.py")):
        (own := folder / path.stem).mkdir(parents=True)
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), style():
            found = runpy.run_path(str(path))["main"](own)
        if isinstance(found, dict):
            values |= {f"{path.stem}.{name}": value for name, value in found.items()}
        code = path.read_text()
        words, title = (
            ast.get_docstring(ast.parse(code)),
            path.stem.replace("_", " ").capitalize(),
        )
        picture = f"![{title}]({path.stem}.png)"
        shown = f"```text\n{printed.getvalue().strip()}\n```\n\n```python\n{code}```\n"
        page = f"# {title}\n\n{words}\n\n{picture}\n\n{shown}"
        (own / "index.md").write_text(page)
        cards.append(CARD.format(name=path.stem, title=title, words=words))
    (folder / "index.md").write_text("\n".join([*cards, "</div>\n"]))
    return values


def split_reference(folder: Path) -> None:
    """The API by room: a page for each heading of api.md, which becomes the list of them."""
    (own := folder / "api").mkdir()
    first, *rooms = re.split(r"^## ", (folder / "api.md").read_text(), flags=re.MULTILINE)
    lines = [first.strip(), ""]
    for room in rooms:
        title, _, words = room.partition("\n")
        name = re.sub(r"\W+", "-", title.lower())
        (own / f"{name}.md").write_text(f"# {title}\n{words}")
        names = ", ".join(
            f"`{word}`" for word in re.findall(r"^::: ([\w.]+)$", words, re.MULTILINE)
        )
        lines.append(f"- [{title}](api/{name}.md): {names}")
    (folder / "api.md").write_text("\n".join(lines) + "\n")


def make_ready() -> None:
    """Every page of the site, in build/docs."""
    shutil.rmtree(READY, ignore_errors=True)
    shutil.copytree(
        Path(__file__).parent, READY, ignore=shutil.ignore_patterns("*.py", "__pycache__")
    )
    (READY / "drag.html").write_text(write_touch_page(), encoding="utf-8")
    split_reference(READY)
    found = write_gallery(READY / "gallery")
    shutil.copytree(
        KEPT, READY / "kept", ignore=shutil.ignore_patterns("*.json", "fig*", "movie*")
    )
    for page in READY.rglob("*.md"):
        words = set_equations(insert_findings(page.read_text())).replace(
            "../paper/kept", "kept"
        )
        if page.parent.name in RUN:
            words = run_pieces(words, page.parent)
        page.write_text(
            insert_numbers(words, found) if str(page.relative_to(READY)) in PAGES else words
        )


if __name__ == "__main__":
    make_ready()
    zensical = Path(sys.executable).with_name("zensical")
    os.chdir(ROOT)
    sys.exit(subprocess.run([zensical, "build", "--clean", "--strict"]).returncode)
