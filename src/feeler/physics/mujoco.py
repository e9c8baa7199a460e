"""The reference engine: MuJoCo, in the plane and in space."""

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any, cast

import numpy as np

from feeler.antenna.segments import to_vector
from feeler.errors import InvalidInput
from feeler.physics.contact import find_radius
from feeler.physics.engine import Contacts, Engine, State, Stepper
from feeler.physics.scene import Scene
from feeler.physics.spec import ROOTED, compile_model

import mujoco  # isort: skip  # after spec, which says in words if it is missing
from feeler.antenna.segments import Antenna

# The reference engine: MuJoCo, stepped as it is; what it finds at contacts is put into feeler's
# words.


class _MujocoStepper(Stepper):
    """One scene in MuJoCo. A base that never moves is part of the world; the first command hangs it
    on joints.
    """

    def __init__(self, scenes: Sequence[Scene], timestep: float) -> None:
        self.timestep, self.scenes = float(timestep), list(scenes)
        if len(self.scenes) != 1:
            raise InvalidInput(f"MuJoCo steps one scene at a time, got {len(self.scenes)}.")
        self.reset(0, self.scenes[0])

    def reset(self, lane: int, scene: Scene) -> None:
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

    def step(self, n_steps: int, drives: Mapping[int, np.ndarray] | None = None) -> bool:
        """Take steps; ``drives`` (step, 3; in space 6) replace the commanded base velocity."""
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
        self.base_force, self.base_moment = _compute_reaction(
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
        _round_contacts(model, data)
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
        return np.array([self.sink])

    def read_contacts(self, lane: int) -> Contacts:
        return self._contacts

    def find_broken(self) -> np.ndarray:
        return ~np.isfinite([self.data.qpos.sum() + self.data.qvel.sum()])

    def move_base(self, lane: int, velocity: tuple[float, float], turn: float) -> None:
        self.drive = np.array([*velocity, turn])
        if not self.moving and self.drive.any():
            self._hang()

    def move_object(
        self, lane: int, o: int, velocity: tuple[float, float], turn: float
    ) -> None:
        self.object_velocity[o] = *velocity, turn

    def read_rates(self, lane: int) -> tuple[np.ndarray, np.ndarray]:
        return self.drive.copy(), self.object_velocity.copy()

    def save(self, lane: int) -> dict[str, object]:
        kept = {
            name: copy(value)
            for name, value in vars(self).items()
            if name not in ("scenes", "model")
        }
        return kept | {"model": self.model}

    def load(self, lane: int, saved: dict[str, object]) -> None:
        """Go back to where it was saved; what was saved at another timestep goes on at this one."""
        other = saved["timestep"] != self.timestep
        for name, value in saved.items():
            if not (other and name in ("model", "timestep")):
                vars(self)[name] = value if name == "model" else copy(value)


def _round_contacts(model: mujoco.MjModel, data: mujoco.MjData) -> None:
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
        return _SpaceMujocoStepper(scenes, timestep)
    return _MujocoStepper(scenes, timestep)


MUJOCO = Engine(make=_make, timestep=0.02)


# The reference engine in space: MuJoCo, with a base that moves as told and walls that it would
# not let move.


class _SpaceMujocoStepper(_MujocoStepper):
    """One scene in space in MuJoCo."""

    def reset(self, lane: int, scene: Scene) -> None:
        self.scenes[0], antenna = scene, scene.antenna
        self.model = compile_model(scene, self.timestep)
        self.data = mujoco.MjData(self.model)
        self.drive = np.array(scene.base_velocity)
        rates = [[*o.velocity, *np.ravel(o.turn)] for o in scene.objects]
        self.object_rate = np.array(rates).reshape(-1, 6)
        self.object_work, self.base_work = np.zeros(len(scene.objects)), 0.0
        self.sink, self.planes = 0.0, len(antenna.planes)
        self.base_wrench, self._contacts = np.zeros((2, 3)), _list_none()
        self._thin = [np.minimum(antenna.radius, find_radius(item)) for item in scene.objects]
        n, loose = self.planes * antenna.n_segments, 3 * (antenna.follicle is not None)
        self._q, self._v = slice(7 + loose, 7 + loose + n), slice(6 + loose, 6 + loose + n)
        self.data.qpos[3:7] = _to_quaternion(scene.base_pose[3:])
        self.data.qpos[self._q] = scene.initial_angle.T.ravel()
        self.data.qvel[self._v] = scene.initial_velocity.T.ravel()
        self._command()
        mujoco.mj_kinematics(self.model, self.data)

    def _rotate(self, body: int) -> np.ndarray:
        """A body's rotation now, from what its ball joint says."""
        found = np.zeros(9)
        address = 3 if body == 0 else 7 * body + (self._q.stop - 7) + 3
        mujoco.mju_quat2Mat(found, self.data.qpos[address : address + 4])
        return found.reshape(3, 3)

    def _command(self) -> None:
        """Give base and objects their rates; a ball joint takes them in the body's own axes."""
        for k, rate in enumerate((self.drive, *self.object_rate)):
            at = 0 if k == 0 else self._v.stop + 6 * (k - 1)
            self.data.qvel[at : at + 6] = [*rate[:3], *(self._rotate(k).T @ rate[3:])]

    def _step(self, drive: np.ndarray, told: bool) -> None:
        model, data, h = self.model, self.data, self.timestep
        before = self._base_rate()
        change = (drive - before) / h
        change[3:] = self._rotate(0).T @ change[3:]
        data.qfrc_applied[:6] = ROOTED * change
        # Put the walls where their bodies are.
        for o, geom in self._list_walls():
            item, turn = self.scenes[0].objects[o], self._rotate(o + 1)
            self.model.geom_pos[geom] = self._place[o]
            axes = turn @ np.column_stack([item.axes[1], item.axes[2], item.axes[0]])
            mujoco.mju_mat2Quat(self.model.geom_quat[geom], axes.ravel())
        mujoco.mj_fwdPosition(model, data)
        _round_contacts(model, data)
        mujoco.mj_fwdVelocity(model, data)
        rods = self._list_rods() if self.scenes[0].flow is not None else []
        self._drag(rods, data.qvel)
        self._carry_walls()
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)
        self._contacts = self._collect_contacts()
        self._count_work()
        rates, place, moving = data.qvel.copy(), self._root, self._root_rate()
        self._drag(rods, data.qvel + h * self._ease(rods, change))
        mujoco.mj_Euler(model, data)
        data.qacc[:] = (data.qvel - rates) / h  # not MuJoCo's: damping is implicit
        self._react(place, rates)
        self.drive = np.array(drive, dtype=float)
        self._command()
        middle = 0.5 * (moving + self._root_rate())
        self.base_work += h * float(self.base_wrench.ravel() @ middle)

    def _base_rate(self) -> np.ndarray:
        rate = self.data.qvel[:6]
        return np.concatenate([rate[:3], self._rotate(0) @ rate[3:]])

    @property
    def _root(self) -> np.ndarray:
        """Where hinge 1 is (3,): the base, and what its follicle gives."""
        given = self._slides @ self.data.qpos[7 : self._q.start]
        return self.data.qpos[:3] + self.scenes[0].base_pose[:3] + given

    @property
    def _slides(self) -> np.ndarray:
        """The follicle's axes in the world (3, slide); none without one."""
        return self._rotate(0)[:, : self._v.start - 6]

    def _root_rate(self) -> np.ndarray:
        """Velocity of hinge 1 and angular velocity of the base (6,)."""
        rate, data = self._base_rate(), self.data
        slide = self._slides @ data.qvel[6 : self._v.start]
        swept = np.cross(rate[3:], self._slides @ data.qpos[7 : self._q.start])
        return np.concatenate([rate[:3] + swept + slide, rate[3:]])

    def _list_rods(self) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Body of each segment, how it turns the rates of all into those of its middle (velocity,
        turn; 6, rate), and its drag over these (6, 6).
        """
        model, data, scene = self.model, self.data, self.scenes[0]
        first = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "segment1")
        rods = []
        for n, length in enumerate(scene.antenna.segment_length):
            along = data.xmat[first + n].reshape(3, 3)[:, 1]
            rows, drag = np.zeros((6, model.nv)), np.zeros((6, 6))
            middle = data.xpos[first + n] + 0.5 * length * along
            mujoco.mj_jac(model, data, rows[:3], rows[3:], middle, first + n)
            straight, across = np.outer(along, along), np.eye(3) - np.outer(along, along)
            flow: Any = scene.flow
            drag[:3, :3] = length * (flow.drag * across + flow.along * straight)
            drag[3:, 3:] = length**3 / 12 * flow.drag * across
            rods.append((first + n, rows, drag))
        return rods

    def _drag(self, rods: list, rate: np.ndarray) -> None:
        """Apply the drag of the flow at these rates of all joints."""
        data, flow = self.data, cast(Any, self.scenes[0].flow)
        for body, rows, drag in rods:
            push = -drag @ (rows @ rate - [*flow.velocity, 0, 0, 0])
            along = data.xmat[body].reshape(3, 3)[:, 1]
            n = body - rods[0][0]
            arm = data.xpos[body] - data.xipos[body]
            arm = arm + 0.5 * self.scenes[0].antenna.segment_length[n] * along
            push[3:] += np.cross(arm, push[:3])
            data.xfrc_applied[body] = push

    def _ease(self, rods: list, change: np.ndarray) -> np.ndarray:
        """Accelerations of all joints with a drag that is implicit, as the hinges' damping is, for
        MuJoCo's step to find: (M + h (C + Jᵀ D J)) q̈ = τ, the base's being known.
        """
        model, data, h = self.model, self.data, self.timestep
        found = np.zeros(model.nv)
        if not rods:
            return found
        whole = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, whole)
        own = slice(6, self._v.stop)
        plain = whole[own] + h * np.diag(model.dof_damping)[own]
        eased = plain + h * sum(rows.T @ drag @ rows for _, rows, drag in rods)[own]
        torque = (data.qfrc_smooth + data.qfrc_constraint)[own]
        found[:6] = change
        found[own] = np.linalg.solve(eased[:, own], torque - eased[:, :6] @ change)
        data.qfrc_smooth[own] += plain @ found - torque
        return found

    def _react(self, place: np.ndarray, rates: np.ndarray) -> None:
        """Force and moment of the base on the antenna, by Newton's and Euler's laws over it, with
        the rates of the step's start.
        """
        model, data = self.model, self.data
        after = data.qvel.copy()
        data.qvel[:] = rates
        mujoco.mj_rnePostConstraint(model, data)
        data.qvel[:] = after
        first = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "segment1")
        turn, force = data.cfrc_int[first, :3], data.cfrc_int[first, 3:]
        arm = data.subtree_com[model.body_rootid[first]] - place
        self.base_wrench = np.array([force, turn + np.cross(arm, force)])

    def _list_walls(self) -> list[tuple[int, int]]:
        """(object, geom) of each wall."""
        walls = [o for o, item in enumerate(self.scenes[0].objects) if item.feature.unbounded]
        kind = mujoco.mjtObj.mjOBJ_GEOM
        return [(o, mujoco.mj_name2id(self.model, kind, f"wall{o + 1}")) for o in walls]

    def _carry_walls(self) -> None:
        """Add the walls' velocity to what contacts with them aim at: a_ref = −b (v − v_wall) …"""
        data = self.data
        walls = {geom: o for o, geom in self._list_walls()}
        for contact in data.contact if walls else ():
            o = walls.get(contact.geom[0])
            if o is None or contact.efc_address < 0:
                continue
            normal, *across = contact.frame.reshape(3, 3)
            rate = self.object_rate[o]
            own = rate[:3] + np.cross(rate[3:], contact.pos - self._place[o])
            rows = [normal]
            if contact.dim == 3:
                slide = zip(across, contact.friction, strict=False)
                rows = [normal + sign * mu * t for t, mu in slide for sign in (1, -1)]
            for k, row in enumerate(rows):
                at = contact.efc_address + k
                data.efc_aref[at] += data.efc_KBIP[at, 1] * float(row @ own)

    @property
    def _place(self) -> np.ndarray:
        """Places (object, 3) of the objects now."""
        start = np.array([o.place for o in self.scenes[0].objects]).reshape(-1, 3)
        return start + self.data.qpos[self._q.stop :].reshape(-1, 7)[:, :3]

    def _collect_contacts(self) -> Contacts:
        model, data, antenna = self.model, self.data, self.scenes[0].antenna
        first = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "segment1")
        walls = {geom: o for o, geom in self._list_walls()}
        rows, wrench = [], np.zeros(6)
        for k, contact in enumerate(data.contact):
            flipped = model.geom_contype[contact.geom[1]] != 0  # the antenna is the second
            own, other = contact.geom[::-1] if flipped else contact.geom
            body = model.geom_bodyid[own]
            o = walls.get(other, model.geom_bodyid[other] - first - antenna.n_segments)
            mujoco.mj_contactForce(model, data, k, wrench)
            frame, sign = contact.frame.reshape(3, 3), 1.0 if flipped else -1.0
            n = body - first
            along, length = data.xmat[body].reshape(3, 3)[:, 1], antenna.segment_length[n]
            share = np.clip((contact.pos - data.xpos[body]) @ along / length, 0.0, 1.0)
            distance = contact.dist - contact.includemargin
            self.sink = max(self.sink, float(-distance / self._thin[o][n]))
            arc = (antenna.hinge_position[n] + share * length) / antenna.length
            force = sign * (frame.T @ wrench[:3])
            rows.append((o, n + 1, arc, contact.pos.copy(), sign * frame[0], distance, force))
        return _list_contacts(rows) if rows else _list_none()

    def _count_work(self) -> None:
        now = self._contacts
        for o, point, force in zip(now.object, now.point, now.force, strict=True):
            rate = self.object_rate[o]
            own = rate[:3] + np.cross(rate[3:], point - self._place[o])
            self.object_work[o] += self.timestep * float(force @ own)

    def read(self) -> State:
        data, scene = self.data, self.scenes[0]
        shape = (scene.antenna.n_segments, self.planes)
        force = np.zeros((len(scene.objects), 3))
        np.add.at(force, self._contacts.object, self._contacts.force)
        push = np.sum(self._contacts.force * self._contacts.normal, axis=1)
        place = push @ self._contacts.place / push.sum() if push.sum() > 0 else np.nan
        turned = to_vector(self._rotate(0))
        base = np.concatenate([self._root, turned])
        forward = [self._rotate(o + 1) @ item.forward for o, item in enumerate(scene.objects)]
        return State(
            angle=data.qpos[self._q].reshape(shape).T[None].copy(),
            velocity=data.qvel[self._v].reshape(shape).T[None].copy(),
            force=force[None],
            place=self._place[None],
            forward=np.array(forward).reshape(1, -1, 3),
            object_work=self.object_work[None].copy(),
            base=base[None],
            base_force=self.base_wrench[None, 0].copy(),
            base_moment=self.base_wrench[None, 1].copy(),
            base_work=np.array([self.base_work]),
            contact_place=np.array([place]),
            sink=np.array([self.sink]),
        )

    def move_base(self, lane: int, velocity: Any, turn: Any) -> None:
        self.drive = np.array([*velocity, *turn])

    def move_object(self, lane: int, o: int, velocity: Any, turn: Any) -> None:
        self.object_rate[o] = *velocity, *turn
        rate = self.drive
        self.drive = self._base_rate()
        self._command()
        self.drive = rate

    def read_rates(self, lane: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.drive), self.object_rate.copy()


def _list_contacts(rows: list[tuple]) -> Contacts:
    names = ("object", "segment", "place", "point", "normal", "distance", "force")
    columns = map(np.array, zip(*rows, strict=True))
    return Contacts(**dict(zip(names, columns, strict=True)))


def _list_none() -> Contacts:
    none = (0, 1, 0.0, np.zeros(3), np.zeros(3), 0.0, np.zeros(3))
    found = _list_contacts([none])
    return Contacts(**{name: value[:0] for name, value in vars(found).items()})


def _to_quaternion(vector: np.ndarray) -> np.ndarray:
    """MuJoCo's quaternion (4,) of a rotation vector [rad]."""
    size, found = float(np.linalg.norm(vector)), np.zeros(4)
    mujoco.mju_axisAngle2Quat(found, np.asarray(vector) / size if size else np.eye(3)[0], size)
    return found


def _compute_reaction(
    antenna: Antenna,
    angle: np.ndarray,
    rate: np.ndarray,
    acceleration: np.ndarray,
    base: np.ndarray,
    gravity: np.ndarray,
    point: np.ndarray,
    force: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Force [N] and moment [N·mm] (about the base, positive as angles are) of the base on the
    antenna.

    F = Σ m (a − g) − Σ f and M = Σ (I α + m (a − g) · P(r)) − Σ f · P(r), with P(r) = (r_y, −r_x).

    Parameters
    ----------
    angle, rate, acceleration
        Of every hinge (segment,) [rad, rad/ms, rad/ms²].
    base
        (3, 3): x, y, heading of the base; their rates; their accelerations.
    gravity
        (2,) [mm/ms²].
    point, force
        Contacts' places [mm] and forces on the antenna [N], (contact, 2).
    """
    heading, omega, alpha = (
        row[2] + np.cumsum(hinge)
        for row, hinge in zip(base, (angle, rate, acceleration), strict=True)
    )
    along = antenna.segment_length[:, None] * np.stack(
        [np.sin(heading), np.cos(heading)], axis=1
    )
    step = alpha[:, None] * _turn(along) - (omega**2)[:, None] * along
    arm = np.cumsum(along, axis=0) - 0.5 * along
    push = antenna.segment_mass[:, None] * (
        base[2, :2] + np.cumsum(step, axis=0) - 0.5 * step - gravity
    )
    own = antenna.segment_mass * antenna.segment_length**2 / 12 * alpha
    moment = own.sum() + np.sum(push * _turn(arm)) - np.sum(force * _turn(point - base[0, :2]))
    return push.sum(axis=0) - force.sum(axis=0), float(moment)


def _turn(r: np.ndarray) -> np.ndarray:
    return np.stack([r[..., 1], -r[..., 0]], axis=-1)
