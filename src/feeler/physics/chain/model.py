"""A scene as plain arrays: what the compiled sweeps read."""

from dataclasses import dataclass

import numpy as np

from feeler.physics.chain.fields import (
    C_DAMPING,
    C_INERTIA,
    C_INVWEIGHT,
    C_LENGTH,
    C_MASS,
    C_RADIUS,
    C_REACH,
    C_REST,
    C_STIFFNESS,
    KIND_BALL,
    KIND_BOX,
    KIND_NONE,
    KIND_POLYGON,
    N_CONSTANTS,
    N_OBJECT,
    O_B,
    O_BASE,
    O_FORWARD_X,
    O_FORWARD_Y,
    O_FRICTION,
    O_HALF_X,
    O_HALF_Y,
    O_HIGH_X,
    O_HIGH_Y,
    O_K,
    O_LOW_X,
    O_LOW_Y,
    O_MAX_IMPEDANCE,
    O_MIDDLE_X,
    O_MIDDLE_Y,
    O_MIDPOINT,
    O_MIN_IMPEDANCE,
    O_POWER,
    O_RADIUS,
    O_WIDTH,
)
from feeler.physics.scene import Scene

MIN_FRICTION = 1e-5  # MuJoCo's smallest friction
WALL = 1e3  # mm; half extent of the box that stands for a wall, as in the MuJoCo model
MIN_VALUE = 1e-15  # MuJoCo's mjMINVAL


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainModel:
    """A scene for one timestep: ``constants`` (segment, field), ``object`` (field,), and convex parts' corners."""

    constants: np.ndarray
    object: np.ndarray
    kind: int
    corners: np.ndarray
    part: np.ndarray
    """First corner of each convex part, and the number of corners at the end."""
    leg_velocity: np.ndarray
    leg_step: np.ndarray
    """Step at which each leg of the path ends, the last for ever."""
    origin: np.ndarray
    timestep: float


def make_model(scene: Scene, timestep: float) -> ChainModel:
    """The scene's arrays at one timestep.

    Raises
    ------
    InvalidInput
        The timestep is larger than half the contact time constant, where MuJoCo would silently change the contact.
    """
    scene.contact.check_timestep(timestep)
    kind, corners, part = _make_shape(scene)
    ends = [round(end / timestep) for end in scene.path.end]
    return ChainModel(
        constants=_make_constants(scene),
        object=_make_object(scene, corners),
        kind=kind,
        corners=corners,
        part=part,
        leg_velocity=np.array(scene.path.velocity, dtype=float),
        leg_step=np.array([*ends, np.iinfo(np.int64).max], dtype=np.int64),
        origin=np.array(scene.origin, dtype=float),
        timestep=float(timestep),
    )


def _make_constants(scene: Scene) -> np.ndarray:
    antenna = scene.antenna
    table = np.zeros((antenna.n_segments, N_CONSTANTS))
    table[:, C_LENGTH], table[:, C_MASS], table[:, C_RADIUS] = (
        antenna.segment_length,
        antenna.segment_mass,
        antenna.radius,
    )
    table[:, C_STIFFNESS], table[:, C_DAMPING], table[:, C_REST] = (
        antenna.stiffness,
        antenna.damping,
        antenna.rest_angle,
    )
    table[:, C_INERTIA] = antenna.segment_mass * antenna.segment_length**2 / 3
    table[:, C_REACH] = antenna.segment_length + antenna.radius
    table[:, C_INVWEIGHT] = compute_invweight(antenna.segment_length, antenna.segment_mass)
    return table


def compute_invweight(length: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """MuJoCo's ``body_invweight0`` for translation (segment,) [1/g]: a third of the trace of J M⁻¹ Jᵀ at each segment's
    centre, straight chain, where only motion across the chain is possible.

    One articulated sweep towards the base and one outwards, O(n): Ω_i = X Ω_(i−1) Xᵀ + S D⁻¹ Sᵀ.
    """
    n, length, mass = len(length), length.tolist(), mass.tolist()  # Python's own floats: faster one by one
    lever, across, inverse = [0.0] * n, [0.0] * n, [0.0] * n
    carried = 0.0  # articulated mass across the chain that the distal part shows at its hinge
    for i in range(n - 1, -1, -1):
        inertia = mass[i] * length[i] ** 2 / 3 + carried * length[i] ** 2
        coupling = mass[i] * length[i] / 2 + carried * length[i]
        carried = mass[i] + carried - coupling**2 / inertia
        lever[i], inverse[i] = coupling / inertia, 1 / inertia
    hinge = 0.0  # inverse inertia across the chain at this hinge, and its couplings with the turn of the segment
    for i in range(n):
        turn, mixed = inverse[i] + lever[i] ** 2 * hinge, -lever[i] * hinge
        across[i] = hinge + length[i] * mixed + length[i] ** 2 / 4 * turn
        hinge = hinge + 2 * length[i] * mixed + length[i] ** 2 * turn
    return np.array(across) / 3


def _make_object(scene: Scene, corners: np.ndarray) -> np.ndarray:
    table = np.zeros(N_OBJECT)
    time_constant, damping_ratio = scene.contact.solref
    low, high, width, midpoint, power = scene.contact.solimp
    table[O_K] = 1 / max(MIN_VALUE, (high * time_constant * damping_ratio) ** 2)
    table[O_B] = 2 / max(MIN_VALUE, high * time_constant)
    table[O_MIN_IMPEDANCE], table[O_MAX_IMPEDANCE], table[O_WIDTH] = low, high, width
    table[O_MIDPOINT], table[O_POWER] = midpoint, power
    table[O_FRICTION] = max(scene.friction, MIN_FRICTION)
    table[O_FORWARD_X], table[O_FORWARD_Y] = scene.forward
    table[O_BASE] = scene.base_angle
    table[[O_HALF_X, O_HALF_Y]] = -np.inf  # nothing is near no object
    if scene.feature is not None:
        grow = table[O_RADIUS] = scene.feature.rounding
        table[O_LOW_X], table[O_LOW_Y] = corners.min(axis=0) - grow
        table[O_HIGH_X], table[O_HIGH_Y] = corners.max(axis=0) + grow
        table[[O_MIDDLE_X, O_MIDDLE_Y]] = corners.min(axis=0) / 2 + corners.max(axis=0) / 2
        table[[O_HALF_X, O_HALF_Y]] = np.ptp(corners, axis=0) / 2 + grow
    return table


def _make_shape(scene: Scene) -> tuple[int, np.ndarray, np.ndarray]:
    """Kind, corners (corner, 2) in the feature's frame, part by part, and where each part begins."""
    feature = scene.feature
    if feature is None:
        return KIND_NONE, np.zeros((1, 2)), np.array([0, 0])
    if feature.kind == "wall":
        face = np.array([[0.0, -WALL], [0.0, WALL], [-2 * WALL, WALL], [-2 * WALL, -WALL]])
        return KIND_BOX, face, np.array([0, 4])
    if feature.kind in ("ball", "box"):
        corners = np.array(feature.parts[0])
        return (KIND_BALL if feature.kind == "ball" else KIND_BOX), corners, np.array([0, len(corners)])
    return KIND_POLYGON, np.concatenate(feature.parts), np.cumsum([0, *map(len, feature.parts)])
