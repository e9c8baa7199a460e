"""An antenna and its walls as plain arrays: what the compiled sweeps of this room read."""

import numpy as np

from feeler.antenna.antenna import Antenna

# columns of the antenna's table, one row per segment
R_LENGTH, R_STIFFNESS, R_DAMPING, R_REST, R_RADIUS, R_MASS, R_FIRMNESS = range(7)
# columns of the walls' table: a straight face, its first point, the unit normal of its free side, its length, and
# whether the wall turns away from the body at its two ends (1) or towards it (0)
F_X, F_Y, F_NX, F_NY, F_LENGTH, F_START, F_END = range(7)

FIRMNESS = 1e3  # [C] 1/mm²; contact stiffness over that of the node's hinge per rad: nodes sink in by some 1e-3 mm
FAR = 1e4  # mm; half length of a face without end


def make_table(antenna: Antenna, firmness: float = FIRMNESS) -> np.ndarray:
    """The antenna as one array (segment, column); a node touches with the thicker of its two capsules."""
    columns = (
        antenna.segment_length,
        antenna.stiffness,
        antenna.damping,
        antenna.rest_angle,
        np.maximum(antenna.radius, np.append(antenna.radius[1:], 0.0)),
        antenna.segment_mass,
        firmness * np.maximum(antenna.stiffness, 1e-6 * antenna.stiffness.max()),
    )
    return np.ascontiguousarray(np.stack(columns, axis=1))


def make_half_plane(x: float, y: float, normal: tuple[float, float]) -> np.ndarray:
    """A single endless face (1, column) through (x, y)."""
    nx, ny = normal
    return np.array([[x - FAR * ny, y + FAR * nx, nx, ny, 2 * FAR, 0.0, 0.0]])
