"""A flow that drags an antenna in space along."""

from typing import Annotated

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Ge, Record, Unit

_WORDS = ("drag", "along", "x", "y", "z")
_EXAMPLE = "name=number,name=number as in drag=2e-5,x=0.3"


class Flow(Record):
    """A steady, even flow; its drag on an antenna is linear in their relative velocity.

    Force per length f = −c⊥ (v − u)⊥ − c∥ (v − u)∥, across the segment and along it. Of a slender
    body of radius r and length L in a fluid of viscosity μ at low Reynolds numbers
    c⊥ ≈ 4πμ/(ln(L/r) + ½) and c∥ about half of that (Cox 1970, J. Fluid Mech. 44: 791); μ is 1.8e-8
    N·ms/mm² in air and 1e-6 in water.

    Attributes
    ----------
    drag : float
        c⊥ [N·ms/mm²], ≥ 0.
    along : float | None
        c∥ [N·ms/mm²], ≥ 0; default: half of ``drag``.
    velocity : tuple[float, float, float]
        u [mm/ms].
    """

    drag: Annotated[float, Ge(0), Unit("N·ms/mm²")]
    along: Annotated[float, Ge(0), Unit("N·ms/mm²")] | None = None
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def _check(self) -> None:
        if self.along is None:
            vars(self)["along"] = self.drag / 2


@checked
def parse_flow(text: str) -> Flow:
    """A flow from one line, as in ``drag=2e-5,x=0.3``: ``drag``, ``along``, and x, y and z of its
    velocity.

    Raises
    ------
    InvalidInput
        Another name, one that is said twice, or no number.
    """
    values: dict[str, float] = {}
    for name, equals, number in (pair.partition("=") for pair in text.split(",")):
        key = name.strip()
        if key not in _WORDS or not equals or key in values:
            raise InvalidInput(
                f"the flow {text!r} must be {_EXAMPLE}, each of {', '.join(_WORDS)} once at most;"
                f" got {name + equals + number!r}."
            )
        values[key] = _parse_number(number, text)
    if "drag" not in values:
        raise InvalidInput(f"the flow {text!r} needs its drag [N·ms/mm²], as in {_EXAMPLE}.")
    x, y, z = (values.pop(axis, 0.0) for axis in "xyz")
    return Flow(velocity=(x, y, z), **values)


def _parse_number(number: str, text: str) -> float:
    try:
        return float(number)
    except ValueError:
        raise InvalidInput(
            f"the flow {text!r} must be {_EXAMPLE}; {number.strip()!r} is no number."
        ) from None
