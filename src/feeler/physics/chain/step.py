"""One step of all lanes, compiled: where the base goes, what is touched, how hard, and where the
chain goes then.
"""

from typing import NamedTuple

import numpy as np
from numba import config, types
from numba.experimental.structref import StructRefProxy, define_proxy, register

from feeler.compiled import compiled, inlined, lean
from feeler.physics.chain import fields as f
from feeler.physics.chain.contact import clear, keep, make_rows, press, solve_contacts
from feeler.physics.chain.narrow import find_contacts
from feeler.physics.chain.sweep import fold, locate, move, refold, seek


class Tables(NamedTuple):
    """All that the compiled step reads and writes; each array's last axis is the lane unless said
    otherwise.

    Attributes
    ----------
    segments : np.ndarray
        Constants as the sweeps read them: without lanes, (field, segment), where all lanes hold one
        antenna.
    wides : tuple
        Constants and work once more, for eight numbers at once, and the width of that.
    shapes : tuple
        (kind, corners, first corner, bounding box, that of each block of parts, owner), the lane
        first.
    contacts : np.ndarray
        (lane, contact, field).
    rows : np.ndarray
        (lane, row, field).
    memory : np.ndarray
        (lane, contact, field): what each contact of the step before came to; it follows from
        ``rows`` and ``number``.
    number : np.ndarray
        (lane,): contacts of the last step; −1 in a lane that had too many.
    pair : tuple | None
        The width of two lanes, where one is stepped by itself and a sweep can do two things at
        once.
    """

    constants: np.ndarray
    segments: np.ndarray
    work: np.ndarray
    wides: tuple
    base: np.ndarray
    obj: np.ndarray
    place: np.ndarray
    shapes: tuple
    contacts: np.ndarray
    rows: np.ndarray
    memory: np.ndarray
    number: np.ndarray
    open: np.ndarray
    loaded: np.ndarray
    width: tuple
    pair: tuple | None


@register
class _HandleType(types.StructRef):
    """The type of a :class:`Handle`."""


class Handle(StructRefProxy):
    """Tables handed to compiled code as one thing: its 25 arrays one by one cost as much as a
    step.
    """


define_proxy(Handle, _HandleType, ["tables"])


@compiled
def make_handle(tables):
    """A handle on tables."""
    return Handle(tables)


if config.DISABLE_JIT:  # type: ignore[attr-defined]  # numba's proxy would call itself for ever

    class _PlainHandle(NamedTuple):
        tables: Tables

    make_handle = _PlainHandle


@compiled
def step_many(handle, first, n_steps, timestep, drive, damped):
    """Take ``n_steps`` steps; all arrays are changed in place.

    ``drive`` (step or 1, x y turn, lane): velocity of the base at the end of each step from number
    ``first`` on, the last one for ever. ``damped``: contact is solved with the implicit damping in
    it. Returns whether some lane has come to an end.
    """
    return _step_tables(handle.tables, first, n_steps, timestep, drive, damped)


@lean
def _step_tables(t, first, n_steps, timestep, drive, damped):
    n = t.work.shape[1]
    for step in range(first, first + n_steps):
        _accelerate(t.base, drive[min(step, drive.shape[0] - 1)], timestep)
        touched = _find(t)
        if touched:
            _push(t, timestep, damped)
        if not (
            touched and (damped or t.pair is not None)
        ):  # else _push has left what the hinges need
            fold(t.segments, t.work, t.base, t.loaded, timestep, t.width)
        if touched:
            t.loaded[:] = False
            for lane in range(t.number.shape[0]):
                clear(t.work, t.rows[lane], f.ROWS * t.number[lane], lane)
        _carry(t.base, t.place, drive[min(step, drive.shape[0] - 1)], timestep)
        move(t.segments, t.work, t.wides, t.base, timestep, t.width)
    for lane in range(
        t.number.shape[0]
    ):  # the tip's heading is the sum of all angles: one that is lost shows there
        if t.number[lane] < 0 or not np.isfinite(
            t.work[f.W_HEADING, n - 1, lane] + t.work[f.W_OMEGA, n - 1, lane]
        ):
            return True
    return False


@inlined
def _accelerate(base, drive, timestep):
    """The base's acceleration in this step, which brings it to the driven velocity."""
    for lane in range(base.shape[2]):
        base[0, f.B_AX, lane] = (drive[0, lane] - base[0, f.B_VX, lane]) / timestep
        base[0, f.B_AY, lane] = (drive[1, lane] - base[0, f.B_VY, lane]) / timestep
        base[0, f.B_ALPHA, lane] = (drive[2, lane] - base[0, f.B_TURN, lane]) / timestep


@inlined
def _carry(base, place, drive, timestep):
    """Move the base, and the objects as seen from it; add up the base's work."""
    for lane in range(base.shape[2]):
        vx, vy, turn = drive[0, lane], drive[1, lane], drive[2, lane]
        power = base[0, f.B_FX, lane] * 0.5 * (vx + base[0, f.B_VX, lane])
        power += base[0, f.B_FY, lane] * 0.5 * (vy + base[0, f.B_VY, lane])
        power += base[0, f.B_MOMENT, lane] * 0.5 * (turn + base[0, f.B_TURN, lane])
        base[0, f.B_WORK, lane] += timestep * power
        base[0, f.B_VX, lane], base[0, f.B_VY, lane], base[0, f.B_TURN, lane] = vx, vy, turn
        base[0, f.B_X, lane] += timestep * vx
        base[0, f.B_Y, lane] += timestep * vy
        base[0, f.B_HEADING, lane] += timestep * turn
        for o in range(place.shape[0]):
            place[o, f.P_X, lane] += timestep * (place[o, f.P_VX, lane] - vx)
            place[o, f.P_Y, lane] += timestep * (place[o, f.P_VY, lane] - vy)
            turning = timestep * place[o, f.P_TURN, lane]
            if turning != 0.0:
                place[o, f.P_HEADING, lane] += turning
                c, s = np.cos(turning), np.sin(turning)
                x, y = place[o, f.P_FORWARD_X, lane], place[o, f.P_FORWARD_Y, lane]
                x, y = c * x + s * y, c * y - s * x
                size = np.sqrt(x * x + y * y)
                place[o, f.P_FORWARD_X, lane], place[o, f.P_FORWARD_Y, lane] = (
                    x / size,
                    y / size,
                )


@inlined
def _find(t):
    """Each lane's contacts, and whether there are any; a crowded lane gets the count −1 for
    good.
    """
    kinds, corners, starts, boxes, blocks, owner = t.shapes
    last = np.int64(-1)  # a plain −1 is a type of its own to numba, compiled for once more
    for o in range(t.place.shape[0]):
        seek(t.segments, t.work, t.obj, t.place, o, t.pair, t.width)
        for lane in range(t.number.shape[0]):
            if t.place[o, f.P_FIRST, lane] <= t.place[o, f.P_LAST, lane]:
                last = max(last, np.int64(t.place[o, f.P_LAST, lane]))
            t.place[o, f.P_FX, lane] = t.place[o, f.P_FY, lane] = 0.0
    for lane in range(t.number.shape[0]):
        keep(t.rows[lane], max(t.number[lane], 0), t.memory[lane], f.ROWS)
        t.number[lane] = min(t.number[lane], 0)
        t.base[0, f.B_PRESS, lane] = t.base[0, f.B_PLACE, lane] = 0.0
    if last < 0:
        return False
    locate(t.work, last, t.width)
    touched = False
    for lane in range(t.number.shape[0]):
        shapes = (kinds[lane], corners[lane], starts[lane], boxes[lane], blocks[lane])
        for o in range(t.place.shape[0]):
            first, stop = owner[lane, o], owner[lane, o + 1]
            if (
                t.number[lane] >= 0
                and t.place[o, f.P_FIRST, lane] <= t.place[o, f.P_LAST, lane]
            ):
                t.number[lane] = find_contacts(
                    t.constants,
                    t.work,
                    t.obj,
                    o,
                    shapes,
                    first,
                    stop,
                    t.place,
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
            make_rows(
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
                last = max(last, np.int64(t.contacts[lane, k, f.T_SEGMENT]))
    solve_contacts(
        t.segments,
        t.work,
        t.base,
        t.rows,
        t.number,
        t.loaded,
        t.memory,
        t.open,
        timestep,
        damped,
        last,
        t.pair,
        t.width,
    )
    t.loaded[:] = False
    for lane in range(t.number.shape[0]):
        if t.number[lane] > 0:
            press(
                t.constants,
                t.work,
                t.base,
                t.place,
                t.contacts[lane],
                t.rows[lane],
                f.ROWS * t.number[lane],
                t.loaded,
                timestep,
                lane,
            )
    if t.pair is not None and not damped:
        refold(t.work, t.wides, t.base, t.loaded, last, t.width)


@compiled
def record_many(handle, tape, sample, stop, every, timestep, drive, damped):
    """Take ``every`` steps before each sample ``sample`` … ``stop`` − 1, and write it to ``tape``
    (lane, sample, column).

    Columns as in :func:`feeler.physics.stepper.make_row`. Returns the first sample that was not
    written, and whether some lane has come to an end; nothing goes on after that.
    """
    for k in range(sample, stop):
        ended = step_many(handle, (k - sample) * every, every, timestep, drive, damped)
        for lane in range(tape.shape[0]):
            _write(handle.tables, tape[lane, k], lane)
        if ended:
            return k + 1, True
    return stop, False


@inlined
def _write(t, row, lane):
    n = t.work.shape[1]
    for i in range(n):
        row[i], row[n + i] = (
            t.work[f.W_ANGLE, i, lane] + 0.0,
            t.work[f.W_RATE, i, lane] + 0.0,
        )  # no negative zeros
    fx = fy = work = 0.0
    for o in range(t.place.shape[0]):
        fx, fy, work = (
            fx + t.place[o, f.P_FX, lane],
            fy + t.place[o, f.P_FY, lane],
            work + t.place[o, f.P_WORK, lane],
        )
    at = 2 * n
    row[at], row[at + 1], row[at + 2], row[at + 3] = (
        fx,
        fy,
        t.base[0, f.B_WORK, lane] + 0.0,
        work,
    )
    for k in range(3):
        row[at + 4 + k] = t.base[0, f.B_X + k, lane] + 0.0
        row[at + 7 + k] = t.base[0, f.B_FX + k, lane] + 0.0
    pressed = t.base[0, f.B_PRESS, lane]
    row[at + 10] = t.base[0, f.B_PLACE, lane] / pressed if pressed > 0.0 else np.nan
    row[at + 11] = t.base[0, f.B_SINK, lane] + 0.0
