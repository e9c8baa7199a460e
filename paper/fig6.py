"""Figs. 6 and S7: the robotic antenna. There is no real recording; a surrogate stands in for it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure

from feeler.analysis import INDICES, compute_dispersion
from feeler.antenna import Antenna
from feeler.decoding import Relative, compute_sweep
from feeler.decoding.transfer import TransferClassifier, TransferScore
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.plotting import PALETTE, say_clock, style, write_movie
from feeler.plotting.style import FEATURE_COLOURS, mark_panels, pick_shades
from feeler.plotting.tensors import plot_tensor as draw_tensor
from feeler.report import Section, make_spread
from feeler.robot import (
    Recording,
    RobotFit,
    Surrogate,
    Touches,
    compute_tip,
    draw_robots,
    fit_factors,
    make_posture,
    make_robot,
    make_touches,
    make_training,
    measure_transfer,
    repair,
    simulate_release,
    simulate_touches,
    sweep_shots,
    touch_robots,
)
from feeler.robot.description import ROBOT_SPEEDS
from feeler.tensors import rectify
from paper.cache import keep
from paper.context import Context
from paper.scale import Scale

# What Figs. 6 and S7 show: transfer from simulation to a robotic antenna, here a surrogate
# robot.

_RELEASE = 2000.0  # ms


@lru_cache(maxsize=1)
def compute(context: Context) -> SimpleNamespace:
    """What :func:`simulate` finds, with ``rows``."""
    effort = context.effort
    data = keep("robot", simulate, effort, seed=context.seed, engine=context.engine)
    score = data.score
    right = [t[1:] == p[1:] for t, p in zip(score.true, score.predicted, strict=True)]
    scores = {
        f"{name}.{number:g}": one
        for name, numbers, found in (
            ("gap", data.sizes, data.by_size),
            ("models", data.variants, data.by_variants),
            ("own", data.shots, data.by_shots),
        )
        for number, one in zip(numbers, found, strict=True)
    }
    rows = {
        "robot.transfer": make_spread(*score.share("all"), n=effort.robots),
        "robot.speed_location": float(np.mean(right)),
        "robot.p1": data.fit.stiffness_factor,
        "robot.p2": data.fit.damping_factor,
        "robot.fit_error": data.fit.error,
        "robot.resolution": float(np.degrees(np.max(data.calibration.resolution))),
    } | {
        f"robot.{name}.{part}": make_spread(*one.share(part), n=one.total)
        for name, one in scores.items()
        for part in score.correct
    }
    return SimpleNamespace(**vars(data), rows=rows, fps=effort.fps)


def simulate(effort: Scale, *, seed: int = 0, engine: str = DEFAULT_ENGINE) -> SimpleNamespace:
    """Train on simulations, test on surrogate robots; ``effort`` sets how many.

    Returns
    -------
    SimpleNamespace
        ``training``: the simulated set, 30 classes. Of the first surrogate robot at one reality
        gap: ``touches``, its six tip contacts; ``calibration``, capacitance to angle; ``raw``,
        capacitance of the slow ball contact at the tip; ``release``, angles after a release;
        ``fit``, p1 and p2 fitted to that; ``simulated_release``, angles (hinge, time) of the fitted
        model. Of all surrogate robots: ``by_size`` scores for each reality gap of ``sizes``; at one
        gap ``score``, ``by_variants`` trained on the nominal model and as many random ones
        (``variants``), and ``by_shots`` trained with as many touches of the robot itself
        (``shots``).
    """
    training = make_training(engine=engine)
    classifier = TransferClassifier(random_state=seed).fit(training.values, training.labels)
    robots = {size: draw_robots(size, effort.robots, seed) for size in effort.gaps}
    read = {size: touch_robots(group, engine=engine) for size, group in robots.items()}
    varied = (
        make_training(n_variants=1, rng=np.random.default_rng([seed, 1]), engine=engine)
        if effort.variants
        else None
    )
    by_size = tuple(measure_transfer(classifier, read[size]) for size in effort.gaps)
    raw, release, fit, simulated = _compute_examples(robots[1.0][0], engine)
    return SimpleNamespace(
        training=training,
        touches=read[1.0][0],
        calibration=robots[1.0][0].calibration,
        raw=raw,
        release=release,
        fit=fit,
        simulated_release=simulated,
        score=by_size[effort.gaps.index(1.0)],
        sizes=effort.gaps,
        by_size=by_size,
        variants=effort.variants,
        by_variants=tuple(
            _score_variants(n, varied, read[1.0], seed, engine)
            for n in effort.variants
            if varied is not None
        ),
        shots=effort.shots,
        by_shots=tuple(_score_shots(training, effort, seed, engine)),
    )


def _compute_examples(
    robot: Surrogate, engine: str
) -> tuple[Recording, Recording, RobotFit, np.ndarray]:
    """Raw readouts of a slow ball, a recorded release, and the factors fitted to it."""
    slow_ball = make_touches(locations=(0.9,), speeds=(0.027,))[0]
    raw = robot.touch([slow_ball], engine=engine)[0]
    posture = np.zeros(robot.antenna.n_segments)
    posture[-8:] = make_posture(make_robot())
    start = posture + robot.antenna.rest_angle
    motion = simulate_release(robot.antenna, start, _RELEASE, engine=engine)
    recorded = robot.record(motion).to_angles(robot.calibration, outside="extend")
    release = repair(recorded, gaps="bridge")
    fit = fit_factors(release, engine=engine)
    rest = release.values[:, -500:].mean(axis=1)
    start = release.values[:, 0] - rest
    simulated = simulate_release(fit.antenna, start, _RELEASE, engine=engine)
    return raw, replace(release, values=release.values - rest[:, None]), fit, simulated


def _score_variants(
    n_variants: int, varied: Touches, read: Sequence[Touches], seed: int, engine: str
) -> TransferScore:
    training = varied
    if n_variants > 1:
        training = make_training(
            n_variants=n_variants, rng=np.random.default_rng([seed, n_variants]), engine=engine
        )
    copies = max(
        2, 10 // (1 + n_variants)
    )  # about as many training tensors as without variants
    classifier = TransferClassifier(n_copies=copies, random_state=seed).fit(
        training.values, training.labels
    )
    return measure_transfer(classifier, read)


def _score_shots(
    training: Touches, effort: Scale, seed: int, engine: str
) -> list[TransferScore]:
    if not effort.shots:
        return []
    robots = draw_robots(1.0, effort.shot_robots, seed + 1)
    return sweep_shots(training, effort.shots, robots, engine=engine)


# The eight-segment model, compared by speed and by stiffness profile as the insect's is.

_PROFILES = ("exponential", "linear", "uniform")
# [C] exponential control: stiffness of hinge 8 over hinge 1; the insect's 1e-5 leaves no tip here
_TIP_SHARE = 0.1
_DURATION = 2600.0  # ms, the longest slow touch
_STRIDE = 4  # every fourth sample is kept: nothing in the motion is faster than 100 Hz


def make_profiles() -> dict[str, Antenna]:
    """The robot, whose widths fall linearly, and two controls.

    All have the same compliance Σ 1/k_n and the same damping time c/k.
    """
    linear = make_robot()
    steps = np.linspace(0, 1, linear.n_segments)
    shapes = {
        "exponential": _TIP_SHARE**steps,
        "linear": linear.stiffness,
        "uniform": np.ones(linear.n_segments),
    }
    time = linear.damping[0] / linear.stiffness[0]
    profiles = {}
    for name in _PROFILES:
        stiffness = shapes[name] * np.sum(1 / shapes[name]) / np.sum(1 / linear.stiffness)
        profiles[name] = linear.replace(
            stiffness=stiffness, damping=time * stiffness, name=f"robot {name}"
        )
    return profiles


def touch_robot(antenna: Antenna, speed: float, engine: str = DEFAULT_ENGINE) -> np.ndarray:
    """Rectified tensors (trial, sensor, time) [rad], 4 ms apart, of the ten touches at a speed.

    All have one duration; they are not aligned.
    """
    motions = simulate_touches(
        antenna, make_touches(speeds=[speed]), duration=_DURATION, engine=engine
    )
    return rectify(np.stack(motions)[:, :, ::_STRIDE])


def compute_groups(context: Context) -> SimpleNamespace | None:
    """Dispersion and accuracy by speed (the robot) and by profile (slow touches).

    Returns
    -------
    SimpleNamespace
        ``rows``; ``found``: ``speed`` and ``profile``, each group's name → ``pearson``, ``ssim``,
        ``mse``, ``nmi`` (closest match, averaged: :class:`~feeler.analysis.Interval` over the ten
        touches) and ``accuracy`` (10 classes, LDA, noise of 20 % of each tensor's maximum on raw
        tensors).
    """
    n_repeats, engine = context.effort.robot_repeats, context.engine
    if not n_repeats:
        return None
    profiles = make_profiles()
    speeds = {f"{s:g} m/s": touch_robot(profiles["linear"], s, engine) for s in ROBOT_SPEEDS}
    slow = {
        name: speeds[f"{ROBOT_SPEEDS[-1]:g} m/s"]
        if name == "linear"
        else touch_robot(antenna, ROBOT_SPEEDS[-1], engine)
        for name, antenna in profiles.items()
    }
    by_speed, by_profile = (
        _compare_groups(groups, n_repeats, context.seed) for groups in (speeds, slow)
    )
    fast, *_, slowest = by_speed.values()
    graded, uniform = by_profile["linear"], by_profile["uniform"]
    return SimpleNamespace(
        rows=_list_agreement("speed", {"slow": slowest, "fast": fast})
        | _list_agreement("profile", {"graded": graded, "uniform": uniform}),
        found={"speed": by_speed, "profile": by_profile},
    )


def _compare_groups(
    groups: dict[str, np.ndarray], n_repeats: int, random_state: int
) -> dict[str, dict]:
    names = np.repeat(list(groups), [len(tensors) for tensors in groups.values()])
    dispersion = compute_dispersion(np.concatenate(list(groups.values())), list(names))
    classes = [f"{trial.name} {trial.location:g}" for trial in make_touches()[:10]]
    result = {}
    for name, tensors in groups.items():
        sweep = compute_sweep(
            tensors,
            classes,
            ratios=(0.2,),
            n_repeats=n_repeats,
            noise=Relative(),
            random_state=random_state,
        )
        averages = {index: average[name] for index, average in dispersion.average.items()}
        result[name] = {**averages, "accuracy": float(sweep.noisy.mean())}
    return result


# Fig. 6 and Movie S4: every panel says whether it shows the simulation or the surrogate.

_PAPER_RIGHT, _PAPER_TOTAL = 5, 6  # [P]
_N_TOUCHES = 10  # of each group that is compared
_RELEASE_SPAN, _RELEASE_SLOWER = 600.0, 10.0  # ms shown of Movie S4; times slower than life
_BALL, _BOX = FEATURE_COLOURS["ball"], FEATURE_COLOURS["box"]
_SIMULATED, _SURROGATE = "#000000", PALETTE[0]


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Panels a to e as the paper names them, from the top."""
    rows = figure.subfigures(4, 1, height_ratios=(1.0, 1.0, 0.9, 1.2), squeeze=False).flat
    slow_ball = data.touches.labels.index(("ball", 0.9, 0.027))
    a = rows[0].subplots(1, 3, width_ratios=(1, 1.2, 1.2))
    _plot_layout(a[0])
    _plot_channels("ii", data.raw, a[1], "capacitance [pF]")
    _plot_channels("iii", data.touches.recordings[slow_ball], a[2], "hinge angle [°]")
    mark_panels(a[0], "a")
    b = rows[1].subplots(1, 2)
    _plot_release(data, b[0])
    _plot_grid(data.training, b[1])
    pair = rows[2].subplots(1, 2, sharey=True)
    tensors = (
        data.training.values[data.training.labels.index(("ball", 0.9, 0.027))],
        data.touches.values[slow_ball],
    )
    limit = float(np.rad2deg(max(np.abs(angle).max() for angle in tensors)))
    names = ("simulation", "surrogate (a iv)")
    for ax, angle, name in zip(pair, tensors, names, strict=True):
        plot_tensor(angle, ax, name, limit)
    rows[2].colorbar(pair[0].images[0], ax=pair, label="hinge angle [°]", pad=0.01)
    mark_panels(pair[0], "d")
    _plot_confusion(data, rows[3].subplots())


def _plot_layout(ax: Axes) -> None:
    """The eight hinges on the device's outline, base at the left."""
    robot = make_robot()
    place, width = robot.hinge_position, (11.0, 10.0, 9.2, 8.2, 7.1, 6.1, 5.2, 4.6)
    outline = np.append(place, robot.length)
    half = np.append(width, width[-1]) / 2
    ax.fill_between(outline, -half, half, color="#DDDDDD")
    for k, (x, colour) in enumerate(zip(place, pick_shades("hinge", place.size), strict=True)):
        ax.plot(x, 0, "o", color=colour)
        ax.text(x, 7.0, str(k + 1), color=colour, ha="center", fontsize=7)
    ax.set(
        xlabel="from hinge 1 [mm]",
        yticks=[],
        ylim=(-7, 14),
        aspect="equal",
        title="(i) 8 hinges",
    )


def _plot_channels(part: str, recording: Recording, ax: Axes, label: str) -> None:
    """Channels over time, coloured from base to tip."""
    values = np.rad2deg(recording.values) if recording.quantity == "angle" else recording.values
    for channel, colour in zip(values, pick_shades("hinge", len(values)), strict=True):
        ax.plot(recording.time, channel, lw=0.6, color=colour)
    ax.set(xlabel="time [ms]", ylabel=label, title=f"({part}) {recording.source}")


def plot_tensor(angle: np.ndarray, ax: Axes, title: str, limit: float) -> None:
    """Hinge angles (hinge, time at 1 kHz) [rad] as a picture in degrees up to ±``limit``, base at
    the bottom.
    """
    time, norm = np.arange(angle.shape[1]), Normalize(-limit, limit)
    draw_tensor(np.rad2deg(angle), time, ax, norm, labels=False, unit="°").set_cmap("RdBu_r")
    ax.set(xlabel="time [ms]", ylabel="hinge (base → tip)", title=title)


def _plot_release(data: SimpleNamespace, ax: Axes) -> None:
    """Tip after a release: surrogate and the model fitted to it (panel B, Movie S4)."""
    robot = make_robot()
    ax.plot(
        data.release.time,
        compute_tip(robot, data.release.values),
        color=_SURROGATE,
        lw=1,
        label="surrogate",
    )
    tip = compute_tip(robot, data.simulated_release)
    ax.plot(
        np.arange(tip.size), tip, "--", color=_SIMULATED, lw=0.8, label="simulation, fitted"
    )
    ax.set(xlabel="time after release [ms]", ylabel="tip [mm]", title="impulse response")
    mark_panels(ax, "b")
    ax.legend(loc="upper right", ncols=2)


def _draw_release(data: SimpleNamespace, ax: Axes) -> Callable[[float], list]:
    """Movie S4: a function that moves both shapes to a time [ms] after the release and returns what
    it changed.
    """
    robot, angles = make_robot(), (data.release.values, data.simulated_release)
    looks: tuple[dict[str, Any], ...] = (
        {"color": _SURROGATE, "label": "surrogate"},
        {"color": _SIMULATED, "ls": "--", "label": "simulation, fitted"},
    )
    lines = [ax.plot([], [], marker="o", ms=3, **look)[0] for look in looks]
    clock = ax.set_title(say_clock(_RELEASE_SPAN, _RELEASE_SLOWER))
    ax.set(
        xlim=(-2, 1.08 * robot.length),
        ylim=(-35, 35),
        aspect="equal",
        xlabel="from hinge 1 [mm]",
        ylabel="sideways [mm]",
    )
    ax.legend(loc="upper left", fontsize=9)

    def move(time: float) -> list:
        for line, angle in zip(lines, angles, strict=True):
            points = robot.shape(angle[:, min(round(time), angle.shape[1] - 1)])
            line.set_data(points[:, 1], points[:, 0])
        clock.set_text(say_clock(time, _RELEASE_SLOWER))
        return [*lines, clock]

    return move


def _plot_grid(training: Touches, ax: Axes) -> None:
    """The simulated set: tip traces of all 30 classes, aligned (panel C)."""
    tips = compute_tip(training.antenna, training.values)
    for tip, (feature, _, _) in zip(tips, training.labels, strict=True):
        ax.plot(
            np.arange(tip.size) - 1500, tip, lw=0.5, color=_BALL if feature == "ball" else _BOX
        )
    ax.set(xlabel="time from first peak [ms]", ylabel="tip [mm]", xticks=[-1500, -750, 0])
    for feature in ("ball", "box"):
        ax.plot([], [], color=FEATURE_COLOURS[feature], label=feature)
    ax.legend(loc="lower left")
    ax.set_title("simulation: 30 classes")
    mark_panels(ax, "c")


def _plot_confusion(data: SimpleNamespace, ax: Axes) -> None:
    """Panel E: six tip contacts of all surrogate robots at one reality gap, and what was read."""
    true = sorted(set(data.score.true))
    classes = sorted({*true, *data.score.predicted})
    counts = data.score.confusion(classes)[[classes.index(label) for label in true]]
    image = ax.imshow(counts, aspect="auto", cmap="Greys", vmin=0)
    for row, label in enumerate(true):
        ax.plot(classes.index(label), row, "s", mfc="none", mec=_SURROGATE, ms=14, mew=1.2)
    for row, column in zip(*counts.nonzero(), strict=True):
        dark = counts[row, column] > counts.max() / 2
        colour = "w" if dark else "k"
        ax.text(
            column,
            row,
            str(counts[row, column]),
            color=colour,
            ha="center",
            va="center",
            size=7,
        )
    names = [f"{feature} {place:g} L\n{speed:g} m/s" for feature, place, speed in classes]
    ax.set_xticks(range(len(classes)), names, rotation=90, fontsize=6.5)
    ax.set_yticks(range(len(true)), [f"{f} {s:g} m/s" for f, _, s in true])
    ax.set(xlabel="predicted", ylabel="true, at the tip", xlim=(-0.5, len(classes) - 0.5))
    if (figure := ax.get_figure(root=False)) is not None:
        figure.colorbar(image, ax=ax, label="contacts", pad=0.01)
    mark_panels(ax, "e")


def show(data: SimpleNamespace, section: Section) -> None:
    """Fig. 6 and Movie S4."""
    section.text(
        "The robot's recordings are not public. Everything here that stands for the real robot is a"
        " surrogate: a second, independent model with drawn parameters, noise, quantisation, drift"
        " and dropped samples. It shows the method; it is not evidence about the paper's robot,"
        " whose 5 of 6 stands as published."
    )
    share, low, high = data.score.share()
    one = data.score.total <= _PAPER_TOTAL  # its contacts are no sample of robots
    interval = " (one robot)" if one else f" (95 % CI {100 * low:.0f} to {100 * high:.0f} %)"
    section.figure(
        "fig6_robot",
        "a: surrogate robot, a ball at the tip at 0.027 m/s: layout, the hinges' colours (i), raw"
        " readout (ii), hinge angles (iii), tensor (iv, in d). b:"
        f" impulse response; fitted p1 = {data.fit.stiffness_factor:.2f}, p2 ="
        f" {data.fit.damping_factor:.2f} ms (the paper's robot: 1.19, 2.06; the surrogate has"
        " parameters of its own, and the linear model does not meet it fully). c: the training set."
        " d: one touch as tensors, aligned on the tip's first peak. e: surrogates' tip contacts, in"
        f" squares those classified correctly: {data.score.correct['all']} of {data.score.total} ="
        f" {100 * share:.0f} %{interval}; the paper's robot: {_PAPER_RIGHT} of {_PAPER_TOTAL}."
        " (Fig. 6A–E)",
        lambda figure: plot(data, figure),
        height=7.6,
        numbers={
            "sizes": data.sizes,
            "shares": [score.share("all") for score in data.by_size],
            "variants": data.variants,
            "by_variants": [score.share("all") for score in data.by_variants],
            "shots": data.shots,
            "by_shots": [score.share("all") for score in data.by_shots],
        },
    )
    _write_movie(section, data)
    parts = list(data.score.correct)
    section.table(
        ["reality gap", *parts, "contacts"],
        [
            [f"{size:g}", *(f"{score.share(part)[0]:.2f}" for part in parts), score.total]
            for size, score in zip(data.sizes, data.by_size, strict=True)
        ],
        "Share of the surrogate robots' tip contacts classified correctly. The paper's real"
        " robot: 5 of 6.",
    )


def _write_movie(section: Section, data: SimpleNamespace) -> None:
    with style():
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        move = _draw_release(data, figure.subplots())
        times = np.arange(0.0, _RELEASE_SPAN, 1000 / data.fps / _RELEASE_SLOWER)
        path = section.folder / "movieS4_release.mp4"
        write_movie(path, figure, lambda k: move(float(times[k])), len(times), data.fps)
    section.movie(
        path,
        f"Release of the surrogate robot and of the model fitted to it, {_RELEASE_SLOWER:g} times"
        " slower than life. (Movie S4)",
    )


def show_groups(data: SimpleNamespace, section: Section) -> None:
    """A table for each comparison."""
    section.heading(
        "The eight-segment model, compared as the 140-link one; its graded profile falls linearly"
    )
    for comparison, groups in data.found.items():
        measures = list(next(iter(groups.values())))
        section.table(
            [comparison, *measures],
            [[name, *(g[m] for m in measures)] for name, g in groups.items()],
        )


def _list_agreement(comparison: str, ends: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """In how many of the indices the first is more dispersed than the second, beyond the intervals
    of both, and their values.
    """
    more, rows = [], {}
    for index, known in INDICES.items():
        first, second = (values[index] for values in ends.values())
        less, greater = (first, second) if known.is_similarity else (second, first)
        more.append(less.high < greater.low)
        for name, values in ends.items():
            one = values[index]
            rows[f"robot.{index}.{name}"] = make_spread(
                one.estimate, one.low, one.high, n=_N_TOUCHES
            )
    return rows | {
        f"robot.agree.{comparison}": {"value": float(np.mean(more)), "n": _N_TOUCHES}
    }


# Fig. S7: tensors of the six tip contacts, simulation beside surrogate robot. Shares Fig. 6's
# data.


def compute_contacts(context: Context) -> SimpleNamespace:
    """The ``training`` set and the ``touches`` of Fig. 6, and the relative difference
    ‖surrogate − simulation‖ / ‖simulation‖ of the aligned tensors, per contact: ``differences``.
    """
    data = compute(context)
    differences = {}
    for label, surrogate in zip(data.touches.labels, data.touches.values, strict=True):
        simulated = data.training.values[data.training.labels.index(label)]
        differences[label] = float(
            np.linalg.norm(surrogate - simulated) / np.linalg.norm(simulated)
        )
    return SimpleNamespace(
        rows={}, training=data.training, touches=data.touches, differences=differences
    )


def plot_contacts(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """A column per contact: simulation above, surrogate below, aligned on the tip's first peak."""
    axes = figure.subplots(2, len(data.touches.labels), sharex=True, sharey=True)
    limit = max(
        float(np.rad2deg(np.abs(touches.values[touches.labels.index(label)])).max())
        for touches in (data.training, data.touches)
        for label in data.differences
    )
    for (label, difference), (above, below) in zip(
        data.differences.items(), axes.T, strict=True
    ):
        feature, _, speed = label
        for ax, touches, name in (
            (above, data.training, f"{feature}, {speed:g} m/s\nsimulation"),
            (below, data.touches, f"surrogate\ndiffers by {difference:.0%}"),
        ):
            plot_tensor(touches.values[touches.labels.index(label)], ax, name, limit)
            ax.title.set_fontsize(7)
    figure.colorbar(axes[0, 0].images[0], ax=axes, label="hinge angle [°]", pad=0.01)
    for ax in axes.flat:
        ax.label_outer()


def show_contacts(data: SimpleNamespace, section: Section) -> None:
    """The six contacts, and how much they differ."""
    differences = {" ".join(map(str, label)): one for label, one in data.differences.items()}
    section.figure(
        "figS7_tensors",
        "Six tip contacts, aligned on the first peak: simulation above, surrogate robot below."
        " In slow touches the peak is flat, and much of the difference is a shift. (Fig. S7)",
        lambda figure: plot_contacts(data, figure),
        height=3.4,
        numbers={"relative_difference": differences},
    )
