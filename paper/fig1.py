"""Figs. 1, 5E: sensors, sampling, stiffness; a touch, the animal and the conditions as drawings."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch, Rectangle

from feeler import touch
from feeler.analysis import find_noise
from feeler.analysis.dispersion import bootstrap_mean
from feeler.antenna.segments import Antenna
from feeler.decoding.classifiers import make_lda
from feeler.decoding.sweeps import Plan, compute_left_out
from feeler.objects.noise import Common
from feeler.objects.trials import SPEEDS, Trial, place
from feeler.plotting.antennas import OBJECT_COLOUR, MovingAntenna, make_patch, plot_posture
from feeler.plotting.results import list_shapes
from feeler.plotting.style import (
    ANTENNA_COLOURS,
    PALETTE,
    mark_panels,
    mark_places,
    pick_colours,
    set_decades,
)
from feeler.plotting.tensors import plot_tensor, take_curvature
from feeler.report import Section, make_spread
from feeler.tensors import in_unit, rectify
from feeler.tensors.transforms import compute_bend, reconstruct_posture
from feeler.wall import Approach
from paper.context import Context
from paper.data import (
    COMPLETE,
    keep_whole,
    list_profiles,
    list_speeds,
    list_touches,
    load_complete,
    load_tensors,
)
from paper.fig3 import compute as compute_wall
from paper.table import read_declared

# Fig. 1A–B as numbers: sensor spacing, sampling rate and compliance, the axes along which the
# paper says that a distributed sensor is designed.

_Spread = dict[str, float]
_SHORT = {"threshold a tenth of the peak": "> peak / 10"}  # beside the panel's letter


def compute_reading(
    tensors: xr.Dataset, asked: Mapping[str, Any], plan: Plan, *, random_state: int = 0
) -> SimpleNamespace:
    """How often places and objects never trained on are classified correctly, with fewer
    sensors or samples.

    Returns
    -------
    SimpleNamespace
        ``place`` by which sensors are kept (every k-th), on objects never trained; ``thing``,
        shape and size, by sampling rate [Hz], at places never trained: accuracies with the interval
        over the touches that are read. ``chance`` of both.
    """
    array = keep_whole(tensors)
    array = array / array.max()
    thing = np.array(
        [
            f"{a} {b:g}"
            for a, b in zip(tensors["feature"].values, tensors["size"].values, strict=True)
        ]
    )
    place = np.array([f"{value:g}" for value in tensors["location"].values])
    options: dict[str, Any] = {"plan": plan, "random_state": random_state}
    time = in_unit(tensors["time"], "ms").values
    steps = {rate: max(1, round(1000.0 / rate / (time[1] - time[0]))) for rate in asked["rate"]}
    sensors = {
        k: _read(array[:, _choose(array.shape[1], k)], place, thing, **options)
        for k in asked["every_sensor"]
    }
    samples = {
        rate: _read(array[:, :, _choose(array.shape[2], step)], thing, place, **options)
        for rate, step in steps.items()
    }
    return SimpleNamespace(
        place={k: _average(right) for k, right in sensors.items()},
        thing={rate: _average(right) for rate, right in samples.items()},
        chance={"place": 1 / len({*place}), "thing": 1 / len({*thing})},
    )


def _choose(n: int, step: int) -> slice:
    """Every ``step``-th of n, from the middle of the first step."""
    return slice((min(step, n) - 1) // 2, None, step)


def _read(
    array: np.ndarray,
    labels: np.ndarray,
    groups: np.ndarray,
    *,
    plan: Plan,
    random_state: int,
) -> np.ndarray:
    """How often each touch is classified correctly (touch,) from noisy copies, when its
    group was left out of the training; in a group every label stands once.
    """
    folds = compute_left_out(
        array,
        labels,
        groups,
        ratios=(plan.probe,),
        n_copies=plan.n_copies,
        n_repeats=plan.control_repeats or plan.n_repeats,
        noise=Common(reference=1.0),
        estimator=make_lda(),
        random_state=random_state,
    )
    return np.concatenate(
        [fold.recall[0][~np.isnan(fold.recall[0])] for fold in folds.values()]
    )


def scale_stiffness(antenna: Antenna, factor: float) -> Antenna:
    """The antenna with stiffness and damping of every hinge times ``factor``."""
    return antenna.replace(
        stiffness=factor * antenna.stiffness, damping=factor * antenna.damping
    )


def compute_activity(
    tensors: xr.Dataset, asked: Mapping[str, Any], *, random_state: int = 0
) -> SimpleNamespace:
    """How many sensors touches activate, and what an ideal observer makes of it.

    Returns
    -------
    SimpleNamespace
        ``active`` by threshold: how many sensors pass it in each touch (trial,); ``noise``, the
        floor [rad] that is tolerated at each place (place,).
    """
    angle = rectify(
        in_unit(tensors["angle"], "rad").transpose("trial", "sensor", "time").values
    )
    peak = angle.max(axis=2)
    thresholds = {
        f"threshold {asked['threshold']:g} rad": asked["threshold"],
        "threshold a tenth of the peak": asked["share"] * peak.max(axis=1)[:, None],
    }
    places = tensors["location"].values
    drawn = {"n_draws": asked["draws"], "random_state": random_state}
    noise = [find_noise(angle[places == place], **drawn)[0] for place in np.unique(places)]
    return SimpleNamespace(
        active={name: (peak > threshold).sum(axis=1) for name, threshold in thresholds.items()},
        noise=np.nan_to_num(noise),  # none is tolerated where all touches are one
    )


def _average(values: np.ndarray) -> _Spread:
    mean = bootstrap_mean(values.astype(float), np.random.default_rng(0))
    return make_spread(mean.estimate, mean.low, mean.high, n=len(values))


def plot(data: SimpleNamespace, figure: Figure) -> None:
    """A panel per axis."""
    axes = figure.subplots(1, 4)
    reading, activity = data.reading, data.activity
    spacing = data.antenna.length / data.antenna.sensors.size
    places = {spacing * k: value for k, value in reading.place.items()}
    _plot_curve(axes[0], places, PALETTE[0], "LDA", 100)
    _plot_curve(axes[1], reading.thing, PALETTE[0], "LDA", 100)
    for ax, kind in zip(axes, ("place", "thing"), strict=False):
        ax.axhline(100 * reading.chance[kind], color="#888888", ls=":", lw=0.8, label="chance")
        ax.set(ylim=(0, 103))
    axes[0].set(xlabel="spacing of sensors [mm]", ylabel="place classified correctly [%]")
    axes[1].set(xlabel="sampling rate [Hz]", ylabel="shape and size classified correctly [%]")
    for k, name in enumerate(next(iter(activity.values())).active):
        active = {factor: _average(found.active[name]) for factor, found in activity.items()}
        _plot_curve(
            axes[2],
            active,
            PALETTE[1 + k],
            _SHORT.get(name, name.replace("threshold ", "> ")),
            1,
        )
    noise = {factor: _average(found.noise) for factor, found in activity.items()}
    _plot_curve(axes[3], noise, PALETTE[3], "ideal observer", 1)
    axes[2].set(xlabel="stiffness [× its own]", ylabel="active sensors", ylim=(0, None))
    axes[3].set(xlabel="stiffness [× its own]", ylabel="noise tolerance [rad]", ylim=(0, None))
    for ax in axes:
        ax.legend(
            fontsize=6.5,
            handlelength=1.0,
            loc="lower right",
            bbox_to_anchor=(1.05, 0.98),
            borderpad=0,
        )


def _plot_curve(
    ax: Axes, values: Mapping[float, _Spread], colour: str, label: str, unit: float
) -> None:
    """Values with their intervals, along a logarithmic axis."""
    x = np.array(list(values))
    mean, low, high = (
        unit * np.array([value.get(end, value["value"]) for value in values.values()])
        for end in ("value", "low", "high")
    )
    ax.errorbar(
        x, mean, (mean - low, high - mean), fmt="o-", ms=3, capsize=2, color=colour, label=label
    )
    ax.set_xscale("log")
    mark_places(ax.xaxis, _thin(sorted(values)))


def _thin(places: Sequence[float]) -> list[float]:
    """At most three of them, with both ends."""
    chosen = np.linspace(0, len(places) - 1, min(3, len(places))).round().astype(int)
    return [float(f"{places[k]:.2g}") for k in chosen]


_ACTIVE, _SILENT = PALETTE[1], "#BBBBBB"


def count_active(tensors: xr.Dataset, threshold: float) -> np.ndarray:
    """Sensors whose angle [rad] is beyond a threshold (time, sensor) in a Dataset of one touch."""
    return in_unit(tensors["angle"], "rad").transpose("trial", "time", "sensor").values[0] > (
        threshold
    )


def plot_compliance(data: SimpleNamespace, figure: Figure) -> None:
    """The moment of most active sensors, a panel for each stiffness."""
    axes = figure.subplots(1, len(data.touched), sharex=True, sharey=True)
    for ax, (factor, tensors) in zip(axes, data.touched.items(), strict=True):
        active = count_active(tensors, data.threshold)
        now = int(active.sum(axis=1).argmax())
        _draw(data.antenna, data.trial, tensors, now, active[now], ax)
        words = "its own stiffness" if factor == 1 else f"{factor:g} × as stiff"
        ax.set_title(f"{words}\n{active[now].sum()} of {active.shape[1]} sensors active")
    mark_panels(axes[0])
    marks = [
        Line2D([], [], color=colour, marker="o", ls="", ms=3, label=label)
        for colour, label in ((_ACTIVE, f"angle > {data.threshold:g} rad"), (_SILENT, "less"))
    ]
    met = Patch(color=OBJECT_COLOUR, label="object")
    figure.legend(handles=[*marks, met], loc="outside lower center", ncols=3)


def _draw(
    antenna: Antenna, trial: Trial, tensors: xr.Dataset, now: int, active: np.ndarray, ax: Axes
) -> None:
    points = reconstruct_posture(tensors, antenna).values[0, now]
    placed, time = place(antenna, trial), in_unit(tensors["time"], "ms").values[now]
    ax.add_patch(
        make_patch(trial.shape, placed.origin + placed.velocity * time, placed.forward)
    )
    plot_posture(points, ax, lw=1.5)
    sensors = points[antenna.sensors - 1]
    for chosen, colour in ((~active, _SILENT), (active, _ACTIVE)):
        ax.plot(*sensors[chosen].T, "o", ms=2.2, color=colour, zorder=4)
    ax.set(aspect="equal", xlim=(-0.25 * antenna.length, 0.75 * antenna.length))
    ax.axis("off")


def compute(context: Context) -> SimpleNamespace:
    """What spacing, sampling and compliance do to slow touches of the first profile.

    Returns
    -------
    SimpleNamespace
        ``rows``; ``reading``, see :func:`compute_reading`, trained with noise of size ``probe``;
        ``activity`` by factor of stiffness, see :func:`compute_activity`; ``touched`` by factor,
        the Dataset of one ``trial`` on the softest, the own and the stiffest ``antenna``.
    """
    asked, profile = read_declared("declared.toml")["axes"], list_profiles(context)[0]
    antenna, tensors = context.profiles[profile], load_complete(context, profile)
    touches = [
        trial for trial in list_touches(context, profile) if trial.speed == SPEEDS["slow"]
    ]
    activity, touched = {}, {}
    number, plan = find_touch(touches, SPEEDS["slow"]), context.effort.plan
    for factor in asked["stiffness"]:
        found = tensors
        if factor != 1.0:
            found = touch(
                scale_stiffness(antenna, factor), touches, duration=COMPLETE, **context.physics
            )
        activity[factor] = compute_activity(found, asked, random_state=context.seed)
        touched[factor] = found.isel(trial=[number])
    reading = compute_reading(tensors, asked, plan, random_state=context.seed)
    return SimpleNamespace(
        rows=_list_values(reading, activity),
        reading=reading,
        activity=activity,
        touched={factor: touched[factor] for factor in (max(touched), 1.0, min(touched))},
        threshold=asked["threshold"],
        probe=plan.probe,
        profile=profile,
        antenna=antenna,
        trial=touches[number],
    )


def show(data: SimpleNamespace, section: Section) -> None:
    """One touch at three stiffnesses, and a panel per axis."""
    section.text(
        "The paper names three axes along which a distributed sensor is designed: the spacing of"
        " its sensors, their sampling rate, and compliance. Each is changed by itself, on complete"
        f" slow touches of the antenna '{data.profile}'. Sensors and samples that are left out are"
        " not averaged, so what stays is as noisy as before. The object follows its own path"
        " whatever the antenna does: so an antenna that is softer everywhere is bent into almost"
        " the same shape, with less force."
    )
    section.figure(
        "fig1_compliance",
        f"One touch ({data.trial.label}) of an antenna with other stiffness, each at the moment at"
        " which most sensors are active. The object's path is the same for all. (Fig. 1A)",
        lambda figure: plot_compliance(data, figure),
        height=2.8,
        numbers={
            f"{factor:g}": count_active(tensors, data.threshold).sum(axis=1)
            for factor, tensors in data.touched.items()
        },
    )
    section.figure(
        "fig1_axes",
        f"A: place of touch, on objects never trained; B: shape and size, at places never trained"
        f" (LDA on noisy tensors, sd {data.probe:g} of the greatest angle). C: sensors whose angle"
        " passes a threshold in a touch. D: noise floor at which an ideal observer still names"
        " three of four objects at a place. A to C: mean over touches, D: over places, with 95 %"
        " intervals. (Fig. 1A–B)",
        lambda figure: plot(data, figure),
        height=2.6,
        numbers={
            **vars(data.reading),
            "activity": {f"{factor:g}": vars(found) for factor, found in data.activity.items()},
        },
    )


def _list_values(
    reading: SimpleNamespace, activity: Mapping[float, SimpleNamespace]
) -> dict[str, object]:
    values: dict[str, object] = {
        f"axes.place.every {k}": value for k, value in reading.place.items()
    }
    values |= {f"axes.object.{rate:g} Hz": value for rate, value in reading.thing.items()}
    for factor, found in activity.items():
        values[f"axes.noise75.stiffness x {factor:g}"] = _average(found.noise)
        for name, active in found.active.items():
            values[f"axes.active.{name}.stiffness x {factor:g}"] = _average(active)
    stiff, soft = (activity[end(activity)] for end in (max, min))
    for name, active in soft.active.items():  # of the same touches: pairs
        values[f"axes.gain.{name}"] = _average(active - stiff.active[name])
    gain = np.divide(
        soft.noise, stiff.noise, where=stiff.noise > 0, out=np.ones_like(soft.noise)
    )
    return values | {"axes.gain.noise75": _average(gain - 1)}


# Fig. 1B, E as a drawing: how one touch of the run becomes a tactile tensor.

_CORNER = (6, 8)  # sensors and samples that are drawn large


def choose_moments(tensor: np.ndarray, count: int = 4) -> list[int]:
    """Samples at even distances from the first to the last in which a tensor (sensor, time) has a
    tenth of its greatest value.
    """
    felt = np.flatnonzero(tensor.max(axis=0) >= 0.1 * tensor.max())
    return [int(k) for k in np.linspace(felt[0], felt[-1], count).round()]


def plot_touch(data: SimpleNamespace, figure: Figure) -> None:
    """Four moments with what the sensors feel then, and the tensor that these columns make."""
    antenna, tensors = data.antenna, data.tensors
    tensor, time = take_curvature(tensors)[0], in_unit(tensors["time"], "ms").values
    norm = Normalize(0.0, max(float(tensor.max()), 1e-9))
    grid = figure.add_gridspec(2, 8, height_ratios=(1, 1), width_ratios=(1, 0.08) * 4)
    moments = choose_moments(tensor)
    for k, now in enumerate(moments):
        ax = figure.add_subplot(grid[0, 2 * k])
        draw_moment(antenna, data.trial, tensors, now, ax, norm)
        ax.set_title(f"{k + 1}: {time[now]:.0f} ms")
        _draw_column(tensor[:, now], figure.add_subplot(grid[0, 2 * k + 1]), norm)
    whole = figure.add_subplot(grid[1, :6])
    mark_panels((figure.axes[0], whole), "be")
    image = plot_tensor(tensor, time, whole, norm)
    whole.set_xticks(time[moments], [f"{k + 1}" for k in range(len(moments))])
    whole.set(
        xlabel="time; the four moments above", title="the tensor: a column for each moment"
    )
    corner = figure.add_subplot(grid[1, 6:])
    # A few sensors and samples around the greatest value, so large that each is seen
    sensor, sample = np.unravel_index(tensor.argmax(), tensor.shape)
    first = [
        int(np.clip(at - size // 2, 0, whole - size))
        for at, size, whole in zip((sensor, sample), _CORNER, tensor.shape, strict=True)
    ]
    part = tensor[first[0] :, first[1] :][: _CORNER[0], : _CORNER[1]]
    corner.imshow(part, origin="lower", aspect="auto", norm=norm, interpolation="nearest")
    corner.set_xticks(np.arange(part.shape[1] + 1) - 0.5, [])
    corner.set_yticks(np.arange(part.shape[0] + 1) - 0.5, [])
    corner.tick_params(length=0)
    corner.grid(color="#888888", lw=0.4)
    spacing = antenna.length / antenna.sensors.size
    corner.set(
        xlabel=f"Δt = {time[1] - time[0]:g} ms",
        ylabel=f"Δx ≈ {spacing:.2g} mm",
        title="its greatest value",
    )
    figure.colorbar(image, ax=corner, label="curvature [1/mm]")


def _draw_column(values: np.ndarray, ax: Axes, norm: Normalize) -> None:
    """What all sensors feel at one moment, base at the bottom."""
    ax.imshow(
        values[:, None], origin="lower", aspect="auto", norm=norm, interpolation="nearest"
    )
    ax.set(xticks=[], yticks=[])
    ax.spines[:].set_visible(True)


def compute_touch(context: Context) -> SimpleNamespace:
    """A slow touch of the first profile."""
    return _take_touch(context, list_profiles(context)[0], SPEEDS["slow"])


def show_touch(data: SimpleNamespace, section: Section) -> None:
    """How its tensor comes about."""
    section.figure(
        "fig1_touch",
        f"A {data.trial.label} and its tensor. Above: the antenna at four moments, coloured by"
        " its curvature, with what its sensors feel then as a column beside it, base at the bottom."
        " Below: all columns one after another; on the right a part of it enlarged, in which Δx is"
        " the mean distance of neighbouring sensors and Δt the time between samples. (Fig. 1B, E)",
        lambda figure: plot_touch(data, figure),
        height=4.0,
        numbers={"curvature": take_curvature(data.tensors)[0]},
    )


# A touch of the run as a drawing: the antenna and the object at one moment, to scale.


def find_touch(touches: Sequence[Trial], speed: float) -> int:
    """The number of a touch that shows most: of the first kind of object the greater one, at the
    place nearest the base.
    """
    asked = [k for k, one in enumerate(touches) if one.speed == speed]
    kind = touches[asked[0]].feature.kind
    same = [k for k in asked if touches[k].feature.kind == kind]
    return min(same, key=lambda k: (touches[k].location, -touches[k].feature.size))


def draw_moment(
    antenna: Antenna,
    trial: Trial,
    tensors: xr.Dataset,
    now: int,
    ax: Axes,
    norm: Normalize,
) -> MovingAntenna:
    """Antenna and object at sample ``now`` of a touch, coloured by its curvature, without frame;
    ``tensors`` holds this one touch.
    """
    reach = antenna.length
    left = max(0.16 * reach, 2.2 * trial.feature.size)
    ax.set(xlim=(-left, 0.86 * reach), ylim=(-0.03 * reach, 1.08 * reach), aspect="equal")
    ax.axis("off")
    placed, time = place(antenna, trial), in_unit(tensors["time"], "ms").values[now]
    ax.add_patch(
        make_patch(trial.shape, placed.origin + placed.velocity * time, placed.forward)
    )
    drawn = MovingAntenna(antenna, ax, norm)
    posture = reconstruct_posture(tensors, antenna).values[0, now]
    drawn.move(posture, compute_bend(tensors, antenna)[now])
    return drawn


# Fig. 1C, and the scene of Fig. 3A, as a drawing: a cockroach with one antenna along a wall.

_ANTENNAE_PER_BODY = 1.5  # [P] an antenna's length, in lengths of the body


def _choose_wall(shapes: SimpleNamespace) -> int:
    """Which of the distances is drawn: the middle one of those with an inverted J, or else of
    those in contact.
    """
    bent = np.flatnonzero(shapes.inverted & shapes.contact)
    met = bent if bent.size else np.flatnonzero(shapes.contact)
    return int(met[len(met) // 2])


def plot_animal(sweep: Approach, ax: Axes) -> None:
    """Body, the free antenna, the one along the wall with its greatest bend, and the distance."""
    shapes, antenna = list_shapes(sweep), sweep.antenna
    at, side = _choose_wall(shapes), sweep.posture.sign
    free = int(np.flatnonzero(~shapes.contact)[0]) if not shapes.contact.all() else 0
    wall, reach = abs(float(shapes.wall[at])), antenna.length
    _draw_body(reach / _ANTENNAE_PER_BODY, ax)
    for points, flip in ((shapes.points[at], side), (shapes.points[free], -side)):
        shown = points * [flip, 1]
        plot_posture(shown, ax, lw=2.2, zorder=4)
        ax.plot(*shown[antenna.sensors - 1].T, ".", ms=0.9, color="#FFFFFF", zorder=5)
    top = float(max(shapes.points[k][:, 1].max() for k in (at, free)))
    low, high = -0.75 * reach, top + 9.0
    ax.add_patch(Rectangle((wall, low), 5.0, high - low, color=OBJECT_COLOUR, lw=0))
    ax.text(wall + 2.5, 0.5 * (low + high), "wall", rotation=90, ha="center", va="center")
    peak = shapes.peak[at] * [side, 1]
    ax.plot(*peak, "o", ms=6, mfc="none", mec=PALETTE[2], mew=1.5, zorder=6)
    ax.annotate(
        "greatest bend",
        peak,
        (wall + 8.0, peak[1]),
        arrowprops={"arrowstyle": "-", "lw": 0.6, "color": PALETTE[2]},
        va="center",
        color=PALETTE[2],
    )
    level = top + 3.0
    ax.annotate("", (wall, level), (0, level), arrowprops={"arrowstyle": "<->", "lw": 0.8})
    ax.text(0.5 * wall, level + 0.5, "wall distance", ha="center", va="bottom")
    ax.plot([0, 0], [0, level + 2], ":", color="#888888", lw=0.8, zorder=0)
    ax.set(xlim=(-0.75 * reach, wall + 20), ylim=(low, high), aspect="equal")
    ax.axis("off")
    mark_panels(ax, "c")
    ax.plot([-0.7 * reach, -0.7 * reach + 10], [low + 3] * 2, color="black", lw=1.5)
    ax.text(-0.7 * reach + 5, low + 4, "10 mm", ha="center", va="bottom")


def _draw_body(length: float, ax: Axes) -> None:
    """Head, pronotum and abdomen of a body of this length [mm], head at the origin; a sketch."""
    for centre, wide, long in ((0.05, 0.16, 0.1), (0.2, 0.3, 0.24), (0.62, 0.34, 0.76)):
        ax.add_patch(
            Ellipse(
                (0, -centre * length),
                wide * length,
                long * length,
                fc=ANTENNA_COLOURS[1],
                ec="#FFFFFF",
                lw=0.8,
            )
        )
    for front, back in ((0.25, 0.05), (0.35, 0.5), (0.5, 1.0)):
        for side in (-1, 1):
            knee = side * 0.32 * length
            ax.plot(
                [0, knee, 1.35 * knee],
                [-front * length, -0.5 * (front + back) * length, -back * length],
                color=ANTENNA_COLOURS[0],
                lw=0.8,
                zorder=0,
            )


def compute_animal(context: Context) -> SimpleNamespace | None:
    """The first profile's ``sweep`` in the leading set-up, where it meets the wall."""
    sweep = next(iter(compute_wall(context).sweeps.values()))
    met = context.is_cockroach and sweep.contact.any()
    return SimpleNamespace(rows={}, sweep=sweep) if met else None


def show_animal(data: SimpleNamespace, section: Section) -> None:
    """A cockroach beside the wall."""
    shapes = list_shapes(data.sweep)
    section.figure(
        "fig1_animal",
        "A cockroach from above. Both antennae are the model's: the one along the wall is at rest"
        " in the leading set-up, the other one is free, pre-bent as this set-up asks. White dots:"
        " sensors. The body is a sketch of the length that the paper gives, two thirds of an"
        " antenna's. Along a wall an antenna bends most at one place; where that is may tell how"
        " far the wall is. (Fig. 1C, 3A)",
        lambda figure: plot_animal(data.sweep, figure.subplots()),
        height=3.4,
        numbers={"points": shapes.points[_choose_wall(shapes)]},
    )


# Fig. 5E as a drawing: the speeds and the profiles that are compared, in touches of the run.

_PUSHED = 9.0  # mm that the object has moved since contact, at every profile
_LATER = 15.0  # ms since contact, at every speed


def compute_conditions(context: Context) -> SimpleNamespace:
    """One touch of each profile at the slow speed, and of the first profile at each speed, each
    with the ``moment`` that is drawn [ms since contact].
    """
    profiles, slow = list_profiles(context), SPEEDS["slow"]
    first = profiles[0]
    speeds = sorted(list_speeds(context, first).items(), key=lambda item: item[1])
    return SimpleNamespace(
        rows={},
        profiles={p: _take_touch(context, p, slow, _PUSHED / slow) for p in profiles},
        speeds={
            f"{name}, {speed:g} m/s": _take_touch(context, first, speed, _LATER)
            for name, speed in speeds
        },
    )


def _take_touch(
    context: Context, profile: str, speed: float, moment: float = 0.0
) -> SimpleNamespace:
    touches = list_touches(context, profile)
    number = find_touch(touches, speed)
    return SimpleNamespace(
        rows={},
        antenna=context.profiles[profile],
        trial=touches[number],
        tensors=load_tensors(context, profile).isel(trial=[number]),
        moment=moment,
    )


def plot_conditions(data: SimpleNamespace, figure: Figure) -> None:
    """Profiles and their touches above, touches at each speed below."""
    both = data.profiles, data.speeds
    bends = [
        compute_bend(one.tensors, one.antenna)[_find_sample(one)].max()
        for touches in both
        for one in touches.values()
    ]
    norm = Normalize(0.0, max(*map(float, bends), 1e-9))
    columns = 1 + max(map(len, both))
    axes = figure.subplots(2, columns, width_ratios=(1.2, *[1] * (columns - 1)))
    _draw_stiffness({name: one.antenna for name, one in data.profiles.items()}, axes[0, 0])
    mark_panels(axes[0, 0], "e")
    _draw_ways([one.trial.speed for one in data.speeds.values()], axes[1, 0])
    for row, touches in zip(axes[:, 1:], both, strict=True):
        for ax, (name, one) in zip(row, touches.items(), strict=False):
            drawn = draw_moment(
                one.antenna, one.trial, one.tensors, _find_sample(one), ax, norm
            )
            ax.set_title(name)
        for ax in row[len(touches) :]:
            ax.axis("off")
    figure.colorbar(drawn.colours, ax=axes[:, 1:], label="curvature [1/mm]", pad=0.01)


def _find_sample(one: SimpleNamespace) -> int:
    """The sample at a touch's moment, or the last one."""
    time = in_unit(one.tensors["time"], "ms").values
    return min(int(np.searchsorted(time, one.trial.lead + one.moment)), time.size - 1)


def _draw_stiffness(antennas: Mapping[str, Antenna], ax: Axes) -> None:
    """Stiffness along every profile."""
    for name, colour in pick_colours(antennas).items():
        one = antennas[name]
        ax.plot(one.hinge_position / one.length, one.stiffness, color=colour, label=name)
    ax.legend(loc="lower left", borderpad=0.1)
    set_decades(ax)
    ax.set(xlabel="location (base 0, tip 1)", ylabel="stiffness [N·mm/rad]")


def _draw_ways(speeds: list[float], ax: Axes) -> None:
    """How far an object has come over time, at every speed."""
    time = np.array([0.0, 40.0])
    for speed, colour in zip(
        speeds, pick_colours(f"{s:g} m/s" for s in speeds).values(), strict=True
    ):
        ax.plot(time, speed * time, color=colour, label=f"{speed:g} m/s")
    ax.axvline(_LATER, color="#888888", ls=":", lw=0.8)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, columnspacing=0.8)
    ax.set(
        xlabel="time since contact [ms]", ylabel="distance since contact [mm]", ylim=(0, None)
    )


def show_conditions(data: SimpleNamespace, section: Section) -> None:
    """What is compared in most of what follows."""
    section.figure(
        "fig5e_conditions",
        "What is compared. Above: antennae that differ in stiffness only, each when the same slow"
        f" object has pushed it for {_PUSHED:g} mm. Below: one antenna and one object at each"
        f" speed, each {_LATER:g} ms after contact (dotted on the left). (Fig. 5E)",
        lambda figure: plot_conditions(data, figure),
        height=4.4,
        numbers={name: one.antenna.stiffness for name, one in data.profiles.items()},
    )
