"""Scenes in space as MuJoCo has them: one hinge for each plane, objects and base on slides and a
ball.

A wall without end is a plane of the world, which MuJoCo does not let move: the engine moves it.
"""

import mujoco
import numpy as np

from feeler.antenna.follicle import Follicle
from feeler.physics.contact import Softness
from feeler.physics.scene import Scene
from feeler.physics.spec import HEAVY, ROOTED, soften
from feeler.stimulus.object import Object
from feeler.stimulus.solid import is_box, list_solids

_AXES = ([0, 0, -1], [1, 0, 0], [0, 1, 0])
"""What the hinges of each plane turn about, in the segment's frame."""


def add_in_space(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Put the scene's base, antenna and objects into the spec."""
    antenna = scene.antenna
    base = spec.worldbody.add_body(name="base", pos=scene.base_pose[:3])  # its ball turns it
    _add_joints(base, "base", ROOTED)
    soft, parent = scene.contact.soften(antenna), base
    width = soft.widen(*scene.contact.widen(scene.speed))
    for n in range(antenna.n_segments):
        parent = _add_segment(parent, scene, n, soft, float(width[n]))
    for o, item in enumerate(scene.objects):
        _add_object(spec, scene, o, item)


def _add_segment(
    parent: mujoco.MjsBody, scene: Scene, n: int, soft: Softness, width: float
) -> mujoco.MjsBody:
    antenna = scene.antenna
    before = antenna.segment_length[n - 1] if n else 0.0
    length, centre = antenna.segment_length[n], antenna.mass_centre[n]
    body = parent.add_body(name=f"segment{n + 1}", pos=[0, before, 0])
    if n == 0 and antenna.follicle is not None:
        _add_follicle(body, antenna.follicle)
    for k, plane in enumerate(antenna.planes):
        body.add_joint(
            name=f"hinge{n + 1}{plane}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=_AXES[k],
            stiffness=[antenna.stiffness[k, n], 0.0, 0.0],
            damping=[antenna.damping[k, n], 0.0, 0.0],
            springref=antenna.rest_angle[k, n],
        )
    across = antenna.inertia[n]
    body.explicitinertial = True
    body.mass, body.ipos = antenna.segment_mass[n], [0, centre, 0]
    body.inertia = [across, antenna.axial[n], across]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, 0, 0, length, 0],
        size=[antenna.radius[n], 0, 0],
        contype=1,
        conaffinity=0,
        rgba=[0.45, 0.25, 0.1, 1],
        solmix=1.0,
        **soften(scene, 0.0, float(soft.d_max[n]), width),
    )
    return body


def _add_follicle(body: mujoco.MjsBody, follicle: Follicle) -> None:
    """Three slides along the base's axes."""
    for k, axis in enumerate("xyz"):
        body.add_joint(
            name=f"follicle_{axis}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=np.eye(3)[k],
            stiffness=[follicle.stiffness[k], 0.0, 0.0],
            damping=[follicle.damping[k], 0.0, 0.0],
        )


def _add_joints(body: mujoco.MjsBody, name: str, mass: float) -> None:
    """Three slides and a ball, and a mass that nothing here can slow."""
    for axis, direction in (("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1])):
        body.add_joint(name=f"{name}_{axis}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    body.add_joint(name=f"{name}_turn", type=mujoco.mjtJoint.mjJNT_BALL)
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, [0, 0, 0], [mass] * 3
    body.gravcomp = 1.0


def _add_object(spec: mujoco.MjSpec, scene: Scene, o: int, item: Object) -> None:
    axes = np.column_stack([item.axes[1], item.axes[2], item.axes[0]])  # MuJoCo's planes face z
    body = spec.worldbody.add_body(name=f"object{o + 1}", pos=item.place)
    _add_joints(body, f"object{o + 1}", HEAVY)
    shared = {"contype": 0, "conaffinity": 1, "rgba": [0.2, 0.5, 0.3, 1], "solmix": 0.0}
    shared |= soften(scene, item.friction)
    if item.feature.unbounded:
        plane = mujoco.mjtGeom.mjGEOM_PLANE
        spec.worldbody.add_geom(
            name=f"wall{o + 1}",
            type=plane,
            size=[0, 0, 1],
            pos=item.place,
            quat=_read_quaternion(axes),
            **shared,
        )
        return
    for number, corners in enumerate(list_solids(item.feature)):
        name = f"object{o + 1}part{number}"
        body.add_geom(**_describe_solid(spec, name, corners, item), **shared)


def _describe_solid(
    spec: mujoco.MjSpec, name: str, corners: np.ndarray, item: Object
) -> dict[str, object]:
    """Geom fields of a convex solid; the rounding of what has faces is the geom's margin."""
    rounding, world = item.feature.rounding, corners @ item.axes
    if len(corners) == 1:
        return {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [rounding, 0, 0], "pos": world[0]}
    if len(corners) == 2:
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        return {"type": kind, "size": [rounding, 0, 0], "fromto": world.ravel()}
    turned = _read_quaternion(item.axes.T)
    if is_box(corners):
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2 @ item.axes
        size = np.ptp(corners, axis=0) / 2
        place = {"pos": middle, "quat": turned, "margin": rounding}
        return {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": size, **place}
    mesh = spec.add_mesh(name=name)
    mesh.uservert = corners.ravel()
    place = {"quat": turned, "margin": rounding}
    return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name, **place}


def to_quaternion(vector: np.ndarray) -> np.ndarray:
    """MuJoCo's quaternion (4,) of a rotation vector [rad]."""
    size, found = float(np.linalg.norm(vector)), np.zeros(4)
    mujoco.mju_axisAngle2Quat(found, np.asarray(vector) / size if size else np.eye(3)[0], size)
    return found


def _read_quaternion(matrix: np.ndarray) -> np.ndarray:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, matrix.ravel())
    return found
