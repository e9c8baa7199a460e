"""Policies: ways to move in order to know, written by hand or learned."""

from collections.abc import Callable
from functools import lru_cache
from importlib.resources import as_file, files
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from scipy.special import expit

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
from feeler.records import Ge, Gt, Registry
from feeler.tensors.formats import Model, load_model
from feeler.validation import Seed, checked

# Ways to move in order to know; anyone may register one more.

POLICIES: Registry[Callable[..., Policy]] = Registry(
    "policy", {"learned": "feeler.active.policies:make_learned"}
)
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


# The learned policy: what recurrent PPO made of the observer's beliefs, as stored weights that
# NumPy runs.

POLICY_KIND, POLICY_VERSION = "LearnedPolicy", 1
_WAY, _FAST, _LONG = (
    20.0,
    1.2,
    150.0,
)  # mm, mm/ms, ms: what numbers are divided by, to be about one in size
OWN = 6  # numbers beside the beliefs


def see(known: Belief, deadline: float) -> np.ndarray:
    """What a policy is told (body, number), each about one in size: belief in each object, their
    entropy, the probability that contact has begun, way, speed, time gone and time left."""
    n, classes = known.belief.shape
    entropy = -(known.belief * np.log(np.maximum(known.belief, 1e-300))).sum(axis=1) / np.log(
        classes
    )
    time = np.full(n, known.time / _LONG), np.full(n, max(deadline - known.time, 0.0) / _LONG)
    own = np.stack(
        [entropy, known.touching, known.way / _WAY, known.speed / _FAST, *time], axis=1
    )
    return np.concatenate([known.belief, own], axis=1).astype(np.float32)


def make_actor(arrays: dict[str, np.ndarray], deadline: float) -> Policy:
    """The policy of an actor's weights: an LSTM, two layers of tanh, and the speed of the menu with
    the greatest score.
    """
    state: list[np.ndarray] = []
    wanted = arrays["lstm_actor.weight_ih_l0"].shape[1]

    def choose(known: Belief) -> np.ndarray:
        seen = see(known, deadline)
        if seen.shape[1] != wanted:
            raise InvalidInput(
                f"this policy was learned for {wanted - OWN} objects, the task has"
                f" {seen.shape[1] - OWN}. Train one for it with studies/active/learning.py."
            )
        if known.time == 0:
            state[:] = [
                np.zeros((len(seen), arrays["lstm_actor.weight_hh_l0"].shape[1]), np.float32)
            ] * 2
        state[:] = _remember(arrays, seen, *state)
        hidden = state[0]
        for layer in ("mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2"):
            hidden = np.tanh(hidden @ arrays[f"{layer}.weight"].T + arrays[f"{layer}.bias"])
        scores = hidden @ arrays["action_net.weight"].T + arrays["action_net.bias"]
        return np.array(MENU)[scores.argmax(axis=1)]

    return choose


def _remember(
    arrays: dict[str, np.ndarray], seen: np.ndarray, hidden: np.ndarray, cell: np.ndarray
) -> list[np.ndarray]:
    """One step of the LSTM, its gates in PyTorch's order."""
    name = "lstm_actor.{}_l0".format
    gates = seen @ arrays[name("weight_ih")].T + arrays[name("bias_ih")]
    gates = gates + hidden @ arrays[name("weight_hh")].T + arrays[name("bias_hh")]
    into, keep, new, out = np.split(gates, 4, axis=1)
    cell = expit(keep) * cell + expit(into) * np.tanh(new)
    return [expit(out) * np.tanh(cell), cell]


def find_weights(seed: Seed) -> Path:
    """Where the weights of a seed are kept with the package."""
    with as_file(files("feeler.active")) as folder:
        return Path(folder) / f"learned{seed}.safetensors"


_MAX_SEED = 2**32  # no file of the package has a longer name


@lru_cache(maxsize=8)
def _load(seed: Seed) -> Model:
    path = find_weights(seed)
    if seed > _MAX_SEED or not path.is_file():
        known = sorted(
            file.stem.removeprefix("learned")
            for file in path.parent.glob("learned*.safetensors")
        )
        raise InvalidInput(
            f"no policy was learned with seed {seed}; there are: {', '.join(known) or 'none'}."
        )
    return load_model(path, kind=POLICY_KIND, version=POLICY_VERSION, trusted=True)


@checked
def make_learned(
    seed: Annotated[float, Ge(0)] = 0.0, deadline: Annotated[float, Gt(0)] = 50.0
) -> Policy:
    """What recurrent PPO learned with a seed, told that it is asked at a deadline [ms]."""
    return make_actor(_load(int(seed)).arrays, deadline)


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
        bent = np.linalg.norm(angle[:2], axis=0)
        return points[:, :2], bent, scene.antenna.flatten()
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
        left, grid = figure.add_subplot(1, 2, 1), figure.add_gridspec(2, 2)
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
