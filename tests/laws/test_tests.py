"""A test that can pass without looking is none: no assertion hangs on a condition."""

import ast
from pathlib import Path

TESTS = sorted(Path(__file__).parents[1].rglob("test_*.py"))


def find_waiting(path: Path) -> set[str]:
    """Tests of a file in which an assertion stands behind an ``if``."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    tests = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]
    branches = [
        (test.name, one) for test in tests for one in ast.walk(test) if isinstance(one, ast.If)
    ]
    return {
        f"{path.stem}.{name}"
        for name, one in branches
        if any(isinstance(part, ast.Assert) for part in ast.walk(one))
    }


def test_no_assertion_waits_for_a_condition():
    assert set().union(*map(find_waiting, TESTS)) == set()
