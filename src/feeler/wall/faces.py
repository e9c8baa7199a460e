"""Contact of an antenna's nodes with straight faces: pressure, and friction with a stored place of sticking."""

import numpy as np

from feeler.compiled import compiled
from feeler.wall.table import (
    F_END,
    F_LENGTH,
    F_NX,
    F_NY,
    F_START,
    F_X,
    F_Y,
    R_FIRMNESS,
    R_RADIUS,
)

MAX_DEPTH = 4.0  # mm; a node deeper than this behind a face belongs to another face
CONCAVE_REACH = 5.0  # mm; a face is prolonged by this beyond a corner that turns towards the body
NEW_FACE = 10.0  # mm; a node this far from its anchor has gone to another face with the same slot


@compiled
def _touch(face, faces, k, x, y, radius):
    """(depth, normal x, normal y, place along the face) of one node at face k; depth < 0: no contact."""
    dx, dy = x - face[F_X], y - face[F_Y]
    nx, ny = face[F_NX], face[F_NY]
    gap = dx * nx + dy * ny
    if gap >= radius:
        return -1.0, nx, ny, 0.0  # most nodes, most of the time
    along = dx * ny - dy * nx  # the face runs along its normal turned by −90°, so that a wall on the right runs forward
    low = 0.0 if face[F_START] > 0.5 else -CONCAVE_REACH
    high = face[F_LENGTH] if face[F_END] > 0.5 else face[F_LENGTH] + CONCAVE_REACH
    if low <= along <= high:
        depth = radius - gap
        return (depth if depth < MAX_DEPTH else -1.0), nx, ny, along
    if along > high and face[F_END] > 0.5 and gap > 0.0 and k + 1 < faces.shape[0]:
        # past a corner that turns away, in front of neither face: the corner itself
        ex, ey = x - faces[k + 1, F_X], y - faces[k + 1, F_Y]
        if ex * faces[k + 1, F_NY] - ey * faces[k + 1, F_NX] < 0.0:
            far = np.sqrt(ex * ex + ey * ey)
            if 0.0 < far < radius:
                return radius - far, ex / far, ey / far, high
    return -1.0, nx, ny, along


@compiled
def add_contacts(table, faces, friction, points, anchor, pressed, force, stiffness):
    """Force (segment, 2) and stiffness (segment, 3: xx, xy, yy) at every node; returns (energy, touching nodes).

    ``anchor`` (segment, 2 slots) is where a node sticks along a face, NaN where it has just come; friction is
    limited by ``pressed`` (segment, 2 slots), the normal force at the end of the step before, so that a step has a
    potential energy.
    """
    energy, count = 0.0, 0
    for i in range(table.shape[0]):
        force[i, 0] = force[i, 1] = 0.0
        stiffness[i, 0] = stiffness[i, 1] = stiffness[i, 2] = 0.0
        firm = table[i, R_FIRMNESS]
        for k in range(faces.shape[0]):
            depth, nx, ny, along = _touch(faces[k], faces, k, points[i + 1, 0], points[i + 1, 1], table[i, R_RADIUS])
            if depth <= 0.0:
                continue
            count += 1
            energy += 0.5 * firm * depth * depth
            force[i, 0] += firm * depth * nx
            force[i, 1] += firm * depth * ny
            stiffness[i, 0] += firm * nx * nx
            stiffness[i, 1] += firm * nx * ny
            stiffness[i, 2] += firm * ny * ny
            held, limit = anchor[i, k % 2], friction * pressed[i, k % 2]
            if limit <= 0.0 or np.isnan(held):
                continue
            tx, ty, slip = ny, -nx, along - held
            if abs(slip) * firm <= limit:
                energy += 0.5 * firm * slip * slip
                drag = -firm * slip
                stiffness[i, 0] += firm * tx * tx
                stiffness[i, 1] += firm * tx * ty
                stiffness[i, 2] += firm * ty * ty
            else:
                energy += limit * (abs(slip) - 0.5 * limit / firm)
                drag = -limit if slip > 0.0 else limit
            force[i, 0] += drag * tx
            force[i, 1] += drag * ty
    return energy, count


@compiled
def move_anchors(table, faces, friction, points, anchor, pressed):
    """After a step: note the normal forces; nodes that slid drag their anchor along, nodes that left forget it."""
    for i in range(table.shape[0]):
        for slot in range(2):
            best, depth, along = -1, 0.0, 0.0
            for k in range(slot, faces.shape[0], 2):
                trial, _, _, place = _touch(faces[k], faces, k, points[i + 1, 0], points[i + 1, 1], table[i, R_RADIUS])
                if trial > depth:
                    best, depth, along = k, trial, place
            if best < 0:
                anchor[i, slot], pressed[i, slot] = np.nan, 0.0
                continue
            held, reach = anchor[i, slot], friction * pressed[i, slot] / table[i, R_FIRMNESS]
            if np.isnan(held) or abs(along - held) > NEW_FACE:
                anchor[i, slot] = along
            elif along - held > reach:
                anchor[i, slot] = along - reach
            elif held - along > reach:
                anchor[i, slot] = along + reach
            pressed[i, slot] = table[i, R_FIRMNESS] * depth
