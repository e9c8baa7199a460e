"""Cells of the report swapped, doubled or mislabelled where they are made, and whether the kept
smoke run (``tests/studies/paper/golden.txt``) notices.

A place that the smoke run does not come to is no cell of it, and another one is drawn.
"""

import ast
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

PAPER = Path("src/feeler/studies/paper")
COMPARE = """
from pathlib import Path
from tests.golden import compare, read_kept
from tests.studies.paper._golden import KEPT, TOLERANCES, write_golden
print("\\n".join(compare(read_kept(KEPT), write_golden(Path({out!r})), TOLERANCES)[0]))
"""
Edit = tuple[tuple[int, int], tuple[int, int], str]
"""Where it begins and ends, and what stands there then."""


def judge_report(copy: Path, seed: int, number: int) -> tuple[int, int]:
    """How many of so many mistakes were noticed; each that was not is printed."""
    if said := _run(copy):
        raise SystemExit(f"without any mistake the run is not what was kept:\n{said[:2000]}")
    noticed = tried = 0
    for path, edits, reach, what in _draw(copy, seed):
        if tried == number:
            break
        said = _run_with(copy, path, edits)
        if not said and not _is_reached(copy, path, reach):
            continue
        tried, noticed = tried + 1, noticed + bool(said)
        verdict = "noticed" if said else "UNNOTICED"
        print(f"{verdict} {path.name}:{edits[0][0][0]} {what}", flush=True)
    return noticed, tried


def _run_with(copy: Path, path: Path, edits: list[Edit]) -> str:
    source = path.read_text(encoding="utf-8")
    path.write_text(_edit(source, edits), encoding="utf-8")
    try:
        return _run(copy)
    finally:
        path.write_text(source, encoding="utf-8")


def _run(copy: Path) -> str:
    """What differs from what was kept, or how the run failed."""
    out = copy / "out" / "golden"
    options = ["--scale", "smoke", "--workers", "1", "--out", str(out)]
    env = {**os.environ, "PYTHONPATH": f"{copy / 'src'}{os.pathsep}{copy}"}
    for words in (
        ["-m", "feeler", "reproduce", *options],
        ["-c", COMPARE.format(out=str(out))],
    ):
        done = subprocess.run(
            [sys.executable, *words],
            cwd=copy,
            env=env,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            return done.stderr[-500:] or "failed"
    return done.stdout.strip()


def _is_reached(copy: Path, path: Path, reach: ast.expr) -> bool:
    """Whether the smoke run comes to an expression."""
    mark = copy / "reached"
    mark.unlink(missing_ok=True)
    touch = f"__import__('pathlib').Path({str(mark)!r}).touch()"
    text = ast.unparse(reach)
    _run_with(copy, path, [(*_span(reach), f"({touch}, {text})[1]")])
    return mark.exists()


def _draw(copy: Path, seed: int) -> Iterator[tuple[Path, list[Edit], ast.expr, str]]:
    """Mistakes in an order drawn by the seed."""
    found = []
    for path in sorted((copy / PAPER).glob("*.py")):
        source = path.read_text(encoding="utf-8")
        found += [
            (path, *mistake)
            for mistake in _find(ast.parse(source))
            if _stands_there(source, mistake[1]) and _is_other(source, mistake[0])
        ]
    random.Random(seed).shuffle(found)
    return iter(found)


def _is_other(source: str, edits: list[Edit]) -> bool:
    """Whether it is another program."""
    try:
        return ast.dump(ast.parse(_edit(source, edits))) != ast.dump(ast.parse(source))
    except SyntaxError:
        return False


def _stands_there(source: str, node: ast.expr) -> bool:
    """Whether the expression stands where Python says; in texts it may not."""
    try:
        there = ast.parse(ast.get_source_segment(source, node) or "", mode="eval")
    except SyntaxError:
        return False
    return ast.unparse(there) == ast.unparse(node)


def _find(tree: ast.Module) -> Iterator[tuple[list[Edit], ast.expr, str]]:
    """Mistakes in what sections show: headers, rows, values, and numbers in sentences."""
    for node in _list_shown(tree):
        if isinstance(node, ast.FormattedValue) and node.format_spec:
            text = ast.unparse(node.value)
            yield [(*_span(node.value), f"(2 * ({text}))")], node.value, f"double {text}"
        cells = node.elts if isinstance(node, ast.List) else []
        cells = node.values if isinstance(node, ast.Dict) and _names_values(node) else cells
        for one, other in pairwise(cells):
            yield from _swap(one, other)
        for cell in cells:
            if not isinstance(cell, ast.Constant | ast.JoinedStr | ast.Dict | ast.Starred):
                text = ast.unparse(cell)
                yield [(*_span(cell), f"2 * ({text})")], cell, f"double {text}"


def _list_shown(tree: ast.Module) -> Iterator[ast.AST]:
    """What lies within functions that are handed the section, or that tabulate for those."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            told = ast.unparse(function)
            if "section" in told or ".append([" in told or "tabulate" in function.name:
                yield from ast.walk(function)


def _names_values(node: ast.Dict) -> bool:
    return all(
        isinstance(key, ast.Constant | ast.JoinedStr) and "." in ast.unparse(key)
        for key in node.keys
    )


def _swap(one: ast.expr, other: ast.expr) -> Iterator[tuple[list[Edit], ast.expr, str]]:
    texts = ast.unparse(one), ast.unparse(other)
    if texts[0] != texts[1] and not any(
        isinstance(cell, ast.Starred | ast.Dict) for cell in (one, other)
    ):
        edits = [(*_span(one), texts[1]), (*_span(other), texts[0])]
        yield edits, one, f"swap {texts[0]} and {texts[1]}"


def _span(node: ast.expr) -> tuple[tuple[int, int], tuple[int, int]]:
    assert node.end_lineno is not None and node.end_col_offset is not None
    return (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)


def _edit(source: str, edits: list[Edit]) -> str:
    """The source with what stands at some places replaced; columns count bytes."""
    lines = source.encode().splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))
    raw = source.encode()
    for (row, column), (last, end), text in sorted(edits, reverse=True):
        raw = raw[: starts[row - 1] + column] + text.encode() + raw[starts[last - 1] + end :]
    return raw.decode()
