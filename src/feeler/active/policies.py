"""Policies: ways to move in order to know."""

from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.active.observer import MENU, Belief, Observer, Policy
from feeler.active.tasks import Arena
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.files import load_function
from feeler.physics.scene import Scene
from feeler.plotting.antennas import (
    SLOWER,
    MovingAntenna,
    choose_frames,
    make_patch,
    say_clock,
    write_movie,
)
from feeler.plotting.style import style
from feeler.records import Registry
from feeler.validation import checked

# Ways to move in order to know; anyone may register one more.

POLICIES: Registry[Callable[..., Policy]] = Registry("policy")
"""What makes each policy, by name; ``POLICIES.register(name, make)`` adds one. Arguments are
numbers.
"""


@POLICIES.register("fixed")
def _make_fixed(speed: float = 0.3) -> Policy:
    """One speed [mm/ms], from the beginning to the end."""
    return lambda known: speed


@POLICIES.register("fast-then-slow")
def _make_fast_then_slow(fast: float = 1.2, slow: float = 0.12, after: float = 10.0) -> Policy:
    """Fast until a time [ms], then slow, whatever is felt."""
    return lambda known: fast if known.time < after else slow


@POLICIES.register("slow-after-contact")
def _make_slow_after_contact(
    fast: float = 1.2, slow: float = 0.12, sure: float = 0.5
) -> Policy:
    """Fast until contact has begun with probability ``sure``, then slow."""
    return lambda known: np.where(known.touching < sure, fast, slow)


@POLICIES.register("random")
def _make_random(seed: float = 0.0, hold: float = 20.0) -> Policy:
    """A speed drawn from the menu every ``hold`` [ms], the same for all bodies."""
    return lambda known: np.random.default_rng([int(seed), int(known.time // hold)]).choice(
        MENU
    )


@POLICIES.register("greedy")
def _make_greedy(hold: float = 20.0) -> Policy:
    """Every ``hold`` [ms] the speed that is expected to tell most about the object within them."""
    speeds = [speed for speed in MENU if speed >= 0.06]
    last = [np.zeros(0)]

    def choose(known: Belief) -> np.ndarray:
        if known.time % hold < 1e-9:
            last[0] = np.array(speeds)[known.look(speeds, min(hold, known.left)).argmax(axis=1)]
        return last[0]

    return choose


@checked
def parse_policy(text: str) -> Policy:
    """A policy from ``name``, ``name:number,number`` or ``file.py:function``, whose function takes
    a Known.

    Raises
    ------
    InvalidInput
        No such policy or file, or numbers that do not fit.
    """
    name, _, rest = text.partition(":")
    if name.endswith(".py"):
        return load_function(Path(name), rest or "policy", "a policy")
    make = POLICIES[name]
    try:
        return make(*(float(word) for word in rest.split(",") if word))
    except InvalidInput:
        raise
    except (TypeError, ValueError):
        usual = signature(make).parameters.values()
        raise InvalidInput(
            f"{name!r} takes {', '.join(one.name for one in usual)} as numbers, got {rest!r}."
            f" Write it as in {name}:{','.join(f'{one.default:g}' for one in usual)}."
        ) from None


# Episodes to look at: a picture of a lane, and a movie of what a body did.

_PEAK = 0.06  # rad; where the colours end [C]


def _look_at(arena: Arena, lane: int) -> tuple[np.ndarray, np.ndarray, Antenna]:
    """Points (joint, 2) [mm], how far each hinge is bent, whichever way (segment,) [rad], and the
    antenna of a lane; in space as seen along z.
    """
    scene = arena.starts[lane].scene
    if arena.state is None or arena.fresh[lane]:
        angle, base = scene.initial_angle, np.array(scene.base)
    else:
        angle, base = arena.state.angle[lane], arena.state.base[lane]
    if scene.antenna.spatial:
        points = scene.antenna.shape(angle, base[3:]) + base[:3]
        return points[:, :2], np.linalg.norm(angle[:2], axis=0), scene.antenna.flatten()
    return scene.antenna.shape(angle, base[2]) + base[:2], np.abs(angle), scene.antenna


def draw_lane(arena: Arena, lane: int) -> np.ndarray:
    """A picture (height, width, 3) of a lane as it is."""
    with style():
        figure = Figure(figsize=(3.2, 3.6), dpi=100, layout="constrained")
        canvas, ax = FigureCanvasAgg(figure), figure.subplots()
        points, angle, antenna = _look_at(arena, lane)
        _set_up(ax, arena.starts[lane].scene, points[None])
        MovingAntenna(antenna, ax, Normalize(0.0, _PEAK)).move(points, angle)
        ax.set_title(f"{arena.time[lane]:.0f} ms", fontsize=8)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _set_up(ax: Axes, scene: Scene, points: np.ndarray) -> None:
    """Objects, and room for all points (row, joint, 2)."""
    for item in scene.objects:
        ax.add_patch(
            make_patch(item.feature, np.array(item.place)[:2], np.array(item.forward)[:2])
        )
    low, high = points.min(axis=(0, 1)) - 6.0, points.max(axis=(0, 1)) + 6.0
    low, high = np.minimum(low, [-14.0, -4.0]), np.maximum(high, [14.0, 46.0])
    ax.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        aspect="equal",
        xlabel="x [mm]",
        ylabel="y [mm]",
    )


def write_film(film: dict[str, Any], path: Path, *, slower: float = SLOWER) -> Path:
    """The movie of an episode: the antenna and the object, the body's speed, and what it
    believes.
    """
    time, speed = film["time"], film["speed"]
    with style():
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        grid = figure.add_gridspec(2, 2)
        left = figure.add_subplot(grid[:, 0])
        above, below = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
        _set_up(left, film["scene"], film["points"])
        antenna = MovingAntenna(film["scene"].antenna.flatten(), left, Normalize(0.0, _PEAK))
        (pace,) = above.plot([], [], color="#1b1f24")
        above.set(
            xlim=(0, time[-1]),
            ylim=(min(0.0, speed.min()) - 0.05, 1.1 * speed.max() + 0.05),
        )
        above.set(ylabel="speed [m/s]")
        lines = [below.plot([], [], label=label)[0] for label in film["labels"]]
        below.set(xlim=(0, time[-1]), ylim=(0, 1.02), xlabel="time [ms]", ylabel="belief")
        if lines:
            figure.legend(handles=lines, fontsize=6.5, ncols=3, loc="outside lower right")
        shown = choose_frames(time, slower=slower)
        clock = left.set_title(say_clock(float(time[-1]), slower), fontsize=8)

        def draw(k: int) -> list[Artist]:
            now = int(shown[k])
            clock.set_text(say_clock(float(time[now]), slower))
            pace.set_data(time[: now + 1], speed[: now + 1])
            for line, values in zip(lines, film["belief"].T, strict=False):
                line.set_data(time[: now + 1], values[: now + 1])
            return [*antenna.move(film["points"][now], film["angle"][now]), pace, *lines, clock]

        return write_movie(Path(path), figure, draw, len(shown))


@checked
def film_policy(
    observer: Observer, policy: Policy, touch: int = 0, duration: float | None = None
) -> dict[str, Any]:
    """What a body does that feels touch number ``touch`` and moves by a policy."""
    frames: list[tuple[Any, ...]] = []

    def watch(arena: Any) -> None:
        points, angle, _ = _look_at(arena, touch)
        frames.append((points, angle, float(arena.base[touch, 2])))

    episodes = observer.run(policy, 1, duration, watch=(touch, watch))
    points, angle, speed = (np.array(column) for column in zip(*frames, strict=True))
    row = np.minimum(
        (np.arange(len(frames)) + 1) / observer.period, len(episodes.time) - 1
    ).astype(int)
    labels = tuple(
        f"{feature.name} {feature.size:g} mm" for feature in observer.task.trials.features
    )
    return {
        "scene": observer.starts[touch].scene,
        "time": 1.0 + np.arange(len(frames)),
        "points": points,
        "angle": angle,
        "speed": speed,
        "belief": episodes.belief[row, touch],
        "labels": labels,
    }
