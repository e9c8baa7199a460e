"""The reference engine: MuJoCo, stepped as it is; what it finds at contacts is put into feeler's
words.
"""

from collections.abc import Mapping, Sequence
from copy import copy

import mujoco
import numpy as np

from feeler.errors import InvalidInput
from feeler.physics.contact import find_radius
from feeler.physics.engine import Engine
from feeler.physics.reaction import compute_reaction
from feeler.physics.scene import Scene
from feeler.physics.spec import ROOTED, compile_model
from feeler.physics.stepper import Contacts, State, Stepper


class MujocoStepper(Stepper):
    """One scene in MuJoCo. A base that never moves is part of the world; the first command hangs it
    on joints.
    """

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
        self.object_velocity = np.array([[*o.velocity, o.turn] for o in scene.objects]).reshape(
            -1, 3
        )
        self.object_work, self.base_work = np.zeros(len(scene.objects)), 0.0
        self.force = np.zeros((len(scene.objects), 2))
        self.base_force, self.base_moment, self.sink = np.zeros(2), 0.0, 0.0
        self._thin = [
            np.minimum(scene.antenna.radius, find_radius(item)) for item in scene.objects
        ]
        self.data.qpos[self._hinges], self.data.qvel[self._hinges] = (
            scene.initial_angle,
            scene.initial_velocity,
        )
        if self.moving:
            self.data.qvel[:3] = self.drive
        self._contacts = self._find_contacts(*self._find_forces())

    @property
    def _hinges(self) -> slice:
        first = 3 if self.moving else 0
        return slice(first, first + self.scenes[0].antenna.n_segments)

    def _hang(self) -> None:
        """Put the base on joints, everything else staying as it is."""
        own, data = self._hinges, self.data
        angle, rate, rest = (
            data.qpos[own].copy(),
            data.qvel[own].copy(),
            data.qpos[own.stop :].copy(),
        )
        time, warm = data.time, data.qacc_warmstart.copy()
        self.moving = True
        self.model = compile_model(self.scenes[0], self.timestep, moving=True)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[self._hinges], self.data.qvel[self._hinges] = angle, rate
        self.data.qpos[self._hinges.stop :], self.data.time, self.data.qacc_warmstart[3:] = (
            rest,
            time,
            warm,
        )

    @np.errstate(over="ignore", invalid="ignore")  # what diverges is named by who asks for it
    def step(self, n_steps: int, drives: Mapping[int, np.ndarray] | None = None) -> bool:
        """Take steps; ``drives`` (step, 3) replace the commanded base velocity."""
        with np.errstate(all="ignore"):  # what has diverged says so by its numbers
            for k in range(n_steps):
                self.drive = drives[0][k] if drives else self.drive
                self._step(self.drive, told=k == n_steps - 1)
        return bool(self.find_broken()[0])

    def _step(self, drive: np.ndarray, told: bool) -> None:
        """One step; contacts are put into words where they are ``told``, the reaction also where a
        base's work needs it.
        """
        model, data, hinges = self.model, self.data, self._hinges
        data.qvel[hinges.stop :] = self.object_velocity.ravel()
        if self.moving:
            data.qfrc_applied[:3] = ROOTED * ((drive - data.qvel[:3]) / self.timestep)
        self._forward()
        pair, segment, point, force = self._find_forces()
        self._push(pair, point, force)
        depth = data.contact.includemargin - data.contact.dist
        for o, n, deep in zip(pair, segment, depth, strict=True):
            self.sink = max(self.sink, float(deep / self._thin[o][n]))
        if not (told or self.moving):
            mujoco.mj_Euler(model, data)
            return
        if told:
            self._contacts = self._find_contacts(pair, segment, point, force)
        angle, rate, base = data.qpos[hinges].copy(), data.qvel[hinges].copy(), np.zeros((3, 3))
        base[0] = self._base
        if self.moving:
            base[1], base[2] = data.qvel[:3], (drive - data.qvel[:3]) / self.timestep
        mujoco.mj_Euler(model, data)
        acceleration = (
            data.qvel[hinges] - rate
        ) / self.timestep  # not MuJoCo's qacc: damping is implicit
        self.base_force, self.base_moment = compute_reaction(
            self.scenes[0].antenna,
            angle,
            rate,
            acceleration,
            base,
            np.asarray(self.scenes[0].gravity),
            point,
            force,
        )
        if self.moving:
            middle = 0.5 * (base[1] + drive)
            self.base_work += self.timestep * float(
                np.dot([*self.base_force, self.base_moment], middle)
            )
            data.qvel[:3] = drive

    def _push(self, pair: np.ndarray, point: np.ndarray, force: np.ndarray) -> None:
        """Each object's force on the antenna, and the work it does in this step."""
        self.force = np.zeros((len(self.scenes[0].objects), 2))
        if not len(pair):
            return
        place = self._place
        for o, at, push in zip(pair, point, force, strict=True):
            vx, vy, turn = self.object_velocity[o]
            x, y = at - place[o]
            self.force[o] += push
            self.object_work[o] += self.timestep * float(push @ [vx + turn * y, vy - turn * x])

    def _forward(self) -> None:
        """MuJoCo's forward dynamics."""
        model, data = self.model, self.data
        mujoco.mj_fwdPosition(model, data)
        round_contacts(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)

    def _find_forces(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Object and segment (contact,), point and force on the antenna (contact, 2) of what MuJoCo
        has found.
        """
        model, data, count = self.model, self.data, self.data.ncon
        if not count:
            return (
                np.zeros(0, dtype=int),
                np.zeros(0, dtype=int),
                np.zeros((0, 2)),
                np.zeros((0, 2)),
            )
        contact, wrench, force = data.contact, np.zeros(6), np.zeros((count, 2))
        geom, flipped = contact.geom, _find_flipped(model, data)
        own = np.where(flipped, geom[:, 1], geom[:, 0])
        other = np.where(flipped, geom[:, 0], geom[:, 1])
        first = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "segment1")
        for k, frame in enumerate(contact.frame):
            mujoco.mj_contactForce(model, data, k, wrench)
            force[k] = (1.0 if flipped[k] else -1.0) * (frame.reshape(3, 3).T @ wrench[:3])[:2]
        segment = model.geom_bodyid[own] - first
        pair = model.geom_bodyid[other] - first - self.scenes[0].antenna.n_segments
        return pair, segment, contact.pos[:, :2].copy(), force

    def _find_contacts(
        self, pair: np.ndarray, segment: np.ndarray, point: np.ndarray, force: np.ndarray
    ) -> Contacts:
        """What :meth:`_find_forces` gives, with places on the antenna, normals and distances."""
        antenna, contact = self.scenes[0].antenna, self.data.contact
        points = (
            antenna.shape(self.data.qpos[self._hinges], base_angle=self._base[2])
            + self._base[:2]
        )
        along = np.diff(points, axis=0)[segment]
        share = np.clip(
            ((point - points[segment]) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0
        )
        arc = antenna.hinge_position[segment] + share * antenna.segment_length[segment]
        return Contacts(
            object=pair,
            segment=segment + 1,
            place=arc / antenna.length,
            point=point,
            normal=_find_normals(self.model, self.data)[:, :2],
            distance=contact.dist - contact.includemargin,
            force=force,
        )

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
            contact_place=np.array(
                [push @ contacts.place / push.sum() if push.sum() > 0 else np.nan]
            ),
            sink=np.array([self.sink]),
        )

    def read_sink(self) -> np.ndarray:
        """How deep contacts have sunk at most (1,)."""
        return np.array([self.sink])

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

    def move_object(
        self, lane: int, o: int, velocity: tuple[float, float], turn: float
    ) -> None:
        """Command an object."""
        self.object_velocity[o] = *velocity, turn

    def save(self, lane: int) -> dict[str, object]:
        """All that the future depends on, but for the scene."""
        kept = {
            name: copy(value)
            for name, value in vars(self).items()
            if name not in ("scenes", "model")
        }
        return kept | {"model": self.model}

    def load(self, lane: int, saved: dict[str, object]) -> None:
        """Go back to where it was saved; what was saved at another timestep goes on at this one."""
        other = saved["timestep"] != self.timestep
        kept = {
            name: value
            for name, value in saved.items()
            if not (other and name in ("model", "timestep"))
        }
        vars(self).update(
            {name: copy(value) if name != "model" else value for name, value in kept.items()}
        )


def round_contacts(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put the contact points of rounded parts between the rounded surfaces."""
    if model.geom_margin.any() and data.ncon:
        contact = data.contact
        contact.pos[:] += 0.5 * contact.includemargin[:, None] * _find_normals(model, data)
        mujoco.mj_makeConstraint(model, data)
        mujoco.mj_projectConstraint(model, data)


def _find_flipped(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Whether the antenna is a contact's second geom (contact,): then MuJoCo's normal points to
    it.
    """
    return model.geom_contype[data.contact.geom[:, 1]] != 0


def _find_normals(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Unit vectors (contact, 3) from the objects to the antenna."""
    flipped = _find_flipped(model, data)
    return np.where(flipped[:, None], 1.0, -1.0) * data.contact.frame[:, :3]


def _make(scenes: Sequence[Scene], timestep: float) -> Stepper:
    if scenes[0].antenna.spatial:
        from feeler.physics.mujoco_space import SpaceMujocoStepper

        return SpaceMujocoStepper(scenes, timestep)
    return MujocoStepper(scenes, timestep)


MUJOCO = Engine(make=_make, timestep=0.02)
