"""Write the tutorials as notebooks that were run, with their pictures: docs/notebooks/NAME.ipynb.

python docs/notebooks.py [NAME …]
"""

import json
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

TUTORIALS = Path(__file__).parent / "tutorial"
NOTEBOOKS = Path(__file__).parent / "notebooks"
CODE = re.compile(r"^```python\n(.*?)^```\n", re.DOTALL | re.MULTILINE)
PICTURE = re.compile(r"^!\[[^\n]*\n", re.MULTILINE)  # which the notebook draws itself
ITSELF = re.compile(r"^\[As a notebook\][^\n]*\n", re.MULTILINE)
SECONDS = 1800  # that one cell may take
INSTALL = "*In a new environment: `pip install 'feeler[movie,active,design,cnn]'`.*"


def make_cells(markdown: str) -> list[dict[str, Any]]:
    """The cells of a page: text, and each piece of Python, without output."""
    cells = []
    for k, part in enumerate(CODE.split(markdown)):
        if k % 2:
            code = {"execution_count": None, "outputs": []}
            cells.append({"cell_type": "code", **code, "source": part.strip()})
        elif text := ITSELF.sub("", PICTURE.sub("", part)).strip():
            text = text if cells else f"{text}\n\n{INSTALL}"
            cells.append({"cell_type": "markdown", "source": text})
    return [{**cell, "id": f"cell-{k}", "metadata": {}} for k, cell in enumerate(cells)]


def make_notebook(name: str) -> dict[str, Any]:
    """The notebook of a tutorial, not run yet."""
    cells = make_cells((TUTORIALS / f"{name}.md").read_text(encoding="utf-8"))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def run_notebook(notebook: dict[str, Any]) -> dict[str, Any]:
    """The same with what its cells print and show; a cell that fails ends it."""
    import nbformat
    from nbclient import NotebookClient

    node = nbformat.from_dict(notebook)
    with tempfile.TemporaryDirectory() as folder:
        place = {"metadata": {"path": folder}}
        NotebookClient(node, timeout=SECONDS, kernel_name="python3", resources=place).execute()
    for cell in node.cells:
        cell.metadata = {}  # when it was run
        if cell.cell_type == "code":
            cell.outputs = [one for one in cell.outputs if one.get("name") != "stderr"]
    return json.loads(nbformat.writes(node, version=nbformat.NO_CONVERT))


def main(names: list[str]) -> None:
    """Make the notebooks of these tutorials; of all where none is named."""
    NOTEBOOKS.mkdir(exist_ok=True)
    for name in names or sorted(path.stem for path in TUTORIALS.glob("*.md")):
        text = json.dumps(run_notebook(make_notebook(name)), indent=1, ensure_ascii=False)
        (NOTEBOOKS / f"{name}.ipynb").write_text(text + "\n", encoding="utf-8")
        print(f"wrote docs/notebooks/{name}.ipynb")


if __name__ == "__main__":
    main(sys.argv[1:])
