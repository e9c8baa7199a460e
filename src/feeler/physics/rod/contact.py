"""Contact of an antenna's nodes with convex parts: pressure, and friction with a stored place of
sticking.
"""

import math

import numpy as np

from feeler.compiled import compiled
from feeler.physics.rod import fields as f


@compiled
def place_faces(model, lane):
    """Put the faces where their objects are."""
    for p in range(model.parts.shape[0]):
        item = lane.objects[int(model.parts[p, f.P_OBJECT])]
        x, y, c, s = item[f.O_X], item[f.O_Y], item[f.O_FORWARD_X], item[f.O_FORWARD_Y]
        for k in range(int(model.parts[p, f.P_FIRST]), int(model.parts[p, f.P_STOP])):
            own, face = model.faces[k], lane.faces[k]
            face[f.F_X], face[f.F_Y] = (
                x + (c * own[f.F_X] - s * own[f.F_Y]),
                y + (s * own[f.F_X] + c * own[f.F_Y]),
            )
            face[f.F_NX], face[f.F_NY] = (
                c * own[f.F_NX] - s * own[f.F_NY],
                s * own[f.F_NX] + c * own[f.F_NY],
            )


@compiled
def _touch(faces, part, point, reach):
    """(depth, normal x, normal y, place on the rim) of a node at a convex part; depth < 0: no
    contact.

    Of a convex part the face that is farthest, with its sign, is the nearest, or one of the two at
    the nearest corner.
    """
    best, gap, x, y = int(part[f.P_FIRST]), -np.inf, point[0], point[1]
    for k in range(best, int(part[f.P_STOP])):
        far = (x - faces[k, f.F_X]) * faces[k, f.F_NX] + (y - faces[k, f.F_Y]) * faces[
            k, f.F_NY
        ]
        if far >= reach:
            return -1.0, 0.0, 0.0, 0.0  # most nodes, most of the time
        if far > gap:
            best, gap = k, far
    face = faces[best]
    dx, dy, nx, ny, length = (
        x - face[f.F_X],
        y - face[f.F_Y],
        face[f.F_NX],
        face[f.F_NY],
        face[f.F_LENGTH],
    )
    along = dx * ny - dy * nx
    start = (
        face[f.F_START] + reach * face[f.F_TURN]
    )  # where on the rim as the node's middle sees it
    if length > 0.0 and (gap <= 0.0 or 0.0 <= along <= length):
        return reach - gap, nx, ny, start + along
    corner = min(max(along, 0.0), length)
    ex, ey = dx - corner * ny, dy + corner * nx
    away = np.sqrt(ex * ex + ey * ey)
    if not 0.0 < away < reach:
        return -1.0, 0.0, 0.0, 0.0
    turned = math.atan2(ex * ny - ey * nx, ex * nx + ey * ny)
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
    """Gravity and contact at every node: force (segment, 2) and stiffness (segment, 3: xx, xy, yy);
    contacts are noted in ``lane.push``. Returns (energy, touching nodes).

    Friction is limited by ``lane.pressed``, the normal force at the end of the step before, so that
    a step has a potential energy.
    """
    energy, count = 0.0, 0
    for i in range(model.table.shape[0]):
        firm, weight = model.table[i, f.R_FIRMNESS], model.table[i, f.R_WEIGHT]
        force[i, 0], force[i, 1] = weight * model.gravity[0], weight * model.gravity[1]
        energy -= force[i, 0] * points[i + 1, 0] + force[i, 1] * points[i + 1, 1]
        stiffness[i, 0] = stiffness[i, 1] = stiffness[i, 2] = 0.0
        for p in range(model.parts.shape[0]):
            part, push = model.parts[p], lane.push[i, p]
            reach = model.table[i, f.R_RADIUS] + part[f.P_ROUNDING]
            depth, nx, ny, place = _touch(lane.faces, part, points[i + 1], reach)
            push[f.C_DEPTH] = depth
            if depth <= 0.0:
                continue
            count += 1
            energy += 0.5 * firm * depth * depth
            fx, fy = firm * depth * nx, firm * depth * ny
            stiffness[i, 0] += firm * nx * nx
            stiffness[i, 1] += firm * nx * ny
            stiffness[i, 2] += firm * ny * ny
            held, limit = lane.anchor[i, p], part[f.P_FRICTION] * lane.pressed[i, p]
            if limit > 0.0 and not np.isnan(held):
                tx, ty, slip = ny, -nx, _slip(place, held, part[f.P_RIM], reach)
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
            push[f.C_NX], push[f.C_NY], push[f.C_PLACE], push[f.C_FX], push[f.C_FY] = (
                nx,
                ny,
                place,
                fx,
                fy,
            )
    return energy, count


@compiled
def move_anchors(model, lane):
    """After a step: note the normal forces; nodes that slid drag their anchor along, nodes that
    left forget it.
    """
    for i in range(model.table.shape[0]):
        firm = model.table[i, f.R_FIRMNESS]
        for p in range(model.parts.shape[0]):
            part, depth, place = (
                model.parts[p],
                lane.push[i, p, f.C_DEPTH],
                lane.push[i, p, f.C_PLACE],
            )
            if depth <= 0.0:
                lane.anchor[i, p], lane.pressed[i, p] = np.nan, 0.0
                continue
            held, most = lane.anchor[i, p], part[f.P_FRICTION] * lane.pressed[i, p] / firm
            slip = _slip(
                place, held, part[f.P_RIM], model.table[i, f.R_RADIUS] + part[f.P_ROUNDING]
            )
            if np.isnan(held):
                lane.anchor[i, p] = place
            elif abs(slip) > most:
                lane.anchor[i, p] = place - most if slip > 0.0 else place + most
            lane.pressed[i, p] = firm * depth
