"""A test that can pass without looking is none: no assertion hangs on a condition."""

import ast
from pathlib import Path

import pytest

TESTS = sorted(Path(__file__).parents[1].rglob("test_*.py"))


@pytest.mark.parametrize("path", TESTS, ids=lambda path: path.stem)
def test_no_assertion_waits_for_a_condition(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    tests = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]
    branches = [
        (test.name, one) for test in tests for one in ast.walk(test) if isinstance(one, ast.If)
    ]
    waiting = {
        name
        for name, one in branches
        if any(isinstance(part, ast.Assert) for part in ast.walk(one))
    }
    assert not waiting
