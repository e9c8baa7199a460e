"""Lanes filled with scenes in space."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.space import to_matrix
from feeler.physics.chain import fields as f
from feeler.physics.chain.batch import MAX_CONTACTS, ChainStepper, make_table
from feeler.physics.chain.model import fill_object, fill_segments
from feeler.physics.chain.space import fields as s
from feeler.physics.chain.space.step import (
    SpaceTables,
    make_space_handle,
    record_in_space,
    step_in_space,
)
from feeler.physics.chain.space.sweep import move_in_space
from feeler.physics.engine import announce_compiling
from feeler.physics.scene import Scene
from feeler.physics.stepper import Contacts, State
from feeler.stimulus.hull import N_HULL, make_hull
from feeler.stimulus.solid import is_box, list_solids


class SpaceChainStepper(ChainStepper):
    """Scenes in space of one segment count and one number of planes, one per lane."""

    rows_each = s.EDGES
    step_lanes = staticmethod(step_in_space)
    record_lanes = staticmethod(record_in_space)

    def __init__(self, scenes: Sequence[Scene], timestep: float, damped: bool = False) -> None:
        for scene in scenes:
            scene.contact.check_timestep(timestep)
        self.scenes, self.timestep, self.damped = list(scenes), float(timestep), damped
        self.tables: Any = _make_tables(self.scenes)
        self.drive = self.tables.base[0, s.BASE_V : s.BASE_V + 6].copy()[None]
        with announce_compiling("chain in space", len(self.scenes)):
            self._settle()

    def _settle(self) -> None:
        t = self.tables
        self.handle = make_space_handle(t)
        step_in_space(self.handle, 0, 0, self.timestep, self.drive, self.damped)
        move_in_space(t.constants, t.work, t.base, t.kind, 0.0, t.width)

    def read(self) -> State:
        """The state of every lane, as copies."""
        t, lanes = self.tables, len(self.scenes)
        work, place, base = (table + 0.0 for table in (t.work[: s.TORQUE], t.place, t.base[0]))
        pose = [_read_pose(base[s.BASE_TURN : s.BASE_TURN + 4, lane]) for lane in range(lanes)]
        pressed = np.where(base[s.BASE_PRESS] > 0, base[s.BASE_PRESS], np.nan)

        def pick(k: int) -> np.ndarray:
            return place[k : k + 3].transpose(2, 1, 0)

        return State(
            angle=work[s.ANGLE : s.ANGLE + len(t.kind[0])].transpose(2, 0, 1),
            velocity=work[s.RATE : s.RATE + len(t.kind[0])].transpose(2, 0, 1),
            force=pick(s.OBJ_FORCE),
            place=pick(s.OBJ_PLACE),
            forward=pick(s.OBJ_AXES),
            object_work=place[s.OBJ_WORK].T,
            base=np.concatenate([base[s.ROOT : s.ROOT + 3].T, pose], axis=1),
            base_force=base[s.BASE_FORCE : s.BASE_FORCE + 3].T,
            base_moment=base[s.BASE_MOMENT : s.BASE_MOMENT + 3].T,
            base_work=base[s.BASE_WORK],
            contact_place=base[s.BASE_SPOT] / pressed,
            sink=base[s.BASE_SINK],
        )

    def read_sink(self) -> np.ndarray:
        """How deep contacts have sunk at most (lane,)."""
        return self.tables.base[0, s.BASE_SINK]

    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of a lane's last step."""
        t, count = self.tables, max(self.tables.number[lane], 0)
        table = t.contacts[lane, :count]
        rows = t.rows[lane, : s.EDGES * count].reshape(count, s.EDGES, s.N_SPACE_ROW)
        segment, antenna = table[:, s.HIT_SEGMENT].astype(int), self.scenes[lane].antenna
        share = np.clip(table[:, s.HIT_SHARE], 0.0, 1.0)
        arc = antenna.hinge_position[segment] + share * antenna.segment_length[segment]
        force = np.maximum(rows[:, :, f.R_FORCE, None], 0.0)
        return Contacts(
            object=table[:, s.HIT_OBJECT].astype(int),
            segment=segment + 1,
            place=arc / antenna.length,
            point=table[:, s.HIT_POINT : s.HIT_POINT + 3].copy(),
            normal=table[:, s.HIT_NORMAL : s.HIT_NORMAL + 3].copy(),
            distance=table[:, s.HIT_DISTANCE].copy(),
            force=(force * rows[:, :, f.R_W0 + 3 : f.R_W0 + 6]).sum(axis=1),
        )

    def find_broken(self) -> np.ndarray:
        """Whether each lane has left the finite numbers or had too many contacts."""
        work = self.tables.work
        total = work[s.SEG_ALONG : s.OMEGA + 3, -1].sum(axis=0)
        return ~np.isfinite(total) | (self.tables.number < 0)

    def move_base(self, lane: int, velocity: Any, turn: Any) -> None:
        """From the next step on the base moves like this."""
        self.drive[0, :, lane] = *velocity, *turn

    def move_object(self, lane: int, o: int, velocity: Any, turn: Any) -> None:
        """From the next step on the object moves like this."""
        self.tables.place[s.OBJ_V : s.OBJ_OMEGA + 3, o, lane] = *velocity, *turn

    def reset(self, lane: int, scene: Scene) -> None:
        """Begin another scene in one lane; its neighbours go on as if nothing had been."""
        scene.contact.check_timestep(self.timestep)
        others = [k for k in range(len(self.scenes)) if k != lane]
        kept = [self.save(k) for k in others]
        self.scenes[lane] = scene
        self.tables = _make_tables(self.scenes)
        for k, saved in zip(others, kept, strict=True):
            self.load(k, saved)
        self.drive[0, :, lane] = scene.base_velocity
        self._settle()


def _make_tables(scenes: Sequence[Scene]) -> SpaceTables:
    antenna, lanes = scenes[0].antenna, len(scenes)
    n, n_objects = antenna.n_segments, max(len(scene.objects) for scene in scenes)
    found = [_list_solids(scene) for scene in scenes]
    solids, hulls = [rows for rows, _ in found], [rows for _, rows in found]
    n_solids = max(map(len, solids))
    size = min(2 * max(n_solids, 1) * (n + 2), MAX_CONTACTS)
    tables = SpaceTables(
        constants=make_table(s.N_SPACE_CONSTANTS, n, lanes)[0],
        work=make_table(s.N_SPACE_WORK, n, lanes)[0],
        base=np.zeros((1, s.N_SPACE_BASE, lanes)),
        obj=np.zeros((n_objects, f.N_OBJECT, lanes)),
        place=np.zeros((s.N_SPACE_PLACE, n_objects, lanes)),
        solids=np.full((lanes, n_solids, s.N_SOLID), -1.0),
        hulls=np.zeros((lanes, max(map(len, hulls)), N_HULL)),
        contacts=np.empty((lanes, size, s.N_SPACE_CONTACT)),
        rows=np.empty((lanes, s.EDGES * size, s.N_SPACE_ROW)),
        memory=np.empty((lanes, size + 1, s.N_SPACE_MEMORY)),
        number=np.zeros(lanes, dtype=np.int64),
        open=np.zeros(lanes, dtype=np.bool_),
        loaded=np.zeros(n, dtype=np.bool_),
        kind=(
            (0,) * len(antenna.planes),
            (0,) * any(scene.antenna.follicle is not None for scene in scenes),
            (0,) * any(scene.flow is not None for scene in scenes),
        ),
        width=(0,) * lanes,
    )
    for lane, (scene, own) in enumerate(zip(scenes, solids, strict=True)):
        tables.solids[lane, : len(own)] = own
        tables.hulls[lane, : len(hulls[lane])] = hulls[lane]
        _fill(tables, lane, scene)
    return tables


def _fill(t: SpaceTables, lane: int, scene: Scene) -> None:
    """Put one scene's constants and first state into its lane."""
    own = t.constants[:, :, lane]
    fill_segments(own, scene.antenna, scene.contact)
    _fill_segments(own, scene.antenna)
    planes = slice(len(t.kind[0]))
    t.work[s.ANGLE :, :, lane][planes] = scene.initial_angle
    t.work[s.RATE :, :, lane][planes] = scene.initial_velocity
    base, pose = t.base[0, :, lane], scene.base_pose
    base[s.BASE_PLACE : s.BASE_PLACE + 3], base[s.BASE_V : s.BASE_V + 6] = (
        pose[:3],
        scene.base_velocity,
    )
    base[s.BASE_TURN : s.BASE_TURN + 4] = _to_quaternion(to_matrix(pose[3:]))
    base[s.BASE_AXES : s.BASE_AXES + 9] = to_matrix(pose[3:]).T.ravel()
    base[s.BASE_GRAVITY : s.BASE_GRAVITY + 3] = scene.gravity
    base[s.ROOT : s.ROOT + 3], base[s.GIVE_HELD] = pose[:3], np.inf
    if (follicle := scene.antenna.follicle) is not None:
        base[s.GIVE_STIFF : s.GIVE_STIFF + 3] = follicle.stiffness
        base[s.GIVE_DAMP : s.GIVE_DAMP + 3], base[s.GIVE_HELD] = follicle.damping, 0.0
    if (flow := scene.flow) is not None:
        length = scene.antenna.segment_length
        own[s.C_FLOW], own[s.C_FLOW + 1] = flow.drag * length, (flow.along - flow.drag) * length
        base[s.FLOW_V : s.FLOW_V + 3] = flow.velocity
    for o, item in enumerate(scene.objects):
        fill_object(t.obj[o, :, lane], item, scene)
        place = t.place[:, o, lane]
        place[s.OBJ_PLACE : s.OBJ_PLACE + 3], place[s.OBJ_V : s.OBJ_V + 3] = (
            item.place,
            item.velocity,
        )
        place[s.OBJ_OMEGA : s.OBJ_OMEGA + 3] = item.turn
        place[s.OBJ_TURN : s.OBJ_TURN + 4] = _to_quaternion(item.axes.T)
        place[s.OBJ_AXES : s.OBJ_AXES + 9] = item.axes.ravel()


def _fill_segments(table: np.ndarray, antenna: Antenna) -> None:
    share = antenna.mass_centre / antenna.segment_length
    lever = antenna.segment_mass * share
    hinge = antenna.inertia + lever * share * antenna.segment_length**2
    table[s.C_SHARE], table[s.C_LEVER], table[s.C_HINGE] = share, lever, hinge
    table[s.C_EXCESS] = (antenna.axial - hinge) / antenna.segment_length**2
    table[s.C_ACROSS], table[s.C_AXIAL] = antenna.inertia, antenna.axial - antenna.inertia
    for at, rows in (
        (s.C_STIFF, antenna.stiffness),
        (s.C_DAMP, antenna.damping),
        (s.C_SLACK, antenna.rest_angle),
    ):
        table[at : at + len(rows)] = rows


def _list_solids(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Rows (solid, field) of a scene's solids, object after object, and those of its hulls."""
    rows, hulls, n = [], [np.zeros((0, N_HULL))], 0
    for o, item in enumerate(scene.objects):
        if item.feature.unbounded:
            rows.append([o, s.SOLID_WALL, *np.zeros(9)])
        for corners in list_solids(item.feature):
            if len(corners) <= 2:
                kind = s.SOLID_BALL if len(corners) == 1 else s.SOLID_CAPSULE
                rows.append([o, kind, *corners[0], *corners[-1], 0, 0, 0])
                continue
            box = [*corners.min(axis=0), *corners.max(axis=0)]
            if is_box(corners):
                rows.append([o, s.SOLID_BOX, *box, 0, 0, 0])
                continue
            hull, n_faces = make_hull(corners)
            rows.append([o, s.SOLID_HULL, *box, n, n + n_faces, n + len(hull)])
            hulls.append(hull)
            n += len(hull)
    return np.array(rows).reshape(-1, s.N_SOLID), np.concatenate(hulls)


def _to_quaternion(matrix: np.ndarray) -> np.ndarray:
    """(w, x, y, z) of a rotation matrix."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(matrix).as_quat(), 1)


def _read_pose(quaternion: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.roll(quaternion, -1)).as_rotvec() + 0.0
