"""One step of all lanes in space, compiled, as :mod:`feeler.physics.chain.step` in the plane."""

from typing import NamedTuple

import numpy as np
from numba import config, types
from numba.experimental.structref import StructRefProxy, define_proxy, register

from feeler.compiled import compiled, inlined, lean
from feeler.physics.chain.contact import keep
from feeler.physics.chain.space import fields as s
from feeler.physics.chain.space.contact import (
    clear_in_space,
    make_rows_in_space,
    press_in_space,
    solve_in_space,
)
from feeler.physics.chain.space.narrow import find_in_space
from feeler.physics.chain.space.sweep import fold_in_space, locate_in_space, move_in_space


class SpaceTables(NamedTuple):
    """All that the compiled step reads and writes; names and axes as in the plane, but for
    ``place`` (field, object, lane), ``solids`` (lane, solid, field) and ``hulls`` (lane, row of
    :func:`feeler.stimulus.hull.make_hull`, column).
    """

    constants: np.ndarray
    work: np.ndarray
    base: np.ndarray
    obj: np.ndarray
    place: np.ndarray
    solids: np.ndarray
    hulls: np.ndarray
    contacts: np.ndarray
    rows: np.ndarray
    memory: np.ndarray
    number: np.ndarray
    open: np.ndarray
    loaded: np.ndarray
    # planes, whether some base gives way, whether something flows: the compiler knows how long a
    # tuple is, and leaves out what nobody asks for
    kind: tuple
    width: tuple


@register
class _SpaceHandleType(types.StructRef):
    """The type of a :class:`_SpaceHandle`."""


class _SpaceHandle(StructRefProxy):
    """Tables handed to compiled code as one thing."""


define_proxy(_SpaceHandle, _SpaceHandleType, ["tables"])


@compiled
def make_space_handle(tables):
    """A handle on tables."""
    return _SpaceHandle(tables)


if config.DISABLE_JIT:  # type: ignore[attr-defined]  # numba's proxy would call itself for ever

    class _PlainHandle(NamedTuple):
        tables: SpaceTables

    make_space_handle = _PlainHandle


@compiled
def step_in_space(handle, first, n_steps, timestep, drive, damped):
    """Take ``n_steps`` steps, as ``step_many``; ``drive`` is (step or 1, 6, lane)."""
    return _step_tables(handle.tables, first, n_steps, timestep, drive, damped)


@lean
def _step_tables(t, first, n_steps, timestep, drive, damped):
    n = t.work.shape[1]
    for step in range(first, first + n_steps):
        now = drive[min(step, drive.shape[0] - 1)]
        for lane in range(t.number.shape[0]):
            for k in range(6):  # accelerations bring the base to the driven velocity
                change = now[k, lane] - t.base[0, s.BASE_V + k, lane]
                t.base[0, s.BASE_A + k, lane] = change / timestep
        touched = _find(t)
        if touched:
            _push(t, timestep, damped)
        if not (touched and damped):
            fold_in_space(t.constants, t.work, t.base, t.loaded, t.kind, timestep, t.width)
        if touched:
            t.loaded[:] = False
            for lane in range(t.number.shape[0]):
                clear_in_space(t.work, t.rows[lane], s.EDGES * t.number[lane], lane)
        _count_work(t.base, timestep)
        _carry(t.base, t.place, now, timestep)
        move_in_space(t.constants, t.work, t.base, t.kind, timestep, t.width)
        _count_work(t.base, timestep)
    for lane in range(t.number.shape[0]):
        if t.number[lane] < 0 or not _is_finite(t.work, n, lane):
            return True
    return False


@inlined
def _is_finite(work, n, lane):
    """Whether a lane's numbers are; all that is lost shows in the last segment."""
    total = 0.0
    for k in range(3):
        total += work[s.SEG_ALONG + k, n - 1, lane] + work[s.OMEGA + k, n - 1, lane]
    return np.isfinite(total)


@inlined
def _count_work(base, timestep):
    """Half a step's work of the base on hinge 1; called before and after it moves."""
    for lane in range(base.shape[2]):
        for k in range(3):
            force = base[0, s.BASE_FORCE + k, lane] * base[0, s.ROOT_V + k, lane]
            moment = base[0, s.BASE_MOMENT + k, lane] * base[0, s.BASE_OMEGA + k, lane]
            base[0, s.BASE_WORK, lane] += 0.5 * timestep * (force + moment)


@inlined
def _carry(base, place, drive, timestep):
    """Move base and objects."""
    for lane in range(base.shape[2]):
        for k in range(6):
            base[0, s.BASE_V + k, lane] = drive[k, lane]
        for k in range(3):
            base[0, s.BASE_PLACE + k, lane] += timestep * drive[k, lane]
        turn(base[0], s.BASE_TURN, s.BASE_OMEGA, s.BASE_AXES, timestep, lane)
        for o in range(place.shape[1]):
            for k in range(3):
                place[s.OBJ_PLACE + k, o, lane] += timestep * place[s.OBJ_V + k, o, lane]
            turn(place[:, o], s.OBJ_TURN, s.OBJ_OMEGA, s.OBJ_AXES, timestep, lane)


@inlined
def turn(table, quaternion, omega, axes, timestep, lane):
    """Turn a body's quaternion by its angular velocity, and write its axes one after the other."""
    x, y, z = table[omega, lane], table[omega + 1, lane], table[omega + 2, lane]
    size = np.sqrt(x * x + y * y + z * z)
    a, b, c, d = (
        table[quaternion, lane],
        table[quaternion + 1, lane],
        table[quaternion + 2, lane],
        table[quaternion + 3, lane],
    )
    if size * timestep != 0.0:
        w, sine = np.cos(0.5 * timestep * size), np.sin(0.5 * timestep * size) / size
        x, y, z = sine * x, sine * y, sine * z
        a, b, c, d = (
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c + y * a + z * b - x * d,
            w * d + z * a + x * c - y * b,
        )
        size = np.sqrt(a * a + b * b + c * c + d * d)
        a, b, c, d = a / size, b / size, c / size, d / size
        table[quaternion, lane], table[quaternion + 1, lane] = a, b
        table[quaternion + 2, lane], table[quaternion + 3, lane] = c, d
    table[axes, lane] = a * a + b * b - c * c - d * d
    table[axes + 1, lane], table[axes + 2, lane] = 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)
    table[axes + 3, lane] = 2.0 * (b * c - a * d)
    table[axes + 4, lane] = a * a - b * b + c * c - d * d
    table[axes + 5, lane] = 2.0 * (c * d + a * b)
    table[axes + 6, lane], table[axes + 7, lane] = 2.0 * (b * d + a * c), 2.0 * (c * d - a * b)
    table[axes + 8, lane] = a * a - b * b - c * c + d * d


@inlined
def _find(t):
    """Each lane's contacts, and whether there are any; a crowded lane gets the count −1 for
    good.
    """
    locate_in_space(t.work, t.base, t.work.shape[1] - 1, t.width)
    touched = False
    for lane in range(t.number.shape[0]):
        keep(t.rows[lane], max(t.number[lane], 0), t.memory[lane], s.EDGES)
        t.number[lane] = min(t.number[lane], 0)
        t.base[0, s.BASE_PRESS, lane] = t.base[0, s.BASE_SPOT, lane] = 0.0
        for o in range(t.place.shape[1]):
            for k in range(3):
                t.place[s.OBJ_FORCE + k, o, lane] = 0.0
        for k in range(t.solids.shape[1]):
            if t.number[lane] >= 0 and t.solids[lane, k, s.S_OBJECT] >= 0.0:
                t.number[lane] = find_in_space(
                    t.constants,
                    t.work,
                    t.obj,
                    t.place,
                    t.solids[lane, k],
                    t.hulls[lane],
                    t.contacts[lane],
                    t.number[lane],
                    lane,
                )
        touched = touched or t.number[lane] > 0
    return touched


@inlined
def _push(t, timestep, damped):
    """Solve the contacts and leave their wrenches in the bias columns, or the hinges as ``fold``
    leaves them.
    """
    last = np.int64(-1)
    for lane in range(t.number.shape[0]):
        count = t.number[lane]
        if count > 0:
            make_rows_in_space(
                t.constants,
                t.work,
                t.base,
                t.obj,
                t.contacts[lane],
                count,
                t.place,
                t.rows[lane],
                lane,
            )
            for k in range(count):
                last = max(last, np.int64(t.contacts[lane, k, s.HIT_SEGMENT]))
    solve_in_space(
        t.constants,
        t.work,
        t.base,
        t.rows,
        t.number,
        t.loaded,
        t.memory,
        t.open,
        timestep if damped else 0.0,
        last,
        t.kind,
        t.width,
    )
    t.loaded[:] = False
    for lane in range(t.number.shape[0]):
        if t.number[lane] > 0:
            press_in_space(
                t.constants,
                t.work,
                t.base,
                t.place,
                t.contacts[lane],
                t.rows[lane],
                s.EDGES * t.number[lane],
                t.loaded,
                timestep,
                lane,
            )


@compiled
def record_in_space(handle, tape, sample, stop, every, timestep, drive, damped):
    """Take ``every`` steps before each sample and write it to ``tape``, as ``record_many``."""
    for k in range(sample, stop):
        ended = step_in_space(handle, (k - sample) * every, every, timestep, drive, damped)
        for lane in range(tape.shape[0]):
            _write(handle.tables, tape[lane, k], lane)
        if ended:
            return k + 1, True
    return stop, False


@inlined
def _write(t, row, lane):
    n, at = t.work.shape[1], 0
    for table in (s.ANGLE, s.RATE):
        for p in range(len(t.kind[0])):
            for i in range(n):
                row[at] = t.work[table + p, i, lane] + 0.0  # no negative zeros
                at += 1
    row[at : at + 5] = 0.0
    for o in range(t.place.shape[1]):
        for k in range(3):
            row[at + k] += t.place[s.OBJ_FORCE + k, o, lane]
        row[at + 4] += t.place[s.OBJ_WORK, o, lane]
    row[at + 3] = t.base[0, s.BASE_WORK, lane] + 0.0
    _write_pose(t.base, row[at + 5 : at + 11], lane)
    for k in range(6):
        row[at + 11 + k] = t.base[0, s.BASE_FORCE + k, lane] + 0.0
    pressed = t.base[0, s.BASE_PRESS, lane]
    row[at + 17] = t.base[0, s.BASE_SPOT, lane] / pressed if pressed > 0.0 else np.nan
    row[at + 18] = t.base[0, s.BASE_SINK, lane] + 0.0


@inlined
def _write_pose(base, row, lane):
    """Hinge 1's place and the base's rotation vector (6,)."""
    w, size = base[0, s.BASE_TURN, lane], 0.0
    for k in range(3):
        row[k] = base[0, s.ROOT + k, lane] + 0.0
        row[3 + k] = base[0, s.BASE_TURN + 1 + k, lane]
        size += row[3 + k] * row[3 + k]
    size = np.sqrt(size)
    angle = 2.0 * np.arctan2(size, abs(w))
    factor = (angle / size if size > 0.0 else 2.0) * (1.0 if w >= 0.0 else -1.0)
    for k in range(3):
        row[3 + k] = factor * row[3 + k] + 0.0
