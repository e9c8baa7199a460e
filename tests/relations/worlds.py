"""The worlds of the relations: each is small, awkward, and made once."""

from dataclasses import replace
from functools import cache, reduce
from operator import xor
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

import feeler
from feeler.antenna import Antenna
from feeler.antenna.segments import Follicle
from feeler.physics.contact import CONTACTS


class World(SimpleNamespace):
    """What a kind of world is made of, by name; each is itself alone."""

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
TRIALS = (
    feeler.Trial(feature=feeler.Ball(radius=1.53), location=0.5, speed=0.6),
    feeler.Trial(
        feature=feeler.Triangle(half_width=2.0),
        location=0.7,
        speed=0.4,
        approach=70,
        friction=0.3,
    ),
    feeler.Trial(feature=BOX, location=0.8, speed=0.5, side="right", friction=0.4),
    feeler.Trial(
        feature=feeler.Ball(radius=1.0),
        location=0.6,
        speed=0.3,
        base=feeler.BaseMotion(velocity=(0.05, 0.0), turn=-0.004),
    ),
    feeler.Trial(feature=BOX, location=0.97, speed=0.3, lead=7.0),
)
"""Touches of three shapes, both sides, oblique, sliding off the tip, and with a base that moves."""


def make_scene(antenna: Antenna | None = None, **options: Any) -> World:
    """The trials on an antenna."""
    return World(
        antenna=antenna or make_antenna(),
        trials=TRIALS,
        options={"duration": 40.0, "timestep": 0.05, **options},
    )


def make_hand(antenna: Antenna | None = None, **options: Any) -> World:
    """Two objects from two sides, one of which turns, and a base that moves."""
    antenna = antenna or make_antenna()
    ball = feeler.Object(
        feature=feeler.Ball(radius=1.5), place=(-2.0, 21.0), velocity=(0.3, 0.02), name="ball"
    )
    box = feeler.Object(
        feature=BOX,
        place=(3.0, 12.0),
        forward=(-1.0, 0.0),
        velocity=(-0.2, 0.05),
        turn=0.01,
        friction=0.4,
        name="box",
    )
    return World(
        antenna=antenna,
        objects=(ball, box),
        base=feeler.BaseMotion(velocity=(0.05, 0.02), turn=0.002),
        options=options,
    )


def make_touches() -> World:
    """Bending that travels along the antenna in both directions, with noise of one size."""
    t, s = np.arange(60.0), np.arange(12.0)[:, None]
    rows = []
    for at, peak in ((2, 1.0), (5, 0.8), (9, 0.6)):
        for delay in (12, 20):
            wave = np.exp(-((t - delay - np.abs(s - at)) ** 2) / 30 - (s - at) ** 2 / 8)
            ripple = 0.3 * np.exp(-((t - delay - 18) ** 2) / 20 - (s - at - 1) ** 2 / 6)
            rows.append(peak * wave - ripple)
    clean = np.array(rows)
    rng, noise, copies = np.random.default_rng(4), 0.1, 8
    drawn = [np.repeat(clean, k, axis=0) for k in (copies, 2)]
    learn, ask = (item + noise * rng.normal(size=item.shape) for item in drawn)
    labels = np.repeat(["base", "middle", "tip"], 2)
    return World(
        clean=_label(clean, labels),
        learn=_label(learn, np.repeat(labels, copies)),
        ask=_label(ask, np.repeat(labels, 2)),
        noise=noise,
    )


def make_trains() -> World:
    """Poisson trains of the same touches; a unit of each touch is nearly silent."""
    known = make_touches()
    rng = np.random.default_rng(5)
    rates = known.clean.clip(min=0) * 150 + 1
    learn, ask = (
        item.copy(data=rng.poisson(rates.values.repeat(k, axis=0) * 1e-3).astype(float))
        for item, k in ((known.learn, 8), (known.ask, 2))
    )
    return World(clean=rates, learn=learn, ask=ask, noise=0.0)


def _label(values: np.ndarray, labels: np.ndarray) -> xr.DataArray:
    return xr.DataArray(
        values, dims=("trial", "sensor", "time"), coords={"label": ("trial", labels)}
    )


def make_bases() -> World:
    """Bases with pulses at their first and last lags, and others between."""
    rng = np.random.default_rng(6)
    first, second = np.zeros((2, 3, 8, 10))
    for bases in (first, second):
        for basis in bases:
            basis[rng.integers(0, 8, 4), rng.integers(0, 10, 4)] = rng.uniform(0.2, 1, 4)
    first[0], second[0] = 0, 0
    first[0, 2, 0] = first[0, 6, 4] = first[0, 6, 5] = 1
    second[0, 2, 9] = second[0, 6, 4] = 1
    dims = ("component", "sensor", "lag")
    return World(first=xr.DataArray(first, dims=dims), second=xr.DataArray(second, dims=dims))


def make_film(*, doubted: bool = False) -> World:
    """Two antennae that whisk at 8 and 5 Hz for four seconds, seen from above."""
    t = np.arange(800) / 200.0
    head, abdomen = np.array([200.0, 300.0]), np.array([200.0, 400.0])
    columns = {"head": np.tile(head, (800, 1)), "abdomen": np.tile(abdomen, (800, 1))}
    for sign, name, rate, swing in ((-1, "left_tip", 8.0, 15), (1, "right_tip", 5.0, 20)):
        swing = swing * (1 + 0.2 * np.sin(3.7 * t))  # no two whisks alike
        angle = np.deg2rad(40 + swing * np.sin(2 * np.pi * rate * t + 0.3))
        columns[name] = head + 110 * np.stack([sign * np.sin(angle), -np.cos(angle)], axis=1)
        columns[name] += np.random.default_rng(8).normal(0, 0.3, (800, 2))  # of the tracker
    if not doubted:
        return World(columns=columns)
    for name, first in (("left_tip", 20), ("abdomen", 31)):
        columns[name][first::47] = np.nan
    return World(columns=columns, form="dlc", options=("--max-gap", "5"))


def make_lines(*, framed: bool = False) -> World:
    """Samples of three sensors, a time first; or framed, with a number and a sum, as a board's."""
    values = np.random.default_rng(7).uniform(0, 1, (12, 3)).round(4)
    return World(
        lines=tuple(frame(k, k, v) if framed else plain(k, v) for k, v in enumerate(values))
    )


def plain(time: float, values: Any) -> bytes:
    return (f"{time}," + ",".join(f"{v:g}" for v in values) + "\n").encode()


def frame(number: int, time: float, values: Any = (0.1, 0.2, 0.3)) -> bytes:
    """A line as a board sends it: number, time and values, and the exclusive or of all bytes."""
    body = f"{number},{time:.3f}," + ",".join(f"{v:g}" for v in values)
    return f"${body}*{reduce(xor, body.encode()):02X}\n".encode()


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
    return World(
        touches=tuple((one.time, one.values) for one in learn_robot()[2].recordings[:2])
    )


def make_spatial(**options: Any) -> World:
    """An antenna in space on a base that gives way in its follicle."""
    plane = make_antenna(12)
    antenna = plane.replace(
        stiffness=np.stack([plane.stiffness, 0.7 * plane.stiffness]),
        damping=np.stack([plane.damping, plane.damping]),
        rest_angle=np.zeros((2, 12)),
        follicle=Follicle(stiffness=(2.0, 5.0, 3.0), damping=(5.0, 9.0, 4.0)),
    )
    still = tuple(replace_speed(trial, trial.speed) for trial in TRIALS)
    return replace(make_scene(antenna, **options), trials=still)


TOLD_SPEED = replace(CONTACTS["smooth"], speed=1.0)


def make_record() -> World:
    """Touches of both sides at two speeds, with all labels, as they are stored."""
    antenna = make_antenna(name="exponential")
    trials = [
        replace_speed(t, v) for v in (0.3, 0.6) for t in (TRIALS[0], TRIALS[1], TRIALS[4])
    ]
    return World(dataset=feeler.touch(antenna, trials, duration=40.0))


def replace_speed(trial: feeler.Trial, speed: float) -> feeler.Trial:
    return trial.replace(speed=speed, base=None)


def make_animals() -> World:
    """A short antenna, a long one, and one that swings slowly."""
    return World(
        antennas=tuple(
            make_antenna(length=length, stiffness=k * np.exp(-4 * np.linspace(0, 1, 16)))
            for length, k in ((25.0, 1.0), (45.0, 3.0), (30.0, 0.3))
        )
    )


def make_wish(*, study: bool = False) -> World:
    """A box that is dragged against the studio's antenna."""
    wish = {"kind": "box", "size": 1.5, "location": 0.7, "speed": 0.3, "duration": 60.0}
    return World(wish=wish, study=study)


def make_release() -> World:
    """Two animals that swing after they were let go."""
    t = np.arange(0, 120, 0.5)
    columns = {
        name: size * np.exp(-t / fade) * np.cos(2 * np.pi * rate * t)
        for name, size, rate, fade in (("a1", 1.0, 0.040, 20.0), ("a2", 0.7, 0.055, 15.0))
    }
    return World(columns={"time": t, **columns})
