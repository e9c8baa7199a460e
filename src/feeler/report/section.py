"""A section of a report: figures, movies, tables, words and numbers, files of one folder."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from feeler.disk.files import write_text
from feeler.records.checked import checked

if TYPE_CHECKING:
    from feeler.report.pictures import Pictures

PAGES = "figures.pdf"
MARKER = "section.json"


@dataclass(kw_only=True)
class Section:
    """What one stage leaves behind; ``values`` are the numbers that claims are held against.

    Attributes
    ----------
    vector : bool
        Whether figures are also kept as pages of a PDF.
    kept : str
        What is said of a section that another run made; "" of this run's own.
    scale : str
        The scale of the run that made it; "": this run's.
    waits : bool
        Whether this run is still making its own.
    """

    name: str
    title: str
    folder: Path
    vector: bool = True
    blocks: list[dict[str, object]] = field(default_factory=list)
    values: dict[str, object] = field(default_factory=dict)
    seconds: float = 0.0
    cached: bool = False
    kept: str = ""
    scale: str = ""
    waits: bool = False

    def text(self, words: str) -> None:
        """A paragraph."""
        self.blocks.append({"kind": "text", "text": words})

    def heading(self, words: str) -> None:
        """A heading within the section."""
        self.blocks.append({"kind": "heading", "text": words})

    def table(
        self, header: Sequence[str], rows: Sequence[Sequence[object]], caption: str = ""
    ) -> None:
        """A table; numbers are shown with four digits."""
        plain = [[_show(cell) for cell in row] for row in rows]
        self.blocks.append(
            {"kind": "table", "header": list(header), "rows": plain, "caption": caption}
        )

    def figure(
        self,
        name: str,
        caption: str,
        draw: Callable,
        *,
        width: float | None = None,
        height: float = 3.0,
        numbers: Mapping[str, object] | None = None,
    ) -> None:
        """Draw with ``draw(figure)``; keep it as PNG and, if ``vector``, as a page of a PDF.

        Parameters
        ----------
        name : str
            Name of the picture's file, and of the JSON file with its numbers.
        caption : str
        draw : callable
            Draws into the ``Figure`` that it is given.
        width, height : float
            [inches]; default width: two columns.
        numbers : mapping of str to array, optional
            The numbers that the figure draws.
        """
        inches, tensors, words = self._pictures.draw(name, draw, width=width, height=height)
        size = [round(96 * side) for side in inches]
        block = {"kind": "figure", "name": name, "caption": caption}
        self.blocks.append(block | {"size": size, "hover": tensors, "words": words})
        if numbers is not None:
            self.numbers(name, **numbers)

    @cached_property
    def _pictures(self) -> "Pictures":
        # Matplotlib loads slowly, and whoever only reads a section does not draw.
        from feeler.report.pictures import Pictures

        return Pictures(self.folder, self.folder / PAGES, vector=self.vector)

    def list_figures(self) -> list[str]:
        """Names of the figures, in the order of the pages of ``figures.pdf``."""
        return [str(block["name"]) for block in self.blocks if block["kind"] == "figure"]

    def movie(self, path: Path, caption: str) -> None:
        """A movie already written into the folder, and its still if there is one."""
        still = path.with_suffix(".jpg").name if path.with_suffix(".jpg").exists() else ""
        self.blocks.append(
            {"kind": "movie", "name": path.name, "caption": caption, "still": still}
        )

    def turnable(self, name: str, caption: str, scene: Mapping[str, object]) -> None:
        """A touch in space that is turned by hand; ``scene`` is what
        :func:`feeler.plotting.turn.describe_turnable` gives.
        """
        self.blocks.append(
            {"kind": "turnable", "name": name, "caption": caption, "scene": dict(scene)}
        )

    def numbers(self, name: str, **arrays: object) -> None:
        """Keep the numbers a figure draws as JSON."""
        text = json.dumps(
            {key: to_json(value) for key, value in arrays.items()}, sort_keys=True
        )
        write_text(self.folder / f"{name}.json", text)

    def say_kept(self) -> str:
        """What a reader must know of a section that another run made; "" of this run's own."""
        waits = " This run is making its own; this page is written anew when it is there."
        return self.kept and self.kept + waits * self.waits

    def save(self) -> None:
        """Close the PDF and write ``section.json``, which says that the section is whole."""
        if "_pictures" in self.__dict__:
            self._pictures.close()
        data = asdict(self) | {"folder": None, "values": to_json(self.values)}
        write_text(self.folder / MARKER, json.dumps(data, sort_keys=True, indent=1))

    @classmethod
    def load(cls, folder: Path) -> "Section":
        """Read a section that ``save`` wrote."""
        data = json.loads((folder / MARKER).read_text())
        return cls(**data | {"folder": folder, "cached": True})


@checked
def make_spread(value: float, low: float, high: float, *, n: int) -> dict[str, float]:
    """A value of ``n`` draws with the ends of its spread, in the form in which ``Section.values``
    keeps it; one draw has no spread, so its ends are left out.
    """
    ends = {"low": float(low), "high": float(high)} if n > 1 else {}
    return {"value": float(value), **ends, "n": int(n)}


@checked
def make_interval(mean: float, half: float, *, n: int) -> dict[str, float]:
    """``mean`` ± ``half`` of ``n`` draws."""
    return make_spread(mean, mean - half, mean + half, n=n)


def to_json(value: object) -> object:
    """Arrays, NumPy scalars and mappings as JSON knows them; what is not a number becomes null."""
    if hasattr(value, "values") and not isinstance(value, dict):
        value = value.values
    if isinstance(value, dict):
        return {str(key): to_json(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [to_json(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def _show(cell: object) -> str:
    if isinstance(cell, bool | str):
        return str(cell)
    if isinstance(cell, int | np.integer):
        return f"{cell:d}"
    if isinstance(cell, float | np.floating):
        return f"{cell:.4g}" if np.isfinite(cell) else "undefined"
    return str(cell)
