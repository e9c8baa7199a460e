"""A flow that drags an antenna in space along."""

from typing import Annotated

from feeler.record import Ge, Record, Unit


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
