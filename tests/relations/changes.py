"""Every transformation of a world under which the answer is known."""

import atexit
import copy
import pickle
import re
import shutil
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import feeler
from feeler.physics.contact import get_contact
from feeler.tensors import QUANTITIES
from feeler.tensors.formats import FORMATS
from tests.relations.relation import Answer, Change, on_arrays, pick
from tests.relations.worlds import World, frame


def turn(*names: str, by: Any) -> Any:
    """What changes each of these parts of a world."""
    return lambda w: w.but(**{name: by(getattr(w, name)) for name in names})


def rows_of(name: str, rows: Any) -> Any:
    return turn(name, by=lambda items: tuple(items[k] for k in rows))


def keys(test: Any) -> Any:
    """The part of an answer whose keys pass."""
    return lambda answer: {k: v for k, v in answer.items() if test(k)}


def without(*names: str) -> Any:
    return keys(lambda key: key.split()[0] not in names)


# ---- the mirror image; turned and moved -------------------------------------------------------

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


def mirror_record(dataset: xr.Dataset) -> xr.Dataset:
    return dataset.assign({
        name: (item.dims, mirror_quantity(str(name), item).values, item.attrs)
        for name, item in dataset.variables.items()
        if name == "side" or name in dataset.data_vars
    })  # fmt: skip


VECTORS = ("place", "forward", "velocity")
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


def mirror_object(item: feeler.Object) -> feeler.Object:
    """An object's mirror image about the antenna at rest."""
    flip = {key: (-getattr(item, key)[0], getattr(item, key)[1]) for key in VECTORS}
    return item.replace(feature=item.feature.mirror(), turn=-item.turn, **flip)


def mirror_shown(name: str, item: xr.DataArray) -> xr.DataArray:
    signs = {"odd": -1, "point": (-1, 1), "vector": (-1, 1), "pose": (-1, 1, -1)}
    return item * np.array(signs[KINDS[name]]) if name in KINDS else item


def turn_shown(name: str, item: xr.DataArray) -> xr.DataArray:
    kind, values = KINDS.get(name), item.values
    if kind in ("point", "vector"):
        values = values @ ROTATION.T + (SHIFT if kind == "point" else 0)
    if kind == "pose":
        values = np.append(ROTATION @ values[:2] + SHIFT, values[2] + TURN)
    return item.copy(data=values)


def turn_hand(world: World) -> World:
    """Base and objects, turned about the origin and moved together."""
    time = np.linspace(0.0, 60.0, 7)
    pose = world.base.compute_pose(time)
    pose = np.column_stack([pose[:, :2] @ ROTATION.T + SHIFT, pose[:, 2] + TURN])
    objects = []
    for item in world.objects:
        moved = {key: ROTATION @ np.array(getattr(item, key)) for key in VECTORS}
        moved["place"] = moved["place"] + SHIFT
        objects.append(item.replace(**{key: tuple(v.tolist()) for key, v in moved.items()}))
    return world.but(base=feeler.BaseMotion(time=time, pose=pose), objects=tuple(objects))


# ---- other units: a world of other numbers that moves in the same way --------------------------


def measure_in(time: float = 1.0, length: float = 1.0, mass: float = 1.0) -> dict[str, Any]:
    """The same scene where the units of time, length and mass are so much smaller."""
    torque, speed = mass * length**2 / time**2, length / time

    def scale(item: Any, **by: float) -> Any:
        """A record with some of its fields multiplied, be they numbers, tuples or arrays."""
        fields = {name: getattr(item, name) for name in by}
        return item.replace(**{
            name: tuple(np.multiply(value, by[name])) if isinstance(value, tuple)
            else value * by[name] for name, value in fields.items()
        })  # fmt: skip

    def apply(world: World) -> World:
        a, contact = world.antenna, get_contact(None, world.antenna)
        antenna = scale(a, segment_length=length, radius=length, segment_mass=mass,
                        stiffness=torque, damping=torque * time)  # fmt: skip
        if a.follicle is not None:  # springs and dampers of places, not of angles
            held = scale(a.follicle, stiffness=mass / time**2, damping=mass / time)
            antenna = antenna.replace(follicle=held)
        trials = []
        for trial in world.trials:
            sizes = [k for k, v in trial.feature.to_plain().items() if isinstance(v, float)]
            trials.append(scale(trial, speed=speed, lead=time).replace(
                feature=scale(trial.feature, **dict.fromkeys(sizes, length)),
                base=trial.base and scale(trial.base, velocity=speed, turn=1 / time),
            ))  # fmt: skip
        d_min, d_max, width, *rest = contact.solimp
        contact = scale(contact, crossing=time, lingering=time).replace(
            solref=(contact.solref[0] * time, contact.solref[1]),
            solimp=(d_min, d_max, width * length, *rest),
        )
        options = {"sample_interval": 1.0, **world.options, "contact": contact}
        options |= {k: options[k] * time for k in ("duration", "sample_interval", "timestep")}
        return world.but(antenna=antenna, trials=tuple(trials), options=options)

    powers = {
        "1/mm": 1 / length, "rad/ms": 1 / time, "mm": length, "ms": time, "mm/ms": speed,
        "N": torque / length, "N*mm": torque, "uJ": torque,
    }  # fmt: skip

    def expect(name: str, item: xr.DataArray) -> xr.DataArray:
        if name == "base_pose":
            by = [length, length, 1.0] if item.sizes["pose"] == 3 else [length] * 3 + [1.0] * 3
            return item * xr.DataArray(by, dims="pose")
        unit = QUANTITIES[name].unit if name in QUANTITIES else {"picture": "1/mm"}.get(name)
        return item * powers.get(unit, 1) if unit in powers else item

    return {"apply": apply, "expect": on_arrays(expect)}


def slow_down(world: World) -> World:
    """Half the speed for twice the time, of the same antenna."""
    trials = tuple(t.replace(speed=t.speed / 2, lead=t.lead * 2) for t in world.trials)
    options = {"sample_interval": 1.0, **world.options}
    options |= {k: 2 * options[k] for k in ("duration", "sample_interval", "timestep")}
    return world.but(trials=trials, options=options)


def half_rates(name: str, item: xr.DataArray) -> xr.DataArray:
    power = {"rad/ms": 0.5, "mm/ms": 0.5, "ms": 2.0}
    unit = QUANTITIES[name].unit if name in QUANTITIES else ""
    return item * power[unit] if unit in power else item


def choose(**options: Any) -> Any:
    return lambda w: w.but(options={**w.options, **options})


def keep_in_store(world: World) -> World:
    folder = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return choose(store=Path(folder, "set.zarr"))(world)


# ---- before, between and after: snapshots, copies, pieces -----------------------------------


def drive_back(simulation: Any) -> None:
    simulation.step(10.0)
    moment = simulation.snapshot()
    simulation.step(9.0)
    simulation.restore(moment)
    simulation.step(14.0)


def drive_copy(duplicate: Any, simulation: Any) -> Any:
    simulation.step(10.0)
    other = duplicate(simulation)
    simulation.step(5.0)
    other.step(14.0)
    return other


def drive_pieces(simulation: Any) -> None:
    for piece in (0.05, 0.45, 9.5, 14.0):
        simulation.step(piece)


def build(world: World) -> feeler.Simulation:
    options = {"timestep": 0.05, **world.options}
    return feeler.Simulation(world.antenna, world.objects, base=world.base, **options)


def restore_from(strange: Any) -> Any:
    """Goes on from the snapshot of a simulation that is not this one."""

    def apply(world: World) -> World:
        def drive(simulation: Any) -> None:
            other = build(strange(world))
            other.step(10.0)
            simulation.restore(other.snapshot())

        return world.but(drive=drive)

    return apply


STRANGE = {
    "antenna": turn("antenna", by=lambda a: a.replace(stiffness=3 * a.stiffness)),
    "objects": turn(
        "objects", by=lambda o: (o[0].replace(feature=feeler.Ball(radius=1)), o[1])
    ),
    "speed": turn("objects", by=lambda o: (o[0].replace(velocity=(0.2, 0.02)), o[1])),
    "fewer objects": rows_of("objects", [0]),
    "gravity": choose(gravity=(0.0, -0.01)),
    "timestep": choose(timestep=0.02),
    "engine": choose(engine="mujoco"),
}
"""Simulations that are not the world's own, each in one thing."""


def tell_later(world: World) -> World:
    """The objects stand still at first and are told how to move; contact reckons with it."""

    def drive(simulation: Any) -> None:
        for item in world.objects:
            simulation.move_object(item.name, item.velocity, item.turn)
        simulation.step(24.0)

    still = tuple(o.replace(velocity=(0.0, 0.0), turn=0.0) for o in world.objects)
    return world.but(objects=still, drive=drive)


# ---- trials, sensors, amplitude; files ---------------------------------------------------------

ALL = ("clean", "learn", "ask")
TAME = 2.0**-9
EXTREME = "squares are numbers"
"""What a refusal of numbers says whose squares are none."""


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


def reload(name: str) -> Any:
    """A Dataset written in a format and read again."""
    more = {"session_start": "2026-01-31T10:00:00+01:00", "identifier": "it"}

    def apply(dataset: xr.Dataset) -> xr.Dataset:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "set").with_suffix(FORMATS[name].suffix)
            feeler.save(dataset, path, **(more if name == "nwb" else {}))
            return feeler.load(path, trusted=True).load()

    return turn("dataset", by=apply)


# ---- films -------------------------------------------------------------------------------------


def move_places(by: Any) -> Any:
    return turn("columns", by=lambda columns: {k: by(v) for k, v in columns.items()})


TIPS = {"left_tip": "right_tip", "right_tip": "left_tip"}


def mirror_film(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {TIPS.get(k, k): v * [-1, 1] + [600, 0] for k, v in columns.items()}


def swap_sides(answer: Answer) -> Answer:
    """A list of two belongs to the left and the right, as do rhythms; notes name the tips."""
    ends = {"[0]": "[1]", "[1]": "[0]"}
    sides = {"rhythm.left.": "rhythm.right.", "rhythm.right.": "rhythm.left."}
    found: Answer = {}
    for key, value in answer.items():
        if "notes" in key:
            value = re.sub("left_tip|right_tip", lambda m: TIPS[m[0]], value)
        if key.startswith("trials") and key[-3:] in ends:
            key = key[:-3] + ends[key[-3:]]
        if value is not None and key.endswith(("against right.lag", "against right.phase")):
            value = -value
        found[re.sub(r"rhythm\.(left|right)\.", lambda m: sides[m[0]], key)] = value
    return found


def half_speeds(answer: Answer) -> Answer:
    """Speeds and frequencies are half, as is the cut-off where it is told; lags are twice."""
    words = ("mean", "error", "speed", "cutoff", "cut_off", "frame_rate", ".frequency")
    by = {k: 2.0 if k.endswith(".lag") else 0.5 for k in answer
          if k.endswith(".lag") or any(w in k for w in words)}  # fmt: skip
    return {k: v * by.get(k, 1) if isinstance(v, float) else v for k, v in answer.items()}


def only_speeds(answer: Answer) -> Answer:
    """What is measured, without what is said of how."""
    return {k: v for k, v in answer.items() if "mean" in k and isinstance(v, float)}


def peak_of(side: int | None) -> Any:
    """The speed of one side, by its number; None: of the only one that was measured."""

    def take_peak(answer: Answer) -> Answer:
        peaks = [answer[f"trials[0].mean_peak[{k}]"] for k in (0, 1)]
        known = [peak for peak in peaks if peak is not None]
        assert side is not None or len(known) == 1
        return {"peak": known[0] if side is None else peaks[side]}

    return take_peak


def lose(name: str) -> Any:
    """Every fifteenth place of a landmark is not seen."""

    def apply(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        places = columns[name].copy()
        places[7::15] = np.nan
        return {**columns, name: places}

    return turn("columns", by=apply)


# ---- boards and robots -------------------------------------------------------------------------

CLOCK = 2**32 / 1000  # ms after which a board's clock of microseconds goes round
OLD_SESSION = tuple(
    frame(30000 + k, (0.9 * CLOCK + 4 * k) % CLOCK if k < 3 else 4.0 * k) for k in range(6)
)
"""The board restarts after its clock has gone round once."""
NOISES = {
    "a torn line": (b"5,.1,\n",),
    "a line begun late": (b"505,0.2\n",),
    "a bad byte": (b"5,0.\xff1,0.2,0.3\n",),
    "a banner": (b"ets Jun  8 2016 00:22:57\n", b"rst:0x1 (POWERON_RESET)\n"),
}
"""What comes between two samples and is none."""


def interrupt(*lines: bytes, at: int = 5) -> Any:
    return turn("lines", by=lambda known: (*known[:at], *lines, *known[at:]))


def scale_release(by: float) -> Any:
    return turn("columns", by=lambda c: {k: v if k == "time" else v * by for k, v in c.items()})


def flip_mirrored(answer: Answer) -> Answer:
    """Once contact is noticed, one of two mirror images is judged as the other."""
    known = {k: answer.get(k.replace("mirrored", "since_contact"), 0) for k in answer}
    return {k: not v if "mirrored" in k and known[k] >= 0 else v for k, v in answer.items()}


# ---- the list ----------------------------------------------------------------------------------

PERMUTED = [  # a tuple of a world, and the dim of answers that follows it
    ("scene", "trials", "trial", 5),
    ("animals", "antennas", "trial", 3),
    ("hand", "objects", "object", 2),
    ("named", "names", "no dim", 3),
]

CHANGES = [
    *(Change(f"permute {name}", kind, rows_of(name, _order(n)),
             tolerance=1e-6 if kind == "hand" else 1e-9, expect=pick(_order(n), dim))
      for kind, name, dim, n in PERMUTED),
    *(Change("alone", kind, rows_of(name, [n - 2, 0]), expect=pick([n - 2, 0], dim))
      for kind, name, dim, n in PERMUTED[:2]),
    # scenes: what touches return
    Change("mirror", "scene", tolerance=1e-7, expect=on_arrays(mirror_quantity),
           apply=turn("trials", by=lambda trials: tuple(
               t.replace(side=SIDE[t.side]) for t in trials))),
    Change("append silent trials", "scene", look=pick(slice(5), "trial"),
           apply=turn("trials", by=lambda trials: (*trials, trials[0].replace(lead=500.0)))),
    Change("every second sample", "scene", choose(sample_interval=2.0),
           part=without("sink", "error"), expect=pick(slice(None, None, 2), "time", "frame")),
    *(Change(f"units of {unit}", "scene", **measure_in(**{unit: 4.0}), tolerance=1e-6)
      for unit in ("time", "length", "mass")),
    Change("half the speed, twice the time", "scene", slow_down, tolerance=1e-3,
           part=without("error"), expect=on_arrays(half_rates)),
    Change("by MuJoCo", "scene", choose(engine="mujoco"), tolerance=5e-5,
           part=without("work", "timestep", "sink")),
    Change("kept in a store", "scene", keep_in_store),
    # simulations in the hand
    Change("mirror", "hand", tolerance=1e-6, expect=on_arrays(mirror_shown),
           apply=lambda w: w.but(base=w.base.mirror(),
                                 objects=tuple(map(mirror_object, w.objects)))),
    Change("turn and move", "hand", turn_hand, expect=on_arrays(turn_shown), tolerance=1e-6),
    *(Change(name, "hand", turn("drive", by=lambda _, drive=drive: drive)) for name, drive in {
        "in pieces": drive_pieces, "snapshot, step, restore, step": drive_back,
        "pickle": partial(drive_copy, lambda s: pickle.loads(pickle.dumps(s))),
        "deepcopy": partial(drive_copy, copy.deepcopy)}.items()),
    Change("told later", "hand", tell_later, tolerance=0.02),
    *(Change(f"restore from another {what}", "hand", restore_from(strange), refusal="snapshot")
      for what, strange in STRANGE.items()),
    # labelled arrays of touches and of spikes
    Change("mirror", "touches", turn(*ALL, by=lambda item: -item)),
    Change("alone", "touches", turn("ask", by=lambda item: item[[3, 1]]),
           expect=pick([3, 1], "trial", "other trial")),
    Change("permute trials", "touches", turn("clean", "ask", by=shuffle("trial")),
           expect=reorder("trial")),
    Change("permute sensors", "touches", turn(*ALL, by=shuffle("sensor")),
           expect=reorder("sensor"), tolerance=1e-6),
    Change("append silent trials", "touches", turn("ask", by=silence), or_refusal="constant",
           look=pick(slice(0, -3), "trial", "other trial")),
    *(Change(f"amplitude and noise times {by:g}", "touches", tolerance=1e-7,
             apply=turn(*ALL, "noise", by=lambda item, by=by: item * by),
             or_refusal=EXTREME if by != TAME else "") for by in (TAME, 1e-160, 1e-300, 1e150)),
    # Datasets and files
    *(Change(f"reload from {name}", "record", reload(name))
      for name, form in FORMATS.items() if form.save is not None and name != "csv"),
    Change("mirror", "record", turn("dataset", by=mirror_record),
           expect=on_arrays(mirror_quantity)),
    Change("permute trials", "record", turn("dataset", by=shuffle("trial")),
           expect=reorder("trial")),
    # bases
    Change("append silent lags", "bases", turn("first", "second", by=lambda item: item.pad(
        lag=(0, 5), constant_values=0.0))),
    Change("permute components", "bases", turn("first", by=shuffle("component")),
           expect=reorder("component")),
    Change("scale", "bases", turn("first", by=lambda item: item * 3.0)),
    Change("filter in time", "bases", turn("first", by=lambda item: item.pad(
        lag=(0, 4), constant_values=0).pipe(
            lambda wide: wide + 0.5 * wide.roll(lag=1) + 0.2 * wide.roll(lag=4)))),
    # films
    Change("mirror", "film", turn("columns", by=mirror_film), expect=swap_sides),
    Change("turn and move", "film", move_places(lambda v: v @ ROTATION.T + 500), tolerance=1e-6),
    Change("other units", "film", move_places(lambda v: v * 2.5), tolerance=1e-6),
    Change("permute landmarks", "film", turn("columns", by=lambda c: dict(reversed(c.items())))),
    Change("half the speed, twice the time", "film", turn("rate", by=lambda rate: rate / 2),
           expect=half_speeds, tolerance=1e-3),
    *(Change(f"rate by a column {name}", "film", turn("clock", by=lambda _, name=name: name),
             tolerance=1e-7) for name in ("time_s", "time_ms")),
    *(Change(f"{name} unseen at times", "film", lose(name), tolerance=0.05, part=only_speeds)
      for name in ("abdomen", "left_tip")),
    *(Change(name, "film", lambda w, how=how: w.but(**how), part=only_speeds, tolerance=1e-6)
      for name, how in {"reload from nwb": {"through": "nwb"}, "in another format":
                        {"form": "dlc"}, "one animal of two": {"form": "two animals"}}.items()),
    *(Change(f"{side} alone", "film", expect=peak_of(k), look=peak_of(None), tolerance=1e-6,
             apply=turn("options", by=lambda words, tips=tips: (*words, "--tips", tips)))
      for k, side, tips in ((0, "left", "left_tip"), (1, "right", ",right_tip"))),
    Change("a rate that its clock contradicts", "film", refusal="frame",
           apply=lambda w: w.but(clock="time_s", options=("--frame-rate", "30"))),
    Change("one file of two", "film", lambda w: w.but(through="two files"),
           part=keys(lambda key: key.startswith("trials[0].mean"))),
    # boards and a robot's touches
    *(Change(name, "lines", interrupt(*lines)) for name, lines in NOISES.items()),
    Change("after another session", "lines", lambda w: w.but(before=OLD_SESSION)),
    Change("opened in mid-line", "lines", interrupt(b"3,0.2\n", at=0)),
    Change("other separators", "lines", turn("lines", by=lambda lines: tuple(
        line.replace(b",", b";\t") for line in lines))),
    Change("mirror", "bent", expect=flip_mirrored, apply=turn("touches", by=lambda touches: tuple(
        (time, -values) for time, values in touches))),
    Change("alone", "bent", rows_of("touches", [0]), expect=keys(lambda k: k.startswith("0"))),
    Change("torn lines", "bent", lambda w: w.but(torn=True), or_refusal="line 1",
           part=keys(lambda key: not key.endswith("broken"))),
    # the studio; encoders: the order of calls
    Change("mirror", "wish", turn("wish", by=lambda wish: wish | {"side": "right"}),
           tolerance=1e-5,
           expect=on_arrays(lambda name, item: -item if name == "angle" else item)),
    *(Change(f"{what} in between", "calls", turn("calls", by=lambda calls, what=what: (
        calls[0], what, *calls[1:]))) for what in ("pickle", "save")),
    *(Change(f"{what} after it", "calls", turn("calls", by=lambda calls, what=what: (
        *calls, what)), tolerance=0.05) for what in ("partial_fit", "fit_stream")),
    # antennas by name; releases
    Change("alone", "named", rows_of("names", [1]),
           expect=keys(lambda key: key.startswith(("linear", "posture", "units")))),
    *(Change(f"time as {clock}", "release", turn("clock", by=lambda _, clock=clock: clock),
             tolerance=1e-6) for clock in ("time_s", "frame")),
    *(Change(name, "release", scale_release(by), tolerance=1e-6)
      for name, by in (("mirror", -1.0), ("other units", 40.0))),
]  # fmt: skip
"""One list; what does not apply to a producer is in test_relations.py, with its reason."""
