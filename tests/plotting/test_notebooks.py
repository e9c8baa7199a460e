"""The notebooks that ship are the tutorials, run, with their pictures."""

import json
from pathlib import Path

import pytest
from scripts import load_script

DOCS = Path(__file__).parents[2] / "docs"
NAMES = sorted(path.stem for path in (DOCS / "tutorial").glob("*.md"))


MAKER = load_script("docs", "notebooks")


def list_outputs(notebook):
    return [
        one
        for cell in notebook["cells"]
        if cell["cell_type"] == "code"
        for one in cell["outputs"]
    ]


def has_picture(output):
    data = output.get("data", {})
    html = "".join(data.get("text/html", ""))
    return "image/png" in data or "data:image/png" in html or "<svg" in html or "<video" in html


def strip(notebook):
    return [(cell["cell_type"], "".join(cell["source"])) for cell in notebook["cells"]]


@pytest.mark.parametrize("name", NAMES)
def test_a_tutorial_ships_as_a_notebook_that_was_run(name):
    shipped = json.loads((DOCS / "notebooks" / f"{name}.ipynb").read_text(encoding="utf-8"))
    assert strip(shipped) == strip(MAKER.make_notebook(name)), (
        f"run: make notebooks NAME={name}"
    )
    outputs = list_outputs(shipped)
    assert any(map(has_picture, outputs))
    assert not [one for one in outputs if one["output_type"] == "error"]
    assert all(
        cell["execution_count"] for cell in shipped["cells"] if cell["cell_type"] == "code"
    )


def test_pieces_of_python_become_cells_and_pictures_of_pages_do_not():
    page = "# T\n\nWords.\n\n```python\na = 1\n\nb = 2\n```\n\n![x](x.png)\n\n"
    page += "```console\n$ c\n```\n"
    cells = MAKER.make_cells(page)
    assert [cell["cell_type"] for cell in cells] == ["markdown", "code", "markdown"]
    assert cells[1]["source"] == "a = 1\n\nb = 2" and "x.png" not in cells[2]["source"]
    assert "pip install" in cells[0]["source"] and "$ c" in cells[2]["source"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_runs(name):
    pytest.importorskip("nbclient")
    again = MAKER.run_notebook(MAKER.make_notebook(name))
    assert any(map(has_picture, list_outputs(again)))
