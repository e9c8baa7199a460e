"""Stepping a chain: MuJoCo's discrete equations at O(n) cost."""

import numpy as np
from numba import njit

from feeler.errors import InvalidInput, SimulationDiverged
from feeler.physics.chain.contact import N_ROW, ROWS, clear, make_rows, press, solve_contacts
from feeler.physics.chain.fields import KIND_NONE, N_WORK, O_BASE, W_ANGLE, W_RATE
from feeler.physics.chain.model import ChainModel, make_model
from feeler.physics.chain.narrow import N_CONTACT, find_contacts
from feeler.physics.chain.sweep import COMPILE, advance, move
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion, Scene

CHUNK_WORK = 1_000_000  # segment-steps between looks for Ctrl-C, about 50 ms
MAX_CONTACTS = 20_000
OK, DIVERGED, CROWDED = range(3)


@njit(**COMPILE)
def step_many(
    constants,
    obj,
    kind,
    corners,
    part,
    leg_velocity,
    leg_step,
    first,
    n_steps,
    place,
    work,
    table,
    rows,
    loaded,
    memory,
    force,
    timestep,
):
    """Take ``n_steps`` steps from step number ``first``; a status. All arrays are changed in place."""
    leg = 0
    for step in range(first, first + n_steps):
        while step >= leg_step[leg]:
            leg += 1
        vx, vy = leg_velocity[leg, 0], leg_velocity[leg, 1]
        move(constants, work, obj[O_BASE])
        force[0] = force[1] = 0.0
        count = 0
        if kind != KIND_NONE:
            count = find_contacts(constants, work, obj, kind, corners, part, place[0], place[1], table)
            if count < 0:
                return CROWDED
        if count > 0:
            make_rows(constants, work, obj, table, count, vx, vy, rows)
            solve_contacts(constants, work, rows, ROWS * count, loaded, memory)
            loaded[:] = False
            force[0], force[1] = press(work, rows, ROWS * count, loaded)
        advance(constants, work, loaded, timestep)
        if count > 0:
            clear(work, rows, ROWS * count)
            loaded[:] = False
        place[0] += timestep * vx
        place[1] += timestep * vy
        if not np.isfinite(work[constants.shape[0] - 1, W_RATE]):
            return DIVERGED
    return OK


def run(scene: Scene, clock: Clock) -> Motion:
    """Simulate one scene with the chain engine."""
    model = make_model(scene, clock.timestep)
    return _Run(scene, model, clock).run()


class _Run:
    def __init__(self, scene: Scene, model: ChainModel, clock: Clock) -> None:
        n = scene.antenna.n_segments
        self.scene, self.model, self.clock = scene, model, clock
        self.work = np.zeros((n, N_WORK))
        self.work[:, W_ANGLE], self.work[:, W_RATE] = scene.initial_angle, scene.initial_velocity
        size = min(2 * (n + 2) * len(model.part), MAX_CONTACTS)
        self.table, self.rows = np.zeros((size, N_CONTACT)), np.zeros((ROWS * size, N_ROW))
        self.loaded, self.memory = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.int64)
        self.place, self.force = model.origin.copy(), np.zeros(2)

    def run(self) -> Motion:
        clock, n = self.clock, self.scene.antenna.n_segments
        angle, velocity = np.empty((clock.n_samples, n)), np.empty((clock.n_samples, n))
        force = np.zeros((clock.n_samples, 2))
        for k in range(clock.n_samples):
            if k:
                self._advance(k)
            angle[k], velocity[k], force[k] = self.work[:, W_ANGLE], self.work[:, W_RATE], self.force
            if not (np.isfinite(angle[k]).all() and np.isfinite(velocity[k]).all()):
                raise SimulationDiverged(self.scene.label, clock.time[k], angle[max(k - 1, 0)], velocity[max(k - 1, 0)])
        return Motion(time=clock.time, angle=angle, velocity=velocity, force=force)

    def _advance(self, k: int) -> None:
        step, last = (k - 1) * self.clock.steps_per_sample, k * self.clock.steps_per_sample
        chunk = max(1, CHUNK_WORK // len(self.work))
        model = self.model
        while step < last:
            n_steps = min(chunk, last - step)
            status = step_many(
                model.constants,
                model.object,
                model.kind,
                model.corners,
                model.part,
                model.leg_velocity,
                model.leg_step,
                step,
                n_steps,
                self.place,
                self.work,
                self.table,
                self.rows,
                self.loaded,
                self.memory,
                self.force,
                self.clock.timestep,
            )
            if status == CROWDED:
                raise InvalidInput(
                    f"'{self.scene.label}' makes more than {len(self.table)} contacts at once. Use an outline with fewer "
                    "convex parts."
                )
            step += n_steps
