"""Antennas in space: every hinge bends in two planes and may twist; and segments that taper.

A segment points along the second axis (y) of a frame of its own. In the frame of the segment before
it, its hinge first bends y towards x, then y towards z, and then twists about y by the third angle
(from z towards x). With the last two at rest it is the planar antenna. As of any universal joint,
the order of the two bends matters where both are large.
"""

from typing import Any

import numpy as np

from feeler.errors import InvalidInput

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


def find_points(length: np.ndarray, angle: np.ndarray, base: Any = 0.0) -> np.ndarray:
    """Base, hinges and tip (…, segment + 1, 3) [mm], as :func:`find_frames`."""
    steps = length[:, None] * find_frames(angle, base)[..., 1, :]
    points = np.zeros((*steps.shape[:-2], length.size + 1, 3))
    np.cumsum(steps, axis=-2, out=points[..., 1:, :])
    return points


def check_planes(fields: dict[str, np.ndarray]) -> int:
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


def list_frustum(taper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of frusta whose distal radius is ``taper`` times the proximal one: where the centre of mass
    lies, over the length from the hinge, and the inertia across it over mass · length² (thin).
    """
    t, whole = taper, 1 + taper + taper**2
    centre = (1 + 2 * t + 3 * t**2) / (4 * whole)
    return centre, (1 + 3 * t + 6 * t**2) / (10 * whole) - centre**2
