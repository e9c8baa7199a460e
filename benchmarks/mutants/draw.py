"""Mutants: the tool's operators that a tired person could stand for, and one of ours that swaps
names.
"""

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator
from parso.python.tree import Name
from printed import DoublePrinted, OtherUnit

TOOL = {
    "ReplaceBinaryOperator": (
        "Add_Sub Sub_Add Mul_Div Div_Mul FloorDiv_Mul Pow_Mul Mod_FloorDiv BitAnd_BitOr"
        " BitOr_BitAnd"
    ),
    "ReplaceComparisonOperator": (
        "Lt_LtE Lt_GtE LtE_Lt LtE_Gt Gt_GtE Gt_LtE GtE_Gt GtE_Lt Eq_NotEq NotEq_Eq Is_IsNot"
        " IsNot_Is"
    ),
    "ReplaceUnaryOperator": "Delete_USub Delete_Invert Delete_Not",
    "": (
        "AddNot ReplaceTrueWithFalse ReplaceFalseWithTrue ReplaceAndWithOr ReplaceOrWithAnd"
        " ReplaceBreakWithContinue ReplaceContinueWithBreak NumberReplacer ZeroIterationForLoop"
    ),
}

PAIRS = """
    min max, mean median, nanmean nanmedian, argmin argmax, sin cos, deg2rad rad2deg, floor ceil, \
any all, round floor,
    sum mean, nansum nanmean, maximum minimum, log exp, zeros ones, left right, low high, first \
last, start
    stop, before after, lower upper, std var, stiffness damping, width height, position location, \
tile repeat
"""
SWAPS = {
    one: other for pair in PAIRS.split(",") for one, other in (pair.split(), pair.split()[::-1])
}
SWAPS["abs"] = "float"  # no more than what it was

SOLVER = {
    "tol",
    "xtol",
    "ftol",
    "gtol",
    "rtol",
    "atol",
    "x_scale",
    "maxiter",
    "max_iter",
    "max_nfev",
    "stacklevel",
    "strict",
}
"""Arguments that say how hard a solver tries, or check what always holds: they change no number."""


class SwapName(Operator):
    """One name of a pair stands for the other: ``mean`` for ``median``, ``left`` for ``right``."""

    def mutation_positions(self, node):
        if isinstance(node, Name) and node.value in SWAPS:
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        return Name(SWAPS[node.value], node.start_pos, prefix=node.prefix)

    @classmethod
    def examples(cls):
        return ()


OPERATORS: list[Operator] = [SwapName()]
OPERATORS += [
    get_operator(f"core/{kind}_{name}".replace("/_", "/"))()
    for kind, names in TOOL.items()
    for name in names.split()
]
PRINTED: list[Operator] = [DoublePrinted(), OtherUnit()]


@dataclass(frozen=True)
class Mutant:
    """One small mistake in one file."""

    path: Path
    line: int
    before: str
    after: str
    code: str


def draw_mutants(
    root: Path, paths: list[Path], seed: int, *, printed: bool = False
) -> Iterator[Mutant]:
    """All places where a mistake can be made, each once, in an order and with a mistake drawn by
    ``seed``.

    ``printed``: in what is printed and drawn, instead of in what is computed.
    """
    rng = random.Random(seed)
    sites: dict[tuple[Path, tuple[int, int]], list[tuple[Operator, int]]] = {}
    for path in paths:
        source = (root / path).read_text(encoding="utf-8")
        hidden = _find_hidden(source, printed)
        nodes = list(ast_nodes(get_ast(source)))
        for operator in PRINTED if printed else OPERATORS:
            places = [
                position for node in nodes for position, _ in operator.mutation_positions(node)
            ]
            for occurrence, place in enumerate(places):
                if not any(start <= place < end for start, end in hidden):
                    sites.setdefault((path, place), []).append((operator, occurrence))
    order = sorted(sites)
    rng.shuffle(order)
    for path, place in order:
        source = (root / path).read_text(encoding="utf-8")
        code = mutate_code(source, *rng.choice(sites[path, place]))
        changed = [
            pair
            for pair in zip(source.splitlines(), code.splitlines(), strict=False)
            if pair[0] != pair[1]
        ]
        if changed and _is_other(source, code):
            yield Mutant(path, place[0], changed[0][0].strip(), changed[0][1].strip(), code)


def _is_other(source: str, code: str) -> bool:
    """Whether it is another program; a star turned into a slash in a signature makes none."""
    try:
        before, after = ast.parse(source), ast.parse(code)
    except SyntaxError:
        return False
    named = [
        [len(n.kwonlyargs) for n in ast.walk(tree) if isinstance(n, ast.arguments)]
        for tree in (before, after)
    ]
    return ast.dump(after) != ast.dump(before) and named[0] == named[1]


def _find_hidden(source: str, printed: bool) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Where none is planted: types, imports, decorators, texts and errors, and how hard a solver
    tries.
    """
    hidden: list[ast.AST] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Raise | ast.Import | ast.ImportFrom | ast.Assert):
            hidden.append(node)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            hidden += node.decorator_list
            hidden += (
                [node.returns] if isinstance(node, ast.FunctionDef) and node.returns else []
            )
        elif isinstance(node, ast.arg | ast.AnnAssign) and node.annotation:
            hidden.append(node.annotation)
        elif isinstance(node, ast.JoinedStr) and not printed:
            hidden.append(node)
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "reshape"
        ):
            hidden += [
                size for size in node.args if isinstance(size, ast.UnaryOp)
            ]  # NumPy takes any −n for −1
        elif isinstance(node, ast.keyword) and node.arg in SOLVER:
            hidden.append(node.value)
    return [((n.lineno, n.col_offset), (n.end_lineno, n.end_col_offset)) for n in hidden]  # type: ignore[attr-defined]
