"""What a person reads: a number printed twice as large, or with another unit behind it."""

import re

from cosmic_ray.operators.operator import Operator
from parso.python.tree import Name

OTHER = {
    "mm": "cm",
    "cm": "mm",
    "ms": "s",
    "s": "ms",
    "Hz": "kHz",
    "kHz": "Hz",
    "°": "rad",
    "rad": "°",
    "%": "‰",
    "m/s": "mm/s",
    "mm/ms": "cm/s",
    "cm/s": "m/s",
    "°/s": "rad/s",
    "mN": "N",
    "mg": "g",
    "µJ": "mJ",
    "bits": "nats",
    "degrees": "radians",
    "MB": "GB",
}
UNITS = "|".join(sorted(map(re.escape, OTHER), key=len, reverse=True))
BEHIND_A_NUMBER = re.compile(rf"^( ?)({UNITS})(?![\w/·°])")
OF_AN_AXIS = re.compile(rf" [(\[]({UNITS})[)\]]")


class DoublePrinted(Operator):
    """A number with a format in an f-string is twice as large: ``{2 * (speed):.2f}``."""

    def mutation_positions(self, node):
        if node.type == "fstring_expr" and any(
            child.type == "fstring_format_spec" and child.get_code()[-1] in "defg%"
            for child in node.children
        ):
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        opening, number, *rest = (child.get_code() for child in node.children)
        return Name(f"{opening}2 * ({number}){''.join(rest)}", node.start_pos)

    @classmethod
    def examples(cls):
        return ()


class OtherUnit(Operator):
    """A unit behind a number, or in the brackets of an axis, is another."""

    def mutation_positions(self, node):
        if self._find(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        start, end = self._find(node).span(self._find(node).lastindex)
        return Name(
            node.value[:start] + OTHER[node.value[start:end]] + node.value[end:],
            node.start_pos,
            prefix=node.prefix,
        )

    def _find(self, node):
        if node.type == "string" and node.parent.type != "simple_stmt":  # a docstring is one
            return OF_AN_AXIS.search(node.value)
        if node.type != "fstring_string" or node.parent.type != "fstring":
            return None
        before = node.get_previous_sibling()
        behind = (
            BEHIND_A_NUMBER.search(node.value)
            if before is not None and before.type == "fstring_expr"
            else None
        )
        return behind or OF_AN_AXIS.search(node.value)

    @classmethod
    def examples(cls):
        return ()
