"""The robotic antenna's hinges: geometry, theoretical stiffness, numbers with their sources."""

from typing import Annotated, Any

import numpy as np

from feeler.antenna.fact import Fact
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Gt, Record, Unit, freeze

ROBOT_FACTS: dict[str, Fact] = {
    "n_hinges": Fact(value=8, unit="1", tag="P", note="capacitive hinges"),
    "body": Fact(
        value=(73.0, 16.0, 2.0),
        unit="mm",
        tag="P",
        note="length, width, thickness of the whole device",
    ),
    "mass": Fact(value=0.491, unit="g", tag="P", note="of the whole device"),
    "modulus": Fact(value=2500.0, unit="MPa", tag="P", note="Young's modulus of Kapton"),
    "stiffness_factor": Fact(value=1.19, unit="1", tag="P", note="p1: k = p1·k_th"),
    "damping_factor": Fact(
        value=2.06, unit="ms", tag="P", note="p2: c = p2·k_th; the unit is not stated [C]"
    ),
    "spacing": Fact(
        value=7.85, unit="mm", tag="D", note="between hinges; from the poster [A, D]"
    ),
    "mount": Fact(
        value=6.2, unit="mm", tag="D", note="rigid part before hinge 1; about, [A, D]"
    ),
    "last_link": Fact(value=7.5, unit="mm", tag="D", note="beyond hinge 8; about, [A, D]"),
    "width": Fact(
        value=(11.0, 10.0, 9.2, 8.2, 7.1, 6.1, 5.2, 4.6),
        unit="mm",
        tag="D",
        note="±0.3, base to tip; [A, D]",
    ),
    "thickness": Fact(
        value=0.0508,
        unit="mm",
        tag="C",
        note="of the flexure; plausible range 0.0254 to 0.0508",
    ),
    "hinge_length": Fact(
        value=0.5, unit="mm", tag="C", note="of the flexure; plausible range 0.5 to 0.9"
    ),
    "radius": Fact(
        value=1.0,
        unit="mm",
        tag="C",
        note="collision radius: half the 2 mm thickness of the device",
    ),
}


class Flexures(Record):
    """Flexure hinges as geometry; each field is one number or one per hinge, base to tip.

    Attributes
    ----------
    width : np.ndarray
        Width across the antenna [mm].
    thickness : np.ndarray
        Thickness of the bending sheet [mm].
    length : np.ndarray
        Free length of the flexure along the antenna [mm].
    modulus : np.ndarray
        Young's modulus [MPa = N/mm²].
    """

    width: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    thickness: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    length: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    modulus: Annotated[np.ndarray, "hinge?", Gt(0), Unit("MPa")]

    def _check(self) -> None:
        try:
            arrays = np.broadcast_arrays(np.empty(1), *vars(self).values())[1:]
        except ValueError as error:
            raise InvalidInput(
                "width, thickness, length and modulus must be one number or one per hinge, all of"
                " one length."
            ) from error
        vars(self).update(zip(vars(self), map(freeze, arrays), strict=True))
        with np.errstate(over="ignore", under="ignore"):
            theory = self.stiffness
        if not np.all((theory > 0) & np.isfinite(theory)):
            raise InvalidInput(
                "width, thickness, length and modulus give no stiffness that can be computed with;"
                f" check their units (mm, MPa): got {theory.min():g} to {theory.max():g} N·mm/rad."
            )

    @property
    def stiffness(self) -> np.ndarray:
        """Theoretical stiffness (hinge,) [N·mm/rad]: k_th = E·w·t³/(12·ℓ) (Methods; form [B])."""
        return self.modulus * self.width * self.thickness**3 / (12 * self.length)


@checked
def make_flexures(**changes: float | np.ndarray) -> Flexures:
    """The robot's eight hinges.

    ``thickness``, ``length``, ``width`` and ``modulus`` replace the defaults.
    """
    facts = {
        "length": "hinge_length",
        **{key: key for key in ("width", "thickness", "modulus")},
    }
    values: dict[str, Any] = {name: ROBOT_FACTS[fact].value for name, fact in facts.items()}
    return Flexures(**values | changes)
