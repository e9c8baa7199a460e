"""The chain engine with a polygon's corners as MuJoCo holds them, so that both engines start from
the same numbers.
"""

from collections.abc import Sequence

import mujoco as engine
import numpy as np

from feeler.physics import mujoco
from feeler.physics.chain import fields as f
from feeler.physics.chain.stepper import ChainStepper
from feeler.physics.chain.sweep import move
from feeler.physics.engine import ENGINES, Engine, State
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Motion, Scene

NAME = "chain with MuJoCo's corners"


def run_like_mujoco(scene: Scene, clock: Clock) -> Motion:
    """The chain's motion from the numbers that MuJoCo has."""
    ENGINES.register(NAME, Engine(make=make_like_mujoco, timestep=0.02))
    try:
        return run_scene(scene, clock, NAME)
    finally:
        ENGINES.unregister(NAME)


def make_like_mujoco(scenes: Sequence[Scene], timestep: float) -> ChainStepper:
    """The chain; MuJoCo stores the corners of a mesh in single precision, which moves them by up to
    1e-7 mm.
    """
    stepper = ChainStepper(scenes, timestep)
    kind, corners, start, *_ = stepper.tables.shapes
    for lane, scene in enumerate(scenes):
        parts = sum(len(item.feature.parts) for item in scene.objects)
        meshes = [k for k in range(parts) if kind[lane, k] == f.KIND_POLYGON]
        for k, stored in zip(meshes, read_corners(scene, timestep), strict=True):
            for j in range(start[lane, k], start[lane, k + 1]):
                near = np.argsort(np.hypot(*(stored - corners[lane, j]).T))[
                    :2
                ]  # the prism's upper and lower corner
                moved = stored[near].mean(axis=0)
                assert np.abs(moved - corners[lane, j]).max() < 1e-6
                corners[lane, j] = moved
    return stepper


def take_over(stepper: ChainStepper, state: State) -> None:
    """Put the chain's first lane where another engine's is, at the rates that it has itself."""
    t = stepper.tables
    t.work[f.W_ANGLE, :, 0], t.work[f.W_RATE, :, 0] = state.angle[0], state.velocity[0]
    t.base[0, f.B_X : f.B_HEADING + 1, 0] = state.base[0]
    t.place[:, f.P_X : f.P_Y + 1, 0] = state.place[0] - state.base[0, :2]
    t.place[:, f.P_FORWARD_X : f.P_FORWARD_Y + 1, 0] = state.forward[0]
    move(t.constants, t.work, t.wides, t.base, 0.0, t.width)


def read_corners(scene: Scene, timestep: float) -> list[np.ndarray]:
    """Corners (corner, 2) of each mesh of the compiled model, in its feature's frame, object after
    object.
    """
    model = mujoco.compile_model(scene, timestep)
    turn, found = np.empty(9), []
    for geom in np.flatnonzero(model.geom_type == engine.mjtGeom.mjGEOM_MESH):
        mesh = model.geom_dataid[geom]
        start = model.mesh_vertadr[mesh]
        corners = model.mesh_vert[start : start + model.mesh_vertnum[mesh]].astype(float)
        engine.mju_quat2Mat(turn, model.geom_quat[geom])
        world = corners @ turn.reshape(3, 3).T + model.geom_pos[geom]
        x, y = scene.objects[model.geom_bodyid[geom] - scene.antenna.n_segments - 1].forward
        found.append(world[:, :2] @ np.array([[x, -y], [y, x]]))
    return found
