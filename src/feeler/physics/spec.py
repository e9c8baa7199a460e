"""A scene as MuJoCo's MjSpec or MJCF, to simulate, to view or to control."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from feeler.antenna.segments import Antenna, Follicle
from feeler.errors import InvalidInput, MissingDependencyError
from feeler.files import writing
from feeler.objects.bodies import Object
from feeler.objects.meshes import is_box, list_solids
from feeler.objects.motion import lift
from feeler.objects.trials import Trial
from feeler.physics.contact import MIN_FRICTION, Contact, get_contact
from feeler.physics.engine import ENGINES, choose_timestep
from feeler.physics.scene import Scene, make_scene

try:
    import mujoco
except ImportError as error:
    words = "the MuJoCo engine and MJCF files need mujoco: pip install 'feeler[mujoco]'."
    raise MissingDependencyError(words) from error

# A scene as MuJoCo's MjSpec. The only module that writes one.
#
# Everything is in g, mm, ms, so each MuJoCo default that assumes SI is set on purpose: timestep
# (default 2 µs here), gravity (1000 g), solref (20 µs) and solver tolerance. The planar chain
# lies in z = 0; every hinge turns about −z, so that an angle is positive from +y towards +x.
# Objects and a moving base are bodies so heavy that the antenna cannot slow them.

# g; so heavy that the antenna cannot slow it, yet its velocity is real to the contact solver
HEAVY = 1e9
# g; of a moving base, which carries the antenna: beside it the antenna's mass is rounded away
ROOTED = 1e15
_SOLVER_ITERATIONS = (
    25  # with tolerance 0: MuJoCo's default tolerance (1e-8) leaves errors of 1e-3 rad
)
# mm; half thickness of prisms across the plane; any value beyond the collision radius is the same
_DEPTH = 5.0


_AXES = ([0, 0, -1], [1, 0, 0], [0, 1, 0])
"""What the hinges of each plane turn about, in the segment's frame."""


def _make_spec(scene: Scene, timestep: float, *, moving: bool = False) -> mujoco.MjSpec:
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
    spatial = scene.antenna.spatial
    parent, place = spec.worldbody, lift(scene.base_pose[: 3 if spatial else 2].tolist())
    if spatial or moving:  # in space its ball turns it
        parent, place = parent.add_body(name="base", pos=place), (0.0, 0.0, 0.0)
        _add_joints(parent, "base", ROOTED, spatial=spatial)
    _add_segments(parent, scene, [*place])
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


def _add_segments(parent: mujoco.MjsBody, scene: Scene, first: list[float]) -> None:
    """The antenna on a parent, its first hinge at ``first``."""
    antenna, spatial, heading = scene.antenna, scene.antenna.spatial, scene.base_pose[2]
    soft = scene.contact.soften(antenna)
    width = soft.widen(*scene.contact.widen(scene.speed))
    across, centre = antenna.inertia, antenna.mass_centre
    thick = np.minimum(antenna.segment_mass * antenna.radius**2 / 2, across)
    axial = antenna.axial if spatial else thick
    for n, length in enumerate(antenna.segment_length):
        body = parent.add_body(
            name=f"segment{n + 1}",
            pos=first if n == 0 else [0, antenna.segment_length[n - 1], 0],
        )
        if n == 0 and antenna.follicle is not None:
            _add_follicle(body, antenna.follicle)
        if n == 0 and not spatial:
            body.quat = [np.cos(heading / 2), 0, 0, -np.sin(heading / 2)]
        for k, plane in enumerate(antenna.planes if spatial else ("",)):
            hinge = (k, n) if spatial else n
            body.add_joint(
                name=f"hinge{n + 1}{plane}",
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=_AXES[k],
                # MuJoCo takes a polynomial; only the linear term is used
                stiffness=[antenna.stiffness[hinge], 0.0, 0.0],
                damping=[antenna.damping[hinge], 0.0, 0.0],
                springref=antenna.rest_angle[hinge],
            )
        body.explicitinertial = True
        body.mass, body.ipos = antenna.segment_mass[n], [0, centre[n], 0]
        body.inertia = [across[n], axial[n], across[n]]
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


def _add_joints(body: mujoco.MjsBody, name: str, mass: float, *, spatial: bool) -> None:
    """Two slides and a hinge, in space three and a ball, and a mass that nothing here can slow."""
    for axis, direction in zip("xyz" if spatial else "xy", np.eye(3), strict=False):
        body.add_joint(name=f"{name}_{axis}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    if spatial:
        body.add_joint(name=f"{name}_turn", type=mujoco.mjtJoint.mjJNT_BALL)
    else:
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
    """An object on its joints; one in the plane is a prism. A wall without end in space is a plane
    of the world, which MuJoCo does not let move: the engine moves it.
    """
    spatial, unbounded = scene.antenna.spatial, item.feature.unbounded
    body = spec.worldbody.add_body(name=f"object{o + 1}", pos=lift(item.place))
    _add_joints(body, f"object{o + 1}", HEAVY, spatial=spatial)
    shared = {"contype": 0, "conaffinity": 1, "rgba": [0.2, 0.5, 0.3, 1], "solmix": 0.0}
    shared |= soften(scene, item.friction)
    if spatial and unbounded:
        axes = np.column_stack([item.axes[1], item.axes[2], item.axes[0]])  # its planes face z
        plane = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "size": [0, 0, 1], "pos": item.place}
        spec.worldbody.add_geom(
            name=f"wall{o + 1}", quat=_read_quaternion(axes), **plane, **shared
        )
        return
    for number, corners in enumerate(
        list_solids(item.feature) if spatial else map(_extrude, item.feature.parts)
    ):
        name = f"object{o + 1}part{number}"
        body.add_geom(**_describe_solid(spec, name, corners, item, spatial), **shared)


def _extrude(part: np.ndarray) -> np.ndarray:
    """Corners (corner, 3) of a convex part of the plane; what has faces is a prism."""
    sides = (0.0,) if len(part) < 3 else (-_DEPTH, _DEPTH)
    return np.concatenate([np.insert(part, 2, side, axis=1) for side in sides])


def _describe_solid(
    spec: mujoco.MjSpec, name: str, corners: np.ndarray, item: Object, spatial: bool
) -> dict[str, object]:
    """Geom fields of a convex solid; the rounding of what has faces is the geom's margin. MuJoCo
    recentres meshes, and their geom's frame places them back.
    """
    rounding, axes = item.feature.rounding, item.axes
    world = corners @ axes
    if len(corners) == 1:
        return {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [rounding, 0, 0], "pos": world[0]}
    if len(corners) == 2:
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        return {"type": kind, "size": [rounding, 0, 0], "fromto": world.ravel()}
    half = np.arctan2(axes[0, 1], axes[0, 0]) / 2
    turned = _read_quaternion(axes.T) if spatial else [np.cos(half), 0, 0, np.sin(half)]
    if is_box(corners):
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2 @ axes
        place = {"pos": middle, "quat": turned, "size": np.ptp(corners, axis=0) / 2}
        return {"type": mujoco.mjtGeom.mjGEOM_BOX, "margin": rounding, **place}
    mesh = spec.add_mesh(name=name)
    mesh.uservert = (corners if spatial else world).ravel()
    place = {"quat": turned} if spatial else {}
    return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name, "margin": rounding, **place}


def compile_model(scene: Scene, timestep: float, *, moving: bool = False) -> mujoco.MjModel:
    """The compiled model; meshes are recentred by MuJoCo and placed back by their geom's frame."""
    return _make_spec(scene, timestep, moving=moving).compile()


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


def _read_quaternion(matrix: np.ndarray) -> np.ndarray:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, matrix.ravel())
    return found


# What makes a model one to control: servos at its base, sensors, objects that are put.

SERVOS = ("base_x", "base_y", "base_turn")
_STIFF = 2 * np.pi * 0.05  # [C] rad/ms; the base follows its command like a servo of 50 Hz


def _add_control(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Servos at the base, sensors at the sensors, objects that are put where one wants them."""
    for name in SERVOS:
        _add_servo(spec, name, float(spec.body("base").mass))
    for hinge in map(int, scene.antenna.sensors):
        _add_sensors(spec, scene.antenna, hinge)
    for number in range(1, len(scene.objects) + 1):
        body = spec.body(f"object{number}")
        for joint in list(body.joints):
            spec.delete(joint)
        body.mocap = True


def _add_servo(spec: mujoco.MjSpec, joint: str, inertia: float) -> mujoco.MjsActuator:
    """A critically damped position servo of what moves with this mass [g] or inertia [g·mm²]."""
    servo = spec.add_actuator(
        name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT, gear=[1, 0, 0, 0, 0, 0]
    )
    servo.set_to_position(kp=inertia * _STIFF**2, kv=2 * inertia * _STIFF)
    return servo


def _add_sensors(spec: mujoco.MjSpec, antenna: Antenna, hinge: int) -> None:
    """Angle and velocity of a hinge, in space of each plane, and touch on the segment beyond
    it.
    """
    for plane in antenna.planes if antenna.spatial else ("",):
        joint = {"objtype": mujoco.mjtObj.mjOBJ_JOINT, "objname": f"hinge{hinge}{plane}"}
        spec.add_sensor(
            name=f"angle{hinge}{plane}", type=mujoco.mjtSensor.mjSENS_JOINTPOS, **joint
        )
        spec.add_sensor(
            name=f"velocity{hinge}{plane}", type=mujoco.mjtSensor.mjSENS_JOINTVEL, **joint
        )
    length, radius = antenna.segment_length[hinge - 1], antenna.radius[hinge - 1]
    spec.body(f"segment{hinge}").add_site(
        name=f"skin{hinge}",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, 0, 0, length, 0],
        size=[2 * radius, 0, 0],  # wider than the segment: contacts lie on its surface
        rgba=[0, 0, 0, 0],
    )
    _add_site_sensor(spec, f"touch{hinge}", mujoco.mjtSensor.mjSENS_TOUCH, f"skin{hinge}")


def _add_site_sensor(spec: mujoco.MjSpec, name: str, kind: mujoco.mjtSensor, site: str) -> None:
    spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=site)


# The antenna alone, as a body to attach to a robot's model.

# kg·m²; MuJoCo refuses bodies of less than 1e-15
_LEAST_INERTIA = 1.01e-15
# of a geom's softness, beside which the softness of what the parent has counts for nothing
_OWN_SOFTNESS = 1e6


def _make_body(
    antenna: Antenna,
    *,
    units: str = "si",
    servo: bool = False,
    speed: float = 0.0,
    contact: Contact | None = None,
) -> mujoco.MjSpec:
    """The antenna alone as an MjSpec without options, to be attached to a robot's model.

    It points along +y of what it is attached to and, in the plane, bends about −z. Sensors:
    ``base_force`` and ``base_torque`` of the mount on the antenna, in the mount's axes; per
    sensor ``angle``, ``velocity`` and ``touch``. It
    collides with geoms that have MuJoCo's default ``contype`` and ``conaffinity``, with its own
    softness and the other's friction, and with no other antenna.

    Parameters
    ----------
    antenna
        In the plane or in space.
    units
        ``si`` (kg, m, s) or ``mm`` (g, mm, ms).
    servo
        A hinge ``base_turn`` at the base and a critically damped position servo of 50 Hz [C], on
        a hub that weighs as much as the antenna [C]. The first segment then touches nothing, as
        MuJoCo would have it collide with the body that carries the hub.
    speed
        The greatest speed at which it will be touched [mm/ms], see ``feeler.physics.contact``.
    contact
        Softness; default: feeler's own for this antenna.

    Raises
    ------
    InvalidInput
        Unknown units, or a servo of an antenna in space.

    Notes
    -----
    MuJoCo refuses moments of inertia below 1e-15 kg·m². In SI smaller ones (of the thinnest
    segments of an insect's antenna) are raised to that; :func:`count_raised` says how many.
    """
    if units not in UNITS:
        raise InvalidInput(f"units must be one of {', '.join(UNITS)}, got {units!r}.")
    if servo and antenna.spatial:
        raise InvalidInput("servo=True is for antennas that bend in one plane.")
    contact = contact or get_contact(None, antenna)
    scene = Scene(antenna=antenna, contact=replace(contact, speed=max(speed, contact.speed)))
    spec = mujoco.MjSpec()
    spec.modelname = f"{antenna.name}"
    spec.compiler.degree = False
    base = spec.worldbody.add_body(name="base")
    base.add_site(name="base", size=[antenna.radius[0]] * 3)
    if servo:
        _add_hub(spec, base, antenna)
    _add_segments(base, scene, [0.0, 0.0, 0.0])
    for geom in spec.geoms:
        geom.solmix = _OWN_SOFTNESS
    if servo:
        spec.body("segment1").first_geom().contype = 0
    for hinge in map(int, antenna.sensors):
        _add_sensors(spec, antenna, hinge)
    _add_site_sensor(spec, "base_force", mujoco.mjtSensor.mjSENS_FORCE, "base")
    _add_site_sensor(spec, "base_torque", mujoco.mjtSensor.mjSENS_TORQUE, "base")
    if units == "si":
        _convert_to_si(spec)
    return spec


def _add_hub(spec: mujoco.MjSpec, base: mujoco.MjsBody, antenna: Antenna) -> None:
    middle = antenna.hinge_position + antenna.segment_length / 2
    inertia = float(antenna.segment_mass @ middle**2)
    hinge = base.add_joint(name="base_turn", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, -1])
    base.explicitinertial = True
    base.mass, base.ipos, base.inertia = antenna.segment_mass.sum(), [0, 0, 0], [inertia] * 3
    servo = _add_servo(spec, "base_turn", 2 * inertia)
    # a joint's damping is implicit and stands any timestep, a servo's is not
    hinge.damping, servo.biasprm[2] = [-servo.biasprm[2], 0, 0], 0.0
    servo.ctrllimited, servo.ctrlrange = True, [-np.pi / 2, np.pi / 2]


def count_raised(antenna: Antenna) -> int:
    """How many segments have a moment of inertia that MuJoCo does not take in SI."""
    bodies = [body for body in _make_body(antenna).bodies if body.name.startswith("segment")]
    return sum(bool(np.min(body.inertia) <= _LEAST_INERTIA) for body in bodies)


UNITS = ("si", "mm")
_SI = 1e-3  # g, mm, ms in kg, m, s


def _convert_to_si(spec: mujoco.MjSpec) -> None:
    """Everything in a spec of g, mm, ms in kg, m, s instead, but for its options."""
    for body in spec.bodies:
        body.pos = body.pos * _SI
        if body.explicitinertial:
            body.mass, body.ipos = body.mass * _SI, body.ipos * _SI
            body.inertia = np.maximum(body.inertia * _SI**3, _LEAST_INERTIA)
    for joint in spec.joints:
        slides = joint.type == mujoco.mjtJoint.mjJNT_SLIDE
        joint.stiffness = joint.stiffness * (1 / _SI if slides else _SI)
        joint.damping = joint.damping * (1.0 if slides else _SI**2)
    for geom in spec.geoms:
        geom.pos, geom.size, geom.fromto = geom.pos * _SI, geom.size * _SI, geom.fromto * _SI
        geom.margin *= _SI
        geom.solref = [geom.solref[0] * _SI, geom.solref[1]]
        low, high, width, *shape = geom.solimp
        geom.solimp = [low, high, width * _SI, *shape]
    for site in spec.sites:
        site.pos, site.size, site.fromto = site.pos * _SI, site.size * _SI, site.fromto * _SI
    for mesh in spec.meshes:
        mesh.uservert = np.asarray(mesh.uservert) * _SI
    slides = {j.name for j in spec.joints if j.type == mujoco.mjtJoint.mjJNT_SLIDE}
    for servo in spec.actuators:  # the gains are a stiffness and a damping
        loads = (1 / _SI, 1.0) if servo.target in slides else (_SI, _SI**2)
        servo.gainprm = servo.gainprm * loads[0]
        servo.biasprm[1:3] = servo.biasprm[1:3] * loads
    spec.stat.extent *= _SI
    spec.stat.center = np.asarray(spec.stat.center) * _SI


def write_body(antenna: Antenna, path: Path, **options: Any) -> Path:
    """Write :func:`_make_body`'s antenna as MJCF; ``options`` are its own."""
    spec = _make_body(antenna, **options)
    units = "kg, m, s" if options.get("units", "si") == "si" else "g, mm, ms"
    spec.comment = (
        f"feeler antenna {antenna.name!r} in {units}. Attach it at a site: it points along the"
        f" site's +y. feeler's numbers need {describe_options(antenna, **options)} in the model it"
        " is attached to."
    )
    spec.compile()
    return _write(spec, Path(path))


def describe_options(antenna: Antenna, **options: Any) -> str:
    """The options that the parent of :func:`_make_body`'s antenna needs, as MJCF."""
    contact = options.get("contact") or get_contact(None, antenna)
    step = choose_timestep(None, "mujoco", contact)
    step *= _SI if options.get("units", "si") == "si" else 1.0
    return (
        f'<option timestep="{step:g}" integrator="Euler" cone="pyramidal" solver="Newton"'
        f' iterations="{_SOLVER_ITERATIONS}" tolerance="0"/>'
    )


def compare_body(antenna: Antenna, trial: Trial, units: str = "si") -> dict[str, float]:
    """How far hinge angles of the exported antenna come to lie from feeler's own in one touch
    [rad].

    Returns
    -------
    dict[str, float]
        ``peak``: greatest angle from rest; ``own``: greatest difference with the options of
        :func:`describe_options`; ``2 ms`` and so on: with MuJoCo's default options and this
        timestep, inf where that diverges.
    """
    scene = make_scene(antenna, trial)
    step = choose_timestep(None, "mujoco", scene.contact)
    ends = np.arange(1.0, trial.lead + antenna.length / 2 / max(scene.speed, 0.1))
    stepper, expected, before = ENGINES["chain"].make([scene], step), [], 0.0
    for end in ends:
        stepper.step(round(end / step) - round(before / step))
        expected.append(stepper.read().angle[0].T.ravel())
        before = end
    rest = scene.initial_angle.T.ravel()
    found = {"peak": float(np.abs(expected - rest).max())}
    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)  # else it writes a log into the current folder
    try:
        played = {"own": _play(scene, units, ends, step)}
        for step in _PARENT_STEPS:
            played[f"{step:g} ms"] = _play(scene, units, ends, step, own=False)
    finally:
        mujoco.set_mju_user_warning(handler)
    for name, angle in played.items():
        found[name] = float(
            np.nan_to_num(np.abs(angle - expected).max(), nan=np.inf, posinf=np.inf)
        )
    return found


_PARENT_STEPS = (2.0, 0.5, 0.1)  # ms; MuJoCo's default, and shorter ones [C]


def _play(
    scene: Scene, units: str, ends: np.ndarray, timestep: float, own: bool = True
) -> np.ndarray:
    """Angles (time, hinge) of the attached body, touched by the scene's objects."""
    parent, scale = mujoco.MjSpec(), _SI if units == "si" else 1.0
    parent.compiler.degree = False
    for o, item in enumerate(scene.objects):
        _add_object(parent, scene, o, item)
    if units == "si":
        _convert_to_si(parent)
    if own:
        _set_options(parent.option, scene, timestep)
    parent.option.timestep = scale * timestep
    parent.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    parent.option.gravity = [0.0, 0.0, 0.0]
    body = _make_body(scene.antenna, units=units, speed=scene.speed, contact=scene.contact)
    parent.attach(body, frame=parent.worldbody.add_frame(), prefix="antenna_")
    model = parent.compile()
    data, names = mujoco.MjData(model), [model.joint(k).name for k in range(model.njnt)]
    hinges = [k for k, name in enumerate(names) if name.startswith("antenna_")]
    place = model.jnt_qposadr[hinges]
    data.qpos[place] = scene.initial_angle.T.ravel()
    rates: dict[int, tuple[float, ...]] = {}
    for o, item in enumerate(scene.objects):
        velocity = (*item.velocity, *np.ravel(item.turn) / scale)
        rates |= {model.joint(f"object{o + 1}_x").dofadr[0]: velocity}
    rows = []
    for end in ends:
        while data.time < end * scale - 1e-9 * scale:
            for first, velocity in rates.items():
                data.qvel[first : first + len(velocity)] = velocity
            mujoco.mj_step(model, data)
        rows.append(data.qpos[place].copy())
        if any(warning.number for warning in data.warning):
            return np.full((len(ends), len(place)), np.inf)
    return np.array(rows)


# A scene as MJCF: for MuJoCo's own viewer, or for control of the antenna.


def write_mjcf(
    antenna: Antenna,
    trial: Trial,
    path: Path,
    timestep: float | None = None,
    *,
    control: bool = False,
    units: str = "mm",
) -> Path:
    """Write the trial's scene as MJCF; the keyframe ``start`` sets the object moving.

    Parameters
    ----------
    control
        A model to be controlled: the base hangs on three joints with position actuators, the
        objects are mocap bodies (they stand where ``mocap_pos`` puts them), and each sensor gives
        its hinge's angle and velocity and the force of touch on its segment.
    units
        ``mm`` (g, mm, ms) or ``si`` (kg, m, s).

    Raises
    ------
    InvalidInput
        ``control`` of an antenna that bends in space, or unknown units.
    """
    if units not in UNITS:
        raise InvalidInput(f"units must be one of {', '.join(UNITS)}, got {units!r}.")
    scene = make_scene(antenna, trial)
    if control and antenna.spatial:
        raise InvalidInput("control=True is for antennas that bend in one plane.")
    spec = _make_spec(scene, choose_timestep(timestep, "mujoco", scene.contact), moving=control)
    spec.stat.extent, spec.stat.center = antenna.length, [0.0, antenna.length / 2, 0.0]
    step = spec.option.timestep
    if control:
        _add_control(spec, scene)
    spec.comment = (
        "feeler scene in g, mm, ms (so N, N·mm, MPa): one second of the viewer's clock is one"
        " millisecond."
    )
    if units == "si":
        spec.comment = "feeler scene in kg, m, s."
        _convert_to_si(spec)
        spec.option.timestep *= _SI
        spec.option.gravity = spec.option.gravity / _SI
    model = spec.compile()
    key = spec.add_key(name="start")
    if antenna.spatial:
        start = ENGINES["mujoco"].make([scene], step)
        key.qpos, key.qvel = start.data.qpos.copy(), start.data.qvel.copy()  # type: ignore[attr-defined]
    elif control:
        key.qpos = [0.0] * len(SERVOS) + [*scene.initial_angle]
        key.ctrl = [0.0] * len(SERVOS)
    else:
        key.qpos = [*scene.initial_angle, 0.0, 0.0, 0.0]
        key.qvel = [*scene.initial_velocity, *scene.objects[0].velocity, scene.objects[0].turn]
    if units == "si":
        # lengths in m and angular velocities in rad/s; mm/ms are m/s
        place, rate = np.ones(model.nq), np.full(model.nv, 1 / _SI)
        slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        place[model.jnt_qposadr[slides]], rate[model.jnt_dofadr[slides]] = _SI, 1.0
        key.qpos = np.asarray(key.qpos) * place
        if len(key.qvel):
            key.qvel = np.asarray(key.qvel) * rate
    spec.compile()
    return _write(spec, Path(path))


def _write(spec: mujoco.MjSpec, path: Path) -> Path:
    with writing(path) as part:
        part.write_text(spec.to_xml())
    return path
