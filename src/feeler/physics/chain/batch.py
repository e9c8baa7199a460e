"""Lanes filled with scenes: the arrays that a batch of simulations steps together."""

from threading import Event

import numpy as np

from feeler.compiled import compiled
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.physics.chain.compiling import announce_compiling
from feeler.physics.chain.contact import N_ROW, R_SEGMENT, ROWS, clear, make_rows, press, solve_contacts
from feeler.physics.chain.fields import (
    KIND_NONE,
    N_CONSTANTS,
    N_OBJECT,
    N_PLACE,
    N_WORK,
    P_FIRST,
    P_LAST,
    P_VX,
    P_VY,
    P_X,
    P_Y,
    W_ANGLE,
    W_RATE,
)
from feeler.physics.chain.model import ChainModel
from feeler.physics.chain.narrow import N_CONTACT, find_contacts
from feeler.physics.chain.sweep import locate, move, solve
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion, Scene

LANES = 8  # simulations stepped together; two AVX2 or one AVX-512 register per number
MAX_CONTACTS = 20_000
CHUNK = 4_000_000  # segment·lane steps between looks for Ctrl-C, about 50 ms


@compiled
def step_many(
    first, n_steps, timestep, constants, work, wides, obj, shapes, legs, place, contacts, loaded, force, damped, width
):
    """Take ``n_steps`` steps from step number ``first``; all arrays are changed in place.

    ``wides`` = (constants, work, width) once more, for eight numbers at once; ``shapes`` = (kind, corners, part,
    parts), ``legs`` = (velocity, end step), ``contacts`` = (table, rows, memory, count, open), each with the lane
    first. ``damped``: contact is solved with the implicit damping in it.
    """
    count, n = contacts[3], work.shape[1]
    if first == 0:
        move(constants, work, wides, obj, place, 0.0, width)
    for step in range(first, first + n_steps):
        _choose_leg(step, legs, place)
        force[:] = 0.0
        touched = _near(shapes[0], place) and _find(constants, work, obj, shapes, place, contacts, width)
        if touched:
            _push(constants, work, obj, place, contacts, loaded, force, timestep if damped else 0.0, width)
        if not (touched and damped):  # else the contact's last sweep has found the accelerations
            solve(constants, work, obj, loaded, timestep, n - 1, width)
        if touched:
            loaded[:] = False
            for lane in range(count.shape[0]):
                clear(work, contacts[1][lane], ROWS * count[lane], lane)
        for lane in range(count.shape[0]):
            place[0, P_X, lane] += timestep * place[0, P_VX, lane]
            place[0, P_Y, lane] += timestep * place[0, P_VY, lane]
        move(constants, work, wides, obj, place, timestep, width)


@compiled
def _choose_leg(step, legs, place):
    velocity, end = legs
    for lane in range(velocity.shape[0]):
        leg = 0
        while step >= end[lane, leg]:
            leg += 1
        place[0, P_VX, lane], place[0, P_VY, lane] = velocity[lane, leg, 0], velocity[lane, leg, 1]


@compiled
def _near(kind, place):
    for lane in range(kind.shape[0]):  # noqa: SIM110 (numba knows no generators)
        if kind[lane] != KIND_NONE and place[0, P_FIRST, lane] <= place[0, P_LAST, lane]:
            return True
    return False


@compiled
def _find(constants, work, obj, shapes, place, contacts, width):
    """Each lane's contacts, and whether there are any; a crowded lane gets the count −1 for good."""
    kind, corners, part, parts = shapes
    table, count = contacts[0], contacts[3]
    last, touched = np.int64(-1), False  # a plain −1 is a type of its own to numba, compiled for once more
    for lane in range(kind.shape[0]):
        last = max(last, int(place[0, P_LAST, lane]))
    locate(work, last, width)
    for lane in range(kind.shape[0]):
        if count[lane] < 0:
            continue
        count[lane] = 0
        if kind[lane] != KIND_NONE and place[0, P_FIRST, lane] <= place[0, P_LAST, lane]:
            edges = part[lane, : parts[lane] + 1]
            count[lane] = find_contacts(
                constants, work, obj, kind[lane], corners[lane], edges, place, table[lane], lane
            )
        touched = touched or count[lane] > 0
    return touched


@compiled
def _push(constants, work, obj, place, contacts, loaded, force, timestep, width):
    """Solve the contacts and leave their wrenches in the bias columns."""
    table, rows, memory, count, still_open = contacts
    last = work.shape[1] - 1 if timestep > 0.0 else np.int64(-1)
    for lane in range(count.shape[0]):
        if count[lane] > 0:
            make_rows(constants, work, obj, table[lane], count[lane], place, rows[lane], lane)
            last = max(last, int(rows[lane, ROWS * count[lane] - 1, R_SEGMENT]))
    solve_contacts(constants, work, obj, rows, count, loaded, memory, still_open, timestep, last, width)
    loaded[:] = False
    for lane in range(count.shape[0]):
        if count[lane] > 0:
            force[lane, 0], force[lane, 1] = press(work, rows[lane], ROWS * count[lane], loaded, lane)


class Batch:
    """Scenes of one segment count, one per lane, from their initial state to the end of the clock."""

    def __init__(self, scenes: list[Scene], models: list[ChainModel], clock: Clock, damped: bool = False) -> None:
        self.scenes, self.clock, self.damped = scenes, clock, damped
        n, width = scenes[0].antenna.n_segments, len(scenes)
        self.width = (0,) * width
        self.constants, wide_constants = _make_table(N_CONSTANTS, n, width)
        self.work, wide_work = _make_table(N_WORK, n, width)
        self.wides = wide_constants, wide_work, (0,) * (LANES if width == 1 else width)
        self.obj, self.place = np.empty((1, N_OBJECT, width)), np.zeros((1, N_PLACE, width))
        for lane, (scene, model) in enumerate(zip(scenes, models, strict=True)):
            self.constants[:, :, lane], self.obj[0, :, lane] = model.constants.T, model.object
            self.work[W_ANGLE, :, lane], self.work[W_RATE, :, lane] = scene.initial_angle, scene.initial_velocity
            self.place[0, [P_X, P_Y], lane] = model.origin
        self.shapes, self.legs = _stack_shapes(models), _stack_legs(models)
        size = min(max(2, max(len(m.part) - 1 for m in models)) * (n + 2), MAX_CONTACTS)
        self.contacts = (
            np.empty((width, size, N_CONTACT)),
            np.empty((width, ROWS * size, N_ROW)),
            np.zeros((width, n), dtype=np.int64),
            np.zeros(width, dtype=np.int64),
            np.zeros(width, dtype=np.bool_),
        )
        self.loaded, self.force = np.zeros(n, dtype=np.bool_), np.zeros((width, 2))

    def run(self, stop: Event | None = None) -> list[Motion | Exception]:
        """One Motion per lane, or the error that ended it; a lane's end never touches the others.

        Setting ``stop`` from another thread raises KeyboardInterrupt within a chunk.
        """
        self.stop = stop
        self.warm_up()
        clock, width, n = self.clock, len(self.scenes), self.work.shape[1]
        angle, velocity = np.empty((2, width, clock.n_samples, n))
        force = np.zeros((width, clock.n_samples, 2))
        failed: list[Exception | None] = [None] * width
        for k in range(clock.n_samples):
            if k:
                self._advance(k)
            angle[:, k] = self.work[W_ANGLE].T + 0.0  # no negative zeros: equal states are equal bits
            velocity[:, k] = self.work[W_RATE].T + 0.0
            force[:, k] = self.force + 0.0
            self._check(k, angle, velocity, failed)
            if all(failed):
                break
        return [
            failed[i] or Motion(time=clock.time, angle=angle[i], velocity=velocity[i], force=force[i])
            for i in range(width)
        ]

    def warm_up(self) -> None:
        """Compile, or load what was compiled before."""
        with announce_compiling(len(self.width)):
            self._step(0, 0)

    def _step(self, step: int, n_steps: int) -> None:
        step_many(
            step, n_steps, self.clock.timestep, self.constants, self.work, self.wides, self.obj, self.shapes, self.legs,
            self.place, self.contacts, self.loaded, self.force, self.damped, self.width,
        )  # fmt: skip

    def _advance(self, k: int) -> None:
        """From sample k − 1 to sample k, with a breath between chunks."""
        step, last = (k - 1) * self.clock.steps_per_sample, k * self.clock.steps_per_sample
        chunk = max(1, CHUNK // (self.work.shape[1] * len(self.scenes)))
        while step < last:
            if self.stop is not None and self.stop.is_set():
                raise KeyboardInterrupt
            n_steps = min(chunk, last - step)
            self._step(step, n_steps)
            step += n_steps

    def _check(self, k: int, angle: np.ndarray, velocity: np.ndarray, failed: list[Exception | None]) -> None:
        finite = np.isfinite(angle[:, k]).all(axis=1) & np.isfinite(velocity[:, k]).all(axis=1)
        for i, scene in enumerate(self.scenes):
            if failed[i] is None and self.contacts[3][i] < 0:
                failed[i] = InvalidInput(
                    f"'{scene.label}' makes more than {MAX_CONTACTS} contacts at once. "
                    "Use an outline with fewer corners."
                )
            elif failed[i] is None and not finite[i]:
                before = max(k - 1, 0)
                failed[i] = SimulationDiverged(
                    scene.label, self.clock.time[k], angle[i, before].copy(), velocity[i, before].copy()
                )


def _make_table(rows: int, n: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Zeros (row, segment, lane) from the start of a cache line, and the same numbers LANES side by side.

    One lane: row after row, each an odd number of lines, so that equal places of different rows share no cache set.
    More lanes: segment after segment.
    """
    columns = 8 * (n // 8 + 1 | 1) if width == 1 else n
    space = np.zeros(rows * columns * width + 7)
    start = -(space.ctypes.data // 8) % 8
    table = space[start : start + rows * columns * width]
    if width == 1:
        return table.reshape(rows, columns, 1)[:, :n], table.reshape(rows, columns // LANES, LANES)
    table = table.reshape(columns, rows, width).transpose(1, 0, 2)
    return table, table


def _stack_shapes(models: list[ChainModel]) -> tuple[np.ndarray, ...]:
    """Kinds, corners, part starts and part counts with the lane first, padded to the longest."""
    width = len(models)
    corners = np.zeros((width, max(len(m.corners) for m in models), 2))
    part = np.zeros((width, max(len(m.part) for m in models)), dtype=np.int64)
    for i, model in enumerate(models):
        corners[i, : len(model.corners)] = model.corners
        part[i, : len(model.part)] = model.part
    kind = np.array([m.kind for m in models], dtype=np.int64)
    return kind, corners, part, np.array([len(m.part) - 1 for m in models], dtype=np.int64)


def _stack_legs(models: list[ChainModel]) -> tuple[np.ndarray, np.ndarray]:
    longest = max(len(m.leg_step) for m in models)
    velocity = np.zeros((len(models), longest, 2))
    end = np.full((len(models), longest), np.iinfo(np.int64).max)
    for i, model in enumerate(models):
        velocity[i, : len(model.leg_velocity)] = model.leg_velocity
        end[i, : len(model.leg_step)] = model.leg_step
    return velocity, end
