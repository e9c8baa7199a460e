"""One compiled step of all lanes in space, and the lanes filled with scenes."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from feeler.antenna.segments import Antenna, to_matrix
from feeler.compiled import compiled, inlined, nested
from feeler.objects.distance import N_HULL, make_hull
from feeler.objects.meshes import is_box, list_solids
from feeler.physics.chain import fields as f
from feeler.physics.chain.contact import keep
from feeler.physics.chain.model import fill_object, fill_segments
from feeler.physics.chain.space_contact import (
    clear_in_space,
    find_in_space,
    make_rows_in_space,
    press_in_space,
    solve_in_space,
)
from feeler.physics.chain.space_sweep import fold_in_space, locate_in_space, move_in_space
from feeler.physics.chain.stepper import MAX_CONTACTS, ChainStepper, make_table
from feeler.physics.engine import Contacts, State
from feeler.physics.scene import Scene

# One step of all lanes in space, compiled, as :mod:`feeler.physics.chain.stepper` in the plane.


class _SpaceTables(NamedTuple):
    """All that the compiled step reads and writes; names and axes as in the plane, but for
    ``place`` (field, object, lane), ``solids`` (lane, solid, field) and ``hulls`` (lane, row of
    :func:`feeler.objects.distance.make_hull`, column).
    """

    constants: np.ndarray
    work: np.ndarray
    base: np.ndarray
    obj: np.ndarray
    place: np.ndarray
    solids: np.ndarray
    hulls: np.ndarray
    contacts: np.ndarray
    rows: np.ndarray
    memory: np.ndarray
    number: np.ndarray
    open: np.ndarray
    loaded: np.ndarray
    # planes, whether some base gives way, whether something flows: the compiler knows how long a
    # tuple is, and leaves out what nobody asks for
    kind: tuple
    width: tuple


@compiled
def _record_in_space(handle, tape, sample, stop, every, timestep, drive, damped):
    """Take ``every`` steps before each sample and write it to ``tape``, as ``record_many``;
    ``drive`` is (step or 1, 6, lane).
    """
    return _record_tables(handle.tables, tape, sample, stop, every, timestep, drive, damped)


@nested
def _record_tables(t, tape, sample, stop, every, timestep, drive, damped):
    n = t.work.shape[1]
    for row in range(sample, stop):
        for step in range((row - sample) * every, (row - sample) * every + every):
            now = drive[min(step, drive.shape[0] - 1)]
            for lane in range(t.number.shape[0]):
                for k in range(6):  # accelerations bring the base to the driven velocity
                    change = now[k, lane] - t.base[0, f.BASE_V + k, lane]
                    t.base[0, f.BASE_A + k, lane] = change / timestep
            touched = _find(t)
            if touched:
                _push(t, timestep, damped)
            if not (touched and damped):
                fold_in_space(t.constants, t.work, t.base, t.loaded, t.kind, timestep, t.width)
            if touched:
                t.loaded[:] = False
                for lane in range(t.number.shape[0]):
                    clear_in_space(t.work, t.rows[lane], f.EDGES * t.number[lane], lane)
            _count_work(t.base, timestep)
            _carry(t.base, t.place, now, timestep)
            move_in_space(t.constants, t.work, t.base, t.kind, timestep, t.width)
            _count_work(t.base, timestep)
        for lane in range(tape.shape[0]):
            _write(t, tape[lane, row], lane)
        for lane in range(t.number.shape[0]):
            if t.number[lane] < 0 or not _is_finite(t.work, n, lane):
                return row + 1, True
    return stop, False


@inlined
def _is_finite(work, n, lane):
    """Whether a lane's numbers are; all that is lost shows in the last segment."""
    total = 0.0
    for k in range(3):
        total += work[f.SEG_ALONG + k, n - 1, lane] + work[f.OMEGA + k, n - 1, lane]
    return np.isfinite(total)


@inlined
def _count_work(base, timestep):
    """Half a step's work of the base on hinge 1; called before and after it moves."""
    for lane in range(base.shape[2]):
        for k in range(3):
            force = base[0, f.BASE_FORCE + k, lane] * base[0, f.ROOT_V + k, lane]
            moment = base[0, f.BASE_MOMENT + k, lane] * base[0, f.BASE_OMEGA + k, lane]
            base[0, f.BASE_WORK, lane] += 0.5 * timestep * (force + moment)


@inlined
def _carry(base, place, drive, timestep):
    """Move base and objects."""
    for lane in range(base.shape[2]):
        for k in range(6):
            base[0, f.BASE_V + k, lane] = drive[k, lane]
        for k in range(3):
            base[0, f.BASE_PLACE + k, lane] += timestep * drive[k, lane]
        turn(base[0], f.BASE_TURN, f.BASE_OMEGA, f.BASE_AXES, timestep, lane)
        for o in range(place.shape[1]):
            for k in range(3):
                place[f.OBJ_PLACE + k, o, lane] += timestep * place[f.OBJ_V + k, o, lane]
            turn(place[:, o], f.OBJ_TURN, f.OBJ_OMEGA, f.OBJ_AXES, timestep, lane)


@inlined
def turn(table, quaternion, omega, axes, timestep, lane):
    """Turn a body's quaternion by its angular velocity, and write its axes one after the other."""
    x, y, z = table[omega, lane], table[omega + 1, lane], table[omega + 2, lane]
    size = np.sqrt(x * x + y * y + z * z)
    a, b, c, d = (
        table[quaternion, lane],
        table[quaternion + 1, lane],
        table[quaternion + 2, lane],
        table[quaternion + 3, lane],
    )
    if size * timestep != 0.0:
        w, sine = np.cos(0.5 * timestep * size), np.sin(0.5 * timestep * size) / size
        x, y, z = sine * x, sine * y, sine * z
        a, b, c, d = (
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c + y * a + z * b - x * d,
            w * d + z * a + x * c - y * b,
        )
        size = np.sqrt(a * a + b * b + c * c + d * d)
        a, b, c, d = a / size, b / size, c / size, d / size
        table[quaternion, lane], table[quaternion + 1, lane] = a, b
        table[quaternion + 2, lane], table[quaternion + 3, lane] = c, d
    table[axes, lane] = a * a + b * b - c * c - d * d
    table[axes + 1, lane], table[axes + 2, lane] = 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)
    table[axes + 3, lane] = 2.0 * (b * c - a * d)
    table[axes + 4, lane] = a * a - b * b + c * c - d * d
    table[axes + 5, lane] = 2.0 * (c * d + a * b)
    table[axes + 6, lane], table[axes + 7, lane] = 2.0 * (b * d + a * c), 2.0 * (c * d - a * b)
    table[axes + 8, lane] = a * a - b * b - c * c + d * d


@inlined
def _find(t):
    """Each lane's contacts, and whether there are any; a crowded lane gets the count −1 for
    good.
    """
    locate_in_space(t.work, t.base, t.work.shape[1] - 1, t.width)
    touched = False
    for lane in range(t.number.shape[0]):
        keep(t.rows[lane], max(t.number[lane], 0), t.memory[lane], f.EDGES)
        t.number[lane] = min(t.number[lane], 0)
        t.base[0, f.BASE_PRESS, lane] = t.base[0, f.BASE_SPOT, lane] = 0.0
        for o in range(t.place.shape[1]):
            for k in range(3):
                t.place[f.OBJ_FORCE + k, o, lane] = 0.0
        for k in range(t.solids.shape[1]):
            if t.number[lane] >= 0 and t.solids[lane, k, f.S_OBJECT] >= 0.0:
                t.number[lane] = find_in_space(
                    t.constants,
                    t.work,
                    t.obj,
                    t.place,
                    t.solids[lane, k],
                    t.hulls[lane],
                    t.contacts[lane],
                    t.number[lane],
                    lane,
                )
        touched = touched or t.number[lane] > 0
    return touched


@inlined
def _push(t, timestep, damped):
    """Solve the contacts and leave their wrenches in the bias columns, or the hinges as ``fold``
    leaves them.
    """
    last = np.int64(-1)
    for lane in range(t.number.shape[0]):
        count = t.number[lane]
        if count > 0:
            make_rows_in_space(
                t.constants,
                t.work,
                t.base,
                t.obj,
                t.contacts[lane],
                count,
                t.place,
                t.rows[lane],
                lane,
            )
            for k in range(count):
                last = max(last, np.int64(t.contacts[lane, k, f.HIT_SEGMENT]))
    solve_in_space(
        t.constants,
        t.work,
        t.base,
        t.rows,
        t.number,
        t.loaded,
        t.memory,
        t.open,
        timestep if damped else 0.0,
        last,
        t.kind,
        t.width,
    )
    t.loaded[:] = False
    for lane in range(t.number.shape[0]):
        if t.number[lane] > 0:
            press_in_space(
                t.constants,
                t.work,
                t.base,
                t.place,
                t.contacts[lane],
                t.rows[lane],
                f.EDGES * t.number[lane],
                t.loaded,
                timestep,
                lane,
            )


@inlined
def _write(t, row, lane):
    n, at = t.work.shape[1], 0
    for table in (f.ANGLE, f.RATE):
        for p in range(len(t.kind[0])):
            for i in range(n):
                row[at] = t.work[table + p, i, lane] + 0.0  # no negative zeros
                at += 1
    row[at : at + 5] = 0.0
    for o in range(t.place.shape[1]):
        for k in range(3):
            row[at + k] += t.place[f.OBJ_FORCE + k, o, lane]
        row[at + 4] += t.place[f.OBJ_WORK, o, lane]
    row[at + 3] = t.base[0, f.BASE_WORK, lane] + 0.0
    _write_pose(t.base, row[at + 5 : at + 11], lane)
    for k in range(6):
        row[at + 11 + k] = t.base[0, f.BASE_FORCE + k, lane] + 0.0
    pressed = t.base[0, f.BASE_PRESS, lane]
    row[at + 17] = t.base[0, f.BASE_SPOT, lane] / pressed if pressed > 0.0 else np.nan
    row[at + 18] = t.base[0, f.BASE_SINK, lane] + 0.0


@inlined
def _write_pose(base, row, lane):
    """Hinge 1's place and the base's rotation vector (6,)."""
    w, size = base[0, f.BASE_TURN, lane], 0.0
    for k in range(3):
        row[k] = base[0, f.ROOT + k, lane] + 0.0
        row[3 + k] = base[0, f.BASE_TURN + 1 + k, lane]
        size += row[3 + k] * row[3 + k]
    size = np.sqrt(size)
    angle = 2.0 * np.arctan2(size, abs(w))
    factor = (angle / size if size > 0.0 else 2.0) * (1.0 if w >= 0.0 else -1.0)
    for k in range(3):
        row[3 + k] = factor * row[3 + k] + 0.0


# Lanes filled with scenes in space.


class SpaceChainStepper(ChainStepper):
    """Scenes in space of one segment count and one number of planes, one per lane."""

    label, rows_each, sink = "chain in space", f.EDGES, f.BASE_SINK
    commanded = slice(f.BASE_V, f.BASE_V + 6)
    record_lanes = staticmethod(_record_in_space)

    def _make_tables(self) -> _SpaceTables:
        return _make_tables(self.scenes)

    def _move(self) -> None:
        t = self.tables
        move_in_space(t.constants, t.work, t.base, t.kind, 0.0, t.width)

    def read(self) -> State:
        """The state of every lane, as copies."""
        t, lanes = self.tables, len(self.scenes)
        work, place, base = (table + 0.0 for table in (t.work[: f.TORQUE], t.place, t.base[0]))
        pose = [_read_pose(base[f.BASE_TURN : f.BASE_TURN + 4, lane]) for lane in range(lanes)]
        pressed = np.where(base[f.BASE_PRESS] > 0, base[f.BASE_PRESS], np.nan)

        def pick(k: int) -> np.ndarray:
            return place[k : k + 3].transpose(2, 1, 0)

        return State(
            angle=work[f.ANGLE : f.ANGLE + len(t.kind[0])].transpose(2, 0, 1),
            velocity=work[f.RATE : f.RATE + len(t.kind[0])].transpose(2, 0, 1),
            force=pick(f.OBJ_FORCE),
            place=pick(f.OBJ_PLACE),
            forward=pick(f.OBJ_AXES),
            object_work=place[f.OBJ_WORK].T,
            base=np.concatenate([base[f.ROOT : f.ROOT + 3].T, pose], axis=1),
            base_force=base[f.BASE_FORCE : f.BASE_FORCE + 3].T,
            base_moment=base[f.BASE_MOMENT : f.BASE_MOMENT + 3].T,
            base_work=base[f.BASE_WORK],
            contact_place=base[f.BASE_SPOT] / pressed,
            sink=base[f.BASE_SINK],
        )

    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of a lane's last step."""
        t, count = self.tables, max(self.tables.number[lane], 0)
        table = t.contacts[lane, :count]
        rows = t.rows[lane, : f.EDGES * count].reshape(count, f.EDGES, f.N_SPACE_ROW)
        segment, antenna = table[:, f.HIT_SEGMENT].astype(int), self.scenes[lane].antenna
        share = np.clip(table[:, f.HIT_SHARE], 0.0, 1.0)
        arc = antenna.hinge_position[segment] + share * antenna.segment_length[segment]
        force = np.maximum(rows[:, :, f.R_FORCE, None], 0.0)
        return Contacts(
            object=table[:, f.HIT_OBJECT].astype(int),
            segment=segment + 1,
            place=arc / antenna.length,
            point=table[:, f.HIT_POINT : f.HIT_POINT + 3].copy(),
            normal=table[:, f.HIT_NORMAL : f.HIT_NORMAL + 3].copy(),
            distance=table[:, f.HIT_DISTANCE].copy(),
            force=(force * rows[:, :, f.R_W0 + 3 : f.R_W0 + 6]).sum(axis=1),
        )

    def find_broken(self) -> np.ndarray:
        """Whether each lane has left the finite numbers or had too many contacts."""
        work = self.tables.work
        total = work[f.SEG_ALONG : f.OMEGA + 3, -1].sum(axis=0)
        return ~np.isfinite(total) | (self.tables.number < 0)

    def move_object(self, lane: int, o: int, velocity: Any, turn: Any) -> None:
        """From the next step on the object moves like this."""
        self.tables.place[f.OBJ_V : f.OBJ_OMEGA + 3, o, lane] = *velocity, *turn

    def read_rates(self, lane: int) -> tuple[np.ndarray, np.ndarray]:
        """What base (6,) and objects (object, 6) are commanded."""
        count = len(self.scenes[lane].objects)
        own = self.tables.place[f.OBJ_V : f.OBJ_OMEGA + 3, :count, lane]
        return self.drive[0, :, lane].copy(), own.T.copy()

    def _refill(self, lane: int, scene: Scene) -> bool:
        return False


def _make_tables(scenes: Sequence[Scene]) -> _SpaceTables:
    antenna, lanes = scenes[0].antenna, len(scenes)
    n, n_objects = antenna.n_segments, max(len(scene.objects) for scene in scenes)
    found = [_list_solids(scene) for scene in scenes]
    solids, hulls = [rows for rows, _ in found], [rows for _, rows in found]
    n_solids = max(map(len, solids))
    size = min(2 * max(n_solids, 1) * (n + 2), MAX_CONTACTS)
    tables = _SpaceTables(
        constants=make_table(f.N_SPACE_CONSTANTS, n, lanes)[0],
        work=make_table(f.N_SPACE_WORK, n, lanes)[0],
        base=np.zeros((1, f.N_SPACE_BASE, lanes)),
        obj=np.zeros((n_objects, f.N_OBJECT, lanes)),
        place=np.zeros((f.N_SPACE_PLACE, n_objects, lanes)),
        solids=np.full((lanes, n_solids, f.N_SOLID), -1.0),
        hulls=np.zeros((lanes, max(map(len, hulls)), N_HULL)),
        contacts=np.empty((lanes, size, f.N_SPACE_CONTACT)),
        rows=np.empty((lanes, f.EDGES * size, f.N_SPACE_ROW)),
        memory=np.empty((lanes, size + 1, f.N_SPACE_MEMORY)),
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


def _fill(t: _SpaceTables, lane: int, scene: Scene) -> None:
    """Put one scene's constants and first state into its lane."""
    own = t.constants[:, :, lane]
    fill_segments(own, scene.antenna, scene.contact)
    _fill_segments(own, scene.antenna)
    planes = slice(len(t.kind[0]))
    t.work[f.ANGLE :, :, lane][planes] = scene.initial_angle
    t.work[f.RATE :, :, lane][planes] = scene.initial_velocity
    base, pose = t.base[0, :, lane], scene.base_pose
    base[f.BASE_PLACE : f.BASE_PLACE + 3], base[f.BASE_V : f.BASE_V + 6] = (
        pose[:3],
        scene.base_velocity,
    )
    base[f.BASE_TURN : f.BASE_TURN + 4] = _to_quaternion(to_matrix(pose[3:]))
    base[f.BASE_AXES : f.BASE_AXES + 9] = to_matrix(pose[3:]).T.ravel()
    base[f.BASE_GRAVITY : f.BASE_GRAVITY + 3] = scene.gravity
    base[f.ROOT : f.ROOT + 3], base[f.GIVE_HELD] = pose[:3], np.inf
    if (follicle := scene.antenna.follicle) is not None:
        base[f.GIVE_STIFF : f.GIVE_STIFF + 3] = follicle.stiffness
        base[f.GIVE_DAMP : f.GIVE_DAMP + 3], base[f.GIVE_HELD] = follicle.damping, 0.0
    if (flow := scene.flow) is not None:
        length = scene.antenna.segment_length
        own[f.C_FLOW], own[f.C_FLOW + 1] = flow.drag * length, (flow.along - flow.drag) * length
        base[f.FLOW_V : f.FLOW_V + 3] = flow.velocity
    for o, item in enumerate(scene.objects):
        fill_object(t.obj[o, :, lane], item, scene)
        place = t.place[:, o, lane]
        place[f.OBJ_PLACE : f.OBJ_PLACE + 3], place[f.OBJ_V : f.OBJ_V + 3] = (
            item.place,
            item.velocity,
        )
        place[f.OBJ_OMEGA : f.OBJ_OMEGA + 3] = item.turn
        place[f.OBJ_TURN : f.OBJ_TURN + 4] = _to_quaternion(item.axes.T)
        place[f.OBJ_AXES : f.OBJ_AXES + 9] = item.axes.ravel()


def _fill_segments(table: np.ndarray, antenna: Antenna) -> None:
    share = antenna.mass_centre / antenna.segment_length
    lever = antenna.segment_mass * share
    hinge = antenna.inertia + lever * share * antenna.segment_length**2
    table[f.C_SHARE], table[f.C_LEVER], table[f.C_HINGE] = share, lever, hinge
    table[f.C_EXCESS] = (antenna.axial - hinge) / antenna.segment_length**2
    table[f.C_ACROSS], table[f.C_AXIAL] = antenna.inertia, antenna.axial - antenna.inertia
    for at, rows in (
        (f.C_STIFF, antenna.stiffness),
        (f.C_DAMP, antenna.damping),
        (f.C_SLACK, antenna.rest_angle),
    ):
        table[at : at + len(rows)] = rows


def _list_solids(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Rows (solid, field) of a scene's solids, object after object, and those of its hulls."""
    rows, hulls, n = [], [np.zeros((0, N_HULL))], 0
    for o, item in enumerate(scene.objects):
        if item.feature.unbounded:
            rows.append([o, f.SOLID_WALL, *np.zeros(9)])
        for corners in list_solids(item.feature):
            if len(corners) <= 2:
                kind = f.SOLID_BALL if len(corners) == 1 else f.SOLID_CAPSULE
                rows.append([o, kind, *corners[0], *corners[-1], 0, 0, 0])
                continue
            box = [*corners.min(axis=0), *corners.max(axis=0)]
            if is_box(corners):
                rows.append([o, f.SOLID_BOX, *box, 0, 0, 0])
                continue
            hull, n_faces = make_hull(corners)
            rows.append([o, f.SOLID_HULL, *box, n, n + n_faces, n + len(hull)])
            hulls.append(hull)
            n += len(hull)
    return np.array(rows).reshape(-1, f.N_SOLID), np.concatenate(hulls)


def _to_quaternion(matrix: np.ndarray) -> np.ndarray:
    """(w, x, y, z) of a rotation matrix."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(matrix).as_quat(), 1)


def _read_pose(quaternion: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.roll(quaternion, -1)).as_rotvec() + 0.0
