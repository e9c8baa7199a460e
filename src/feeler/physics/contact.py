"""Contact: how soft surfaces are, and how each engine makes it so.

Friction is Coulomb's in all of them, with the coefficient of the object (``Object.friction``).

All take :class:`Contact` word for word: the impedance sets how far surfaces sink in, ``solref`` how
fast they come back.

The default contact follows from the antenna and from how fast it is touched. Let a contact at arc
length s push the antenna aside by δ. Statically the antenna answers with the force δ/C, where
C = Σ (s − s_n)² / k_n sums over the hinges n up to there, and a contact that has sunk by r answers
with g(r) r / (τ² w), g(r) = (d/d_max)² / (1 − d), where τ is its time constant times its damping
ratio and w the inverse mass that MuJoCo reckons with at that segment. From both follow

* d_max: where d has risen to d_max, the sink is the share (1 − d_max) τ² w / C of the push,
  whatever the push. It is at most ``share`` if 1 − d_max = share · C / (τ² w),
  which holds up to ``HARDEST``: closer to a stiff base the share is greater.
* the least width: d has risen to d_max when the push is that of a ``turn`` of the base,
  δ = turn · s, if the width is share · turn · s. Smaller pushes sink in less than that width.
* the width under motion: an object of speed v crosses the width v · ``crossing`` in that time, so
  contact delays what happens by less than that, and no timestep up to half the time constant steps
  across it. A slow object meets an antenna that slides and swings by itself, and presses longer; a
  loaded contact that is much narrower than the step allows alternates from step to step. So up to
  an eighth of the radius the width is v · ``lingering``.

The width is the greatest of these, and at most half the antenna's radius.

An object of speed v that meets the antenna sinks in by about v τ / 3 before it carries the antenna
along, whatever either weighs, so the time constant is at most ``_PACE`` times the antenna's radius:
0.2 ms from a radius of 0.2 mm on, less on thinner antennas, whose timestep is as much smaller.
"""

from dataclasses import replace
from typing import Annotated, NamedTuple

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.objects.bodies import Object
from feeler.records import Ge, Gt, Lt, Record, Registry, Unit

_LONGEST = 0.2  # ms; [C] the time constant that every engine's timestep is made for
_SHORTEST = 0.005  # ms; [C] of the default contact, for antennas that end in a needle's point
_PACE = 1.0  # ms/mm; [C] the most that the default time constant is over the radius
_PLACE = 0.9  # share of the length at which that radius is read: the paper's last location [P]
_FASTEST = 0.6  # mm/ms; the paper's fastest touch [P], for which that time constant is made
_LEAST = 0.001  # ms; [C] a shorter time constant is not advised: something else is wrong
# Greatest d_max: from 0.999 on MuJoCo's solver, at its tightest, is no longer exact to 1e-9
HARDEST = 0.99
MIN_FRICTION = 1e-5  # MuJoCo's smallest; without any, contacts have a normal force only
_EVEN = 0.5  # [C] from this d_min on a contact has no rise that a timestep should follow
DEEP = 0.5  # [C] how deep contacts may sink in, over the smaller radius


class _ContactCompliance(NamedTuple):
    """What :class:`Contact` comes to on each segment of an antenna (segment,).

    Attributes
    ----------
    width : np.ndarray
        At rest [mm].
    slow : np.ndarray
        The most that slow motion widens it to [mm].
    widest : np.ndarray
        The most that any motion widens it to [mm].
    """

    d_max: np.ndarray
    width: np.ndarray
    slow: np.ndarray
    widest: np.ndarray

    def widen(self, slow: float, fast: float) -> np.ndarray:
        """The width under motion (segment,) [mm], by the two that :meth:`Contact.widen` gives."""
        moved = np.maximum(np.minimum(slow, self.slow), np.minimum(fast, self.widest))
        return np.maximum(self.width, moved)


_Positive = Annotated[float, Gt(0)]


class Contact(Record):
    """Softness of contact in MuJoCo's terms; fixed on purpose, because MuJoCo's defaults assume SI
    units.

    The force follows from the depth r by an impedance d(r) that rises from d_min at the surface to
    d_max at ``width``: the contact's reference acceleration is −b v − k d r, and its regularisation
    (1 − d) / d times the inverse mass that the antenna shows there. A small d_min makes the force
    begin at zero, so that it depends smoothly on everything.

    With ``share`` and ``crossing``, width and d_max follow from the antenna and from how fast it is
    touched, as this module derives; those of ``solimp`` are then the least.

    Attributes
    ----------
    solref : tuple[float, float]
        Time constant [ms], damping ratio.
    solimp : tuple[float, float, float, float, float]
        d_min, d_max, width [mm], midpoint, power.
    share : float
        The most that surfaces sink in, over the push; 0: whatever ``solimp`` gives.
    turn : float
        Turn of the base [rad] whose push the width is made for.
    crossing : float
        Time in which a moving object crosses the width [ms]; 0: motion does not widen it.
    lingering : float
        The same for a slow object, until the width is an eighth of the antenna's radius [ms].
    speed : float
        The least speed to reckon with [mm/ms], for motion that is commanded later.
    """

    solref: tuple[_Positive, _Positive] = (0.2, 1.0)
    solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)
    share: Annotated[float, Ge(0), Lt(1)] = 0.0
    turn: Annotated[float, Ge(0)] = 0.005
    crossing: Annotated[float, Ge(0), Unit("ms")] = 0.0
    lingering: Annotated[float, Ge(0), Unit("ms")] = 0.0
    speed: Annotated[float, Ge(0), Unit("mm/ms")] = 0.0

    def _check(self) -> None:
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
                f" {self.solref[0]:.3g} ms; use at most {_round_down(limit):g} ms, leave timestep="
                " out, or give a softer contact."
            )

    def scale_timestep(self, timestep: float) -> float:
        """A timestep [ms] that is made for a time constant of 0.2 ms, divided by the least whole
        number that makes it as small beside this one.
        """
        return timestep / max(1, int(np.ceil(_LONGEST / self.solref[0] - 1e-9)))

    def halve(self) -> "Contact":
        """The contact of half the width."""
        low, high, width, middle, power = self.solimp
        return replace(
            self,
            solimp=(low, high, width / 2, middle, power),
            share=self.share / 2,
            crossing=self.crossing / 2,
            lingering=self.lingering / 2,
        )

    def soften(self, antenna: Antenna) -> _ContactCompliance:
        """Width and d_max at each segment of an antenna, as this module derives them."""
        _, high, width, _, _ = self.solimp
        place = antenna.hinge_position + antenna.segment_length / 2
        most, least = np.full(place.shape, high), np.full(place.shape, width)
        if self.share:
            stretch = np.prod(self.solref) ** 2 * find_invweight(antenna)
            asked = 1 - self.share * _compute_compliance(antenna) / stretch
            most = np.maximum(high, np.minimum(asked, HARDEST))
            least = np.maximum(width, self.share * self.turn * place)
        widest = antenna.radius / 2 if self.share or self.crossing else least
        return _ContactCompliance(most, np.minimum(least, widest), widest / 4, widest)

    def widen(self, speed: float) -> tuple[float, float]:
        """The widths [mm] that an object of a speed [mm/ms] crosses in ``lingering`` and
        ``crossing``.
        """
        fastest = max(speed, self.speed)
        return self.lingering * fastest, self.crossing * fastest


def _compute_compliance(antenna: Antenna) -> np.ndarray:
    """How far a force across the straight antenna pushes each segment's centre aside (segment,)
    [mm/N]; in space where it gives way least.
    """
    hinge = antenna.hinge_position
    lever = hinge + antenna.segment_length / 2 - hinge[:, None]
    squared = np.where(lever > 0, lever, 0.0) ** 2
    if not antenna.spatial:
        return np.sum(squared / antenna.stiffness[:, None], axis=0)
    return np.min(
        [(squared / row[:, None]).sum(axis=0) for row in antenna.stiffness[:2]], axis=0
    )


def find_invweight(antenna: Antenna) -> np.ndarray:
    """MuJoCo's ``body_invweight0`` of an antenna (segment,) [1/g]; in space it moves across in two
    directions.
    """
    if not antenna.spatial:
        return _compute_invweight(antenna.segment_length, antenna.segment_mass)
    frustum = antenna.mass_centre / antenna.segment_length, antenna.inertia
    loose = antenna.follicle is not None
    found = _compute_invweight(antenna.segment_length, antenna.segment_mass, *frustum, loose)
    return 2 * found + (1 / (3 * antenna.segment_mass.sum()) if loose else 0.0)


def _compute_invweight(
    length: np.ndarray,
    mass: np.ndarray,
    centre: np.ndarray | None = None,
    inertia: np.ndarray | None = None,
    loose: bool = False,
) -> np.ndarray:
    """MuJoCo's ``body_invweight0`` for translation (segment,) [1/g]: a third of the trace of J M⁻¹
    Jᵀ at each segment's centre, straight chain, where only motion across the chain is possible.
    ``centre`` is that of mass, over the length, and ``inertia`` that about it; default: rods. The
    base of a ``loose`` chain slides across.

    One articulated sweep towards the base and one outwards, O(n): Ω_i = X Ω_(i−1) Xᵀ + S D⁻¹ Sᵀ.
    """
    n, share = len(length), ([0.5] * len(length) if centre is None else centre.tolist())
    turning = None if inertia is None else inertia + mass * (np.array(share) * length) ** 2
    length, mass = length.tolist(), mass.tolist()  # Python's own floats: faster one by one
    own = [m * a**2 / 3 for m, a in zip(mass, length, strict=True)]  # about the hinge
    own = own if turning is None else turning.tolist()
    lever, across, inverse = [0.0] * n, [0.0] * n, [0.0] * n
    carried = 0.0  # articulated mass across the chain that the distal part shows at its hinge
    for i in range(n - 1, -1, -1):
        whole = own[i] + carried * length[i] ** 2
        coupling = mass[i] * length[i] * share[i] + carried * length[i]
        carried = mass[i] + carried - coupling**2 / whole
        lever[i], inverse[i] = coupling / whole, 1 / whole
    # inverse inertia across the chain at this hinge, and its couplings with the turn of the segment
    hinge = 1 / carried if loose else 0.0
    for i in range(n):
        turn, mixed = inverse[i] + lever[i] ** 2 * hinge, -lever[i] * hinge
        across[i] = hinge + 2 * share[i] * length[i] * mixed
        across[i] += length[i] ** 2 * share[i] ** 2 * turn
        hinge = hinge + 2 * length[i] * mixed + length[i] ** 2 * turn
    return np.array(across) / 3


CONTACTS: Registry[Contact] = Registry("contact")
"""Contacts by name: ``smooth`` (the default, which follows from the antenna), ``even`` (that of
version 0.2: within 0.05 mm whatever touches) and ``hard`` (that of version 0.1).
"""
CONTACTS.register(
    "smooth",
    Contact(
        solimp=(1e-3, 0.95, 1e-6, 0.2, 2.0),
        share=0.005,
        turn=0.005,
        crossing=0.15,
        lingering=0.5,
    ),
)
CONTACTS.register("even", Contact(solimp=(1e-3, 0.95, 0.05, 0.5, 2.0)))
CONTACTS.register("hard", Contact())
DEFAULT_CONTACT = "smooth"


def _choose_time_constant(antenna: Antenna) -> float:
    """The time constant of the default contact on an antenna [ms].

    It is 0.2 ms over the least whole number that makes it at most 1 ms/mm times the radius at 0.9
    of the length, so that an object at up to 0.6 m/s sinks in by less than half that radius; and
    at least 0.005 ms.
    """
    middle = antenna.hinge_position + antenna.segment_length / 2
    radius = float(np.interp(_PLACE * antenna.length, middle, antenna.radius))
    asked = max(_PACE * radius, _SHORTEST)
    return float(_LONGEST / max(1.0, np.ceil(_LONGEST / asked - 1e-9)))


DOUBT = "a contact, or the timestep, is outside what its model is valid for."
"""The text of what is warned of, before one of the sentences below."""


def list_validity_warnings(
    antenna: Antenna, contact: Contact, speed: float, timestep: float, *, fixed: bool = False
) -> list[str]:
    """What cannot be believed of a touch at this speed [mm/ms] with this timestep [ms], in
    sentences; ``fixed``: the timestep was asked for.
    """
    found, moved, thick = [], speed * timestep, float(antenna.radius.max()) / 2
    soft = contact.soften(antenna)
    width = float(soft.widen(*contact.widen(speed)).max())
    if contact.solimp[2] > 2 * thick:
        found.append(
            f"The contact is {contact.solimp[2]:.3g} mm wide, more than the antenna's radius of"
            f" {2 * thick:.3g} mm; use a width of at most {thick:.3g} mm."
        )
    if moved > thick:
        made = _choose_time_constant(antenna) * min(1.0, _FASTEST / speed)
        time = min(made, 4 * thick / speed, contact.solref[0])
        found.append(
            f"At {speed:.3g} mm/ms an object moves {moved:.3g} mm in a timestep of {timestep:.3g}"
            " ms, more than half the antenna's radius;"
            f" use {_advise(contact, time, fixed)}, or a slower object."
        )
    elif contact.solimp[0] < _EVEN and moved > width:
        found.append(
            f"At {speed:.3g} mm/ms an object moves {moved:.3g} mm in a timestep of {timestep:.3g}"
            f" ms, across the whole contact of {width:.3g} mm; use at most"
            f" {_round_down(width / speed):g} ms, or a width of {moved:.3g} mm."
        )
    return found


def describe_sink(sink: float, contact: Contact, *, fixed: bool = False) -> str:
    """The sentence about a contact that sank too deep, over the smaller radius; ``fixed``:
    the timestep was asked for.

    The depth of an impact falls as the time constant to the power 0.4 or faster; beyond some 2.5
    radii the antenna was passed through, and how deep says nothing more.
    """
    said = (
        f"A contact sank in by {sink:.3g} of the smaller radius, more than {DEEP:g}: what it gives"
        " is not that of solid bodies."
    )
    shorter = min((sink / 0.42) ** 2.5, 100.0)
    time = contact.solref[0] / shorter
    units = "density and modulus (g/mm3, MPa) and speeds (mm/ms)"
    advice = (
        f"Use {_advise(contact, time, fixed)}, which takes some {np.ceil(shorter):.0f} times as"
        f" long to compute. Check {units}."
        if time >= _LEAST
        else f"Check {units}."
    )
    return f"{said} {advice}"


def _advise(contact: Contact, time: float, fixed: bool) -> str:
    """The contact with a shorter time constant [ms], as one asks for it."""
    digits = int(np.floor(np.log10(time)))
    time = float(f"{np.floor(time / 10.0 ** (digits - 1)):.0f}e{digits - 1}")
    first, own = contact.solref[0], contact.solimp[0] >= _EVEN or contact.share
    names = [
        name
        for name, known in CONTACTS.items()
        if replace(known, solref=(first, known.solref[1])) == contact
    ]
    # where the width is fixed, a shorter time alone does not make the surface much harder
    names = names if own else [DEFAULT_CONTACT]
    asked = f"contact='{names[0]}:{time:g}'" if names else f"a Contact of solref {time:g}"
    words = f"{asked} (its time constant in ms, in place of {first:.3g})"
    return words + (" and leave timestep= out" if fixed else "")


def _round_down(timestep: float) -> float:
    """The greatest of 1, 2 and 5 times a power of ten that is not above a timestep [ms]: a whole
    number of them makes a millisecond.
    """
    power = 10.0 ** np.floor(np.log10(timestep * (1 + 1e-9)))
    return float(
        f"{max(k for k in (1, 2, 5) if k * power <= timestep * (1 + 1e-9)) * power:.0e}"
    )


def find_radius(item: Object) -> float:
    """The radius [mm] of a ball or a rounded edge, else infinite: what it can sink into."""
    rounded = item.feature.rounding > 0 and min(map(len, item.feature.parts)) <= 2
    return item.feature.rounding if rounded and not item.feature.unbounded else np.inf


def get_contact(
    contact: Contact | str | None = None, antenna: Antenna | None = None
) -> Contact:
    """The contact itself, the one of that name, or the default.

    A name may end in a time constant [ms], as in ``smooth:0.05``. Without it the default contact
    has the time constant that :func:`_choose_time_constant` gives for the ``antenna``.

    Raises
    ------
    InvalidInput
        No such name, or no such time.
    """
    if isinstance(contact, Contact):
        return contact
    name, colon, said = (DEFAULT_CONTACT if contact is None else contact).partition(":")
    found = CONTACTS[name]
    if colon:
        time = _read_time(name, said)
    elif antenna is not None and name == DEFAULT_CONTACT:
        time = _choose_time_constant(antenna)
    else:
        return found
    return found if time == found.solref[0] else replace(found, solref=(time, found.solref[1]))


def _read_time(name: str, said: str) -> float:
    """The time constant [ms] behind the name of a contact."""
    try:
        time = float(said)
    except ValueError:
        time = np.nan
    if not 0 < time < np.inf:
        raise InvalidInput(
            f"a contact's time constant must be a number > 0 [ms], as in contact='{name}:0.05', got"
            f" {said!r}."
        )
    return time
