"""Make the pages ready in build/docs (equations, tutorials, guides and examples run) and
let Zensical set them in site/.

python -m docs.build
"""

import ast
import contextlib
import importlib
import inspect
import io
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from docs.measured import PLACE
from feeler.plotting.style import style
from feeler.studio import write_touch_page

ROOT = Path(__file__).parent.parent
KEPT = ROOT / "paper" / "kept"
EXAMPLES = ROOT / "examples"
READY = ROOT / "build" / "docs"
EQUATION = re.compile(r"^\$\$(.+?)\$\$$", re.DOTALL | re.MULTILINE)
LEFT_OUT = r"^\*\*Not run here\*\*:(?:[^\n]+\n)+\n"
"""Says above a block of Python what it needs that a page has not; such a block isn't run."""
CODE = re.compile(
    rf"(?P<needs>{LEFT_OUT})?^```python\n(?P<code>.*?)^```\n", re.DOTALL | re.MULTILINE
)
RUN = ("tutorial", "guide")  # folders of pages whose Python is run
CARD = "- [![{title}]({name}/small.png)]({name}/index.md)\n\n    **{title}**. {words}\n"
ORDER = (
    *("touch_a_ball", "design_an_antenna", "tell_touches_apart", "read_the_code"),
    *("train_a_network", "fit_a_recording", "feel_a_wall", "listen_to_a_nerve"),
    *("move_to_know", "where_was_i_touched", "rat_whiskers", "cheat_an_objective"),
)
"""Of the examples, those that are not named come last."""
WIDTH = 480  # pixels of a thumbnail
GALLERY = (
    '# Gallery\n\nEach example was run when this page was built.\n\n<div class="grid cards"'
    " markdown>\n"
)


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


def write_gallery(folder: Path) -> None:
    """A page for each example with its picture in feeler's look, what it printed and its code, and
    thumbnails of all.
    """
    cards = [GALLERY]
    names = sorted(
        (path.stem for path in EXAMPLES.glob("*.py")),
        key=lambda name: (name not in ORDER, ORDER.index(name) if name in ORDER else 0, name),
    )
    for path in (EXAMPLES / f"{name}.py" for name in names):
        (own := folder / path.stem).mkdir(parents=True)
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), style():
            runpy.run_path(str(path))["main"](own)
        code = path.read_text()
        title, words, *_ = str(ast.get_docstring(ast.parse(code))).split("\n\n")
        title = title.removesuffix(".")
        whole = str(ast.get_docstring(ast.parse(code))).partition("\n\n")[2]
        with Image.open(own / f"{path.stem}.png") as image:
            image.thumbnail((WIDTH, WIDTH))
            image.save(own / "small.png")
        picture = f"![{title}]({path.stem}.png)"
        shown = f"```text\n{printed.getvalue().strip()}\n```\n\n```python\n{code}```\n"
        page = f"# {title}\n\n{whole}\n\n{picture}\n\n{shown}"
        (own / "index.md").write_text(page)
        cards.append(CARD.format(name=path.stem, title=title, words=" ".join(words.split())))
    (folder / "index.md").write_text("\n".join([*cards, "</div>\n"]))


def summarise(name: str) -> str:
    """First sentence of the docstring of a dotted name."""
    parts = name.split(".")
    for n in range(len(parts), 0, -1):
        with contextlib.suppress(ImportError):
            thing = importlib.import_module(".".join(parts[:n]))
            for part in parts[n:]:
                thing = getattr(thing, part)
            words = " ".join((inspect.getdoc(thing) or "").partition("\n\n")[0].split())
            words = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", words)
            return re.split(r"(?<=[.;:]) (?=[A-Z(\d`*])", words)[0]
    raise ImportError(name)


def split_reference(folder: Path) -> None:
    """The API by room: a page for each heading of api.md, which becomes the list of them."""
    (own := folder / "api").mkdir()
    first, *rooms = re.split(r"^## ", (folder / "api.md").read_text(), flags=re.MULTILINE)
    lines = [first.strip(), ""]
    for room in rooms:
        title, _, words = room.partition("\n")
        name = re.sub(r"\W+", "-", title.lower())
        (own / f"{name}.md").write_text(f"# {title}\n{words}")
        lines += [f"## [{title}](api/{name}.md)", ""]
        for word in re.findall(r"^::: ([\w.]+)$", words, re.MULTILINE):
            short = word.removeprefix("feeler.")
            lines.append(f"- [`{short}`](api/{name}.md#{word}): {summarise(word)}")
        lines.append("")
    (folder / "api.md").write_text("\n".join(lines) + "\n")


def make_ready() -> None:
    """Every page of the site, in build/docs."""
    shutil.rmtree(READY, ignore_errors=True)
    shutil.copytree(
        Path(__file__).parent, READY, ignore=shutil.ignore_patterns("*.py", "__pycache__")
    )
    (READY / "drag.html").write_text(write_touch_page(), encoding="utf-8")
    split_reference(READY)
    write_gallery(READY / "gallery")
    shutil.copytree(
        KEPT, READY / "kept", ignore=shutil.ignore_patterns("*.json", "fig*", "movie*")
    )
    for page in READY.rglob("*.md"):
        words = set_equations(page.read_text()).replace("../paper/kept", "kept")
        if page.parent.name in RUN:
            words = run_pieces(words, page.parent)
        page.write_text(PLACE.sub(r"\g<text>", words))


if __name__ == "__main__":
    make_ready()
    zensical = Path(sys.executable).with_name("zensical")
    os.chdir(ROOT)
    sys.exit(subprocess.run([zensical, "build", "--clean", "--strict"]).returncode)
