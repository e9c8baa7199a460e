"""A scene as MuJoCo's MjSpec. The only module that writes one.

Everything is in g, mm, ms, so each MuJoCo default that assumes SI is set on purpose: timestep
(default 2 µs here), gravity (1000 g), solref (20 µs) and solver tolerance. The planar chain lies in
z = 0; every hinge turns about −z, so that an angle is positive from +y towards +x. Objects and a
moving base are bodies so heavy that the antenna cannot slow them.
"""

from collections.abc import Iterator

import mujoco
import numpy as np

from feeler.physics.contact import MIN_FRICTION
from feeler.physics.scene import Scene
from feeler.stimulus.base import lift
from feeler.stimulus.object import Object

# g; so heavy that the antenna cannot slow it, yet its velocity is real to the contact solver
HEAVY = 1e9
# g; of a moving base, which carries the antenna: beside it the antenna's mass is rounded away
ROOTED = 1e15
_SOLVER_ITERATIONS = (
    25  # with tolerance 0: MuJoCo's default tolerance (1e-8) leaves errors of 1e-3 rad
)
# mm; half thickness of prisms across the plane; any value beyond the collision radius is the same
_DEPTH = 5.0


def make_spec(scene: Scene, timestep: float, *, moving: bool = False) -> mujoco.MjSpec:
    """The scene as an MjSpec: bodies at the hinges, a capsule per segment, each object on two
    slides and a hinge.

    Contact softness is the scene's and must not depend on the timestep: MuJoCo would silently raise
    ``solref[0]`` to two timesteps, so a larger timestep is refused. A ``moving`` base hangs on two
    slides and a hinge as well.

    Raises
    ------
    InvalidInput
        The timestep is larger than half the contact time constant.
    """
    scene.contact.check_timestep(timestep)
    spec = mujoco.MjSpec()
    spec.modelname = f"feeler {scene.antenna.name} (units: g, mm, ms)"
    spec.compiler.degree = False
    _set_options(spec.option, scene, timestep)
    if scene.antenna.spatial:
        from feeler.physics.spec_space import add_in_space

        add_in_space(spec, scene)
        return spec
    _add_antenna(spec, scene, moving)
    for o, item in enumerate(scene.objects):
        _add_object(spec, scene, o, item)
    return spec


def _set_options(option: mujoco.MjOption, scene: Scene, timestep: float) -> None:
    option.timestep = timestep
    option.gravity = lift(scene.gravity)
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER  # implicit in joint damping
    option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL  # [P]
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE  # a serial chain has no sparsity to use
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations = _SOLVER_ITERATIONS
    option.tolerance = 0.0
    option.ccd_tolerance = 1e-12
    option.disableflags = (
        mujoco.mjtDisableBit.mjDSBL_AUTORESET
        | mujoco.mjtDisableBit.mjDSBL_MULTICCD
        | mujoco.mjtDisableBit.mjDSBL_ISLAND
    )


def _add_antenna(spec: mujoco.MjSpec, scene: Scene, moving: bool) -> None:
    antenna, parent = scene.antenna, spec.worldbody
    soft = scene.contact.soften(antenna)
    width = soft.widen(*scene.contact.widen(scene.speed))
    (x, y, heading), first = scene.base_pose, [0.0, 0.0, 0.0]
    if moving:
        parent = parent.add_body(name="base", pos=[x, y, 0.0])
        _add_planar_joints(parent, "base", ROOTED)
    else:
        first = [x, y, 0.0]
    for n, length in enumerate(antenna.segment_length):
        body = parent.add_body(
            name=f"segment{n + 1}",
            pos=first if n == 0 else [0, antenna.segment_length[n - 1], 0],
        )
        if n == 0:
            body.quat = [np.cos(heading / 2), 0, 0, -np.sin(heading / 2)]
        body.add_joint(
            name=f"hinge{n + 1}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, -1],
            stiffness=[
                antenna.stiffness[n],
                0.0,
                0.0,
            ],  # MuJoCo takes a polynomial; only the linear term is used
            damping=[antenna.damping[n], 0.0, 0.0],
            springref=antenna.rest_angle[n],
        )
        mass = antenna.segment_mass[n]
        rod = mass * length**2 / 12
        body.explicitinertial = True
        body.mass, body.ipos = mass, [0, length / 2, 0]
        body.inertia = [rod, min(mass * antenna.radius[n] ** 2 / 2, rod), rod]
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0, 0, 0, 0, length, 0],
            size=[antenna.radius[n], 0, 0],
            contype=1,
            conaffinity=0,
            rgba=[0.45, 0.25, 0.1, 1],
            solmix=1.0,
            **soften(scene, 0.0, soft.d_max[n], width[n]),
        )
        parent = body


def _add_planar_joints(body: mujoco.MjsBody, name: str, mass: float) -> None:
    """Two slides and a hinge, and a mass that nothing here can slow."""
    for axis, direction in (("x", [1, 0, 0]), ("y", [0, 1, 0])):
        body.add_joint(name=f"{name}_{axis}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    body.add_joint(name=f"{name}_turn", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, -1])
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, [0, 0, 0], [mass] * 3
    body.gravcomp = 1.0


def soften(
    scene: Scene, friction: float, d_max: float = 0.95, width: float = 0.05
) -> dict[str, object]:
    """A pair of geoms takes the larger friction and dimension of its two, the object's, and of
    ``solimp`` the one that has a ``solmix``: the antenna's.
    """
    low, _, _, midpoint, power = scene.contact.solimp
    return {
        "condim": 3 if friction > 0 else 1,
        "friction": [
            max(friction, MIN_FRICTION),
            0.005,
            0.0001,
        ],  # torsion and rolling are unused
        "solref": list(scene.contact.solref),
        "solimp": [low, d_max, width, midpoint, power],
    }


def _add_object(spec: mujoco.MjSpec, scene: Scene, o: int, item: Object) -> None:
    body = spec.worldbody.add_body(name=f"object{o + 1}", pos=[*item.place, 0.0])
    _add_planar_joints(body, f"object{o + 1}", HEAVY)
    for shape in _list_geoms(spec, o, item):
        body.add_geom(
            contype=0,
            conaffinity=1,
            rgba=[0.2, 0.5, 0.3, 1],
            solmix=0.0,
            **soften(scene, item.friction),
            **shape,
        )


def _list_geoms(spec: mujoco.MjSpec, o: int, item: Object) -> Iterator[dict[str, object]]:
    """Geom fields of the feature's convex parts, turned into the world's axes; rounding is the
    geom's margin.
    """
    feature, forward = item.feature, np.asarray(item.forward)
    turn = np.stack([forward, [-forward[1], forward[0]]])  # rows: the frame's axes in the world
    half = np.arctan2(forward[1], forward[0]) / 2
    quat = [np.cos(half), 0, 0, np.sin(half)]
    for number, part in enumerate(feature.parts):
        middle, size = (part.min(axis=0) + part.max(axis=0)) / 2, np.ptp(part, axis=0) / 2
        if len(part) == 1:
            yield {
                "type": mujoco.mjtGeom.mjGEOM_SPHERE,
                "size": [feature.rounding, 0, 0],
                "pos": [*(part[0] @ turn), 0],
            }
        elif len(part) == 4 and all(np.unique(part[:, axis]).size == 2 for axis in (0, 1)):
            place = {"pos": [*(middle @ turn), 0], "quat": quat, "margin": feature.rounding}
            yield {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [*size, _DEPTH], **place}
        elif len(part) == 2:
            ends = [*(part[0] @ turn), 0.0, *(part[1] @ turn), 0.0]
            yield {
                "type": mujoco.mjtGeom.mjGEOM_CAPSULE,
                "size": [feature.rounding, 0, 0],
                "fromto": ends,
            }
        else:
            mesh = _add_prism(spec, f"object{o + 1}part{number}", part @ turn)
            yield {
                "type": mujoco.mjtGeom.mjGEOM_MESH,
                "meshname": mesh,
                "margin": feature.rounding,
            }


def _add_prism(spec: mujoco.MjSpec, name: str, corners: np.ndarray) -> str:
    points = [[x, y, z] for z in (-_DEPTH, _DEPTH) for x, y in corners]
    mesh = spec.add_mesh(name=name)
    mesh.uservert = np.ravel(points)
    return name


def compile_model(scene: Scene, timestep: float, *, moving: bool = False) -> mujoco.MjModel:
    """The compiled model; meshes are recentred by MuJoCo and placed back by their geom's frame."""
    return make_spec(scene, timestep, moving=moving).compile()
