"""The rod as an engine: without inertia, or with."""

from dataclasses import replace
from functools import partial

from feeler.errors import InvalidInput
from feeler.physics.contact import Contact, get_contact
from feeler.physics.engine import Engine
from feeler.physics.rod.stepper import RodStepper

# [C] radii per step: a face without end is never passed through; other shapes should be as thick
_STRIDE = 10.0


def _check(contact: Contact, timestep: float) -> None:
    """Implicit steps are of any length; surfaces are rigid whatever is asked for."""
    default = get_contact()
    if replace(contact, solref=(default.solref[0], contact.solref[1])) != default:
        raise InvalidInput(
            "the rod engines stand for rigid surfaces: they read neither solref nor solimp. Leave"
            " contact= out, or use engine='chain-consistent'."
        )


ROD = Engine(make=RodStepper, timestep=1.0, check=_check, stride=_STRIDE)
ROD_INERTIA = Engine(
    make=partial(RodStepper, inertia=True), timestep=1.0, check=_check, stride=_STRIDE
)
