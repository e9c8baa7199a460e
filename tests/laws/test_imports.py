"""Imports run down the layers, and nothing that analyses needs a simulator."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import feeler

SOURCE = Path(feeler.__file__).parent
LAYERS = (
    {
        "checked",
        "draw",
        "errors",
        "compiled",
        "frozen",
        "provenance",
        "registry",
        "limits",
        "guard",
        "toml",
        "sources",
        "svg",
    },
    {"antenna"},
    {"stimulus"},
    {"execute"},
    {"tensors"},
    {"physics"},
    {"experiment"},
    {"response", "encoding", "dispersion", "tracking"},
    {"calibration", "decoding", "information", "wall"},
    {"robot", "learn"},
    {"presets"},
    {"scale"},
    {"plotting"},
    {"report"},
    {"comparison", "studio", "tradeoff"},
    {"paper"},
    {"cli"},
)
RANK = {room: rank for rank, rooms in enumerate(LAYERS) for room in rooms}
FILES = sorted(path for path in SOURCE.rglob("*.py") if path.parent != SOURCE)


def find_rooms(path):
    """Rooms of feeler that a file imports, in functions too."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            parts = name.split(".")
            if parts[0] == "feeler" and len(parts) > 1:
                yield parts[1]


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_run_downwards(path):
    room = path.relative_to(SOURCE).parts[0]
    above = {other for other in find_rooms(path) if RANK[other] > RANK[room]}
    assert not above, f"{room} imports {above}, which lies above it"


def test_no_verb_but_reproduce_reaches_for_the_paper():
    users = {path.relative_to(SOURCE).as_posix() for path in FILES if "paper" in find_rooms(path)}
    assert {user for user in users if not user.startswith("paper/")} == {"cli/reproduce.py"}


def test_one_table_says_what_a_scale_is():
    asking = re.compile(r"""\bscale\s*(==|!=|in)\s*["'](smoke|quick|paper)|["']smoke["']\s*:""")
    assert not [path.relative_to(SOURCE).as_posix() for path in FILES if asking.search(path.read_text())]


@pytest.mark.parametrize(
    ("code", "slow"),
    [
        ("import feeler", ("numpy", "scipy", "xarray", "matplotlib", "numba")),
        ("import feeler.cli.app", ("scipy", "xarray", "matplotlib", "numba")),
        ("import feeler.paper.reproduce, feeler.paper.context as c; c.Context()", ("xarray", "matplotlib", "numba")),
    ],
)
def test_nothing_slow_is_loaded_before_it_is_used(code, slow):
    code = f"import sys; {code}; sys.exit(', '.join({set(slow)!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == ""


def test_a_verb_keeps_its_name_when_its_rooms_are_loaded():
    code = "import feeler, feeler.stimulus.trial, feeler.experiment.touch; feeler.touch.__call__; feeler.bend.__call__"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    "room", ["tensors", "encoding", "dispersion", "decoding", "information", "tracking", "response"]
)
def test_analysis_needs_no_simulator(room):
    code = f"import feeler.{room}, sys; sys.exit('mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_only_one_module_writes_a_model():
    writers = {p.relative_to(SOURCE).as_posix() for p in FILES if re.search(r"^\s*import mujoco$", p.read_text(), re.M)}
    assert writers <= {"physics/mujoco.py"}
