"""A follicle: the base of an antenna in space may slide against springs and dampers."""

from typing import Annotated

from feeler.records.record import Ge, Gt, Record, Unit

_Stiff = Annotated[float, Gt(0), Unit("N/mm")]
_Damp = Annotated[float, Ge(0), Unit("N·ms/mm")]


class Follicle(Record):
    """What holds hinge 1 of an antenna in space: a spring and a damper along each axis of the base.

    It has no mass of its own. Hinge 1 itself turns against its own stiffness and damping: a
    follicle of turning stiffness k in series with a shaft whose first hinge has k₁ is a hinge 1 of
    k k₁/(k + k₁).

    Attributes
    ----------
    stiffness : tuple[float, float, float]
        Towards x, along the base's segment (y), and towards z [N/mm], > 0.
    damping : tuple[float, float, float]
        Likewise [N·ms/mm], ≥ 0.
    """

    stiffness: tuple[_Stiff, _Stiff, _Stiff]
    damping: tuple[_Damp, _Damp, _Damp] = (0.0, 0.0, 0.0)
