"""The worlds of the relations, by kind: each is small, awkward, and made once."""

from functools import cache, partial, reduce
from operator import xor
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

import feeler
from feeler.antenna import Antenna
from feeler.antenna.segments import Follicle
from feeler.physics.contact import CONTACTS
from feeler.physics.engine import DEFAULT_ENGINE, ENGINES


class World(SimpleNamespace):
    """What a kind of world is made of, by name; each is equal to itself alone."""

    __hash__, __eq__ = object.__hash__, object.__eq__

    def but(self, **changes: Any) -> "World":
        return World(**{**vars(self), **changes})


def make_antenna(n: int = 16, length: float = 30.0, **more: Any) -> Antenna:
    """A tapering antenna of a few segments, stiff at the base."""
    s = np.linspace(0, 1, n)
    fields = {
        "segment_length": np.full(n, length / n),
        "segment_mass": np.linspace(4e-5, 1e-5, n),
        "radius": np.linspace(0.3, 0.1, n),
        "stiffness": 2.0 * np.exp(-4 * s),
        "damping": 6.0 * np.exp(-4 * s),
        "rest_angle": np.zeros(n),
        "sensors": np.arange(1, n + 1, 2),
        "name": "tested",
    }
    return Antenna(**{**fields, **more})


BOX = feeler.Box(half_width=2.0, half_height=1.5)
DRIFT = feeler.BaseMotion(velocity=(0.05, 0.0), turn=-0.004)
TRIALS = tuple(
    feeler.Trial(feature=feature, location=location, speed=speed, **more)
    for feature, location, speed, more in (
        (feeler.Ball(radius=1.53), 0.5, 0.6, {}),
        (feeler.Triangle(half_width=2.0), 0.7, 0.4, {"approach": 70, "friction": 0.3}),
        (BOX, 0.8, 0.5, {"side": "right", "friction": 0.4}),
        (feeler.Ball(radius=1.0), 0.6, 0.3, {"base": DRIFT}),
        (BOX, 0.97, 0.3, {"lead": 7.0}),
    )
)
"""Touches of three shapes, both sides, oblique, sliding off the tip, and with a base that moves."""
STILL = tuple(trial.replace(base=None) for trial in TRIALS)


def make_scene(antenna: Antenna | None = None, trials: Any = TRIALS, **options: Any) -> World:
    """An antenna, the trials that touch it, and how they are simulated."""
    options = {"duration": 40.0, "timestep": 0.05, **options}
    return World(antenna=antenna or make_antenna(), trials=trials, options=options)


def make_spatial(**options: Any) -> World:
    """An antenna in space on a base that gives way in its follicle."""
    plane = make_antenna(12)
    antenna = plane.replace(
        stiffness=np.stack([plane.stiffness, 0.7 * plane.stiffness]),
        damping=np.stack([plane.damping, plane.damping]),
        rest_angle=np.zeros((2, 12)),
        follicle=Follicle(stiffness=(2.0, 5.0, 3.0), damping=(5.0, 9.0, 4.0)),
    )
    return make_scene(antenna, STILL, **options)


def make_hand(**options: Any) -> World:
    """A simulation in the hand: two objects from two sides, one of which turns, and a base that
    moves; ``drive`` is what is done to it, by default 24 ms.
    """
    ball = feeler.Object(
        feature=feeler.Ball(radius=1.5), place=(-2.0, 21.0), velocity=(0.3, 0.02), name="ball"
    )
    turned = {"forward": (-1.0, 0.0), "velocity": (-0.2, 0.05), "turn": 0.01, "friction": 0.4}
    box = feeler.Object(feature=BOX, place=(3.0, 12.0), name="box", **turned)
    base = feeler.BaseMotion(velocity=(0.05, 0.02), turn=0.002)
    made = {"antenna": make_antenna(), "objects": (ball, box), "base": base}
    return World(**made, options=options, drive=lambda simulation: simulation.step(24.0))


@cache
def make_touches() -> World:
    """Bending that travels along the antenna in both directions, with noise of one size: clean
    touches, noisy ones to learn, others to ask.
    """
    t, s = np.arange(60.0), np.arange(12.0)[:, None]
    rows = []
    for at, peak in ((2, 1.0), (5, 0.8), (9, 0.6)):
        for delay in (12, 20):
            wave = np.exp(-((t - delay - np.abs(s - at)) ** 2) / 30 - (s - at) ** 2 / 8)
            ripple = 0.3 * np.exp(-((t - delay - 18) ** 2) / 20 - (s - at - 1) ** 2 / 6)
            rows.append(peak * wave - ripple)
    rng, noise, labels = np.random.default_rng(4), 0.1, np.repeat(["base", "middle", "tip"], 2)
    known = xr.DataArray(
        rows, dims=("trial", "sensor", "time"), coords={"label": ("trial", labels)}
    )
    learn, ask = (known.isel(trial=np.repeat(range(6), k)) for k in (8, 2))
    learn, ask = (item + noise * rng.normal(size=item.shape) for item in (learn, ask))
    return World(clean=known, learn=learn, ask=ask, noise=noise)


def make_trains() -> World:
    """Spikes of the same touches: expected rates, counts to learn, counts to ask; a unit of each
    touch is nearly silent.
    """
    known, rng = make_touches(), np.random.default_rng(5)
    rates = known.clean.clip(min=0) * 150 + 1
    learn, ask = (
        item.copy(data=rng.poisson(rates.values.repeat(k, axis=0) * 1e-3).astype(float))
        for item, k in ((known.learn, 8), (known.ask, 2))
    )
    return World(clean=rates, learn=learn, ask=ask, noise=0.0)


def make_bases() -> World:
    """Bases of two fits, with pulses at their first and last lags, and others between."""
    rng = np.random.default_rng(6)
    first, second = np.zeros((2, 3, 8, 10))
    for basis in (*first[1:], *second[1:]):
        basis[rng.integers(0, 8, 4), rng.integers(0, 10, 4)] = rng.uniform(0.2, 1, 4)
    first[0, 2, 0] = first[0, 6, 4] = first[0, 6, 5] = 1
    second[0, 2, 9] = second[0, 6, 4] = 1
    dims = ("component", "sensor", "lag")
    return World(first=xr.DataArray(first, dims=dims), second=xr.DataArray(second, dims=dims))


def make_film(*, doubted: bool = False) -> World:
    """Landmarks [px] of two antennae that whisk at 8 and 5 Hz for four seconds, seen from above;
    the frame rate [Hz], the column that holds it, the form of the file and what it went through.
    """
    t = np.arange(800) / 200.0
    head, abdomen = np.array([200.0, 300.0]), np.array([200.0, 400.0])
    columns = {"head": np.tile(head, (800, 1)), "abdomen": np.tile(abdomen, (800, 1))}
    for sign, name, rate, swing in ((-1, "left_tip", 8.0, 15), (1, "right_tip", 5.0, 20)):
        swing = swing * (1 + 0.2 * np.sin(3.7 * t))  # no two whisks alike
        angle = np.deg2rad(40 + swing * np.sin(2 * np.pi * rate * t + 0.3))
        columns[name] = head + 110 * np.stack([sign * np.sin(angle), -np.cos(angle)], axis=1)
        columns[name] += np.random.default_rng(8).normal(0, 0.3, (800, 2))  # of the tracker
    form, options = ("dlc", ("--max-gap", "5")) if doubted else ("plain", ())
    for name, first in (("left_tip", 20), ("abdomen", 31)) if doubted else ():
        columns[name][first::47] = np.nan
    how = {"rate": 200.0, "clock": "option", "form": form, "through": ""}
    return World(columns=columns, options=options, **how)


def plain(number: int, time: float, values: Any) -> bytes:
    return (f"{time}," + ",".join(f"{v:g}" for v in values) + "\n").encode()


def frame(number: int, time: float, values: Any = (0.1, 0.2, 0.3)) -> bytes:
    """A line as a board sends it: number, time and values, and the exclusive or of all bytes."""
    body = f"{number},{time:.3f}," + ",".join(f"{v:g}" for v in values)
    return f"${body}*{reduce(xor, body.encode()):02X}\n".encode()


def make_lines(write: Any = plain) -> World:
    """Samples of three sensors as a board sends them, and what it sent before."""
    values = np.random.default_rng(7).uniform(0, 1, (12, 3)).round(4)
    return World(lines=tuple(write(k, k, v) for k, v in enumerate(values)), before=())


@cache
def learn_robot() -> tuple[Any, Any, Any]:
    """A decoder and a classifier of the same touches, and touches of a robot that is in neither."""
    from feeler import robot

    trials = robot.make_touches(locations=(0.5, 0.9), speeds=(0.27,))
    training = robot.draw_training_set(trials=trials, robots=4)
    decoder = training.watch(robot.make_decoder(trials=trials))
    known = robot.touch_robots(robot.draw_robots(1.0, 1, 5), trials=trials)
    return decoder, robot.make_classifier(training=training), known[0]


def make_bent() -> World:
    """Touches of a robot: times [ms] and angles [rad] (hinge, time), and whether lines are torn."""
    touches = learn_robot()[2].recordings[:2]
    return World(touches=tuple((one.time, one.values) for one in touches), torn=False)


def make_record() -> World:
    """Touches of both sides at two speeds, with all labels, as they are stored."""
    trials = [STILL[k].replace(speed=v) for v in (0.3, 0.6) for k in (0, 1, 4)]
    return World(dataset=feeler.touch(make_antenna(name="exponential"), trials, duration=40.0))


def make_animals() -> World:
    """A short antenna, a long one, and one that swings slowly, of which experiments are asked."""
    fade = np.exp(-4 * np.linspace(0, 1, 16))
    kinds = ((25.0, 1.0), (45.0, 3.0), (30.0, 0.3))
    return World(
        antennas=tuple(make_antenna(length=long, stiffness=k * fade) for long, k in kinds)
    )


def make_wish(*, study: bool = False) -> World:
    """A box that is dragged against the studio's antenna."""
    wish = {"kind": "box", "size": 1.5, "location": 0.7, "speed": 0.3, "duration": 60.0}
    return World(wish=wish, study=study)


def make_release() -> World:
    """Two animals that swing after they were let go: displacements [mm] at times [ms]."""
    t = np.arange(0, 120, 0.5)
    columns = {
        name: size * np.exp(-t / fade) * np.cos(2 * np.pi * rate * t)
        for name, size, rate, fade in (("a1", 1.0, 0.040, 20.0), ("a2", 0.7, 0.055, 15.0))
    }
    return World(columns={"time": t, **columns}, clock="time_ms")


WORLDS = {
    "scene": make_scene,
    **{
        f"scene by {name}": partial(make_scene, engine=name, timestep=0.02)
        for name in ENGINES
        if name != DEFAULT_ENGINE
    },
    "scene in space": make_spatial,
    "scene in space by chain": partial(make_spatial, engine="chain", timestep=0.02),
    "hand": make_hand,
    "hand with its speed told": partial(
        make_hand, contact=CONTACTS["smooth"].replace(speed=1.0)
    ),
    "touches": make_touches,
    "trains": make_trains,
    "record": make_record,
    "bases": make_bases,
    "film": make_film,
    "film with doubts": partial(make_film, doubted=True),
    "lines": make_lines,
    "lines framed": partial(make_lines, frame),
    "bent": make_bent,
    "animals": make_animals,
    "calls of fit": partial(World, calls=("fit",)),
    "calls of partial_fit too": partial(World, calls=("fit", "partial_fit")),
    "named": partial(World, names=("exponential", "linear", "uniform")),
    "release": make_release,
    "wish": make_wish,
    "wish with a study": partial(make_wish, study=True),
}
"""One of each kind, which is the first word, and awkward ones; made when first asked for."""
