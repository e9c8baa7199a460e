"""Formulas: one line of arithmetic that stands for a number in every segment; read, never run as
Python.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from feeler.errors import InvalidInput

MAX_LENGTH = 1000  # [C] characters
OPERATORS: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
FUNCTIONS: dict[str, Callable] = {
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
    "spread": lambda total, shares: total * shares / np.sum(shares),
}


def list_names(
    n_segments: int, segment_length: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """What a formula may use: ``n`` (1 … N), ``N``, ``x`` = (n − ½) / N; with lengths also ``l``
    and ``s``.

    ``l`` is the segment's length [mm], ``s`` its middle as a fraction of the antenna's length.
    """
    number = np.arange(1.0, n_segments + 1)
    names = {"n": number, "N": np.array(float(n_segments)), "x": (number - 0.5) / n_segments}
    if segment_length is not None:
        length = np.broadcast_to(segment_length, number.shape)
        names |= {"l": length, "s": (np.cumsum(length) - length / 2) / length.sum()}
    return names


def evaluate(formula: str, names: Mapping[str, np.ndarray]) -> np.ndarray:
    """The value of a formula; + − * / **, brackets, pi, and the functions of ``FUNCTIONS``.

    ``spread(total, shares)`` gives shares that add up to the total.

    Raises
    ------
    InvalidInput
        Not such a formula; the message says which part is not understood and what is.
    """
    if len(formula) > MAX_LENGTH:
        raise InvalidInput(
            f"a formula has at most {MAX_LENGTH} characters, got {len(formula)}."
        )
    known = {"pi": np.array(np.pi), **names}

    def value(node: Any) -> Any:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return np.float64(number)  # a float, so that no power grows without bounds
            case ast.Name(id=name) if name in known:
                return known[name]
            case ast.BinOp() if type(node.op) in OPERATORS:
                return OPERATORS[type(node.op)](value(node.left), value(node.right))
            case ast.UnaryOp() if type(node.op) in OPERATORS:
                return OPERATORS[type(node.op)](value(node.operand))
            case ast.Call(func=ast.Name(id=name), keywords=[]) if name in FUNCTIONS:
                return FUNCTIONS[name](*map(value, node.args))
        raise InvalidInput(
            f"{ast.unparse(node)[:40]!r} is not understood in a formula; valid: numbers, + - * / **"
            f" ( ), {', '.join(known)}, {', '.join(f'{name}()' for name in FUNCTIONS)}."
        )

    try:
        with np.errstate(
            all="ignore"
        ):  # what is not finite is refused where the quantity is known
            return np.asarray(value(ast.parse(formula.strip(), mode="eval").body), dtype=float)
    except InvalidInput:
        raise
    except (
        SyntaxError,
        ValueError,
        TypeError,
        OverflowError,
        RecursionError,
        MemoryError,
    ) as error:
        raise InvalidInput(
            f"{formula[:60]!r} is no formula ({str(error)[:60]}); as in 37.78 * exp(-0.0827 * (n -"
            " 1))."
        ) from error
