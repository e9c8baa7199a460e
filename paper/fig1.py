"""Fig. 1A–B as numbers: sensor spacing, sampling rate and compliance, the axes along which the
paper says that a distributed sensor is designed.
"""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from feeler import touch
from feeler.analysis import find_noise
from feeler.analysis.dispersion import bootstrap_mean
from feeler.antenna.segments import Antenna
from feeler.decoding import compute_left_out
from feeler.decoding.classifiers import make_lda
from feeler.decoding.sweeps import Plan
from feeler.objects import Trial, place
from feeler.objects.noise import Common
from feeler.objects.trials import SPEEDS
from feeler.plotting.antennas import OBJECT_COLOUR, make_patch, plot_posture
from feeler.plotting.style import PALETTE, mark_panels, mark_places
from feeler.report import Section, make_spread
from feeler.tensors import in_unit, rectify
from feeler.tensors.transforms import reconstruct_posture
from paper.context import Context
from paper.data import COMPLETE, list_profiles, list_touches, load_complete
from paper.fig1_touch import find_touch
from paper.table import read_declared
from paper.window import keep_whole

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
        XX"""
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


def plot(data: SimpleNamespace, spacing: float, figure: Figure) -> None:
    """A panel per axis; ``spacing`` of neighbouring sensors [mm]."""
    axes = figure.subplots(1, 4)
    reading, activity = data.reading, data.activity
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


def plot_compliance(
    antenna: Antenna,
    trial: Trial,
    touched: Mapping[float, xr.Dataset],
    threshold: float,
    figure: Figure,
) -> None:
    """The moment of most active sensors, a panel for each stiffness; ``touched`` by factor."""
    axes = figure.subplots(1, len(touched), sharex=True, sharey=True)
    for ax, (factor, tensors) in zip(axes, touched.items(), strict=True):
        active = count_active(tensors, threshold)
        now = int(active.sum(axis=1).argmax())
        _draw(antenna, trial, tensors, now, active[now], ax)
        words = "its own stiffness" if factor == 1 else f"{factor:g} × as stiff"
        ax.set_title(f"{words}\n{active[now].sum()} of {active.shape[1]} sensors active")
    mark_panels(axes[0])
    marks = [
        Line2D([], [], color=colour, marker="o", ls="", ms=3, label=label)
        for colour, label in ((_ACTIVE, f"angle > {threshold:g} rad"), (_SILENT, "less"))
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


def _show_compliance(
    section: Section,
    antenna: Antenna,
    trial: Trial,
    touched: Mapping[float, xr.Dataset],
    threshold: float,
) -> None:
    """The drawing, and how many sensors are active over time."""
    section.figure(
        "fig1_compliance",
        f"One touch ({trial.label}) of an antenna with other stiffness, each at the moment at which"
        " most sensors are active. The object's path is the same for all. (Fig. 1A)",
        lambda figure: plot_compliance(antenna, trial, touched, threshold, figure),
        height=2.8,
        numbers={
            f"{factor:g}": count_active(tensors, threshold).sum(axis=1)
            for factor, tensors in touched.items()
        },
    )


def show(context: Context, section: Section) -> None:
    """What spacing, sampling and compliance do to slow touches of the first profile."""
    asked, name = read_declared("declared.toml")["axes"], list_profiles(context)[0]
    antenna, tensors = context.profiles[name], load_complete(context, name)
    touches = [trial for trial in list_touches(context, name) if trial.speed == SPEEDS["slow"]]
    activity, shown = {}, {}
    number = find_touch(touches, SPEEDS["slow"])
    for factor in asked["stiffness"]:
        touched = tensors
        if factor != 1.0:
            touched = touch(
                scale_stiffness(antenna, factor), touches, duration=COMPLETE, **context.physics
            )
        activity[factor] = compute_activity(touched, asked, random_state=context.seed)
        shown[factor] = touched.isel(trial=[number])
    data = SimpleNamespace(
        reading=compute_reading(tensors, asked, context.effort.plan, random_state=context.seed),
        activity=activity,
    )
    section.text(
        "The paper names three axes along which a distributed sensor is designed: the spacing of"
        " its sensors, their sampling rate, and compliance. Each is changed by itself, on complete"
        f" slow touches of the antenna '{name}'. Sensors and samples that are left out are not"
        " averaged, so what stays is as noisy as before. The object follows its own path whatever"
        " the antenna does: so an antenna that is softer everywhere is bent into almost the same"
        " shape, with less force."
    )
    ends = {factor: shown[factor] for factor in (max(shown), 1.0, min(shown))}
    _show_compliance(section, antenna, touches[number], ends, asked["threshold"])
    section.figure(
        "fig1_axes",
        f"A: place of touch, on objects never trained; B: shape and size, at places never trained"
        f" (LDA on noisy tensors, sd {context.effort.plan.probe:g} of the greatest angle). C:"
        " sensors whose angle passes a threshold in a touch. D: noise floor at which an ideal"
        " observer still names three of four objects at a place. A to C: mean over touches, D: over"
        " places, with 95 % intervals. (Fig. 1A–B)",
        lambda figure: plot(data, antenna.length / antenna.sensors.size, figure),
        height=2.6,
        numbers={
            **vars(data.reading),
            "activity": {f"{factor:g}": vars(found) for factor, found in activity.items()},
        },
    )
    section.values |= _list_values(data)


def _list_values(data: SimpleNamespace) -> dict[str, object]:
    values: dict[str, object] = {
        f"axes.place.every {k}": value for k, value in data.reading.place.items()
    }
    values |= {f"axes.object.{rate:g} Hz": value for rate, value in data.reading.thing.items()}
    for factor, found in data.activity.items():
        values[f"axes.noise75.stiffness x {factor:g}"] = _average(found.noise)
        for name, active in found.active.items():
            values[f"axes.active.{name}.stiffness x {factor:g}"] = _average(active)
    stiff, soft = (data.activity[end(data.activity)] for end in (max, min))
    for name, active in soft.active.items():  # of the same touches: pairs
        values[f"axes.gain.{name}"] = _average(active - stiff.active[name])
    gain = np.divide(
        soft.noise, stiff.noise, where=stiff.noise > 0, out=np.ones_like(soft.noise)
    )
    return values | {"axes.gain.noise75": _average(gain - 1)}
