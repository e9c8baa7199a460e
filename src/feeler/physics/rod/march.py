"""Many implicit steps, with base and objects carried along, and the way to an equilibrium."""

import numpy as np

from feeler.compiled import compiled
from feeler.physics.rod import fields as f
from feeler.physics.rod.contact import place_faces
from feeler.physics.rod.newton import take

TOLERANCE = 1e-6  # rad; greatest out-of-balance torque over stiffness in a step
MAX_SPLITS = 4  # a step that fails is taken in 4, 16, … parts
FIRST_STEP, LONGEST_STEP = 0.5, 1e7  # ms; of a relaxation
CALM = 0.05  # rad per step
# rad; an antenna that moves less per step, nearly balanced, is as balanced as rounding lets it be
ROUNDING = 1e-9


@compiled
def march(model, lane, n_steps, timestep, drive, inertia):
    """Take steps in place, the base with ``drive`` (step or 1, 3) at each one's end; False where
    one has no end.
    """
    for k in range(n_steps):
        lane.drive[:] = drive[min(k, drive.shape[0] - 1)]
        for split in range(MAX_SPLITS):
            parts, done = 4**split, False
            kept = (
                lane.heading.copy(),
                lane.points.copy(),
                lane.velocity.copy(),
                lane.anchor.copy(),
            )
            rest = (lane.pressed.copy(), lane.base.copy(), lane.objects.copy(), lane.work.copy())
            for _ in range(parts):
                done = _advance(model, lane, timestep / parts, inertia, split < MAX_SPLITS - 1)
                if not done:
                    break
            if done:
                break
            lane.heading[:], lane.points[:], lane.velocity[:], lane.anchor[:] = kept
            lane.pressed[:], lane.base[:], lane.objects[:], lane.work[:] = rest
        if not done:
            return False
    return True


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
            c, s, x, y = np.cos(turned), np.sin(turned), item[f.O_FORWARD_X], item[f.O_FORWARD_Y]
            item[f.O_FORWARD_X], item[f.O_FORWARD_Y] = c * x + s * y, c * y - s * x
    place_faces(model, lane)
    done, _, _, _ = take(model, lane, before, timestep, inertia, bold, TOLERANCE)
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
    timestep, static, count = FIRST_STEP, np.inf, 0
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
        if static < tolerance or (static < 10 * tolerance and moved < ROUNDING):
            break
        if moved < CALM:
            timestep = min(timestep * 4.0, LONGEST_STEP)
        elif moved > 3 * CALM:
            timestep *= 0.5
    return static, count
