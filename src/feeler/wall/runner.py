"""The compiled loop of a body that runs along a wall with one antenna on it."""

import numpy as np

from feeler.compiled import compiled
from feeler.wall.rod import place_nodes, step
from feeler.wall.table import F_LENGTH, F_NX, F_NY, F_X, F_Y, R_REST

TOLERANCE = 1e-6  # rad; greatest out-of-balance torque over stiffness in a step
BODY_LOST = 1.0  # [C] mm; a body nearer than this has run into the wall
MAX_SPLITS = 4  # a step that fails is taken in 4, 16, … parts

# modes: run straight, steer by the estimate, steer by the true distance
STRAIGHT, BY_TOUCH, BY_TRUTH = range(3)


@compiled
def find_distance(faces, x, y):
    """Distance to the nearest face, with the sign of its side."""
    best, side = np.inf, 1.0
    for k in range(faces.shape[0]):
        dx, dy = x - faces[k, F_X], y - faces[k, F_Y]
        nx, ny = faces[k, F_NX], faces[k, F_NY]
        along = min(max(dx * ny - dy * nx, 0.0), faces[k, F_LENGTH])
        ex, ey = dx - along * ny, dy + along * nx
        far = np.sqrt(ex * ex + ey * ey)
        if far < best:
            best, side = far, -1.0 if dx * nx + dy * ny < 0.0 else 1.0
    return side * best


@compiled
def find_bend(table, base, heading, place, weight):
    """Arc length of the greatest smoothed bend beyond the slack shape [mm]."""
    bend = np.empty(table.shape[0])
    for i in range(table.shape[0]):
        bend[i] = heading[i] - (heading[i - 1] if i else base) - table[i, R_REST]
    size = np.abs(weight @ bend)
    best = np.argmax(size)
    if best == 0 or best == place.shape[0] - 1:
        return place[best]
    bow = size[best - 1] - 2 * size[best] + size[best + 1]
    shift = 0.5 * (size[best - 1] - size[best + 1]) / bow if bow < 0.0 else 0.0
    return place[best] + min(max(shift, -0.5), 0.5) * (place[1] - place[0])


@compiled
def _advance(table, faces, friction, start, end, alpha, heading, points, velocity, anchor, pressed, timestep):
    """Carry the base from ``start`` to ``end`` (x, y, heading) in one step, or more; touching nodes or −1."""
    base, parts = np.empty(4), 1
    for split in range(MAX_SPLITS):
        bold = split < MAX_SPLITS - 1
        done, count = True, 0
        saved = (heading.copy(), points.copy(), velocity.copy(), anchor.copy(), pressed.copy())
        for part in range(parts):
            a, b = part / parts, (part + 1) / parts
            base[0], base[1] = start[0] + b * (end[0] - start[0]), start[1] + b * (end[1] - start[1])
            base[2], base[3] = alpha + start[2] + b * (end[2] - start[2]), alpha + start[2] + a * (end[2] - start[2])
            done, _, count, _ = step(
                table,
                faces,
                friction,
                base,
                heading,
                points,
                velocity,
                anchor,
                pressed,
                timestep / parts,
                True,
                bold,
                TOLERANCE,
            )
            if not done:
                break
        if done:
            return count
        heading[:], points[:, :], velocity[:, :] = saved[0], saved[1], saved[2]
        anchor[:, :], pressed[:, :] = saved[3], saved[4]
        parts *= 4
    return -1


@compiled
def run_loop(
    table, faces, friction, start, alpha, angle, speed, timestep, n_steps, place, weight, steer, delay, line, mode
):
    """Body (step + 1, 3), peak position and estimate (step + 1,), number of valid samples (negative: diverged)."""
    n = table.shape[0]
    body = np.zeros((n_steps + 1, 3))
    position, estimate = np.full(n_steps + 1, np.nan), np.full(n_steps + 1, np.nan)
    heading, points, velocity = np.empty(n), np.zeros((n + 1, 2)), np.zeros((n, 2))
    anchor, pressed = np.full((n, 2), np.nan), np.zeros((n, 2))
    body[0] = start
    turn = alpha + start[2]
    for i in range(n):
        turn += angle[i]
        heading[i] = turn
    place_nodes(table, body[0], heading, points)
    velocity[:, 1] = speed
    target, gain, damp, limit, smoothing = steer
    filtered, rate, share = target, 0.0, timestep / (smoothing + timestep)
    commands = np.zeros(n_steps + 1)
    for k in range(n_steps):
        command = commands[max(k - delay, 0)] if mode != STRAIGHT else 0.0
        body[k + 1, 2] = body[k, 2] + timestep * command
        middle = 0.5 * (body[k, 2] + body[k + 1, 2])
        body[k + 1, 0] = body[k, 0] + timestep * speed * np.sin(middle)
        body[k + 1, 1] = body[k, 1] + timestep * speed * np.cos(middle)
        count = _advance(
            table, faces, friction, body[k], body[k + 1], alpha, heading, points, velocity, anchor, pressed, timestep
        )
        if count < 0:
            return body, position, estimate, -(k + 1)
        truth = find_distance(faces, body[k + 1, 0], body[k + 1, 1])
        if count > 0:
            position[k + 1] = find_bend(table, alpha + body[k + 1, 2], heading, place, weight)
            estimate[k + 1] = min(max(line[0] * position[k + 1] + line[1], line[2]), line[3])
        if mode == STRAIGHT:
            continue
        seen = truth if mode == BY_TRUTH else (estimate[k + 1] if count > 0 else line[3])
        before = filtered
        filtered += share * (seen - filtered)
        rate = (filtered - before) / timestep
        commands[k + 1] = min(max(gain * (filtered - target) + damp * rate, -limit), limit)
        if truth <= BODY_LOST:
            return body, position, estimate, k + 2
    return body, position, estimate, n_steps + 1
