"""Gradients: what any scalar of touches' angles gains from each hinge's stiffness and damping and
each segment's mass.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.physics.clock import Clock
from feeler.physics.engine import get_engine
from feeler.physics.run import make_groups
from feeler.physics.scene import Scene
from feeler.physics.stepper import make_row

ENGINE = "chain-consistent"
SEGMENT = 2000  # [C] steps kept at a time: 38 MB for eight lanes; longer runs go forward once more
FIELDS = ("stiffness", "damping", "segment_mass")


@checked
def pull_back(
    scenes: Sequence[Scene], clock: Clock, weights: Annotated[np.ndarray, "scene sample segment"]
) -> dict[str, np.ndarray]:
    """dL/d stiffness, damping and segment mass of each scene (scene, segment), L being any scalar
    of the sampled angles.

    The reverse sweep of engine ``chain-consistent``: exact for the discrete steps, with contacts'
    active rows held. It costs a few forward runs, however many parameters there are. The contact
    must be smooth (the default), or there is no derivative.

    Parameters
    ----------
    weights
        dL/d angle (scene, sample, segment), sample as in ``clock.time``.

    Raises
    ------
    InvalidInput
        A base that moves, objects that turn or follow a path, or weights of another shape.
    SimulationDiverged
        A scene left the finite numbers.
    """
    scenes = list(scenes)
    _check(scenes, clock, weights)
    found = {name: np.empty((len(scenes), scenes[0].antenna.n_segments)) for name in FIELDS}
    for group in make_groups(scenes, get_engine(ENGINE)):
        for name, values in _go_back([scenes[k] for k in group], clock, weights[group]).items():
            found[name][group] = values
    return found


def _check(scenes: list[Scene], clock: Clock, weights: np.ndarray) -> None:
    segments = {scene.antenna.n_segments for scene in scenes}
    if len(segments) != 1 or weights.shape != (len(scenes), clock.n_samples, *segments):
        raise InvalidInput(
            f"weights must be (scene, sample, segment) of {len(scenes)} scenes with one number of"
            f" segments and {clock.n_samples} samples, got {weights.shape}."
        )
    for scene in scenes:
        if (
            scene.base_motion is not None
            or any(scene.paths)
            or any(item.turn for item in scene.objects)
        ):
            raise InvalidInput(
                f"'{scene.label}': gradients need a base at rest and objects on straight lines."
            )


def _go_back(scenes: list[Scene], clock: Clock, weights: np.ndarray) -> dict[str, np.ndarray]:
    from feeler.physics.chain import adjoint
    from feeler.physics.chain import fields as f
    from feeler.physics.chain.batch import ChainStepper, make_table

    lanes = 1 if len(scenes) == 1 else get_engine(ENGINE).lanes
    filled = [*scenes, *[scenes[-1]] * (lanes - len(scenes))]
    weights = np.concatenate([weights, np.repeat(weights[-1:], lanes - len(scenes), axis=0)])
    stepper, n = ChainStepper(filled, clock.timestep, damped=True), scenes[0].antenna.n_segments
    every, n_steps = clock.steps_per_sample, (clock.n_samples - 1) * clock.steps_per_sample
    starts = range(0, n_steps, SEGMENT)
    saved = []
    for first in starts:
        saved.append([stepper.save(lane) for lane in range(lanes)])
        if first != starts[-1]:
            stepper.step(SEGMENT)
    carried = make_table(adjoint.N_ADJOINT, n, lanes)[0]
    scratch, rows = np.empty((8 * n, f.N_CONTACT)), np.empty((f.ROWS * 8 * n, f.N_ROW))
    for first, states in zip(reversed(starts), reversed(saved), strict=True):
        for lane, state in enumerate(states):
            stepper.load(lane, state)
        count = min(SEGMENT, n_steps - first)
        place = stepper.tables.place.copy()
        start = make_row(stepper.read())
        tape = np.empty((lanes, count + 1, start.shape[1]))
        tape[:, 0] = start
        _, ended = stepper.record(tape, 1, count + 1, 1)
        if ended:
            raise SimulationDiverged(scenes[0].label, (first + count) * clock.timestep)
        adjoint.go_back(
            stepper.handle,
            carried,
            tape,
            place,
            weights,
            first,
            every,
            clock.timestep,
            scratch,
            rows,
        )
    gathered = {
        "stiffness": carried[adjoint.L_STIFFNESS],
        "damping": carried[adjoint.L_DAMPING],
        "segment_mass": (
            carried[adjoint.L_MASS] + _pull_invweight(filled, carried[adjoint.L_INVWEIGHT])
        ),
    }
    return {name: values.T[: len(scenes)].copy() for name, values in gathered.items()}


def _pull_invweight(scenes: list[Scene], gained: np.ndarray) -> np.ndarray:
    """What the masses gain by what the antenna weighs at its contacts (segment, lane)."""
    outlines = [(scene.antenna.segment_length, scene.antenna.segment_mass) for scene in scenes]
    rows = [
        _differentiate_invweight(tuple(length.tolist()), tuple(mass.tolist()))
        for length, mass in outlines
    ]
    return np.stack([gained[:, lane] @ jacobian for lane, jacobian in enumerate(rows)], axis=1)


@lru_cache(maxsize=16)
def _differentiate_invweight(length: tuple[float, ...], mass: tuple[float, ...]) -> np.ndarray:
    """∂ ``body_invweight0`` / ∂ mass (segment, segment) by complex steps, exact."""
    from feeler.physics.chain.model import compute_invweight

    columns = []
    for k in range(len(mass)):
        moved = np.array(mass, dtype=complex)
        moved[k] += 1e-30j
        columns.append(compute_invweight(np.array(length), moved).imag / 1e-30)
    return np.stack(columns, axis=1)
