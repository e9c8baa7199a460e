"""What is shown, kept as lines of text, and compared: a number may be off by a little, words and
order may not.
"""

import difflib
import re
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from unittest.mock import patch

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import Collection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from feeler.plotting.movie import write_movie
from feeler.provenance import list_versions
from feeler.report.page import Pictures

CLOSE = 1e-3
"""How far a number may be off, relative to itself."""
TINY = 1e-12
"""How far a number may be off at all."""
NUMBER = re.compile(r"(?<![\w.])[-−]?\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?")
SENTENCE = re.compile(r"(?<=[.!?]) +(?=[A-ZΑ-Ω])")
ROWS, CELLS, SILENT = ("tr", "dl"), ("td", "th", "dt", "dd"), ("style", "script", "nav")
INLINE = ("a", "b", "i", "span", "em", "strong", "code", "sub", "sup", "br", *CELLS)

Tolerances = Mapping[str, tuple[float, float, str]]
"""Lines by pattern, whose numbers may be off further: relative, absolute, and why."""


def read_page(page: str, left_out: Iterable[str] = ()) -> list[str]:
    """Rows of tables, and sentences with numbers, section by section."""
    reader = _Page(tuple(left_out))
    reader.feed(page)
    reader.close()
    return reader.lines


class _Page(HTMLParser):
    """What a person reads of the page."""

    def __init__(self, left_out: tuple[str, ...]) -> None:
        super().__init__()
        self.lines: list[str] = []
        self._left_out = left_out
        self._words: list[str] = []
        self._row: list[str] | None = None
        self._silent, self._section = 0, ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in SILENT:
            self._silent += 1
        if tag not in INLINE:
            self._end()
        if tag in ROWS:
            self._row = []
        if tag == "section":
            self._section = str(dict(attrs).get("id")).removeprefix("section-")
            self.lines.append(f"# {self._section}")

    def handle_endtag(self, tag: str) -> None:
        if tag in SILENT:
            self._silent -= 1
        if tag in CELLS and self._row is not None:
            self._row.append(self._take())
        elif tag in ROWS:
            self._keep("| " + " | ".join(self._row or []))
            self._row = None
        elif tag not in INLINE:
            self._end()

    def handle_data(self, data: str) -> None:
        if not self._silent:
            self._words.append(data)

    def _take(self) -> str:
        words, self._words = " ".join(" ".join(self._words).split()), []
        return words

    def _end(self) -> None:
        if self._row is not None:
            return
        for sentence in SENTENCE.split(self._take()):
            if NUMBER.search(sentence):
                self._keep(sentence)

    def _keep(self, line: str) -> None:
        if self._section not in self._left_out:
            self.lines.append(line)


def list_leaves(content: object, name: str = "") -> list[tuple[str, object]]:
    """Everything in nested mappings that is none, by its path."""
    if not isinstance(content, dict):
        return [(name, content)]
    return [
        leaf
        for key in sorted(content, key=str)
        for leaf in list_leaves(content[key], f"{name}.{key}" if name else str(key))
    ]


def write(leaf: object) -> str:
    """A value in six digits."""
    if isinstance(leaf, list):
        return "[" + ", ".join(map(write, leaf)) + "]"
    return f"{leaf:.6g}" if isinstance(leaf, float) else str(leaf)


def digest(numbers: object) -> str:
    """How many numbers, their mean size, and their mean in which each has a weight of its own."""
    flat = np.ravel(np.asarray(numbers, dtype=float))
    if flat.size <= 4:
        return write(flat.tolist()) if flat.size else ""
    known = flat[np.isfinite(flat)]
    missing = f", {flat.size - known.size} missing" * (known.size < flat.size)
    if not known.size:
        return f"{flat.size} numbers{missing}"
    weight = np.random.default_rng(flat.size).uniform(0.5, 1.5, flat.size)[np.isfinite(flat)]
    size, mean = np.abs(known).mean(), (weight * known).mean()
    return f"{flat.size} numbers of size {size:.6g}, weighted mean {mean:.6g}{missing}"


def compare(
    kept: list[str], found: list[str], tolerances: Tolerances | None = None
) -> tuple[list[str], list[str]]:
    """What differs, as a diff, and the new lines in which all that is close is as it was kept."""
    settled = list(found)
    masks = [[NUMBER.sub("#", line) for line in lines] for lines in (kept, found)]
    for old, new, n in difflib.SequenceMatcher(
        None, *masks, autojunk=False
    ).get_matching_blocks():
        for k in range(n):
            if _is_close(kept[old + k], found[new + k], tolerances or {}):
                settled[new + k] = kept[old + k]
    return list(difflib.unified_diff(kept, settled, "kept", "now", n=1, lineterm="")), settled


def _is_close(old: str, new: str, tolerances: Tolerances) -> bool:
    declared = (off for pattern, off in tolerances.items() if re.search(pattern, old))
    relative, absolute, _ = next(declared, (CLOSE, TINY, ""))
    pairs = zip(NUMBER.findall(old), NUMBER.findall(new), strict=True)
    return all(
        a == b or abs(parse(a) - parse(b)) <= relative * abs(parse(a)) + absolute
        for a, b in pairs
    )


def parse(number: str) -> float:
    """A number as NUMBER finds it."""
    return float(number.replace(",", "").replace("−", "-"))


def read_kept(path: Path) -> list[str]:
    """What was kept; the first line says with which versions."""
    return path.read_text(encoding="utf-8").splitlines()[1:] if path.exists() else []


def keep(path: Path, found: list[str], tolerances: Tolerances | None = None) -> None:
    """Keep lines, say what they were made with, and print for review what has changed."""
    differences, settled = compare(read_kept(path), found, tolerances)
    print("\n".join(differences) or f"{path.name}: nothing has changed")
    if differences:
        versions = ", ".join(
            f"{name} {number}" for name, number in sorted(list_versions().items())
        )
        path.write_text("\n".join([f"made with {versions}", *settled, ""]), encoding="utf-8")


def describe(figure: Figure) -> list[str]:
    """What stands where in a figure, and in which colour."""
    lines = [f"words {text.get_text()!r}" for text in figure.texts if text.get_text()]
    for n, ax in enumerate(figure.axes):
        x, y = ax.get_xlim(), ax.get_ylim()
        lines.append(
            f"axes {n}: {ax.get_xlabel()!r} {digest(x)}, {ax.get_ylabel()!r} {digest(y)}"
        )
        labels = [t.get_text() for t in (*ax.get_xticklabels(), *ax.get_yticklabels())]
        lines.append(f"title {ax.get_title()!r}, ticks {' '.join(labels)}")
        lines += [f"words {t.get_text()!r} at {digest(t.get_position())}" for t in ax.texts]
        for legend in filter(None, [ax.get_legend()]):
            lines.append(f"legend {[t.get_text() for t in legend.get_texts()]}")
        lines += [
            _describe_artist(artist) for artist in (*ax.lines, *ax.patches, *ax.collections)
        ]
        lines += [f"image {digest(im.get_array())} over {digest(im.get_extent())}, {im.get_clim()}"
                  for im in ax.images]  # fmt: skip
    return lines


def drawing(figures: dict[str, list[str]]):
    """Records what the figures of pages hold."""
    drawn = Pictures.draw

    def draw(self, name, draw, **size):
        made = []
        found = drawn(self, name, lambda figure: made.append(figure) or draw(figure), **size)
        figures[name] = describe(made[0])
        return found

    return patch.object(Pictures, "draw", draw)


def filming(frames: dict[str, list[str]], *modules: ModuleType):
    """Records what stands in the first, a middle and the last frame of the modules' movies."""

    def film(path, figure, draw, n_frames, *rest, **options):
        lines = frames[path.name] = [f"{n_frames} frames, {rest} {options}"]

        def draw_frame(k):
            changed = draw(k)
            if k in (0, 2 * n_frames // 5, n_frames - 1):
                lines.extend(f"frame {k}: {line}" for line in describe(figure))
            return changed

        return write_movie(path, figure, draw_frame, n_frames, *rest, **options)

    stack = ExitStack()
    for module in modules:
        stack.enter_context(patch.object(module, "write_movie", film))
    return stack


def _describe_artist(artist: Artist) -> str:
    name = type(artist).__name__
    if isinstance(artist, Line2D):
        told = (artist.get_linestyle(), artist.get_marker(), to_hex(artist.get_color()))
        where = digest(artist.get_xydata())
    elif isinstance(artist, Collection):
        told = (digest(artist.get_facecolor()), digest(artist.get_edgecolor()))
        values = () if artist.get_array() is None else np.ma.filled(artist.get_array(), np.nan)
        paths = [path.vertices for path in artist.get_paths()]
        where = "; ".join(
            map(digest, (artist.get_offsets(), np.vstack([*paths, [[0, 0]]]), values))
        )
    else:
        told = (to_hex(artist.get_facecolor()),)
        where = digest(artist.get_patch_transform().transform(artist.get_path().vertices))
    return f"{name} {artist.get_label()!r} {told} at {where}"
