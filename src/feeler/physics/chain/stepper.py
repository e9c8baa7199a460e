"""The chain engine: one compiled step of all lanes, the arrays that lanes share, and its two
schemes of contact.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numba import config, types
from numba.experimental.structref import StructRefProxy, define_proxy, register

from feeler.compiled import compiled, inlined, nested
from feeler.errors import InvalidInput
from feeler.physics.chain import fields as f
from feeler.physics.chain.contact import (
    clear,
    find_contacts,
    keep,
    make_rows,
    press,
    solve_contacts,
)
from feeler.physics.chain.fields import LANES
from feeler.physics.chain.model import ChainModel, make_model, stack_shapes
from feeler.physics.chain.sweep import fold, locate, move, refold, seek
from feeler.physics.engine import Contacts, Engine, State, Stepper, announce_compiling
from feeler.physics.scene import Scene

# One step of all lanes, compiled: where the base goes, what is touched, how hard, and where the
# chain goes then.


class Tables(NamedTuple):
    """All that the compiled step reads and writes; each array's last axis is the lane unless said
    otherwise.

    Attributes
    ----------
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


class _Handle(StructRefProxy):
    """Tables handed to compiled code as one thing: its 25 arrays one by one cost as much as a
    step.
    """


define_proxy(_Handle, _HandleType, ["tables"])


@compiled
def make_handle(tables):
    """A handle on tables, of scenes in the plane or in space."""
    return _Handle(tables)


if config.DISABLE_JIT:  # type: ignore[attr-defined]  # numba's proxy would call itself for ever

    class _PlainHandle(NamedTuple):
        tables: tuple

    make_handle = _PlainHandle


@compiled
def record_many(handle, tape, sample, stop, every, timestep, drive, damped):
    """Take ``every`` steps before each sample ``sample`` … ``stop`` − 1, and write it to ``tape``
    (lane, sample, column), if that has lanes; all arrays are changed in place.

    Columns as in :func:`feeler.physics.engine.make_row`. ``drive`` (step or 1, x y turn, lane):
    velocity of the base at the end of each step, the last one for ever. ``damped``: contact is
    solved with the implicit damping in it. Returns the first sample that was not written, and
    whether some lane has come to an end; nothing goes on after that.
    """
    return _record_tables(handle.tables, tape, sample, stop, every, timestep, drive, damped)


@nested
def _record_tables(t, tape, sample, stop, every, timestep, drive, damped):
    n = t.work.shape[1]
    for k in range(sample, stop):
        for step in range((k - sample) * every, (k - sample) * every + every):
            _accelerate(t.base, drive[min(step, drive.shape[0] - 1)], timestep)
            touched = _find(t)
            if touched:
                _push(t, timestep, damped)
            if not (
                touched and (damped or t.pair is not None)
            ):  # else _push has left what the hinges need
                fold(t.constants, t.work, t.base, t.loaded, timestep, t.width)
            if touched:
                t.loaded[:] = False
                for lane in range(t.number.shape[0]):
                    clear(t.work, t.rows[lane], f.ROWS * t.number[lane], lane)
            _carry(t.base, t.place, drive[min(step, drive.shape[0] - 1)], timestep)
            move(t.constants, t.work, t.wides, t.base, timestep, t.width)
        for lane in range(tape.shape[0]):
            _write(t, tape[lane, k], lane)
        for lane in range(t.number.shape[0]):
            # the tip's heading is the sum of all angles: one that is lost shows there
            if t.number[lane] < 0 or not np.isfinite(
                t.work[f.W_HEADING, n - 1, lane] + t.work[f.W_OMEGA, n - 1, lane]
            ):
                return k + 1, True
    return stop, False


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
        seek(t.constants, t.work, t.obj, t.place, o, t.pair, t.width)
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
        t.constants,
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


# Lanes filled with scenes: the arrays that a batch of simulations steps together.

MAX_CONTACTS = 20_000
_NO_TAPE = np.empty((0, 1, 0))


class ChainStepper(Stepper):
    """Scenes of one segment count, one per lane, each of which can be driven, read, saved and
    replaced by itself.
    """

    label, rows_each, sink = "chain", f.ROWS, f.B_SINK
    commanded: Any = np.array([f.B_VX, f.B_VY, f.B_TURN])
    record_lanes = staticmethod(record_many)

    def __init__(self, scenes: Sequence[Scene], timestep: float, damped: bool = False) -> None:
        for scene in scenes:
            scene.timed_contact.check_timestep(timestep)
        self.scenes, self.timestep, self.damped = list(scenes), float(timestep), damped
        self.tables = self._make_tables()
        self.drive = self.tables.base[0, self.commanded].copy()[None]
        with announce_compiling(self.label, len(self.scenes)):
            self._settle()

    def _make_tables(self) -> Any:
        return _make_tables(self.scenes, [make_model(scene) for scene in self.scenes])

    def _settle(self) -> None:
        """Take hold of the tables and compute what follows from the state; changes nothing else."""
        self.handle = make_handle(self.tables)
        self._run(0, self.drive)  # compiles, or loads what was compiled before
        self._move()

    def _move(self) -> None:
        t = self.tables
        move(t.constants, t.work, t.wides, t.base, 0.0, t.width)

    def step(self, n_steps: int, drives: Mapping[int, np.ndarray] | None = None) -> bool:
        """Take steps, all lanes together; ``drives`` (step, 3) replace the commanded base
        velocities of their lanes.
        """
        drive = self._lay_out(n_steps, drives)
        ended = self._run(n_steps, drive)
        if drives:
            self.drive = drive[-1:].copy()
        return ended

    def _run(self, n_steps: int, drive: np.ndarray) -> bool:
        """Take steps and write nothing."""
        return self.record_lanes(
            self.handle, _NO_TAPE, 0, 1, n_steps, self.timestep, drive, self.damped
        )[1]

    def record(
        self,
        tape: np.ndarray,
        sample: int,
        stop: int,
        every: int,
        drives: Mapping[int, np.ndarray] | None = None,
    ) -> tuple[int, bool]:
        """Take ``every`` steps before each sample and write it, all in compiled code."""
        drive = self._lay_out((stop - sample) * every, drives)
        until, ended = self.record_lanes(
            self.handle, tape, sample, stop, every, self.timestep, drive, self.damped
        )
        self.drive = drive[min((until - sample) * every, len(drive)) - 1 :][:1].copy()
        return until, ended

    def _lay_out(self, n_steps: int, drives: Mapping[int, np.ndarray] | None) -> np.ndarray:
        """Base velocities (step or 1, 3, lane): those commanded, but for lanes that are driven step
        by step.
        """
        if not drives:
            return self.drive
        drive = np.repeat(self.drive, n_steps, axis=0)
        for lane, rates in drives.items():
            drive[:, :, lane] = rates
        return drive

    def read(self) -> State:
        """The state of every lane, as copies."""
        t = self.tables
        work, place, base = (
            table + 0.0 for table in (t.work[: f.W_RATE + 1], t.place, t.base[0])
        )  # no negative zeros:
        place = place.transpose(2, 0, 1)  # equal states are equal bits
        return State(
            angle=work[f.W_ANGLE].T,
            velocity=work[f.W_RATE].T,
            force=place[:, :, f.P_FX : f.P_FY + 1],
            place=place[:, :, f.P_X : f.P_Y + 1] + base[f.B_X : f.B_Y + 1].T[:, None],
            forward=place[:, :, f.P_FORWARD_X : f.P_FORWARD_Y + 1],
            object_work=place[:, :, f.P_WORK],
            base=base[f.B_X : f.B_HEADING + 1].T,
            base_force=base[f.B_FX : f.B_FY + 1].T,
            base_moment=base[f.B_MOMENT],
            base_work=base[f.B_WORK],
            contact_place=base[f.B_PLACE]
            / np.where(base[f.B_PRESS] > 0, base[f.B_PRESS], np.nan),
            sink=base[f.B_SINK],
        )

    def read_sink(self) -> np.ndarray:
        """How deep contacts have sunk at most (lane,)."""
        return self.tables.base[0, self.sink]

    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of a lane's last step."""
        t, count = self.tables, max(self.tables.number[lane], 0)
        table, rows = (
            t.contacts[lane, :count],
            t.rows[lane, : f.ROWS * count].reshape(count, f.ROWS, f.N_ROW),
        )
        segment, force = (
            table[:, f.T_SEGMENT].astype(int),
            np.maximum(rows[:, :, f.R_FORCE], 0.0),
        )
        antenna = self.scenes[lane].antenna
        start = (
            t.base[0, f.B_X : f.B_Y + 1, lane]
            - self.timestep * t.base[0, f.B_VX : f.B_VY + 1, lane]
        )  # of the step
        arc = (
            antenna.hinge_position[segment]
            + np.clip(table[:, f.T_SHARE], 0.0, 1.0) * antenna.segment_length[segment]
        )
        return Contacts(
            object=table[:, f.T_OBJECT].astype(int),
            segment=segment + 1,
            place=arc / antenna.length,
            point=table[:, f.T_X : f.T_Y + 1] + start,
            normal=table[:, f.T_NX : f.T_NY + 1].copy(),
            distance=table[:, f.T_DISTANCE].copy(),
            force=np.stack(
                [(force * rows[:, :, w]).sum(axis=1) for w in (f.R_W1, f.R_W2)], axis=1
            ),
        )

    def find_broken(self) -> np.ndarray:
        """Whether each lane has left the finite numbers or had too many contacts."""
        work = self.tables.work
        return ~np.isfinite(work[f.W_HEADING, -1] + work[f.W_OMEGA, -1]) | (
            self.tables.number < 0
        )

    def explain(self, lane: int) -> Exception | None:
        """The error of a lane that had too many contacts."""
        if self.tables.number[lane] >= 0:
            return None
        return InvalidInput(
            f"'{self.scenes[lane].label}' makes more than {MAX_CONTACTS} contacts at once. Use an"
            " outline with fewer corners."
        )

    def move_base(self, lane: int, velocity: Any, turn: Any) -> None:
        """From the next step on the base moves like this."""
        self.drive[0, :, lane] = np.hstack([velocity, turn])

    def move_object(self, lane: int, o: int, velocity: Any, turn: Any) -> None:
        """From the next step on the object moves like this."""
        self.tables.place[o, f.P_VX : f.P_TURN + 1, lane] = *velocity, turn

    def read_rates(self, lane: int) -> tuple[np.ndarray, np.ndarray]:
        """What base (3,) and objects (object, 3) are commanded."""
        own = self.tables.place[: len(self.scenes[lane].objects), :, lane]
        return self.drive[0, :, lane].copy(), own[:, f.P_VX : f.P_TURN + 1].copy()

    def save(self, lane: int) -> tuple[np.ndarray, ...]:
        """All that a lane's future depends on, but for its scene."""
        t, count = self.tables, max(self.tables.number[lane], 0)
        arrays = (t.work[:, :, lane], t.base[:, :, lane], t.place[:, :, lane], t.number[lane])
        rest = (
            self.drive[:, :, lane],
            t.contacts[lane, :count],
            t.rows[lane, : self.rows_each * count],
        )
        return tuple(np.array(array) for array in (*arrays, *rest))

    def load(self, lane: int, saved: tuple[np.ndarray, ...]) -> None:
        """Put a lane back to where it was saved."""
        t = self.tables
        # these may have had more room, or may have more by now
        grown = (t.place[:, :, lane], t.contacts[lane], t.rows[lane])
        for array, kept in zip(grown, (saved[2], *saved[5:]), strict=True):
            both = tuple(map(slice, map(min, array.shape, kept.shape)))
            array[both] = kept[both]
        t.work[:, :, lane], t.base[:, :, lane], t.number[lane], self.drive[:, :, lane] = (
            *saved[:2],
            saved[3],
            saved[4],
        )

    def reset(self, lane: int, scene: Scene) -> None:
        """Begin another scene in one lane; its neighbours go on as if nothing had been."""
        scene.timed_contact.check_timestep(self.timestep)
        fits = self._refill(lane, scene)
        self.scenes[lane] = scene
        if not fits:  # other tables, with the other lanes as they are
            kept = [(k, self.save(k)) for k in range(len(self.scenes)) if k != lane]
            self.tables = self._make_tables()
            for k, saved in kept:
                self.load(k, saved)
        self.drive[0, :, lane] = scene.base_velocity
        self._settle()

    def _refill(self, lane: int, scene: Scene) -> bool:
        """Put a lane's new scene into the tables; whether they have room for it."""
        model, t = make_model(scene), self.tables
        if not _fits(t, model):
            return False
        _fill(t, lane, scene, model)
        for whole, own in zip(t.shapes, stack_shapes([model]), strict=True):
            whole[lane] = own[0, -1] if whole.dtype == np.int64 else 0.0
            whole[lane][tuple(slice(s) for s in own.shape[1:])] = own[0]
        return True


def _make_tables(scenes: Sequence[Scene], models: Sequence[ChainModel]) -> Tables:
    n, width = scenes[0].antenna.n_segments, len(scenes)
    n_objects = max(len(m.obj) for m in models)
    constants, wide_constants = make_table(f.N_CONSTANTS, n, width)
    work, wide_work = make_table(f.N_WORK, n, width)
    size = max(_count_contacts(model) for model in models)
    tables = Tables(
        constants=constants,
        work=work,
        wides=(
            wide_constants,
            wide_work,
            (0,) * (f.LANES if width == 1 else width),
        ),
        base=np.zeros((1, f.N_BASE, width)),
        obj=np.zeros((n_objects, f.N_OBJECT, width)),
        place=np.zeros((n_objects, f.N_PLACE, width)),
        shapes=stack_shapes(models),
        contacts=np.empty((width, size, f.N_CONTACT)),
        rows=np.empty((width, f.ROWS * size, f.N_ROW)),
        memory=np.empty((width, size + 1, f.N_MEMORY)),
        number=np.zeros(width, dtype=np.int64),
        open=np.zeros(width, dtype=np.bool_),
        loaded=np.zeros(n, dtype=np.bool_),
        width=(0,) * width,
        pair=(0, 0) if width == 1 else None,
    )
    for lane, (scene, model) in enumerate(zip(scenes, models, strict=True)):
        _fill(tables, lane, scene, model)
    return tables


def _fill(t: Tables, lane: int, scene: Scene, model: ChainModel) -> None:
    """Put one scene's constants and first state into its lane."""
    t.work[:, :, lane] = 0.0
    t.constants[:, :, lane], t.base[0, :, lane] = model.constants, model.base
    t.work[f.W_ANGLE, :, lane], t.work[f.W_RATE, :, lane] = (
        scene.initial_angle,
        scene.initial_velocity,
    )
    t.place[:, :, lane], n_objects = 0.0, len(model.obj)
    t.obj[:, f.O_PLANES + 2, lane] = -np.inf  # nothing is near no object
    t.obj[:n_objects, :, lane], t.place[:n_objects, :, lane] = model.obj, model.place
    t.number[lane] = 0


def _count_contacts(model: ChainModel) -> int:
    """The most contacts that a scene can make: two of a box with each segment, one of any other
    part.
    """
    most = sum(2 if kind == f.KIND_BOX else 1 for kind, _ in model.parts)
    return min(max(2, most) * (model.constants.shape[1] + 2), MAX_CONTACTS)


def _fits(t: Tables, model: ChainModel) -> bool:
    own = (
        len(model.obj),
        _count_contacts(model),
        *(array.shape[1] for array in stack_shapes([model])),
    )
    room = (t.place.shape[0], t.contacts.shape[1], *(array.shape[1] for array in t.shapes))
    return all(a <= b for a, b in zip(own, room, strict=True))


def make_table(rows: int, n: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Zeros (row, segment, lane) from the start of a cache line, and the same numbers f.LANES side
    by side.

    One lane: row after row, each an odd number of lines, so that equal places of different rows
    share no cache set. More lanes: segment after segment.
    """
    columns = 8 * (n // 8 + 1 | 1) if width == 1 else n
    space = np.zeros(rows * columns * width + 7)
    start = -(space.ctypes.data // 8) % 8
    table = space[start : start + rows * columns * width]
    if width == 1:
        return table.reshape(rows, columns, 1)[:, :n], table.reshape(
            rows, columns // f.LANES, f.LANES
        )
    table = table.reshape(columns, rows, width).transpose(1, 0, 2)
    return table, table


# The chain engine's two schemes of contact: MuJoCo's own, and one with the implicit damping in
# it.


def _make(scenes: Sequence[Scene], timestep: float, *, damped: bool) -> Stepper:

    if scenes[0].antenna.spatial:
        from feeler.physics.chain.space_stepper import SpaceChainStepper

        return SpaceChainStepper(scenes, timestep, damped)
    return ChainStepper(scenes, timestep, damped)


PARITY = Engine(make=partial(_make, damped=False), timestep=0.02, lanes=LANES)
CONSISTENT = Engine(make=partial(_make, damped=True), timestep=0.05, lanes=LANES)
