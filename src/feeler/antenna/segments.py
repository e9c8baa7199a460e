"""An antenna: rigid segments joined by damped hinge springs, in one plane or in space; and how it
oscillates.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np

from feeler.antenna.profiles import Along, compute_beam, sample_quantity
from feeler.errors import InvalidInput
from feeler.records import Ge, Gt, Record, Unit, freeze, make_picture
from feeler.validation import Count, checked, show

# Antennas in space: every hinge bends in two planes and may twist; and segments that taper.
#
# A segment points along the second axis (y) of a frame of its own. In the frame of the segment
# before it, its hinge first bends y towards x, then y towards z, and then twists about y by the
# third angle (from z towards x). With the last two at rest it is the planar antenna. As of any
# universal joint, the order of the two bends matters where both are large.

SPACE_PLANES = ("x", "z", "twist")
"""What a hinge in space does, in this order: it bends towards x, towards z, and twists."""


def to_matrix(rotation: Any) -> np.ndarray:
    """Rotation matrices (…, 3, 3) of rotation vectors (…, 3) [rad]."""
    from scipy.spatial.transform import Rotation

    vectors = np.asarray(rotation, dtype=float)
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*vectors.shape, 3)


def to_vector(matrix: np.ndarray) -> np.ndarray:
    """Rotation vectors (…, 3) [rad] of rotation matrices (…, 3, 3); NaN of what is none."""
    from scipy.spatial.transform import Rotation

    if not np.isfinite(matrix).all():
        return np.full(matrix.shape[:-1], np.nan)
    return Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_rotvec().reshape(matrix.shape[:-1])


def find_rate(vector: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Angular velocity (3,) [rad/ms] of a rotation vector that changes at a rate: J(φ) φ̇."""
    size = float(np.linalg.norm(vector))
    if size < 1e-6:
        return change + 0.5 * np.cross(vector, change)
    once = np.cross(vector, change)
    a, b = (1 - np.cos(size)) / size**2, (size - np.sin(size)) / size**3
    return change + a * once + b * np.cross(vector, once)


def find_frames(angle: np.ndarray, base: Any = 0.0) -> np.ndarray:
    """Frames (…, segment, axis of the frame, 3) of the segments for hinge angles (…, plane,
    segment) [rad].

    ``base`` is the rotation vector (…, 3) of the base [rad], or 0.
    """
    shape, n = angle.shape[:-2], angle.shape[-1]
    turned = np.eye(3) if np.ndim(base) == 0 else np.swapaxes(to_matrix(base), -1, -2)
    x, y, z = (np.broadcast_to(turned, (*shape, 3, 3))[..., k, :] for k in range(3))
    cosines, sines = np.cos(angle)[..., None], np.sin(angle)[..., None]
    frames = np.empty((*shape, n, 3, 3))
    for i in range(n):
        c, s = cosines[..., i, :], sines[..., i, :]
        x, y = c[..., 0, :] * x - s[..., 0, :] * y, c[..., 0, :] * y + s[..., 0, :] * x
        y, z = c[..., 1, :] * y + s[..., 1, :] * z, c[..., 1, :] * z - s[..., 1, :] * y
        if angle.shape[-2] == len(SPACE_PLANES):
            x, z = c[..., 2, :] * x - s[..., 2, :] * z, c[..., 2, :] * z + s[..., 2, :] * x
        frames[..., i, 0, :], frames[..., i, 1, :], frames[..., i, 2, :] = x, y, z
    return frames


def _find_points(length: np.ndarray, angle: np.ndarray, base: Any = 0.0) -> np.ndarray:
    """Base, hinges and tip (…, segment + 1, 3) [mm], as :func:`find_frames`."""
    steps = length[:, None] * find_frames(angle, base)[..., 1, :]
    points = np.zeros((*steps.shape[:-2], length.size + 1, 3))
    np.cumsum(steps, axis=-2, out=points[..., 1:, :])
    return points


def _check_planes(fields: dict[str, np.ndarray]) -> int:
    """How many of SPACE_PLANES the hinges' quantities (plane, segment) have; 1 without any.

    Raises
    ------
    InvalidInput
        A quantity of more or fewer planes than the stiffness, or no rows for two or three planes.
    """
    stiffness = fields["stiffness"]
    planes = len(stiffness) if stiffness.ndim == 2 else 1
    if stiffness.ndim == 2 and planes not in (2, 3):
        raise InvalidInput(
            "stiffness (plane, segment) has 2 rows for bending towards x and z, and a third for"
            f" torsion, got {planes}. Leave the planes out for an antenna in one."
        )
    for name, values in fields.items():
        if values.ndim == 2 and len(values) != planes:
            twist = " Torsion needs its stiffness." if len(values) > max(planes, 2) else ""
            raise InvalidInput(
                f"{name} has {len(values)} planes, but stiffness {planes}; give both one row each"
                f" for {', '.join(SPACE_PLANES[: max(planes, 2)])}.{twist}"
            )
    rest = fields["rest_angle"]
    if planes > 1 and rest.ndim < 2 and np.any(rest):
        raise InvalidInput(
            "rest_angle of an antenna in space needs a row for each plane, as in"
            f" np.stack([towards_x, {', '.join(['np.zeros(n)'] * (planes - 1))}])."
        )
    rows = zip(SPACE_PLANES, np.atleast_2d(stiffness), strict=False)
    slack = [name for name, row in rows if not row.any()]
    if planes > 1 and slack:
        raise InvalidInput(
            f"stiffness is 0 in every hinge of the plane {slack[0]!r}: nothing holds the antenna"
            " there. Give at least one hinge > 0, or leave the row out."
        )
    return planes


def require_plane(antenna: Any, who: str) -> None:
    """Refuse an antenna in space, by the name of who works in the plane only."""
    if antenna.spatial:
        raise InvalidInput(
            f"{who} works in the plane, and {antenna.name!r} is an antenna in space. Use its planar"
            " twin, antenna.flatten()."
        )


def _list_frustum(taper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of frusta whose distal radius is ``taper`` times the proximal one: where the centre of mass
    lies, over the length from the hinge, and the inertia across it over mass · length² (thin).
    """
    t, whole = taper, 1 + taper + taper**2
    centre = (1 + 2 * t + 3 * t**2) / (4 * whole)
    return centre, (1 + 3 * t + 6 * t**2) / (10 * whole) - centre**2


# A follicle: the base of an antenna in space may slide against springs and dampers.

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


# An antenna: rigid segments joined by damped hinge springs, in one plane or in space.

MAX_SEGMENTS = 1000
HINGE = ("stiffness", "damping", "rest_angle")
"""What a hinge has, in space once for each plane."""
_QUANTITIES = ("segment_mass", "radius", *HINGE)
_N_SENSORS = 56  # [P] recorded points along the flagellum


@checked
def make_even_sensors(n_segments: Count, n_sensors: Count = _N_SENSORS) -> np.ndarray:
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
    one number for all. :mod:`feeler.antenna.segments` says how these angles turn a segment.

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
        planes = _check_planes({name: getattr(self, name) for name in HINGE})
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
        length: float | Sequence[float] | np.ndarray,
        modulus: Along,
        density: Along,
        radius: Along | None = None,
        width: Along | None = None,
        thickness: Along | None = None,
        n_segments: int | None = None,
        damping_time: Along = 0.0,
        planes: Literal[1, 2, 3] = 1,
        shear_modulus: Along | None = None,
        **fields: Any,
    ) -> "Antenna":
        """An antenna by its making: m = ρ·A·ℓ, and k = E·I/ℓ in each hinge, with ℓ the halves of
        the segments beside it (of one segment in hinge 1).

        ``length`` [mm] is that of the whole in ``n_segments`` (60) even segments, or a row of all
        segments' lengths. ``radius``, ``width``, ``thickness`` [mm], ``modulus`` [MPa], ``density``
        [g/mm³] and ``damping_time`` [ms] are numbers, or functions or formulas of the place x, 0 at
        the base and 1 at the tip: ``lambda x: 0.2 - 0.15 * x`` or ``"0.2 - 0.15 * x"``, or a row of
        their values in the segments' middles, linear between them. The section is a
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

        Warns
        -----
        ModelValidityWarning
            Density, modulus, length or radius are those of another unit rather than of an antenna.
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
    @checked
    def from_profile(
        cls, n_segments: Count, *, length: float | None = None, **fields: Any
    ) -> "Antenna":
        """An antenna by its profiles: each quantity a number, an array, a profile, or a formula.

        ``stiffness="37.78 * exp(-0.0827 * (n - 1))"`` is ``Exponential(base=37.78, rate=-0.0827)``;
        what a formula may use is in :mod:`feeler.antenna.profiles`. Without ``segment_length`` all
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

    @cached_property
    def spatial(self) -> bool:
        """Whether it bends in space."""
        return self.stiffness.ndim == 2

    @property
    def mass_centre(self) -> np.ndarray:
        """How far from its hinge each segment's centre of mass lies (segment,) [mm]."""
        if not self.spatial:
            return self.segment_length / 2
        return self.segment_length * _list_frustum(self.taper)[0]

    @property
    def inertia(self) -> np.ndarray:
        """Inertia of each segment across its centre of mass, as a thin one (segment,) [g·mm²]."""
        if not self.spatial:
            return self.segment_mass * self.segment_length**2 / 12
        return self.segment_mass * self.segment_length**2 * _list_frustum(self.taper)[1]

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

    @cached_property
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
            return _find_points(self.segment_length, self._check_angle(angle), base_angle)
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


_FASTEST = 2 * np.pi * 1e9  # [C] rad/ms; no part of an antenna swings so fast


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Modes, slowest first: ``frequency`` (mode,) [kHz], ``damping_ratio`` (mode,) [1], ``angle``
    (mode, segment).
    """

    frequency: np.ndarray
    damping_ratio: np.ndarray
    angle: np.ndarray


def compute_mass_matrix(antenna: Antenna) -> np.ndarray:
    """Joint-space inertia (segment, segment) [g·mm²] of the straight antenna in one plane, thin.

    ``M_ij = Σ_{n ≥ max(i, j)} m_n (c_n − s_i)(c_n − s_j) + I_n`` with c_n the segment's centre, s_i
    the hinge's place and I_n = m_n ℓ_n² / 12.
    """
    s, m = antenna.hinge_position, antenna.segment_mass
    centre = s + antenna.mass_centre
    arm = np.maximum(centre[:, None] - s[None, :], 0.0)
    arm[np.triu_indices(arm.shape[0], 1)] = 0.0
    inertia = np.cumsum(antenna.inertia[::-1])[::-1]
    index = np.arange(antenna.n_segments)
    return (arm.T * m) @ arm + inertia[np.maximum.outer(index, index)]


@checked
def compute_modes(antenna: Antenna, n_modes: Count) -> Modes:
    """Undamped modes of the straight antenna and the damping ratio of each taken by itself.

    Solves ``K v = ω² M v`` with K the hinge stiffnesses; ``ζ = vᵀ C v / (2 ω vᵀ M v)``, exact for
    damping proportional to stiffness and the first-order value otherwise. Of an antenna in space
    these are the modes of bending of both planes, and ``angle`` is (mode, plane, segment).
    """
    n_modes, mass = min(n_modes, antenna.n_segments), compute_mass_matrix(antenna)
    planes = zip(
        *(np.atleast_2d(rows)[:2] for rows in (antenna.stiffness, antenna.damping)), strict=True
    )
    found = [_solve(mass, stiffness, damping, n_modes) for stiffness, damping in planes]
    if not antenna.spatial:
        return found[0]
    angle = np.zeros((2 * n_modes, len(antenna.planes), antenna.n_segments))
    for k, modes in enumerate(found):
        angle[k * n_modes : (k + 1) * n_modes, k] = modes.angle
    frequency, ratio = (
        np.concatenate([getattr(modes, name) for modes in found])
        for name in ("frequency", "damping_ratio")
    )
    order = np.argsort(frequency, kind="stable")[:n_modes]
    return Modes(frequency=frequency[order], damping_ratio=ratio[order], angle=angle[order])


def _solve(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, n_modes: int) -> Modes:
    """The modes in one plane."""
    import scipy  # slow to load

    soft = 1 / np.sqrt(stiffness)
    # As ``K^-½ M K^-½ y = y / ω²`` the slow modes have the largest eigenvalues, which come out to
    # the last digits; as
    # ``K v = ω² M v`` they were off by 5e-6, and differently with another number of threads.
    first = len(mass) - n_modes
    shares, vectors = scipy.linalg.eigh(
        soft[:, None] * mass * soft, subset_by_index=(first, first + n_modes - 1)
    )
    omega = 1 / np.sqrt(shares[::-1])
    vectors = soft[:, None] * vectors[:, ::-1] * omega
    modal_damping = np.einsum("im,i,im->m", vectors, damping, vectors)
    return Modes(
        frequency=omega / (2 * np.pi),
        damping_ratio=modal_damping / (2 * omega),
        angle=vectors.T,
    )


@checked
def compute_base_response(antenna: Antenna, frequency: np.ndarray) -> np.ndarray:
    """How far base, hinges and tip swing when the base is shaken sideways by one: complex
    (frequency, segment + 1).

    Small motions of the straight antenna at steady state, ``(K + iωC − ω²M) θ = ω² b`` with ``b_j =
    Σ_n m_n (c_n − s_j)₊``; the argument is the phase against the base. ``frequency`` in kHz, 0 or
    more.
    """
    require_plane(antenna, "compute_base_response")
    omega = 2 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float))
    if omega.ndim != 1 or not omega.size or not np.all(np.abs(omega) < _FASTEST):
        raise InvalidInput(
            f"frequency must be one or more numbers below {_FASTEST / (2 * np.pi):g} kHz, got"
            f" {show(frequency)}."
        )
    s, mass = antenna.hinge_position, compute_mass_matrix(antenna)
    pull = antenna.segment_mass @ np.maximum((s + antenna.segment_length / 2)[:, None] - s, 0.0)
    spring, arm = (
        np.diag(antenna.stiffness),
        np.maximum(np.append(s, antenna.length)[:, None] - s, 0.0),
    )
    damping = np.diag(antenna.damping)
    angles = [
        np.linalg.solve(spring + 1j * w * damping - w**2 * mass, w**2 * pull) for w in omega
    ]
    return 1 + np.array(angles) @ arm.T
