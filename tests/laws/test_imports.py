"""Imports run down the layers, and nothing that analyses needs a simulator."""

import ast
import re
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

import feeler

SOURCE = Path(feeler.__file__).parent
LAYERS = (
    {"errors", "progress"},
    {"records"},
    {"disk", "draw"},
    {"compiled"},
    {"antenna"},
    {"stimulus"},
    {"task"},
    {"execute"},
    {"tensors"},
    {"physics"},
    {"experiment"},
    {"response", "encoding", "dispersion", "tracking"},
    {"calibration", "decoding", "information", "wall"},
    {"robot", "learn", "spikes"},
    {"presets"},
    {"scale", "shipped", "study"},
    {"plotting"},
    {"report"},
    {"active", "comparison", "contests", "design", "spiking", "studio", "tradeoff"},
    {"paper", "__init__"},
    {"cli"},
)
RANK = {room: rank for rank, rooms in enumerate(LAYERS) for room in rooms}
FILES = sorted(path for path in SOURCE.rglob("*.py") if path.parent != SOURCE)


@cache
def find_rooms(path):
    """Rooms of feeler that a file imports, in functions too."""
    return {*_read_rooms(path)}


def _read_rooms(path):
    for node in ast.walk(ast.parse(path.read_text())):
        names = [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            parts = name.split(".")
            if parts[0] == "feeler" and len(parts) > 1:
                yield name_room(parts[1:])


def name_room(parts):
    """The room that a path belongs to; each study is a room of its own."""
    return (
        parts[1].removesuffix(".py") if parts[0] == "studies" and len(parts) > 1 else parts[0]
    )


def test_imports_run_downwards():
    upward = set()
    for path in FILES:
        file = path.relative_to(SOURCE)
        rank = RANK[name_room(file.parts)]
        upward |= {(file.as_posix(), other) for other in find_rooms(path) if RANK[other] > rank}
    assert upward == set()


def test_no_verb_but_reproduce_reaches_for_the_paper():
    users = {
        path.relative_to(SOURCE).as_posix() for path in FILES if "paper" in find_rooms(path)
    }
    assert {user for user in users if not user.startswith("studies/paper/")} == {
        "cli/reproduce.py"
    }


def test_one_table_says_what_a_scale_is():
    asking = re.compile(r"""\bscale\s*(==|!=|in)\s*["'](smoke|quick|paper)|["']smoke["']\s*:""")
    assert not [
        path.relative_to(SOURCE).as_posix() for path in FILES if asking.search(path.read_text())
    ]


BEFORE_USE = (
    ("import feeler", {"numpy", "pydantic", "scipy", "xarray", "matplotlib", "numba"}),
    ("import feeler.cli.app", {"pydantic", "scipy", "xarray", "matplotlib", "numba"}),
    (
        "import paper.reproduce, paper.context as c; c.Context()",
        {"xarray", "matplotlib", "numba"},
    ),
)


def run_python(*lines):
    """What a fresh interpreter says of these lines, one after the other."""
    return subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=False
    ).stderr


def test_nothing_slow_is_loaded_before_it_is_used():
    assert not any(
        later[1] - earlier[1] for earlier, later in pairwise(BEFORE_USE)
    )  # else one process would not do
    steps = [
        f"{code}\nassert not {slow} & set(sys.modules), {code!r}" for code, slow in BEFORE_USE
    ]
    assert run_python("import sys", *steps) == ""


@pytest.mark.long
def test_a_verb_keeps_its_name_when_its_rooms_are_loaded():
    first = "import feeler, feeler.objects.trials, feeler.experiments.tactile"
    assert run_python(first, "feeler.touch.__call__; feeler.bend.__call__") == ""


@pytest.mark.long
def test_analysis_needs_no_simulator():
    rooms = (
        "tensors",
        "encoding",
        "analysis",
        "decoding",
        "tracking",
    )
    steps = [
        f"import feeler.{room}\nassert 'mujoco' not in sys.modules, 'loaded by {room}'"
        for room in rooms
    ]
    assert run_python("import sys", *steps) == ""


def list_files(pattern: str) -> set[str]:
    """Source files in which a pattern occurs."""
    return {
        p.relative_to(SOURCE).as_posix()
        for p in FILES
        if re.search(pattern, p.read_text(), re.M)
    }


def test_only_one_module_writes_a_model():
    assert list_files(r"\bMjSpec\(") == {"physics/spec.py"}
    users = {"spec", "spec_control", "spec_space", "mujoco", "mujoco_space"}
    found = list_files(r"^\s*(import|from) mujoco\b")
    assert found == {f"physics/{name}.py" for name in users}
