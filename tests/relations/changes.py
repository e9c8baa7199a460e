"""Every transformation of a world under which the answer is known."""

import atexit
import copy
import pickle
import re
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import feeler
from feeler.tensors import QUANTITIES
from feeler.tensors.formats import FORMATS
from tests.relations.relation import Answer, Change, on_arrays, pick
from tests.relations.worlds import (
    Animals,
    Bases,
    Bent,
    Calls,
    Film,
    Hand,
    Lines,
    Named,
    Record,
    Release,
    Scene,
    Touches,
    Wish,
    frame,
)

# ---- the mirror image -------------------------------------------------------------------------

SIDE = {"left": "right", "right": "left"}
ODD = {"rad", "1/mm", "rad/ms", "N*mm"}
"""Units of what changes sign in the mirror image, in the plane."""
SIGNS = {"plane": (-1, 1, -1), "axis": (-1, 1, 1), "pose": (-1, 1, -1)}
"""Of what has a row for each plane of bending, each axis, or x, y and heading."""


def mirror_quantity(name: str, item: xr.DataArray) -> xr.DataArray:
    """A quantity of the mirror image: its unit and its dims say which sign it has."""
    if name == "side":
        return xr.where(item == "left", "right", "left")
    if name == "unit_side":
        return -item
    for dim, signs in SIGNS.items():
        if dim in item.dims:
            size = item.sizes[dim]
            moment = name == "base_moment"
            signs = (1, -1, -1) if moment else (signs if size < 6 else (-1, 1, 1, 1, -1, -1))
            return item * xr.DataArray(np.array(signs[:size]), dims=dim)
    return -item if name in QUANTITIES and QUANTITIES[name].unit in ODD else item


def mirror_object(item: feeler.Object) -> feeler.Object:
    """An object's mirror image about the antenna at rest."""
    flip = {key: (-getattr(item, key)[0], getattr(item, key)[1]) for key in VECTORS}
    return item.replace(feature=item.feature.mirror(), turn=-item.turn, **flip)


VECTORS = ("place", "forward", "velocity")


def mirror_touches(world: Touches) -> Touches:
    return map_touches(world, lambda item: -item)


# ---- turned and moved -------------------------------------------------------------------------

TURN, SHIFT = 0.7, np.array([13.0, -8.0])
ROTATION = np.array([[np.cos(TURN), np.sin(TURN)], [-np.sin(TURN), np.cos(TURN)]])
KINDS = {
    **dict.fromkeys(("angle", "velocity", "base_moment"), "odd"),
    **dict.fromkeys(("tip", "shape", "place", "contacts.point"), "point"),
    **dict.fromkeys(("forward", "force", "base_force", "contacts.force"), "vector"),
    "contacts.normal": "vector",
    "base": "pose",
}
"""How what a simulation shows transforms; all else is a plain number."""


def turn_shown(name: str, item: xr.DataArray) -> xr.DataArray:
    kind, values = KINDS.get(name), item.values.copy()
    if kind in ("point", "vector"):
        values = values @ ROTATION.T + (SHIFT if kind == "point" else 0)
    if kind == "pose":
        values = np.append(ROTATION @ values[:2] + SHIFT, values[2] + TURN)
    return item.copy(data=values)


def mirror_shown(name: str, item: xr.DataArray) -> xr.DataArray:
    kind, values = KINDS.get(name), item.values.copy()
    signs = {"odd": -1, "point": (-1, 1), "vector": (-1, 1), "pose": (-1, 1, -1)}
    return item.copy(data=values * np.array(signs.get(kind, 1)) if kind else values)


def turn_hand(world: Hand) -> Hand:
    """Base and objects, turned about the origin and moved together."""
    time = np.linspace(0.0, 60.0, 7)
    pose = world.base.compute_pose(time)
    pose = np.column_stack([pose[:, :2] @ ROTATION.T + SHIFT, pose[:, 2] + TURN])
    objects = []
    for item in world.objects:
        moved = {key: ROTATION @ np.array(getattr(item, key)) for key in VECTORS}
        moved["place"] = moved["place"] + SHIFT
        objects.append(item.replace(**{key: tuple(v.tolist()) for key, v in moved.items()}))
    base = feeler.BaseMotion(time=time, pose=pose)
    return replace(world, base=base, objects=tuple(objects))


# ---- other units: a world of other numbers that moves in the same way --------------------------


def measure_in(time: float = 1.0, length: float = 1.0, mass: float = 1.0):
    """The same scene where the units of time, length and mass are so much smaller."""
    torque = mass * length**2 / time**2
    speed = length / time

    def apply(world: Scene) -> Scene:
        a = world.antenna
        contact = feeler.physics.contact.get_contact(None, a)
        antenna = a.replace(
            segment_length=a.segment_length * length,
            radius=a.radius * length,
            segment_mass=a.segment_mass * mass,
            stiffness=a.stiffness * torque,
            damping=a.damping * torque * time,
        )
        if (held := a.follicle) is not None:  # springs and dampers of places, not of angles
            firm = {"stiffness": mass / time**2, "damping": mass / time}
            fields = {k: tuple(np.multiply(getattr(held, k), v)) for k, v in firm.items()}
            antenna = antenna.replace(follicle=held.replace(**fields))
        trials = []
        for trial in world.trials:
            sizes = {k: v for k, v in trial.feature.to_plain().items() if isinstance(v, float)}
            feature = trial.feature.replace(**{k: v * length for k, v in sizes.items()})
            base = trial.base and feeler.BaseMotion(
                velocity=tuple(np.multiply(trial.base.velocity, speed)),
                turn=trial.base.turn / time,
            )
            moved = {"speed": trial.speed * speed, "lead": trial.lead * time, "base": base}
            trials.append(trial.replace(feature=feature, **moved))
        d_min, d_max, width, *rest = contact.solimp
        contact = replace(
            contact,
            solref=(contact.solref[0] * time, contact.solref[1]),
            solimp=(d_min, d_max, width * length, *rest),
            crossing=contact.crossing * time,
            lingering=contact.lingering * time,
        )
        options = {"sample_interval": 1.0, **world.options}
        options["contact"] = contact
        for name in ("duration", "sample_interval", "timestep"):
            options[name] *= time
        return replace(world, antenna=antenna, trials=tuple(trials), options=options)

    powers = {
        "1/mm": 1 / length, "rad/ms": 1 / time, "mm": length, "ms": time, "mm/ms": speed,
        "N": torque / length, "N*mm": torque, "uJ": torque,
    }  # fmt: skip

    def expect(name: str, item: xr.DataArray) -> xr.DataArray:
        if name == "base_pose":
            by = [length, length, 1.0] if item.sizes["pose"] == 3 else [length] * 3 + [1.0] * 3
            return item * xr.DataArray(by, dims="pose")
        unit = QUANTITIES[name].unit if name in QUANTITIES else {"picture": "1/mm"}.get(name)
        return item * powers[unit] if unit in powers else item

    return apply, on_arrays(expect)


def slow_down(world: Scene) -> Scene:
    """Half the speed for twice the time, of the same antenna."""
    trials = tuple(t.replace(speed=t.speed / 2, lead=t.lead * 2) for t in world.trials)
    doubled = {
        k: 2 * world.options.get(k, 1.0) for k in ("duration", "sample_interval", "timestep")
    }
    return replace(world, trials=trials, options={**world.options, **doubled})


def half_rates(name: str, item: xr.DataArray) -> xr.DataArray:
    power = {"rad/ms": 0.5, "mm/ms": 0.5, "ms": 2.0}
    unit = QUANTITIES[name].unit if name in QUANTITIES else ""
    return item * power[unit] if unit in power else item


def without(*names: str) -> Any:
    return lambda answer: {k: v for k, v in answer.items() if k.split()[0] not in names}


def keep_in_store(world: Scene) -> Scene:
    folder = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return replace(world, options={**world.options, "store": Path(folder, "set.zarr")})


# ---- before, between and after: snapshots, copies, pieces -----------------------------------


def drive_back(simulation: Any) -> Any:
    simulation.step(10.0)
    moment = simulation.snapshot()
    simulation.step(9.0)
    simulation.restore(moment)
    simulation.step(14.0)
    return simulation


def drive_copy(duplicate: Any) -> Any:
    def drive(simulation: Any) -> Any:
        simulation.step(10.0)
        other = duplicate(simulation)
        simulation.step(5.0)
        other.step(14.0)
        return other

    return drive


def drive_pieces(simulation: Any) -> Any:
    for piece in (0.05, 0.45, 9.5, 14.0):
        simulation.step(piece)
    return simulation


def restore_from(strange: Any, step: float = 10.0) -> Any:
    """Goes on from the snapshot of a simulation that is not this one."""

    def apply(world: Hand) -> Hand:
        def drive(simulation: Any) -> Any:
            other = build(strange(world))
            other.step(step)
            simulation.restore(other.snapshot())
            simulation.step(14.0)
            return simulation

        return replace(world, drive=drive)

    return apply


def build(world: Hand) -> feeler.Simulation:
    return feeler.Simulation(
        world.antenna, world.objects, base=world.base, **{"timestep": 0.05, **world.options}
    )


def tell_later(world: Hand) -> Hand:
    """The objects stand still at first and are told how to move; contact reckons with it."""

    def drive(simulation: Any) -> Any:
        for item in world.objects:
            simulation.move_object(item.name, item.velocity, item.turn)
        simulation.step(24.0)
        return simulation

    still = tuple(o.replace(velocity=(0.0, 0.0), turn=0.0) for o in world.objects)
    return replace(world, objects=still, drive=drive)


def others(world: Hand) -> dict[str, Hand]:
    """Simulations that are not the world's own, each in one thing."""
    ball, box = world.objects
    stiff = world.antenna.replace(stiffness=3 * world.antenna.stiffness)
    return {
        "antenna": replace(world, antenna=stiff),
        "objects": replace(world, objects=(ball.replace(feature=feeler.Ball(radius=1.2)), box)),
        "speed": replace(world, objects=(ball.replace(velocity=(0.2, 0.02)), box)),
        "fewer objects": replace(world, objects=(ball,)),
        "gravity": replace(world, options={"gravity": (0.0, -0.01)}),
        "timestep": replace(world, options={"timestep": 0.02}),
        "engine": replace(world, options={"engine": "mujoco"}),
    }


STRANGE = ("antenna", "objects", "speed", "fewer objects", "gravity", "timestep", "engine")

# ---- trials, sensors, amplitude ----------------------------------------------------------------


def map_touches(world: Touches, change: Any, parts: str = "clean learn ask") -> Touches:
    return replace(world, **{name: change(getattr(world, name)) for name in parts.split()})


def scale(world: Touches, by: float) -> Touches:
    """Amplitude and noise together."""
    return replace(map_touches(world, lambda item: item * by), noise=world.noise * by)


TAME = 2.0**-9
EXTREME = "squares are numbers"
"""What a refusal of numbers says whose squares are none."""


def lengthen(dim: str, count: int, axis_first: bool = False) -> Any:
    """Zeros after the last entry along a dim."""
    return lambda item: item.pad({dim: (0, count)}, constant_values=0.0)


def silence(item: xr.DataArray) -> xr.DataArray:
    """Three more trials in which nothing is felt."""
    return xr.concat([item, 0 * item[:3]], "trial")


def shuffle(dim: str) -> Any:
    return lambda item: item.isel({dim: _order(item.sizes[dim])})


def _order(size: int) -> np.ndarray:
    return np.random.default_rng(size).permutation(size)


def reorder(dim: str) -> Any:
    """An answer's rows along a dim, in the shuffled order; square tables have them twice."""

    def change(_: str, item: xr.DataArray) -> xr.DataArray:
        dims = [d for d in item.dims if d in (dim, f"other {dim}")]
        return item.isel({d: _order(item.sizes[d]) for d in dims})

    return on_arrays(change)


def take(rows: slice | list[int], parts: str = "ask") -> Any:
    return lambda world: map_touches(world, lambda item: item[rows], parts)


SOME = [3, 1]

# ---- files -------------------------------------------------------------------------------------


def reload(name: str) -> Any:
    """A Dataset written in a format and read again."""
    form = FORMATS[name]
    more = {"session_start": "2026-01-31T10:00:00+01:00", "identifier": "it"}

    def apply(world: Record) -> Record:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "set").with_suffix(form.suffix)
            feeler.save(world.dataset, path, **(more if name == "nwb" else {}))
            return Record(dataset=feeler.load(path, trusted=True).load())

    return apply


def first_angle(name: str) -> dict[str, Any]:
    """What is compared of a CSV, which holds one variable of one trial; else all is."""
    if name != "csv":
        return {}
    some = {"look": lambda a: {"angle": a["angle"]}}
    return some | {"expect": lambda a: {"angle": a["angle"][:1]}, "tolerance": 1e-6}


def mirror_record(world: Record) -> Record:
    data = world.dataset
    mirrored = {
        name: (item.dims, mirror_quantity(str(name), item).values, item.attrs)
        for name, item in data.variables.items()
        if name == "side" or name in data.data_vars
    }
    return Record(dataset=data.assign(mirrored))


# ---- films -------------------------------------------------------------------------------------


def move_film(world: Film) -> Film:
    """The same film, with the camera turned and moved."""
    return replace(world, columns={k: v @ ROTATION.T + 500 for k, v in world.columns.items()})


TIPS = {"left_tip": "right_tip", "right_tip": "left_tip"}


def mirror_film(world: Film) -> Film:
    flipped = {TIPS.get(k, k): v * [-1, 1] + [600, 0] for k, v in world.columns.items()}
    return replace(world, columns=flipped)


def swap_sides(answer: Answer) -> Answer:
    """A list of two belongs to the left and the right, as do rhythms; notes name the tips."""
    answer = {k: swap_tips(v) if "notes" in k else v for k, v in answer.items()}
    ends = {"[0]": "[1]", "[1]": "[0]"}
    paired = {k for k in answer if k.startswith("trials") and k[-3:] in ends}
    swapped = {(k[:-3] + ends[k[-3:]] if k in paired else k): v for k, v in answer.items()}
    other = {"rhythm.left.": "rhythm.right.", "rhythm.right.": "rhythm.left."}
    found: Answer = {}
    for key, value in swapped.items():
        behind = (
            key.endswith(("against right.lag", "against right.phase")) and value is not None
        )
        key = re.sub(r"rhythm\.(left|right)\.", lambda m: other[m[0]], key)
        found[key] = -value if behind else value
    return found


def swap_tips(words: str) -> str:
    """Words about the mirror image."""
    return re.sub("left_tip|right_tip", lambda m: TIPS[m[0]], words)


def enlarge(world: Film) -> Film:
    return replace(world, columns={k: v * 2.5 for k, v in world.columns.items()})


def say_rate(world: Film) -> Film:
    """The same frames, said to be half as many a second: twice the time at half the speed."""
    return replace(world, rate=world.rate / 2)


def half_speeds(answer: Answer) -> Answer:
    """Speeds and frequencies are half, as is the cut-off where it is told; lags are twice."""
    words = ("mean", "error", "speed", "cutoff", "cut_off", "frame_rate", ".frequency")
    lags = {k: 2 * v for k, v in answer.items() if k.endswith(".lag") and isinstance(v, float)}
    return lags | {
        k: v / 2 if isinstance(v, float) and any(w in k for w in words) else v
        for k, v in answer.items()
        if k not in lags
    }


def only_speeds(answer: Answer) -> Answer:
    """What is measured, without what is said of how."""
    return {k: v for k, v in answer.items() if "mean" in k and isinstance(v, float)}


def first_file(answer: Answer) -> Answer:
    return {k: v for k, v in answer.items() if k.startswith("trials[0].mean")}


def peak_of(side: int | None) -> Any:
    """The speed of one side, by its number; None: of the only one that was measured."""

    def take_peak(answer: Answer) -> Answer:
        peaks = [answer[f"trials[0].mean_peak[{k}]"] for k in (0, 1)]
        known = [peak for peak in peaks if peak is not None]
        assert side is not None or len(known) == 1
        return {"peak": known[0] if side is None else peaks[side]}

    return take_peak


def keep_clock(column: str) -> Any:
    return lambda world: replace(world, clock=column)


def doubt(name: str, likelihood: bool) -> Any:
    """Every fifteenth place of a landmark is not seen."""

    def apply(world: Film) -> Film:
        places = world.columns[name].copy()
        places[7::15] = np.nan
        return replace(world, columns={**world.columns, name: places})

    return apply


def reverse_columns(world: Film) -> Film:
    return replace(world, columns=dict(reversed(world.columns.items())))


# ---- boards ------------------------------------------------------------------------------------


def interrupt(*lines: bytes, at: int = 5) -> Any:
    """Something between two samples that is no sample."""
    return lambda world: replace(world, lines=(*world.lines[:at], *lines, *world.lines[at:]))


def map_release(world: Release, by: float) -> Release:
    columns = {k: v if k == "time" else v * by for k, v in world.columns.items()}
    return replace(world, columns=columns)


def after_a_session(world: Lines) -> Lines:
    """The board restarted after its clock had gone round once."""
    return replace(world, before=OLD_SESSION)


def mirror_bent(world: Bent) -> Bent:
    return replace(world, touches=tuple((time, -values) for time, values in world.touches))


def flip_mirrored(answer: Answer) -> Answer:
    """Once contact is noticed, one of two mirror images is judged as the other."""
    known = {k: answer.get(k.replace("mirrored", "since_contact"), 0) for k in answer}
    return {k: not v if "mirrored" in k and known[k] >= 0 else v for k, v in answer.items()}


def count_broken(answer: Answer) -> Answer:
    return {k: v for k, v in answer.items() if not k.endswith("broken")}


CLOCK = 2**32 / 1000  # ms after which a board's clock of microseconds goes round
OLD_SESSION = tuple(
    frame(30000 + k, (0.9 * CLOCK + 4 * k) % CLOCK if k < 3 else 4.0 * k) for k in range(6)
)

CHANGES = [
    # scenes: what touches return
    Change(name="mirror", of=Scene, tolerance=1e-7, expect=on_arrays(mirror_quantity),
           apply=lambda w: replace(w, trials=tuple(
               t.replace(side=SIDE[t.side]) for t in w.trials))),
    Change(name="alone", of=Scene, expect=pick(SOME, "trial"),
           apply=lambda w: replace(w, trials=tuple(w.trials[k] for k in SOME))),
    Change(name="permute trials", of=Scene, expect=pick([4, 2, 0, 1, 3], "trial"),
           apply=lambda w: replace(w, trials=tuple(w.trials[k] for k in (4, 2, 0, 1, 3)))),
    Change(name="append silent trials", of=Scene, look=pick(slice(5), "trial"),
           apply=lambda w: replace(w, trials=(*w.trials, w.trials[0].replace(lead=500.0)))),
    Change(name="every second sample", of=Scene, look=without("sink", "error"),
           expect=lambda a: pick(slice(None, None, 2), "time", "frame")(
               without("sink", "error")(a)),
           apply=lambda w: replace(w, options={**w.options, "sample_interval": 2.0})),
    *(Change(name=f"units of {unit}", of=Scene, apply=apply, expect=expect, tolerance=1e-6)
      for unit in ("time", "length", "mass")
      for apply, expect in [measure_in(**{unit: 4.0})]),
    Change(name="half the speed, twice the time", of=Scene, apply=slow_down,
           tolerance=1e-3, look=without("error"),
           expect=lambda a: without("error")(on_arrays(half_rates)(a))),
    Change(name="by MuJoCo", of=Scene, tolerance=5e-5, look=without("work", "timestep", "sink"),
           expect=without("work", "timestep", "sink"),
           apply=lambda w: replace(w, options={**w.options, "engine": "mujoco"})),
    Change(name="kept in a store", of=Scene, apply=keep_in_store),
    # simulations in the hand
    Change(name="mirror", of=Hand, tolerance=1e-6, expect=on_arrays(mirror_shown),
           apply=lambda w: replace(w, base=w.base.mirror(),
                                   objects=tuple(map(mirror_object, w.objects)))),
    Change(name="turn and move", of=Hand, apply=turn_hand, expect=on_arrays(turn_shown),
           tolerance=1e-6),
    Change(name="permute objects", of=Hand, tolerance=1e-6,
           expect=pick(slice(None, None, -1), "object"),
           apply=lambda w: replace(w, objects=w.objects[::-1])),
    Change(name="in pieces", of=Hand, apply=lambda w: replace(w, drive=drive_pieces)),
    Change(name="snapshot, step, restore, step", of=Hand,
           apply=lambda w: replace(w, drive=drive_back)),
    Change(name="pickle", of=Hand, apply=lambda w: replace(
        w, drive=drive_copy(lambda s: pickle.loads(pickle.dumps(s))))),
    Change(name="deepcopy", of=Hand, apply=lambda w: replace(w, drive=drive_copy(copy.deepcopy))),
    Change(name="told later", of=Hand, apply=tell_later, tolerance=0.02),
    *(Change(name=f"restore from another {what}", of=Hand, refusal="snapshot",
             apply=restore_from(lambda w, what=what: others(w)[what])) for what in STRANGE),
    # labelled arrays of touches and of spikes
    Change(name="mirror", of=Touches, apply=mirror_touches),
    Change(name="alone", of=Touches, apply=take(SOME), expect=pick(SOME, "trial", "other trial")),
    Change(name="permute trials", of=Touches, expect=reorder("trial"),
           apply=lambda w: map_touches(w, shuffle("trial"), "clean ask")),
    Change(name="permute sensors", of=Touches, expect=reorder("sensor"), tolerance=1e-6,
           apply=lambda w: map_touches(w, shuffle("sensor"))),
    Change(name="append silent trials", of=Touches, look=pick(slice(0, -3), "trial", "other trial"),
           or_refusal="constant",
           apply=lambda w: map_touches(w, silence, "ask")),
    *(Change(name=f"amplitude and noise times {by:g}", of=Touches, tolerance=1e-7,
             or_refusal=EXTREME if by != TAME else "",
             apply=lambda w, by=by: scale(w, by)) for by in (TAME, 1e-160, 1e-300, 1e150)),
    # Datasets and files
    *(Change(name=f"reload from {name}", of=Record, apply=reload(name), **first_angle(name))
      for name, form in FORMATS.items() if form.save is not None),
    Change(name="mirror", of=Record, apply=mirror_record, expect=on_arrays(mirror_quantity)),
    Change(name="permute trials", of=Record, expect=reorder("trial"),
           apply=lambda w: Record(dataset=shuffle("trial")(w.dataset))),
    # bases
    Change(name="append silent lags", of=Bases,
           apply=lambda w: replace(w, first=lengthen("lag", 7)(w.first),
                                   second=lengthen("lag", 3)(w.second))),
    Change(name="permute components", of=Bases, expect=reorder("component"),
           apply=lambda w: replace(w, first=shuffle("component")(w.first))),
    Change(name="scale", of=Bases, apply=lambda w: replace(w, first=w.first * 3.0)),
    Change(name="filter in time", of=Bases, apply=lambda w: replace(
        w, first=w.first.pad(lag=(0, 4), constant_values=0).pipe(
            lambda item: item + 0.5 * item.roll(lag=1) + 0.2 * item.roll(lag=4)))),
    # films
    Change(name="mirror", of=Film, apply=mirror_film, expect=swap_sides),
    Change(name="turn and move", of=Film, apply=move_film, tolerance=1e-6),
    Change(name="other units", of=Film, apply=enlarge, tolerance=1e-6),
    Change(name="permute landmarks", of=Film, apply=reverse_columns),
    Change(name="half the speed, twice the time", of=Film, apply=say_rate, expect=half_speeds,
           tolerance=1e-3),
    *(Change(name=f"rate by a column {column}", of=Film, apply=keep_clock(column),
             tolerance=1e-7) for column in ("time_s", "time_ms")),
    *(Change(name=f"{name} unseen at times", of=Film, apply=doubt(name, False), tolerance=0.05,
             expect=only_speeds, look=only_speeds) for name in ("abdomen", "left_tip")),
    *(Change(name=name, of=Film, tolerance=1e-6, expect=only_speeds, look=only_speeds,
             apply=lambda w, how=how: replace(w, **how)) for name, how in {
        "reload from nwb": {"through": "nwb"}, "in another format": {"form": "dlc"},
        "one animal of two": {"form": "two animals"},
    }.items()),
    *(Change(name=f"{side} alone", of=Film, expect=peak_of(k), look=peak_of(None), tolerance=1e-6,
             apply=lambda w, tips=tips: replace(w, options=(*w.options, "--tips", tips)))
      for k, side, tips in ((0, "left", "left_tip"), (1, "right", ",right_tip"))),
    Change(name="a rate that its clock contradicts", of=Film, refusal="frame",
           apply=lambda w: replace(w, clock="time_s", options=("--frame-rate", "30"))),
    Change(name="one file of two", of=Film, apply=lambda w: replace(w, through="two files"),
           expect=first_file, look=first_file),
    # boards
    *(Change(name=name, of=Lines, apply=interrupt(*lines)) for name, lines in {
        "a torn line": (b"5,.1,\n",), "a line begun late": (b"505,0.2\n",),
        "a bad byte": (b"5,0.\xff1,0.2,0.3\n",),
        "a banner": (b"ets Jun  8 2016 00:22:57\n", b"rst:0x1 (POWERON_RESET)\n"),
    }.items()),
    Change(name="after another session", of=Lines, apply=after_a_session),
    Change(name="opened in mid-line", of=Lines, apply=interrupt(b"3,0.2\n", at=0)),
    Change(name="other separators", of=Lines, apply=lambda w: replace(
        w, lines=tuple(line.replace(b",", b";\t") for line in w.lines))),
    # a robot's touches
    Change(name="mirror", of=Bent, apply=mirror_bent, expect=flip_mirrored),
    Change(name="alone", of=Bent, apply=lambda w: replace(w, touches=w.touches[:1]),
           expect=lambda a: {k: v for k, v in a.items() if k.startswith("0")}),
    Change(name="torn lines", of=Bent, expect=count_broken, look=count_broken,
           or_refusal="line 1", apply=lambda w: replace(w, torn=True)),
    # the studio
    Change(name="mirror", of=Wish, tolerance=1e-5,
           apply=lambda w: replace(w, wish={**w.wish, "side": "right"}),
           expect=on_arrays(lambda name, item: -item if name == "angle" else item)),
    # encoders: the order of calls
    *(Change(name=f"{what} in between", of=Calls,
             apply=lambda w, what=what: replace(w, calls=(w.calls[0], what, *w.calls[1:])))
      for what in ("pickle", "save")),
    *(Change(name=f"{what} after it", of=Calls, tolerance=0.05,
             apply=lambda w, what=what: replace(w, calls=(*w.calls, what)))
      for what in ("partial_fit", "fit_stream")),
    # antennas by name; releases
    Change(name="alone", of=Named, expect=lambda a: {
               k: v for k, v in a.items() if k.startswith(("linear", "posture", "units"))},
           apply=lambda w: replace(w, names=("linear",))),
    Change(name="permute antennas", of=Named,
           apply=lambda w: replace(w, names=w.names[::-1])),
    *(Change(name=f"time as {clock}", of=Release, tolerance=1e-6,
             apply=lambda w, clock=clock: replace(w, clock=clock))
      for clock in ("time_s", "frame")),
    Change(name="mirror", of=Release, tolerance=1e-6, apply=lambda w: map_release(w, -1.0)),
    Change(name="other units", of=Release, tolerance=1e-6, apply=lambda w: map_release(w, 40.0)),
    # animals that are calibrated
    Change(name="alone", of=Animals, expect=pick([0], "trial"),
           apply=lambda w: replace(w, antennas=w.antennas[:1])),
    Change(name="permute trials", of=Animals, expect=pick([2, 0, 1], "trial"),
           apply=lambda w: replace(w, antennas=tuple(w.antennas[k] for k in (2, 0, 1)))),
]  # fmt: skip
"""One list; what does not apply to a producer is in test_relations.py, with its reason."""
