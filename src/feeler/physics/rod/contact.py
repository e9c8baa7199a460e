"""Contact of an antenna's nodes with convex parts: pressure, and friction with a stored place of sticking."""

import numpy as np

from feeler.compiled import compiled
from feeler.physics.rod.model import (
    C_DEPTH,
    C_FX,
    C_FY,
    C_NX,
    C_NY,
    F_LENGTH,
    F_NX,
    F_NY,
    F_START,
    F_TURN,
    F_X,
    F_Y,
    O_FORWARD_X,
    O_FORWARD_Y,
    O_X,
    O_Y,
    P_FIRST,
    P_FRICTION,
    P_OBJECT,
    P_RIM,
    P_ROUNDING,
    P_STOP,
    R_FIRMNESS,
    R_RADIUS,
    R_WEIGHT,
)


@compiled
def place_faces(model, lane):
    """Put the faces where their objects are."""
    for p in range(model.parts.shape[0]):
        item = lane.objects[int(model.parts[p, P_OBJECT])]
        x, y, c, s = item[O_X], item[O_Y], item[O_FORWARD_X], item[O_FORWARD_Y]
        for k in range(int(model.parts[p, P_FIRST]), int(model.parts[p, P_STOP])):
            own, face = model.faces[k], lane.faces[k]
            face[F_X], face[F_Y] = x + (c * own[F_X] - s * own[F_Y]), y + (s * own[F_X] + c * own[F_Y])
            face[F_NX], face[F_NY] = c * own[F_NX] - s * own[F_NY], s * own[F_NX] + c * own[F_NY]


@compiled
def _touch(faces, first, stop, x, y, reach):
    """(depth, normal x, normal y, place on the rim) of a node at a convex part; depth < 0: no contact.

    Of a convex part the face that is farthest, with its sign, is the nearest, or one of the two at the nearest corner.
    """
    best, gap = first, -np.inf
    for k in range(first, stop):
        far = (x - faces[k, F_X]) * faces[k, F_NX] + (y - faces[k, F_Y]) * faces[k, F_NY]
        if far >= reach:
            return -1.0, 0.0, 0.0, 0.0  # most nodes, most of the time
        if far > gap:
            best, gap = k, far
    face = faces[best]
    dx, dy, nx, ny, length = x - face[F_X], y - face[F_Y], face[F_NX], face[F_NY], face[F_LENGTH]
    along = dx * ny - dy * nx
    start = face[F_START] + reach * face[F_TURN]  # where on the rim as the node's middle sees it
    if length > 0.0 and (gap <= 0.0 or 0.0 <= along <= length):
        return reach - gap, nx, ny, start + along
    corner = min(max(along, 0.0), length)
    ex, ey = dx - corner * ny, dy + corner * nx
    away = np.sqrt(ex * ex + ey * ey)
    if not 0.0 < away < reach:
        return -1.0, 0.0, 0.0, 0.0
    turned = np.arctan2(ex * ny - ey * nx, ex * nx + ey * ny)
    return reach - away, ex / away, ey / away, start + corner + reach * turned


@compiled
def _slip(place, held, rim, reach):
    """How far a node is from where it sticks, the shorter way round."""
    slip = place - held
    if rim < np.inf:
        whole = rim + 2 * np.pi * reach
        slip -= whole * np.round(slip / whole)
    return slip


@compiled
def add_forces(model, lane, points, force, stiffness):
    """Gravity and contact at every node: force (segment, 2) and stiffness (segment, 3: xx, xy, yy); contacts are noted in
    ``lane.push``. Returns (energy, touching nodes).

    Friction is limited by ``lane.pressed``, the normal force at the end of the step before, so that a step has a potential
    energy.
    """
    energy, count = 0.0, 0
    for i in range(model.table.shape[0]):
        firm, weight = model.table[i, R_FIRMNESS], model.table[i, R_WEIGHT]
        force[i, 0], force[i, 1] = weight * model.gravity[0], weight * model.gravity[1]
        energy -= force[i, 0] * points[i + 1, 0] + force[i, 1] * points[i + 1, 1]
        stiffness[i, 0] = stiffness[i, 1] = stiffness[i, 2] = 0.0
        for p in range(model.parts.shape[0]):
            part, push = model.parts[p], lane.push[i, p]
            reach = model.table[i, R_RADIUS] + part[P_ROUNDING]
            depth, nx, ny, place = _touch(
                lane.faces, int(part[P_FIRST]), int(part[P_STOP]), points[i + 1, 0], points[i + 1, 1], reach
            )
            push[C_DEPTH] = depth
            if depth <= 0.0:
                continue
            count += 1
            energy += 0.5 * firm * depth * depth
            fx, fy = firm * depth * nx, firm * depth * ny
            stiffness[i, 0] += firm * nx * nx
            stiffness[i, 1] += firm * nx * ny
            stiffness[i, 2] += firm * ny * ny
            held, limit = lane.anchor[i, p], part[P_FRICTION] * lane.pressed[i, p]
            if limit > 0.0 and not np.isnan(held):
                tx, ty, slip = ny, -nx, _slip(place, held, part[P_RIM], reach)
                if abs(slip) * firm <= limit:
                    energy += 0.5 * firm * slip * slip
                    drag = -firm * slip
                    stiffness[i, 0] += firm * tx * tx
                    stiffness[i, 1] += firm * tx * ty
                    stiffness[i, 2] += firm * ty * ty
                else:
                    energy += limit * (abs(slip) - 0.5 * limit / firm)
                    drag = -limit if slip > 0.0 else limit
                fx += drag * tx
                fy += drag * ty
            force[i, 0] += fx
            force[i, 1] += fy
            push[C_NX], push[C_NY], push[C_FX], push[C_FY] = nx, ny, fx, fy
    return energy, count


@compiled
def move_anchors(model, lane):
    """After a step: note the normal forces; nodes that slid drag their anchor along, nodes that left forget it."""
    for i in range(model.table.shape[0]):
        firm = model.table[i, R_FIRMNESS]
        for p in range(model.parts.shape[0]):
            part = model.parts[p]
            reach = model.table[i, R_RADIUS] + part[P_ROUNDING]
            depth, _, _, place = _touch(
                lane.faces, int(part[P_FIRST]), int(part[P_STOP]), lane.points[i + 1, 0], lane.points[i + 1, 1], reach
            )
            if depth <= 0.0:
                lane.anchor[i, p], lane.pressed[i, p] = np.nan, 0.0
                continue
            held, most = lane.anchor[i, p], part[P_FRICTION] * lane.pressed[i, p] / firm
            slip = _slip(place, held, part[P_RIM], reach)
            if np.isnan(held):
                lane.anchor[i, p] = place
            elif abs(slip) > most:
                lane.anchor[i, p] = place - most if slip > 0.0 else place + most
            lane.pressed[i, p] = firm * depth
