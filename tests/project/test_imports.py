"""Imports run down the layers, and nothing that analyses needs a simulator."""

import ast
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

import feeler

SOURCE = Path(feeler.__file__).parent
LAYERS = (
    {"renamed"},
    {"errors", "progress"},
    {"validation"},
    {"records", "draw", "sandbox", "compiled"},
    {"files"},
    {"provenance", "tables"},
    {"antenna"},
    {"objects"},
    {"execute"},
    {"tensors"},
    {"physics"},
    {"experiments"},
    {"analysis", "encoding", "tracking"},
    {"calibration", "decoding", "wall"},
    {"robot", "learn", "spikes"},
    {"presets", "study"},
    {"plotting"},
    {"report"},
    {"active", "animal", "challenge", "comparison", "design", "studio", "tradeoff"},
    {"__init__"},
    {"cli", "__main__"},
)
RANK = {room: rank for rank, rooms in enumerate(LAYERS) for room in rooms}
FILES = sorted(SOURCE.rglob("*.py"))


@cache
def find_modules(path):
    """Modules that a file imports, in functions too, as the parts of their names."""
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
    return [name.split(".") for name in names]


@pytest.mark.long
def test_imports_run_downwards():
    upward = set()
    for path in FILES:
        file = path.relative_to(SOURCE)
        rooms = {parts[1] for parts in find_modules(path) if parts[0] == "feeler" and parts[1:]}
        rank = RANK[file.parts[0].removesuffix(".py")]
        upward |= {(file.as_posix(), other) for other in rooms if RANK[other] > rank}
    assert upward == set()


@pytest.mark.long
def test_no_module_but_the_command_reproduce_reaches_for_the_paper_or_a_study():
    users = {
        path.relative_to(SOURCE).as_posix()
        for path in FILES
        if any(parts[0] in ("paper", "studies") for parts in find_modules(path))
    }
    assert users == {"cli/reproduce.py"}


BEFORE_USE = (
    ("import feeler", {"numpy", "scipy", "xarray", "matplotlib", "numba"}),
    ("import feeler.cli.app", {"scipy", "xarray", "matplotlib", "numba"}),
)


def run_python(*lines):
    """What a fresh interpreter says of these lines, one after the other."""
    return subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=False
    ).stderr


@pytest.mark.long
def test_nothing_slow_is_loaded_before_it_is_used():
    assert not any(
        later[1] - earlier[1] for earlier, later in pairwise(BEFORE_USE)
    )  # else one process would not do
    steps = [
        f"{code}\nassert not {slow} & set(sys.modules), {code!r}" for code, slow in BEFORE_USE
    ]
    say = "from feeler.cli.options import say_json", "say_json({})"  # first when a touch begins
    steps += [*say, "assert 'matplotlib' not in sys.modules"]
    assert run_python("import sys", *steps) == ""
