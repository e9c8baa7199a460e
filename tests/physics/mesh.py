"""The chain engine with a polygon's corners as MuJoCo holds them, so that both engines start from the same numbers."""

import mujoco as engine
import numpy as np

from feeler.physics import mujoco
from feeler.physics.chain.batch import Batch
from feeler.physics.chain.model import ChainModel, make_model
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion, Scene


def run_like_mujoco(scene: Scene, clock: Clock) -> Motion:
    """The chain's motion from the numbers that MuJoCo has."""
    return Batch([scene], [make_model_like_mujoco(scene, clock.timestep)], clock).run()[0]


def make_model_like_mujoco(scene: Scene, timestep: float) -> ChainModel:
    """The chain's model; MuJoCo stores the corners of a mesh in single precision, which moves them by up to 1e-7 mm."""
    model = make_model(scene, timestep)
    for part, corners in enumerate(read_corners(scene, timestep)):
        for k in range(model.part[part], model.part[part + 1]):
            near = np.argsort(np.hypot(*(corners - model.corners[k]).T))[:2]  # the prism's upper and lower corner
            stored = corners[near].mean(axis=0)
            assert np.abs(stored - model.corners[k]).max() < 1e-6
            model.corners[k] = stored
    return model


def read_corners(scene: Scene, timestep: float) -> list[np.ndarray]:
    """Corners (corner, 2) of each mesh of the compiled model, in the feature's frame."""
    model = mujoco.compile_model(scene, timestep)
    turn, found = np.empty(9), []
    x, y = scene.forward
    for geom in np.flatnonzero(model.geom_type == engine.mjtGeom.mjGEOM_MESH):
        mesh = model.geom_dataid[geom]
        start = model.mesh_vertadr[mesh]
        corners = model.mesh_vert[start : start + model.mesh_vertnum[mesh]].astype(float)
        engine.mju_quat2Mat(turn, model.geom_quat[geom])
        world = corners @ turn.reshape(3, 3).T + model.geom_pos[geom]
        found.append(world[:, :2] @ np.array([[x, -y], [y, x]]))
    return found
