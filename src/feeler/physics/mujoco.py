"""The reference engine: MuJoCo. The only module that writes an MjSpec.

Everything is in g, mm, ms, so each MuJoCo default that assumes SI is set on purpose: timestep (default 2 µs here), gravity
(1000 g), solref (20 µs) and solver tolerance. The planar chain lies in z = 0; every hinge turns about −z, so that an angle
is positive from +y towards +x.
"""

from collections.abc import Iterator

import mujoco
import numpy as np

from feeler.errors import SimulationDiverged
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion, Scene

OBJECT_MASS = 1e9  # g; so heavy that the antenna cannot slow it, yet its velocity is real to the contact solver
SOLVER_ITERATIONS = 25  # with tolerance 0: MuJoCo's default tolerance (1e-8) leaves errors of 1e-3 rad
DEPTH = (
    5.0  # mm; half thickness of prisms and boxes across the plane; any value beyond the collision radius is the same
)
WALL = 1e3  # mm; half extent of the box that stands for a wall


def make_spec(scene: Scene, timestep: float) -> mujoco.MjSpec:
    """The scene as an MjSpec: bodies at the hinges, a capsule per segment, the object on two slide joints.

    Contact softness is the scene's and must not depend on the timestep: MuJoCo would silently raise ``solref[0]`` to two
    timesteps, so a larger timestep is refused.

    Raises
    ------
    InvalidInput
        The timestep is larger than half the contact time constant.
    """
    scene.contact.check_timestep(timestep)
    spec = mujoco.MjSpec()
    spec.modelname = f"feeler {scene.antenna.name} (units: g, mm, ms)"
    spec.compiler.degree = False
    _set_options(spec.option, timestep)
    _add_antenna(spec, scene)
    if scene.feature is not None:
        _add_object(spec, scene)
    return spec


def _set_options(option: mujoco.MjOption, timestep: float) -> None:
    option.timestep = timestep
    option.gravity = [0.0, 0.0, 0.0]  # [D] tests of this scale run without gravity
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER  # implicit in joint damping
    option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL  # [P]
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE  # a serial chain has no sparsity to use
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations = SOLVER_ITERATIONS
    option.tolerance = 0.0
    option.ccd_tolerance = 1e-12
    option.disableflags = (
        mujoco.mjtDisableBit.mjDSBL_AUTORESET
        | mujoco.mjtDisableBit.mjDSBL_MULTICCD
        | mujoco.mjtDisableBit.mjDSBL_ISLAND
    )


def _add_antenna(spec: mujoco.MjSpec, scene: Scene) -> None:
    antenna, parent = scene.antenna, spec.worldbody
    half = scene.base_angle / 2
    for n, length in enumerate(antenna.segment_length):
        body = parent.add_body(name=f"segment{n + 1}", pos=[0, 0 if n == 0 else antenna.segment_length[n - 1], 0])
        if n == 0:
            body.quat = [np.cos(half), 0, 0, -np.sin(half)]
        body.add_joint(
            name=f"hinge{n + 1}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, -1],
            stiffness=_coefficient(body, antenna.stiffness[n]),
            damping=_coefficient(body, antenna.damping[n]),
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
            **_softness(scene),
        )
        parent = body


def _coefficient(body: mujoco.MjsBody, value: float) -> object:
    """MuJoCo's joints take a polynomial of stiffness and damping; only the linear term is used."""
    return [value, 0.0, 0.0]


def _softness(scene: Scene) -> dict[str, object]:
    return {
        "condim": 3,
        "friction": [
            max(scene.friction, 1e-5),
            0.005,
            0.0001,
        ],  # MuJoCo's smallest friction; torsion and rolling unused
        "solref": list(scene.contact.solref),
        "solimp": list(scene.contact.solimp),
        "margin": 0.0,
    }


def _add_object(spec: mujoco.MjSpec, scene: Scene) -> None:
    body = spec.worldbody.add_body(name="object", pos=[*scene.origin, 0.0])
    for name, axis in (("x", [1, 0, 0]), ("y", [0, 1, 0])):
        body.add_joint(name=f"object_{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    body.explicitinertial = True
    body.mass, body.inertia = OBJECT_MASS, [OBJECT_MASS] * 3
    for shape in _shapes(spec, scene):
        body.add_geom(contype=0, conaffinity=1, rgba=[0.2, 0.5, 0.3, 1], **_softness(scene), **shape)


def _shapes(spec: mujoco.MjSpec, scene: Scene) -> Iterator[dict[str, object]]:
    """Geom fields of the feature, turned into the world's axes."""
    feature = scene.feature
    forward = np.asarray(scene.forward)
    turn = np.stack([forward, [-forward[1], forward[0]]])  # rows: the frame's axes in the world
    half = np.arctan2(forward[1], forward[0]) / 2
    quat = [np.cos(half), 0, 0, np.sin(half)]
    if feature.kind == "ball":
        yield {
            "type": mujoco.mjtGeom.mjGEOM_SPHERE,
            "size": [feature.radius, 0, 0],
            "pos": [*(feature.parts[0][0] @ turn), 0],
        }
    elif feature.kind in ("box", "wall"):
        height, width = (WALL, WALL) if feature.kind == "wall" else (feature.half_height, feature.half_width)
        size = [height, width, DEPTH]
        yield {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": size, "pos": [*(-height * forward), 0], "quat": quat}
    else:
        for number, part in enumerate(feature.parts):
            yield {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": _add_prism(spec, f"part{number}", part @ turn)}


def _add_prism(spec: mujoco.MjSpec, name: str, corners: np.ndarray) -> str:
    points = [[x, y, z] for z in (-DEPTH, DEPTH) for x, y in corners]
    mesh = spec.add_mesh(name=name)
    mesh.uservert = np.ravel(points)
    return name


def compile_model(scene: Scene, timestep: float) -> mujoco.MjModel:
    """The compiled model; meshes are recentred by MuJoCo and placed back by their geom's frame."""
    return make_spec(scene, timestep).compile()


def run(scene: Scene, clock: Clock) -> Motion:
    """Simulate one scene.

    Returns
    -------
    Motion
        Angles, velocities and the contact force on the antenna at each sample.

    Raises
    ------
    SimulationDiverged
        Angles left the finite numbers; names the scene and the time.
    """
    model = compile_model(scene, clock.timestep)
    data = mujoco.MjData(model)
    n = scene.antenna.n_segments
    data.qpos[:n], data.qvel[:n] = scene.initial_angle, scene.initial_velocity
    angle, velocity, force = (
        np.empty((clock.n_samples, n)),
        np.empty((clock.n_samples, n)),
        np.zeros((clock.n_samples, 2)),
    )
    for k in range(clock.n_samples):
        if k:
            _advance(model, data, scene, clock, k)
        angle[k], velocity[k] = data.qpos[:n], data.qvel[:n]
        if scene.feature is not None and k:
            force[k] = -data.qfrc_constraint[n : n + 2]
        if not np.isfinite(angle[k]).all():
            raise SimulationDiverged(scene.label, clock.time[k], angle[max(k - 1, 0)], velocity[max(k - 1, 0)])
    return Motion(time=clock.time, angle=angle, velocity=velocity, force=force)


def _advance(model: mujoco.MjModel, data: mujoco.MjData, scene: Scene, clock: Clock, k: int) -> None:
    """Step from sample k − 1 to sample k, changing the object's velocity where a leg of its path ends."""
    step, last = (k - 1) * clock.steps_per_sample, k * clock.steps_per_sample
    n = scene.antenna.n_segments
    ends = [round(end / clock.timestep) for end in scene.path.end]
    while step < last:
        leg = sum(end <= step for end in ends)
        stop = min([last, *(end for end in ends if end > step)])
        if scene.feature is not None:
            data.qvel[n : n + 2] = scene.path.velocity[leg]
        mujoco.mj_step(model, data, nstep=stop - step)
        step = stop
