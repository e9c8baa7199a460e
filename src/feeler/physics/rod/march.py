"""Many implicit steps, with base and objects carried along, and the way to an equilibrium."""

import math

import numpy as np

from feeler.compiled import compiled
from feeler.physics.rod import fields as f
from feeler.physics.rod.contact import place_faces
from feeler.physics.rod.newton import take

_TOLERANCE = 1e-6  # rad; greatest out-of-balance torque over stiffness in a step
_MAX_SPLITS = 9  # [C] how often a step or a part of it that fails is quartered
_MAX_JUMPS = 5  # [C] so many for a part in which an object comes to the antenna's other side
_CAREFUL = 1  # [C] from so many quarterings on each iteration must lower the potential
_FIRST_STEP, _LONGEST_STEP = 0.5, 1e7  # ms; of a relaxation
_CALM = 0.05  # rad per step
# rad; an antenna that moves less per step, nearly balanced, is as balanced as rounding lets it be
_ROUNDING = 1e-9


@compiled
def march(model, lane, n_steps, timestep, drive, inertia):
    """Take steps in place, the base with ``drive`` (step or 1, 3) at each one's end; False where
    one has no end.
    """
    for k in range(n_steps):
        lane.drive[:] = drive[min(k, drive.shape[0] - 1)]
        if not _divide(model, lane, timestep, inertia):
            return False
    return True


@compiled
def _divide(model, lane, timestep, inertia):
    """One step in as few parts as it takes: a part that fails, or in which the antenna jumps over
    something, is quartered; after one that succeeds the next may be longer. Whether it came to its
    end.
    """
    level, left = 0, 4**_MAX_SPLITS  # of the shortest parts
    sides = np.zeros(model.parts.shape[0])
    while left:
        part = 4 ** (_MAX_SPLITS - level)
        kept = (
            lane.heading.copy(),
            lane.points.copy(),
            lane.velocity.copy(),
            lane.anchor.copy(),
        )
        rest = (lane.pressed.copy(), lane.base.copy(), lane.objects.copy(), lane.work.copy())
        place_faces(model, lane)
        for p in range(len(sides)):
            sides[p] = _find_side(model, lane, p)
        span = timestep * part / 4**_MAX_SPLITS
        done = _advance(model, lane, span, inertia, level < _CAREFUL)
        if done and level < _MAX_JUMPS:
            for p in range(len(sides)):
                done = done and sides[p] * _find_side(model, lane, p) >= 0.0
        if done:
            left -= part
            if level and left % (4 * part) == 0:
                level -= 1
            continue
        lane.heading[:], lane.points[:], lane.velocity[:], lane.anchor[:] = kept
        lane.pressed[:], lane.base[:], lane.objects[:], lane.work[:] = rest
        level += 1
        if level > _MAX_SPLITS:
            return False
    return True


@compiled
def _find_side(model, lane, p):
    """On which side of the antenna the middle of a part is: −1 or 1, or 0 beyond its ends."""
    first, stop = int(model.parts[p, f.P_FIRST]), int(model.parts[p, f.P_STOP])
    if model.parts[p, f.P_RIM] == np.inf:
        return 0.0  # nothing jumps over a face without end
    x, y, nearest, side = 0.0, 0.0, np.inf, 0.0
    for k in range(first, stop):
        x += lane.faces[k, f.F_X] / (stop - first)
        y += lane.faces[k, f.F_Y] / (stop - first)
    for i in range(model.table.shape[0]):
        ex = lane.points[i + 1, 0] - lane.points[i, 0]
        ey = lane.points[i + 1, 1] - lane.points[i, 1]
        dx, dy = x - lane.points[i, 0], y - lane.points[i, 1]
        share = (dx * ex + dy * ey) / (ex * ex + ey * ey)
        within = min(max(share, 0.0), 1.0)
        away = (dx - within * ex) ** 2 + (dy - within * ey) ** 2
        if away < nearest:
            beyond = (i == 0 and share < 0.0) or (i == model.table.shape[0] - 1 and share > 1.0)
            nearest, side = away, 0.0 if beyond else np.sign(ex * dy - ey * dx)
    return side


@compiled
def _advance(model, lane, timestep, inertia, bold):
    """Carry base and objects on, and take one step; whether it converged."""
    before = lane.base[2]
    for axis in range(3):
        lane.base[axis] += timestep * lane.drive[axis]
    for o in range(lane.objects.shape[0]):
        item = lane.objects[o]
        item[f.O_X] += timestep * item[f.O_VX]
        item[f.O_Y] += timestep * item[f.O_VY]
        turned = timestep * item[f.O_TURN]
        if turned != 0.0:
            c, s, x, y = (
                math.cos(turned),
                math.sin(turned),
                item[f.O_FORWARD_X],
                item[f.O_FORWARD_Y],
            )
            item[f.O_FORWARD_X], item[f.O_FORWARD_Y] = c * x + s * y, c * y - s * x
    place_faces(model, lane)
    done, _, _, _ = take(model, lane, before, timestep, inertia, bold, _TOLERANCE)
    if done:
        _add_work(model, lane, timestep)
    return done


@compiled
def _add_work(model, lane, timestep):
    """What base and objects did in this step, by the forces at its end, as the step has them."""
    for axis in range(3):
        lane.work[0] += timestep * lane.wrench[axis] * lane.drive[axis]
    for i in range(lane.push.shape[0]):
        for p in range(lane.push.shape[1]):
            push, o = lane.push[i, p], int(model.parts[p, f.P_OBJECT])
            if push[f.C_DEPTH] > 0.0:
                thin = min(model.table[i, f.R_RADIUS], model.parts[p, f.P_RADIUS])
                lane.sink[0] = max(lane.sink[0], push[f.C_DEPTH] / thin)
                item, near = lane.objects[o], model.table[i, f.R_RADIUS]
                x = lane.points[i + 1, 0] - near * push[f.C_NX] - item[f.O_X]
                y = lane.points[i + 1, 1] - near * push[f.C_NY] - item[f.O_Y]
                vx, vy = item[f.O_VX] + item[f.O_TURN] * y, item[f.O_VY] - item[f.O_TURN] * x
                lane.work[1 + o] += timestep * (push[f.C_FX] * vx + push[f.C_FY] * vy)


@compiled
def relax(model, lane, before, tolerance, max_steps):
    """Go to an equilibrium in place; returns (imbalance [rad], touching nodes).

    The time step grows while little happens, so that the last steps are plain Newton steps to the
    equilibrium; where much happens it stays short, and the antenna moves off along its own damping.
    """
    timestep, static, count = _FIRST_STEP, np.inf, 0
    place_faces(model, lane)
    for _ in range(max_steps):
        done, trial, touching, moved = take(
            model, lane, before, timestep, False, False, 0.1 * tolerance
        )
        if not done:
            timestep *= 0.25
            if timestep < 1e-6:
                return np.inf, count
            continue
        before = lane.base[2]  # the base has arrived
        static, count = trial, touching
        if static < tolerance or (static < 10 * tolerance and moved < _ROUNDING):
            break
        if moved < _CALM:
            timestep = min(timestep * 4.0, _LONGEST_STEP)
        elif moved > 3 * _CALM:
            timestep *= 0.5
    return static, count
