"""An antenna: rigid segments joined by damped hinge springs, in one plane or in space."""

from typing import Annotated, Any, Literal

import numpy as np

from feeler.antenna.beam import Along, compute_beam
from feeler.antenna.follicle import Follicle
from feeler.antenna.profile import sample_quantity
from feeler.antenna.space import SPACE_PLANES, check_planes, find_points, list_frustum
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Ge, Gt, Record, Unit, freeze
from feeler.records.shown import make_picture

MAX_SEGMENTS = 1000
HINGE = ("stiffness", "damping", "rest_angle")
"""What a hinge has, in space once for each plane."""
_QUANTITIES = ("segment_mass", "radius", *HINGE)
_N_SENSORS = 56  # [P] recorded points along the flagellum


@checked
def make_even_sensors(
    n_segments: Annotated[int, "> 0"], n_sensors: Annotated[int, "> 0"] = _N_SENSORS
) -> np.ndarray:
    """Hinge numbers (sensor,) spread evenly from hinge 1 to the last; all hinges where there are
    fewer [C].
    """
    if n_sensors >= n_segments:
        return np.arange(1, n_segments + 1)
    return np.unique(np.round(np.linspace(1, n_segments, n_sensors)).astype(int))


class Antenna(Record):
    """An antenna as data, base to tip; segment n hangs on hinge n, hinge 1 sits at the clamped
    base.

    Each array holds one value per segment; a single number stands for the same value in every
    segment. An antenna in space has a row of ``stiffness`` for each of two planes it bends in (x,
    z), and perhaps a third for torsion; ``damping`` and ``rest_angle`` then have as many rows, or
    one number for all. :mod:`feeler.antenna.space` says how these angles turn a segment.

    Attributes
    ----------
    segment_length : np.ndarray
        Length of each segment [mm], > 0.
    segment_mass : np.ndarray
        Mass of each segment [g], > 0, spread evenly over its length (a thin rod).
    radius : np.ndarray
        Collision radius of each segment [mm], > 0; it enters contact, not inertia.
    stiffness : np.ndarray
        Stiffness of each segment's proximal hinge [N·mm/rad], ≥ 0, not all zero.
    damping : np.ndarray
        Damping of each hinge [N·mm·ms/rad], ≥ 0.
    rest_angle : np.ndarray
        Angle of each hinge at which its spring is slack [rad], positive towards +x.
    taper : np.ndarray
        Radius at each segment's distal end over that at its proximal end, as far as its mass and
        inertia go: 1 is a cylinder, 0 ends in a point. Only in space.
    follicle : Follicle | None
        Springs and dampers against which the base slides; default: it is clamped. Only in space.
    sensors : np.ndarray
        Numbers (1 = base) of the hinges that carry a sensor, rising; default 56 spread evenly.
    name : str
        Name that labels its tensors.

    Raises
    ------
    InvalidInput
        An array of the wrong length, not finite, or outside its range, sensors that name no hinge,
        or planes that do not match, such as torsion without its stiffness.
    """

    segment_length: Annotated[np.ndarray, "segment?", Gt(0), Unit("mm")]
    segment_mass: Annotated[np.ndarray, "segment?", Gt(0), Unit("g")]
    radius: Annotated[np.ndarray, "segment?", Gt(0), Unit("mm")]
    stiffness: Annotated[np.ndarray, "plane? segment?", Ge(0), Unit("N·mm/rad")]
    damping: Annotated[np.ndarray, "plane? segment?", Ge(0), Unit("N·mm·ms/rad")]
    rest_angle: Annotated[np.ndarray, "plane? segment?", Unit("rad")] = 0.0  # type: ignore[assignment]  # one number stands for as many as segments
    taper: Annotated[np.ndarray, "segment?", Ge(0)] = 1.0  # type: ignore[assignment]
    follicle: Follicle | None = None
    sensors: Annotated[np.ndarray, "sensor?"] = None  # type: ignore[assignment]  # chosen when the segments are known
    name: str = "custom"

    def _check(self) -> None:
        n = self.segment_length.size
        if not 1 <= n <= MAX_SEGMENTS:
            raise InvalidInput(
                f"an antenna has 1 to {MAX_SEGMENTS} segments, got segment_length with {n} values."
            )
        planes = check_planes({name: getattr(self, name) for name in HINGE})
        for name in ("segment_length", *_QUANTITIES, "taper"):
            values = getattr(self, name)
            if values.ndim and values.shape[-1] != n:
                raise InvalidInput(
                    f"{name} must be one number or {n} numbers (one per segment), got an array of"
                    f" shape {values.shape}."
                )
            rows = (planes,) if planes > 1 and name in HINGE else ()
            vars(self)[name] = freeze(np.broadcast_to(values, (*rows, n)))
        for name in ("taper", "follicle") if planes == 1 else ():
            if np.any(self.taper != 1) if name == "taper" else self.follicle is not None:
                raise InvalidInput(
                    f"{name} is for antennas in space: give stiffness a row for each plane, or"
                    f" leave {name} out."
                )
        if not np.any(self.stiffness > 0):
            raise InvalidInput(
                "stiffness is 0 in every hinge: nothing holds the antenna. Give at least one hinge"
                " > 0."
            )
        if np.any(np.abs(self.rest_angle) > np.pi):
            raise InvalidInput(
                f"rest_angle must lie within ±π rad, got up to {np.abs(self.rest_angle).max():.3g}."
            )
        vars(self)["sensors"] = _check_sensors(self.sensors, n)

    @classmethod
    def from_beam(
        cls,
        *,
        length: float,
        modulus: Along,
        density: Along,
        radius: Along | None = None,
        width: Along | None = None,
        thickness: Along | None = None,
        n_segments: int = 60,
        damping_time: Along = 0.0,
        planes: Literal[1, 2, 3] = 1,
        shear_modulus: Along | None = None,
        **fields: Any,
    ) -> "Antenna":
        """An antenna by its making: k = E·I/ℓ in each hinge (twice that in hinge 1, which stands
        for half a segment), m = ρ·A·ℓ.

        ``radius``, ``width``, ``thickness`` [mm], ``modulus`` [MPa], ``density`` [g/mm³] and
        ``damping_time`` [ms] are numbers, or functions or formulas of the place x, 0 at the base
        and 1 at the tip: ``lambda x: 0.2 - 0.15 * x`` or ``"0.2 - 0.15 * x"``. The section is a
        full circle of ``radius``, or a strip that bends across its ``thickness``. Damping is
        ``damping_time`` times stiffness. Other ``fields`` (sensors, rest_angle, name) are the
        antenna's own.

        With ``planes=2`` it bends in space, a strip towards z across its ``width``, and its
        segments are frusta: m = ρ · (A₀ + 4 A₁ + A₂)/6 · ℓ of the areas at the segment's ends and
        middle, and ``taper`` of the radii at its ends. With ``planes=3`` it twists as well, by
        k = G·J/ℓ with ``shear_modulus`` G [MPa]; J = π r⁴/2, or that of a strip.

        Raises
        ------
        InvalidInput
            No section or two, or a quantity that is not > 0 all along.
        """
        beam = compute_beam(
            length,
            n_segments,
            radius,
            width,
            thickness,
            modulus,
            density,
            damping_time,
            planes,
            shear_modulus,
        )
        return cls(**{**beam, **fields})

    @classmethod
    def from_profile(
        cls, n_segments: int, *, length: float | None = None, **fields: Any
    ) -> "Antenna":
        """An antenna by its profiles: each quantity a number, an array, a profile, or a formula.

        ``stiffness="37.78 * exp(-0.0827 * (n - 1))"`` is ``Exponential(base=37.78, rate=-0.0827)``;
        what a formula may use is in :mod:`feeler.antenna.formula`. Without ``segment_length`` all
        segments share ``length`` [mm] evenly.

        Raises
        ------
        InvalidInput
            Both or none of ``length`` and ``segment_length``, or a formula that is not understood.
        """
        if (length is None) == ("segment_length" not in fields):
            raise InvalidInput("give either length [mm], for even segments, or segment_length.")
        lengths = sample_quantity(fields.pop("segment_length", f"{length!r} / N"), n_segments)
        quantities = {
            k: sample_quantity(v, n_segments, lengths)
            for k, v in fields.items()
            if k in _QUANTITIES
        }
        return cls(segment_length=lengths, **{**fields, **quantities})

    def __repr__(self) -> str:
        mass, sensors = 1e3 * self.segment_mass.sum(), self.sensors.size
        name = f"{self.name!r} in space" if self.spatial else repr(self.name)
        return (
            f"Antenna {name}: {self.n_segments} segments, {self.length:.4g} mm, {mass:.4g}"
            f" mg, {sensors} sensors,\n  stiffness {_span(self.stiffness)} N·mm/rad, damping"
            f" {_span(self.damping)} N·mm·ms/rad"
        )

    def _repr_html_(self) -> str:
        return make_picture(repr(self), [(self.shape()[:, :2], 2 * float(self.radius.mean()))])

    def to_plain(self) -> dict[str, Any]:
        """The fields as plain data, without a taper in one plane, and a follicle where is none."""
        absent = {"taper": not self.spatial, "follicle": self.follicle is None}
        return {k: v for k, v in super().to_plain().items() if not absent.get(k)}

    @property
    def planes(self) -> tuple[str, ...]:
        """What each hinge does: x in one plane; x, z and perhaps twist in space."""
        return SPACE_PLANES[: len(self.stiffness)] if self.spatial else SPACE_PLANES[:1]

    @property
    def spatial(self) -> bool:
        """Whether it bends in space."""
        return self.stiffness.ndim == 2

    @property
    def mass_centre(self) -> np.ndarray:
        """How far from its hinge each segment's centre of mass lies (segment,) [mm]."""
        if not self.spatial:
            return self.segment_length / 2
        return self.segment_length * list_frustum(self.taper)[0]

    @property
    def inertia(self) -> np.ndarray:
        """Inertia of each segment across its centre of mass, as a thin one (segment,) [g·mm²]."""
        if not self.spatial:
            return self.segment_mass * self.segment_length**2 / 12
        return self.segment_mass * self.segment_length**2 * list_frustum(self.taper)[1]

    @property
    def axial(self) -> np.ndarray:
        """Inertia of each segment about its own axis, as a full cylinder of its radius (segment,)
        [g·mm²]; never below what MuJoCo takes.
        """
        own = np.minimum(self.segment_mass * self.radius**2 / 2, self.inertia)
        return np.maximum(own, 2e-15)

    def flatten(self) -> "Antenna":
        """The planar antenna of its first plane, its segments cylinders and its base clamped;
        itself, if it lies in one.
        """
        first = {name: getattr(self, name)[0] for name in HINGE}
        return self.replace(**first, taper=1.0, follicle=None) if self.spatial else self

    def unflatten(self) -> "Antenna":
        """The antenna in space that bends alike in both planes and rests as this one does; itself,
        if it is in space.
        """
        if self.spatial:
            return self
        both = {name: np.stack([getattr(self, name)] * 2) for name in HINGE}
        both["rest_angle"][1] = 0.0
        return self.replace(**both)

    @property
    def n_segments(self) -> int:
        """Number of segments, which is the number of hinges."""
        return self.segment_length.size

    @property
    def length(self) -> float:
        """Length of the straight antenna [mm]."""
        return float(self.segment_length.sum())

    @property
    def hinge_position(self) -> np.ndarray:
        """Arc length (segment,) of each hinge from the base [mm]; the first is 0."""
        return np.concatenate(([0.0], np.cumsum(self.segment_length)[:-1]))

    def shape(self, angle: np.ndarray | None = None, base_angle: Any = 0.0) -> np.ndarray:
        """Points (…, n_segments + 1, 2) [mm] of base, hinges and tip for hinge angles (…, segment)
        [rad].

        Segment n points along (sin φ_n, cos φ_n) with φ_n the sum of the angles up to hinge n and
        ``base_angle``; ``angle=None`` is the posture at rest. In space points are (…, 3), angles
        (…, plane, segment), and ``base_angle`` is a rotation vector (…, 3).

        Raises
        ------
        InvalidInput
            Not one angle per segment.
        """
        if self.spatial:
            return find_points(self.segment_length, self._check_angle(angle), base_angle)
        heading = self._find_heading(angle, base_angle)
        steps = self.segment_length[:, None] * np.stack(
            [np.sin(heading), np.cos(heading)], axis=-1
        )
        points = np.zeros((*steps.shape[:-2], self.n_segments + 1, 2))
        np.cumsum(steps, axis=-2, out=points[..., 1:, :])
        return points

    def tip(self, angle: np.ndarray | None = None, base_angle: Any = 0.0) -> np.ndarray:
        """The last of the points of :meth:`shape`, (…, 2) [mm], in a third of the time."""
        if self.spatial:
            return self.shape(angle, base_angle)[..., -1, :]
        heading = self._find_heading(angle, base_angle)
        across = np.einsum("...n,n->...", np.sin(heading), self.segment_length)
        return np.stack(
            [across, np.einsum("...n,n->...", np.cos(heading), self.segment_length)], axis=-1
        )

    def _find_heading(self, angle: np.ndarray | None, base_angle: float) -> np.ndarray:
        return base_angle + np.cumsum(self._check_angle(angle), axis=-1)

    def _check_angle(self, angle: np.ndarray | None) -> np.ndarray:
        """The angles of all hinges, by default at rest."""
        angle = self.rest_angle if angle is None else np.asarray(angle, dtype=float)
        dims = self.rest_angle.ndim
        if angle.ndim < dims or angle.shape[-dims:] != self.rest_angle.shape:
            planes = f"plane {len(self.planes)}, " if self.spatial else ""
            raise InvalidInput(
                f"shape needs the angles of all {self.n_segments} hinges (…, {planes}segment), got"
                f" shape {angle.shape}. A Dataset holds the sensors' hinges only; simulate with"
                " all_hinges=True to draw it."
            )
        return angle


def _span(values: np.ndarray) -> str:
    """First and last value, base to tip; of each plane, where there are several."""
    if values.ndim == 2:
        rows = zip(SPACE_PLANES, values, strict=False)
        return "; ".join(f"{name}: {_span(row)}" for name, row in rows)
    return (
        f"{values[0]:.3g}"
        if np.all(values == values[0])
        else f"{values[0]:.3g} … {values[-1]:.3g}"
    )


def _check_sensors(sensors: np.ndarray | None, n: int) -> np.ndarray:
    if sensors is None:
        return freeze(make_even_sensors(n), int)
    numbers = np.atleast_1d(sensors)
    if numbers.size == 0 or np.any(numbers % 1):
        raise InvalidInput(
            f"sensors must be whole hinge numbers from 1 to {n}, got {sensors!r}."
        )
    if numbers.min() < 1 or numbers.max() > n or np.any(np.diff(numbers) <= 0):
        raise InvalidInput(
            f"sensors must rise from base to tip within 1…{n}, got {sensors.tolist()}."
        )
    return freeze(numbers, int)
