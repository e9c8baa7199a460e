"""The reference engine: MuJoCo. The only module that writes an MjSpec.

Everything is in g, mm, ms, so each MuJoCo default that assumes SI is set on purpose: timestep (default 2 µs here), gravity
(1000 g), solref (20 µs) and solver tolerance. The planar chain lies in z = 0; every hinge turns about −z, so that an angle
is positive from +y towards +x. Objects and a moving base are bodies so heavy that the antenna cannot slow them.
"""

from collections.abc import Iterator, Mapping, Sequence
from copy import copy

import mujoco
import numpy as np

from feeler.errors import InvalidInput
from feeler.physics.engine import Engine
from feeler.physics.reaction import compute_reaction
from feeler.physics.scene import Scene
from feeler.physics.stepper import Contacts, State, Stepper
from feeler.stimulus.object import Object

HEAVY = 1e9  # g; so heavy that the antenna cannot slow it, yet its velocity is real to the contact solver
ROOTED = 1e15  # g; of a moving base, which carries the antenna: beside it the antenna's mass is rounded away
SOLVER_ITERATIONS = 25  # with tolerance 0: MuJoCo's default tolerance (1e-8) leaves errors of 1e-3 rad
DEPTH = 5.0  # mm; half thickness of prisms across the plane; any value beyond the collision radius is the same
MIN_FRICTION = 1e-5  # MuJoCo's smallest; without any, contacts have a normal force only (condim 1)


def make_spec(scene: Scene, timestep: float, *, moving: bool = False) -> mujoco.MjSpec:
    """The scene as an MjSpec: bodies at the hinges, a capsule per segment, each object on two slides and a hinge.

    Contact softness is the scene's and must not depend on the timestep: MuJoCo would silently raise ``solref[0]`` to two
    timesteps, so a larger timestep is refused. A ``moving`` base hangs on two slides and a hinge as well.

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
    _add_antenna(spec, scene, moving)
    for o, item in enumerate(scene.objects):
        _add_object(spec, scene, o, item)
    return spec


def _set_options(option: mujoco.MjOption, scene: Scene, timestep: float) -> None:
    option.timestep = timestep
    option.gravity = [*scene.gravity, 0.0]
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


def _add_antenna(spec: mujoco.MjSpec, scene: Scene, moving: bool) -> None:
    antenna, parent = scene.antenna, spec.worldbody
    (x, y, heading), first = scene.base_pose, [0.0, 0.0, 0.0]
    if moving:
        parent = parent.add_body(name="base", pos=[x, y, 0.0])
        _add_planar_joints(parent, "base", ROOTED)
    else:
        first = [x, y, 0.0]
    for n, length in enumerate(antenna.segment_length):
        body = parent.add_body(name=f"segment{n + 1}", pos=first if n == 0 else [0, antenna.segment_length[n - 1], 0])
        if n == 0:
            body.quat = [np.cos(heading / 2), 0, 0, -np.sin(heading / 2)]
        body.add_joint(
            name=f"hinge{n + 1}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, -1],
            stiffness=[antenna.stiffness[n], 0.0, 0.0],  # MuJoCo takes a polynomial; only the linear term is used
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
            **_softness(scene, 0.0),
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


def _softness(scene: Scene, friction: float) -> dict[str, object]:
    """A pair of geoms takes the larger friction and dimension of its two: the object's."""
    return {
        "condim": 3 if friction > 0 else 1,
        "friction": [max(friction, MIN_FRICTION), 0.005, 0.0001],  # torsion and rolling are unused
        "solref": list(scene.contact.solref),
        "solimp": list(scene.contact.solimp),
    }


def _add_object(spec: mujoco.MjSpec, scene: Scene, o: int, item: Object) -> None:
    body = spec.worldbody.add_body(name=f"object{o + 1}", pos=[*item.place, 0.0])
    _add_planar_joints(body, f"object{o + 1}", HEAVY)
    for shape in _list_geoms(spec, o, item):
        body.add_geom(contype=0, conaffinity=1, rgba=[0.2, 0.5, 0.3, 1], **_softness(scene, item.friction), **shape)


def _list_geoms(spec: mujoco.MjSpec, o: int, item: Object) -> Iterator[dict[str, object]]:
    """Geom fields of the feature's convex parts, turned into the world's axes; rounding is the geom's margin."""
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
            yield {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [*size, DEPTH], **place}
        elif len(part) == 2:
            ends = [*(part[0] @ turn), 0.0, *(part[1] @ turn), 0.0]
            yield {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "size": [feature.rounding, 0, 0], "fromto": ends}
        else:
            mesh = _add_prism(spec, f"object{o + 1}part{number}", part @ turn)
            yield {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": mesh, "margin": feature.rounding}


def _add_prism(spec: mujoco.MjSpec, name: str, corners: np.ndarray) -> str:
    points = [[x, y, z] for z in (-DEPTH, DEPTH) for x, y in corners]
    mesh = spec.add_mesh(name=name)
    mesh.uservert = np.ravel(points)
    return name


def compile_model(scene: Scene, timestep: float, *, moving: bool = False) -> mujoco.MjModel:
    """The compiled model; meshes are recentred by MuJoCo and placed back by their geom's frame."""
    return make_spec(scene, timestep, moving=moving).compile()


class MujocoStepper(Stepper):
    """One scene in MuJoCo. A base that never moves is part of the world; the first command hangs it on joints."""

    def __init__(self, scenes: Sequence[Scene], timestep: float) -> None:
        self.timestep, self.scenes = float(timestep), list(scenes)
        if len(self.scenes) != 1:
            raise InvalidInput(f"MuJoCo steps one scene at a time, got {len(self.scenes)}.")
        self.reset(0, self.scenes[0])

    def reset(self, lane: int, scene: Scene) -> None:
        """Begin another scene."""
        self.scenes[0], self.moving = scene, scene.base_motion is not None
        self.model = compile_model(scene, self.timestep, moving=self.moving)
        self.data = mujoco.MjData(self.model)
        self.drive = np.array(scene.base_velocity)
        self.object_velocity = np.array([[*o.velocity, o.turn] for o in scene.objects]).reshape(-1, 3)
        self.object_work, self.base_work = np.zeros(len(scene.objects)), 0.0
        self.force = np.zeros((len(scene.objects), 2))
        self.base_force, self.base_moment = np.zeros(2), 0.0
        self.data.qpos[self._hinges], self.data.qvel[self._hinges] = scene.initial_angle, scene.initial_velocity
        if self.moving:
            self.data.qvel[:3] = self.drive
        self._contacts = self._find_contacts()

    @property
    def _hinges(self) -> slice:
        first = 3 if self.moving else 0
        return slice(first, first + self.scenes[0].antenna.n_segments)

    def _hang(self) -> None:
        """Put the base on joints, everything else staying as it is."""
        own, data = self._hinges, self.data
        angle, rate, rest = data.qpos[own].copy(), data.qvel[own].copy(), data.qpos[own.stop :].copy()
        time, warm = data.time, data.qacc_warmstart.copy()
        self.moving = True
        self.model = compile_model(self.scenes[0], self.timestep, moving=True)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[self._hinges], self.data.qvel[self._hinges] = angle, rate
        self.data.qpos[self._hinges.stop :], self.data.time, self.data.qacc_warmstart[3:] = rest, time, warm

    @np.errstate(over="ignore", invalid="ignore")  # what diverges is named by who asks for it
    def step(self, n_steps: int, drives: Mapping[int, np.ndarray] | None = None) -> bool:
        """Take steps; ``drives`` (step, 3) replace the commanded base velocity."""
        with np.errstate(all="ignore"):  # what has diverged says so by its numbers
            for k in range(n_steps):
                self.drive = drives[0][k] if drives else self.drive
                self._step(self.drive)
        return bool(self.find_broken()[0])

    def _step(self, drive: np.ndarray) -> None:
        model, data, hinges = self.model, self.data, self._hinges
        data.qvel[hinges.stop :] = self.object_velocity.ravel()
        base = np.zeros((3, 3))
        base[0] = self._base
        if self.moving:
            base[1], base[2] = data.qvel[:3], (drive - data.qvel[:3]) / self.timestep
            data.qfrc_applied[:3] = ROOTED * base[2]
        angle, rate = data.qpos[hinges].copy(), data.qvel[hinges].copy()
        self._forward()
        self._contacts = self._find_contacts()
        self._push(self._contacts)
        mujoco.mj_Euler(model, data)
        acceleration = (data.qvel[hinges] - rate) / self.timestep  # not MuJoCo's qacc: damping is implicit
        self.base_force, self.base_moment = compute_reaction(
            self.scenes[0].antenna, angle, rate, acceleration, base, np.asarray(self.scenes[0].gravity),
            self._contacts.point, self._contacts.force,
        )  # fmt: skip
        if self.moving:
            middle = 0.5 * (base[1] + drive)
            self.base_work += self.timestep * float(np.dot([*self.base_force, self.base_moment], middle))
            data.qvel[:3] = drive

    def _push(self, contacts: Contacts) -> None:
        """Each object's force on the antenna, and the work it does in this step."""
        self.force = np.zeros((len(self.scenes[0].objects), 2))
        place = self._place
        for o, point, force in zip(contacts.object, contacts.point, contacts.force, strict=True):
            vx, vy, turn = self.object_velocity[o]
            x, y = point - place[o]
            self.force[o] += force
            self.object_work[o] += self.timestep * float(force @ [vx + turn * y, vy - turn * x])

    def _forward(self) -> None:
        """MuJoCo's forward dynamics, with the contact points of rounded parts put between the rounded surfaces."""
        model, data = self.model, self.data
        mujoco.mj_fwdPosition(model, data)
        if model.geom_margin.any() and data.ncon:
            for contact in data.contact:
                contact.pos[:] += 0.5 * contact.includemargin * self._get_normal(contact)
            mujoco.mj_makeConstraint(model, data)
            mujoco.mj_projectConstraint(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)

    def _get_normal(self, contact: mujoco.MjContact) -> np.ndarray:
        """Unit vector (3,) from the object to the antenna."""
        away = contact.frame[:3]
        return away if self.model.geom_contype[contact.geom2] else -away

    def _find_contacts(self) -> Contacts:
        """The contacts that MuJoCo has found, with the forces of its solver."""
        model, data, antenna, count = self.model, self.data, self.scenes[0].antenna, self.data.ncon
        pair, segment = np.zeros(count, dtype=int), np.zeros(count, dtype=int)
        point, normal, force = (np.zeros((count, 2)) for _ in range(3))
        distance, wrench = np.zeros(count), np.zeros(6)
        first = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "segment1")
        for k, contact in enumerate(data.contact):
            mujoco.mj_contactForce(model, data, k, wrench)
            own, other = (
                (contact.geom2, contact.geom1) if model.geom_contype[contact.geom2] else (contact.geom1, contact.geom2)
            )
            sign = 1.0 if own == contact.geom2 else -1.0
            pair[k] = model.geom_bodyid[other] - first - antenna.n_segments
            segment[k] = model.geom_bodyid[own] - first
            point[k], normal[k] = contact.pos[:2], self._get_normal(contact)[:2]
            distance[k] = contact.dist - contact.includemargin
            force[k] = sign * (contact.frame.reshape(3, 3).T @ wrench[:3])[:2]
        points = antenna.shape(data.qpos[self._hinges], base_angle=self._base[2]) + self._base[:2]
        along = np.diff(points, axis=0)[segment]
        share = np.clip(((point - points[segment]) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        arc = antenna.hinge_position[segment] + share * antenna.segment_length[segment]
        return Contacts(
            object=pair, segment=segment + 1, place=arc / antenna.length, point=point, normal=normal, distance=distance,
            force=force,
        )  # fmt: skip

    @property
    def _base(self) -> np.ndarray:
        """Place and heading (3,) of the base now."""
        return self.scenes[0].base_pose + (self.data.qpos[:3] if self.moving else 0.0)

    @property
    def _place(self) -> np.ndarray:
        """Places (object, 2) of the objects now."""
        moved = self.data.qpos[self._hinges.stop :].reshape(-1, 3)[:, :2]
        return moved + np.array([o.place for o in self.scenes[0].objects]).reshape(-1, 2)

    def read(self) -> State:
        """The state, as copies."""
        data, contacts, scene = self.data, self._contacts, self.scenes[0]
        turned = data.qpos[self._hinges.stop :].reshape(-1, 3)[:, 2]
        forward = np.array([o.forward for o in scene.objects]).reshape(-1, 2)
        c, s = np.cos(turned)[:, None], np.sin(turned)[:, None]
        push = np.sum(contacts.force * contacts.normal, axis=1)
        return State(
            angle=data.qpos[None, self._hinges].copy(),
            velocity=data.qvel[None, self._hinges].copy(),
            force=self.force[None].copy(),
            place=self._place[None],
            forward=(c * forward + s * np.stack([forward[:, 1], -forward[:, 0]], axis=1))[None],
            object_work=self.object_work[None].copy(),
            base=self._base[None],
            base_force=self.base_force[None].copy(),
            base_moment=np.array([self.base_moment]),
            base_work=np.array([self.base_work]),
            contact_place=np.array([push @ contacts.place / push.sum() if push.sum() > 0 else np.nan]),
        )

    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of the last step."""
        return self._contacts

    def find_broken(self) -> np.ndarray:
        """Whether its numbers are no longer finite."""
        return ~np.isfinite([self.data.qpos.sum() + self.data.qvel.sum()])

    def explain(self, lane: int) -> None:
        """Nothing that its numbers do not show."""

    def move_base(self, lane: int, velocity: tuple[float, float], turn: float) -> None:
        """Command the base."""
        self.drive = np.array([*velocity, turn])
        if not self.moving and self.drive.any():
            self._hang()

    def move_object(self, lane: int, o: int, velocity: tuple[float, float], turn: float) -> None:
        """Command an object."""
        self.object_velocity[o] = *velocity, turn

    def save(self, lane: int) -> dict[str, object]:
        """All that the future depends on, but for the scene."""
        kept = {name: copy(value) for name, value in vars(self).items() if name not in ("scenes", "model")}
        return kept | {"model": self.model}

    def load(self, lane: int, saved: dict[str, object]) -> None:
        """Go back to where it was saved; what was saved at another timestep goes on at this one."""
        other = saved["timestep"] != self.timestep
        kept = {name: value for name, value in saved.items() if not (other and name in ("model", "timestep"))}
        vars(self).update({name: copy(value) if name != "model" else value for name, value in kept.items()})


MUJOCO = Engine(make=MujocoStepper, timestep=0.02)
