"""Contact: how soft surfaces are, and how each engine makes it so.

Friction is Coulomb's in all of them, with the coefficient of the object (``Object.friction``).

``chain``, ``chain-consistent`` and ``mujoco`` take :class:`Contact` word for word: the impedance
sets how far surfaces sink in, ``solref`` how fast they come back. The ``rod`` engines stand for the
limit of rigid surfaces: a spring at each hinge, so stiff that it sinks in by 0.001 mm (``rod``) or
0.02 mm (``rod-inertia``), see ``feeler.physics.rod.model``. A time constant means nothing where
nothing has inertia, so they read neither ``solref`` nor ``solimp``. Their friction sticks by a
spring as stiff, and slips at the coefficient times the normal force of the step before.
"""

from dataclasses import dataclass

import numpy as np

from feeler.errors import InvalidInput
from feeler.registry import Registry


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Softness of contact in MuJoCo's terms; fixed on purpose, because MuJoCo's defaults assume SI
    units.

    The force follows from the depth r by an impedance d(r) that rises from d_min at the surface to
    d_max at ``width``: the contact's reference acceleration is −b v − k d r, and its regularisation
    (1 − d) / d times the inverse mass that the antenna shows there. A small d_min makes the force
    begin at zero, so that it depends smoothly on everything.

    ``solref`` = (time constant [ms], damping ratio); ``solimp`` = (d_min, d_max, width [mm],
    midpoint, power).
    """

    solref: tuple[float, float] = (0.2, 1.0)
    solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)

    def __post_init__(self) -> None:
        if not (
            np.shape(self.solref) == (2,)
            and np.all(np.isfinite(self.solref))
            and min(self.solref) > 0
        ):
            raise InvalidInput(
                "solref must be two positive numbers (time constant [ms], damping ratio), got"
                f" {self.solref}."
            )
        if np.shape(self.solimp) != (5,):
            raise InvalidInput(
                f"solimp must be (d_min, d_max, width, midpoint, power), got {self.solimp}."
            )
        low, high, width, midpoint, power = self.solimp
        if not (0 < low <= high < 1 and width > 0 and 0 < midpoint < 1 and power >= 1):
            raise InvalidInput(
                "solimp must be (0 < d_min ≤ d_max < 1, width > 0, 0 < midpoint < 1, power ≥ 1),"
                f" got {self.solimp}."
            )

    def check_timestep(self, timestep: float) -> None:
        """Refuse a timestep above half the time constant, where MuJoCo would silently soften the
        contact.
        """
        limit = self.solref[0] / 2
        if timestep > limit * (1 + 1e-9):
            raise InvalidInput(
                f"timestep {timestep:g} ms is too large for the contact's time constant of"
                f" {self.solref[0]:g} ms; use at most {limit:g} ms, or a softer Contact."
            )


CONTACTS: Registry[Contact] = Registry("contact")
"""Contacts by name: ``smooth`` (the default) and ``hard`` (that of version 0.1)."""
CONTACTS.register("smooth", Contact(solimp=(1e-3, 0.95, 0.05, 0.5, 2.0)))
CONTACTS.register("hard", Contact())
DEFAULT_CONTACT = "smooth"


def get_contact(contact: Contact | str | None = None) -> Contact:
    """The contact itself, the one of that name, or the default."""
    if isinstance(contact, Contact):
        return contact
    return CONTACTS[DEFAULT_CONTACT if contact is None else contact]
