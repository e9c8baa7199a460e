"""Figs. 2A, 2B, S1: the antenna, how it moves beside the animal, its fit, and segment lengths."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle

from feeler.analysis import measure_free_response
from feeler.antenna import Antenna, compute_modes
from feeler.antenna.animals import FACTS, cockroach, fit_sigmoid
from feeler.antenna.files import SOURCE_TAGS
from feeler.calibration import (
    EigenParameters,
    Fit,
    Measured,
    Problem,
    Protocol,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    load_targets,
    make_hinges,
    make_starts,
    walk_sloppy_direction,
)
from feeler.calibration.problem import FAILED
from feeler.experiments.mechanics import RADIUS, hit, release
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.plotting import (
    SLOWER,
    MovingAntenna,
    choose_frames,
    say_clock,
    style,
    write_movie,
)
from feeler.plotting.antennas import plot_posture, plot_profiles
from feeler.plotting.style import ANTENNA_COLOURS, PALETTE, mark_panels, set_decades
from feeler.report import Section
from feeler.tensors.transforms import in_unit
from paper.cache import keep
from paper.context import Context
from paper.scale import Scale

# Fig. 2A, C: the antenna, its profiles, and where its numbers come from.


def plot_antenna(antenna: Antenna, figure: Figure) -> None:
    """The antenna lying, its sensors on it, and its profiles (Fig. 2A, C)."""
    grid = figure.add_gridspec(2, 4, height_ratios=(1, 2))
    ax = figure.add_subplot(grid[0, :])
    points = antenna.shape()[:, ::-1]
    radius, colour = antenna.radius, ANTENNA_COLOURS[1]
    ax.fill_between(points[:-1, 0], -radius, radius, color=colour, linewidth=0)
    plot_posture(points, ax, linewidth=1)
    ax.plot(
        points[antenna.sensors - 1, 0],
        points[antenna.sensors - 1, 1],
        ".",
        color=PALETTE[0],
        markersize=3,
        label="sensor",
    )
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0))
    ax.set(xlabel="arc length from the base [mm]", yticks=[], ylim=(-1.5, 1.5), aspect="equal")
    ax.set_title(
        f"{antenna.name}: {antenna.n_segments} segments, {antenna.sensors.size} sensors,"
        f" {antenna.length:.3g} mm"
    )
    ax.spines.left.set_visible(False)
    plot_profiles(antenna, [figure.add_subplot(grid[1, i]) for i in range(4)])
    mark_panels(figure.axes[:2], "ac")


def compute_antenna(context: Context) -> SimpleNamespace:
    """The ``antenna``, and its small oscillations beside its controls': ``modes``, a line each."""
    antenna, modes = context.antenna, []
    for name, control in context.profiles.items():
        found = compute_modes(control, 2)
        frequency, compliance = 1e3 * found.frequency[:2], float((1 / control.stiffness).sum())
        modes.append([name, *frequency, found.damping_ratio[0], compliance])
    rows = {
        "antenna.n_segments": antenna.n_segments,
        "antenna.n_sensors": int(antenna.sensors.size),
    }
    return SimpleNamespace(
        rows=rows, antenna=antenna, modes=modes, is_cockroach=context.is_cockroach
    )


def show_antenna(data: SimpleNamespace, section: Section) -> None:
    """Draw the antenna (Fig. 2A, C), list its numbers with their sources, and its small
    oscillations.
    """
    section.figure(
        "fig2c_antenna",
        f"The antenna '{data.antenna.name}' and what changes along it. Dots: sensors. Inertia is"
        " that of thin rods with the shown masses; the drawn radius enters contact only."
        " (Fig. 2A, C)",
        lambda figure: plot_antenna(data.antenna, figure),
        height=3.2,
        numbers={
            name: getattr(data.antenna, name)
            for name in ("segment_length", "segment_mass", "stiffness", "damping")
        },
    )
    section.table(
        ["profile", "mode 1 [Hz]", "mode 2 [Hz]", "ζ of mode 1", "Σ 1/k [rad/N·mm]"],
        data.modes,
        "Small oscillations of the clamped, straight antenna, the frequencies undamped. ζ is"
        " exact where damping is proportional to stiffness, as in 'uniform' and 'matched'; how"
        " the touched antenna decays is under Calibration. 'matched' is of uniform stiffness,"
        " with the total compliance Σ 1/k of 'exponential'.",
    )
    if data.is_cockroach:
        section.heading("Where the numbers come from")
        section.text(
            "; ".join(f"[{tag}] {meaning}" for tag, meaning in SOURCE_TAGS.items()) + "."
        )
        section.table(
            ["quantity", "value", "unit", "source", "note"],
            [
                [name, fact.value, fact.unit, f"[{fact.tag}]", fact.note]
                for name, fact in FACTS.items()
            ],
        )


# Fig. 2B and Movie S1: the tip after a step and during an impulse, simulated against the
# digitised traces.

# Digitised from the first author's poster [A]: time [ms] from the first opposite peak (step) or the
# largest deflection (impulse), displacement relative to the largest. The animals' own step trace
# leaves −1 at −27 ms, the simulated one at −19 ms. Bands of ±1 SD could not be read off.
STEP_TRACE = np.array(
    [[-19.0, -1.0], [-9.0, 0.0], [0.0, 0.41], [19.0, 0.0], [29.0, -0.06], [46.0, 0.0]]
)
_STEP_ANIMALS_START = -27.0
_IMPULSE_TRACE = np.array([[-22.0, 0.0], [0.0, -1.0], [22.5, 0.0], [30.0, 0.07]])
# [C] mm, mm/ms: not published; chosen after seeing how long the trace's contact lasts
_LEVER, _LEVER_SPEED = 20.0, 0.45
_STEP_SPAN, _IMPULSE_SPAN = 100.0, 60.0  # ms


def compute(context: Context) -> SimpleNamespace:
    """Simulate both experiments.

    Returns
    -------
    SimpleNamespace
        ``rows``. ``step`` over ``step_time``, ``impulse`` over ``impulse_time`` and ``slow`` over
        ``slow_time``: displacements relative to the largest over time [ms] since the turning point
        that the traces share; ``slow`` is the slow impulse on a straight path, which calibration
        uses. ``motion`` (a Dataset of :func:`~feeler.experiments.mechanics.hit`) with the lever,
        for Movie S1 of so many ``fps``.
    """
    antenna = context.antenna
    options: dict[str, Any] = {"engine": context.engine, "sample_interval": 0.2}
    released = release(antenna, duration=2 * _STEP_SPAN, **options)
    time = in_unit(released["time"], "ms").values
    tip = in_unit(released["tip"], "mm").values[0, :, 0]
    free = measure_free_response(time, tip)
    swung = hit(
        antenna, lever=_LEVER, speed=_LEVER_SPEED, duration=2 * _IMPULSE_SPAN, **options
    )
    (impulse_time, impulse), (slow_time, slow) = map(_scale, (swung, hit(antenna, **options)))
    return SimpleNamespace(
        rows={"calibration.rejected": free.rejected},
        antenna=antenna,
        step_time=time - (free.peak_time or 0.0),
        step=-tip / tip[0],
        impulse_time=impulse_time,
        impulse=impulse,
        slow_time=slow_time,
        slow=slow,
        motion=swung,
        fps=context.effort.fps,
    )


def _scale(impulse: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Time since the tip was farthest out [ms], and its displacement over the largest."""
    time, tip = impulse["time"].values, impulse["tip"].values
    size = np.abs(tip)
    return time - float(time[np.argmax(size)]), -tip / size.max()


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Step left, impulse right."""
    left, right = figure.subplots(1, 2)
    # Free response of the tip after the step
    left.plot(data.step_time, data.step, color=PALETTE[1], label="this simulation")
    left.plot(*STEP_TRACE.T, "o", color=PALETTE[0], label="published: simulation, digitised")
    left.plot(
        _STEP_ANIMALS_START,
        -1.0,
        "s",
        color=PALETTE[0],
        fillstyle="none",
        label="published: animals leave −1, digitised",
    )
    left.axhline(0.0, color="#888888", lw=0.6)
    left.set(
        xlabel="time from the first opposite peak [ms]",
        ylabel="tip displacement / step",
        xlim=(-32, _STEP_SPAN - 32),
    )
    left.set_title("step")
    left.legend(loc="lower right")
    # Tip during and after the hit
    right.plot(
        data.impulse_time,
        data.impulse,
        color=PALETTE[1],
        label=f"this simulation, lever {_LEVER:g} mm, {_LEVER_SPEED:g} m/s",
    )
    right.plot(
        data.slow_time,
        data.slow,
        color=PALETTE[4],
        ls="--",
        label="this simulation, straight, 0.2 m/s",
    )
    right.plot(*_IMPULSE_TRACE.T, "o", color=PALETTE[0], label="published: digitised")
    right.axhline(0.0, color="#888888", lw=0.6)
    right.set(
        xlabel="time from the largest deflection [ms]",
        ylabel="tip displacement / largest",
        xlim=(-60, _IMPULSE_SPAN),
    )
    right.set(title="impulse", ylim=(-1.08, 0.62))  # room for the legend above the curves
    right.legend(loc="upper left")
    mark_panels(left, "b")


def _write_movie_s1(data: SimpleNamespace, path: Path) -> Path:
    """Antenna and cylinder left, tip displacement right: the impulse with the lever."""
    antenna, fps = data.antenna, data.fps
    angle, time, place = (data.motion[name].values for name in ("angle", "time", "object"))
    points = antenna.shape(angle)
    curvature = angle / antenna.segment_length
    frames = choose_frames(time, fps=fps)
    with style():
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        norm = Normalize(-(top := float(np.abs(curvature).max())), top)
        line = MovingAntenna(antenna, left, norm, "RdBu_r")
        cylinder = left.add_patch(Circle((0, 0), RADIUS, color=PALETTE[2]))
        high = 1.05 * max(antenna.length, float(place[:, 1].max()) + RADIUS)
        left.set(
            xlim=(-12, 30), ylim=(-2, high), aspect="equal", xlabel="x [mm]", ylabel="y [mm]"
        )
        figure.colorbar(ScalarMappable(norm, "RdBu_r"), ax=left, label="curvature [1/mm]")
        right.plot(*_IMPULSE_TRACE.T, "o", color=PALETTE[0], label="published: digitised")
        (trace,) = right.plot([], [], color=PALETTE[1], label="this simulation")
        right.set(xlim=(data.impulse_time[0], data.impulse_time[-1]), ylim=(-1.1, 0.3))
        right.set(
            xlabel="time from the largest deflection [ms]",
            ylabel="tip displacement against the push / largest",
        )
        right.legend(loc="lower right")
        clock = right.set_title(say_clock(float(time[-1])))

        def draw(k: int) -> list:
            now = frames[k]
            cylinder.center = tuple(place[now])
            trace.set_data(data.impulse_time[: now + 1], data.impulse[: now + 1])
            clock.set_text(say_clock(float(time[now])))
            return [cylinder, *line.move(points[now], curvature[now]), trace, clock]

        return write_movie(path, figure, draw, len(frames), fps)


def show(data: SimpleNamespace, section: Section) -> None:
    """The two experiments, and the movie of one."""
    section.figure(
        "fig2b_responses",
        "Tip after a released step (left) and during a hit (right): simulation with the published"
        " constants against the traces digitised from the poster [A] (the step trace seems to be"
        " the published simulation's own). (Fig. 2B)",
        lambda figure: plot(data, figure),
        height=3.0,
        numbers={
            name: getattr(data, name)
            for name in ("step", "step_time", "impulse", "impulse_time")
        },
    )
    section.movie(
        _write_movie_s1(data, section.folder / "movieS1_impulse.mp4"),
        f"The impulse test in simulation, {SLOWER:g} times slower than life: a cylinder on a lever"
        " pushes the antenna to the right and slips off. Displacement is drawn against the push,"
        " as the published trace is. (Movie S1)",
    )


# Beside Fig. 2B: what four targets determine: directions, error profiles, and the hinges that
# fit the animals.

_LEVEL = 95.0  # % of the draws
_N_HINGES = 140  # [P] the family's rates are per hinge of a cockroach
_SCALE = {"frequency": 1e3}  # kHz → Hz
_UNITS = dict(
    zip(
        ("p1", "p2", "p3", "p4"), ("N·mm/rad", "N·mm·ms/rad", "1/joint", "1/joint"), strict=True
    )
)


def plot_fit(found: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Directions (left two) and the hinges that bootstrapped fits give (right two)."""
    axes = figure.subplots(1, 4)
    _plot_sensitivity(found.directions, axes[0])
    _plot_directions(found.directions, axes[1])
    for ax, base, rate, unit in zip(
        axes[2:], (0, 1), (2, 3), ("N·mm/rad", "N·mm·ms/rad"), strict=True
    ):
        # Median and ``_LEVEL`` % band of exponential profiles, one per draw
        hinge = np.arange(_N_HINGES)
        low, middle, high = np.percentile(
            _draw_out(found.draws[:, base, None], found.draws[:, rate, None]),
            [2.5, 50.0, 97.5],
            axis=0,
        )
        ax.fill_between(
            hinge,
            low,
            high,
            color=PALETTE[0],
            alpha=0.25,
            linewidth=0,
            label=f"draws: {_LEVEL:g} %",
        )
        ax.plot(hinge, middle, color=PALETTE[0], label="draws: median")
        set_decades(ax)
        ax.plot(_draw_out(PAPER_P[base], PAPER_P[rate]), color=PALETTE[1], label="published")
        ax.set(ylabel=f"{('stiffness', 'damping')[base]} [{unit}]", xlabel="hinge")
    figure.legend(*axes[2].get_legend_handles_labels(), loc="outside lower right", ncols=3)


def _plot_sensitivity(directions: EigenParameters, ax) -> None:
    """How much the error changes along each direction."""
    number = np.arange(1, len(directions.sensitivity) + 1)
    ax.plot(number, directions.sensitivity, "o-", color=PALETTE[0])
    set_decades(ax)
    ax.set(xlabel="direction", ylabel="change of the error along it", xticks=number)


def _plot_directions(directions: EigenParameters, ax) -> None:
    """What each direction is made of."""
    ax.imshow(directions.direction, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    for (row, column), share in np.ndenumerate(directions.direction):
        colour = "w" if abs(share) > 0.6 else "k"
        ax.text(column, row, f"{share:.2f}", ha="center", va="center", fontsize=7, color=colour)
    n = len(directions.names)
    ax.set(
        xticks=range(n),
        xticklabels=directions.names,
        yticks=range(n),
        yticklabels=range(1, n + 1),
    )
    ax.set(ylabel="direction", xlabel="what moves together")


def _draw_out(base: float | np.ndarray, rate: float | np.ndarray) -> np.ndarray:
    """``base`` · exp(``rate`` (n − 1)) at every hinge n."""
    return base * np.exp(rate * np.arange(_N_HINGES))


def _plot_profiles(profiles: xr.Dataset, figure: Figure | SubFigure) -> None:
    """Error of the best fit with one parameter held; a gap where no antenna could be measured."""
    names = profiles["parameter"].values
    axes = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
    for ax, name, value, error in zip(
        axes, names, profiles["value"].values, profiles["error"].values, strict=True
    ):
        ax.plot(value, np.where(error < FAILED, error, np.nan), "o-", ms=3, color=PALETTE[0])
        ax.axhline(
            PAPER_ERROR, color="#888888", ls="--", lw=0.8, label="the paper's least error"
        )
        ax.set(xlabel=f"{name} [{_UNITS[name]}]", yscale="log")
    axes[0].set_ylabel("error, the others refitted")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center")


def compute_fit(context: Context) -> SimpleNamespace:
    """What :func:`calibrate` finds, with ``rows``."""
    found = keep(
        "calibration",
        calibrate,
        context.effort,
        antenna=context.antenna,
        seed=context.seed,
        engine=context.engine,
    )
    measured, error, accuracy = next(iter(found.scores.values()))
    targets = zip(measured.names, measured.values, strict=True)
    rows = {
        f"calibration.{name}": float(value) * _SCALE.get(name, 1.0) for name, value in targets
    } | {
        "calibration.cost_published": error,
        "calibration.msa_published": accuracy,
        "calibration.widest_spread": _find_widest_spread(found),
    }
    return SimpleNamespace(**vars(found), rows=rows)


def show_fit(found: SimpleNamespace, section: Section) -> None:
    """What the published constants score, and what is determined."""
    names = next(iter(found.scores.values()))[0].names
    section.heading("Targets, and what the published constants score")
    section.table(
        [
            "antenna",
            *(f"{name} [Hz]" if name in _SCALE else name for name in names),
            "error",
            "median symmetric accuracy",
        ],
        [_row(name, *score) for name, score in found.scores.items()],
        "Reconstructed targets [D]: 17.5 Hz, 0.54, 0.22, 0.55. The paper reports a least error of"
        " 0.067 and 0.0035 against its own targets, which are lost.",
    )
    section.heading("What the targets determine")
    directions, profiles = found.directions, found.profiles
    drawn = "by one linear step per draw" if found.refits is None else "refitted to each draw"
    section.figure(
        "fig2b_directions",
        "a: how much the error changes along four directions in the space of p1…p4 (per unit along"
        " them), most determined first; b: how much each parameter enters a direction. c, d:"
        " stiffness and damping along the antenna for targets drawn from the animals' spread,"
        f" {drawn}.",
        lambda figure: plot_fit(found, figure),
        height=2.6,
        numbers={
            "names": directions.names,
            "sensitivity": directions.sensitivity,
            "direction": directions.direction,
            "draws": found.draws,
        },
    )
    section.text(_describe(found))
    if profiles is not None:
        section.figure(
            "fig2b_error_profiles",
            "Least error with one parameter held and the others refitted; dashed: the paper's"
            " error.",
            lambda figure: _plot_profiles(profiles, figure),
            height=2.6,
            numbers={
                "names": profiles["parameter"].values,
                "value": profiles["value"].values,
                "error": profiles["error"].values,
            },
        )
    low, high = np.percentile(found.draws, [2.5, 97.5], axis=0)
    section.table(
        ["parameter", "2.5 %", "97.5 %"],
        [
            [name, float(a), float(b)]
            for name, a, b in zip(directions.names, low, high, strict=True)
        ],
        f"Bootstrap of the mean of five animals from the targets' spread, {drawn}; an end at the"
        " search's bound (p2 0.25, 2500; p3, p4 −0.16, 0) means not determined.",
    )


def _row(name: str, measured: Measured, error: float, accuracy: float) -> list[object]:
    values = [
        "over-damped" if n in _SCALE and measured.overdamped else float(v) * _SCALE.get(n, 1.0)
        for n, v in zip(measured.names, measured.values, strict=True)
    ]
    return [name, *values, error, accuracy]


def _find_widest_spread(found: SimpleNamespace) -> float:
    """The largest factor by which a base parameter differs among fits as good as the paper's."""
    p, error = found.walked
    good = [PAPER_P, *p[error <= PAPER_ERROR]]
    if found.refits is not None:
        good += [m.p for m in found.refits.minima if m.error <= PAPER_ERROR]
    if found.profiles is not None:
        close = found.profiles["error"].values <= PAPER_ERROR
        good += list(found.profiles["others"].values[close])
    base = np.abs(np.array(good))
    return float((base.max(axis=0) / base.min(axis=0)).max())


def _describe(found: SimpleNamespace) -> str:
    """What the targets determine."""
    p, error = found.walked
    good = np.vstack([PAPER_P, p[error <= PAPER_ERROR]])
    pairs = zip(found.directions.names, good.min(axis=0), good.max(axis=0), strict=True)
    ranges = ", ".join(f"{name} {low:.3g} to {high:.3g}" for name, low, high in pairs)
    return (
        f"{found.directions.describe()} Along that least determined line the model stays at or"
        f" below the paper's error of {PAPER_ERROR} over {ranges}."
    )


# Fig. S1: the sigmoid of segment lengths. Drawn from synthetic antennae: the measured lengths
# were never published.

_N_ANTENNAE = 4  # [P]
_SCATTER = 0.08  # [C] sd of one segment's length, as a share of it


def compute_lengths(context: Context) -> SimpleNamespace:
    """Fit four synthetic antennae scattered about the default one.

    They test the method; how well they are fitted says nothing about cockroaches.

    Returns
    -------
    SimpleNamespace
        ``rows``; ``fit`` (:class:`~feeler.antenna.animals.SigmoidFit`) and ``planted``: the length
        shares (segment,) that the antennae were made from.
    """
    rng, antenna = np.random.default_rng(context.seed), cockroach()
    scatter = np.exp(_SCATTER * rng.standard_normal((_N_ANTENNAE, antenna.n_segments)))
    fit = fit_sigmoid(list(antenna.segment_length * scatter))
    return SimpleNamespace(
        rows={"calibration.sigmoid_residual": fit.squared_residual},
        fit=fit,
        planted=antenna.segment_length / antenna.length,
    )


def plot_lengths(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Length share against relative segment number."""
    ax, fit = figure.subplots(), data.fit
    for number, share in enumerate(fit.share):
        ax.plot(
            fit.x,
            100 * share,
            ".",
            ms=2.5,
            color="#999999",
            label="antennae" if number == 0 else None,
        )
    ax.plot(fit.x, 100 * fit.share.mean(axis=0), ".", ms=4, color=PALETTE[0], label="mean")
    ax.plot(fit.x, 100 * fit.sigmoid.at(fit.x), color=PALETTE[1], label="sigmoid")
    ax.plot(fit.x, 100 * data.planted, "k--", lw=0.8, label="simulated from")
    ax.set_title("synthetic antennae, not animal data")
    ax.text(
        0.97,
        0.05,
        f"squared residual {fit.squared_residual:.1e}",
        transform=ax.transAxes,
        ha="right",
    )
    ax.set(xlabel="segment number / number of segments", ylabel="share of the length [%]")
    ax.legend(loc="upper left")


def show_lengths(data: SimpleNamespace, section: Section) -> None:
    """The sigmoid on synthetic antennae."""
    section.figure(
        "figS1_lengths",
        "Sigmoid fitted to segment lengths of four synthetic antennae scattered about the default"
        " one; the measured lengths were not published. (Fig. S1)",
        lambda figure: plot_lengths(data, figure),
        width=3.5,
        height=2.6,
        numbers={
            "segment": data.fit.x,
            "share": data.fit.share,
            "sigmoid": data.fit.sigmoid.at(data.fit.x),
            "planted": data.planted,
        },
    )


# The calibration: what the published constants give, what refits find, what is determined.

PAPER_P = (37.78, 25.24, -0.0827, -0.0533)  # [P] p1…p4
PAPER_ERROR = 0.067  # [P]
_WALK = np.array([-1.0, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 1.0])
"""[C] Typical changes along the loosest direction."""
_FAMILIES = ("exponential", "linear", "uniform")


def calibrate(
    effort: Scale,
    *,
    antenna: Antenna | None = None,
    seed: int = 0,
    engine: str = DEFAULT_ENGINE,
) -> SimpleNamespace:
    """Score, refit and analyse with some ``effort``.

    Returns
    -------
    SimpleNamespace
        ``scores``: quantities, error and symmetric accuracy of the published constants, the shipped
        presets and every refit, by name. ``refits`` (:class:`~feeler.calibration.Fit` or None):
        least squares from the perturbed starts. ``directions``
        (:class:`~feeler.calibration.EigenParameters`). ``walked``: parameters (step, parameter) and
        errors (step,) along the loosest direction from the published constants. ``profiles``
        (:class:`~feeler.calibration.Profiles` or None). ``draws``: bootstrapped parameters (draw,
        parameter).
    """
    rng = np.random.default_rng(seed)
    antenna = cockroach() if antenna is None else antenna
    targets, protocol = load_targets("cockroach"), Protocol(engine=engine)

    def make(name: str) -> Problem:
        return Problem(hinges=make_hinges(name, antenna), targets=targets, protocol=protocol)

    problem = make("exponential")
    refits = None
    if effort.fit_starts:
        starts = make_starts(problem.hinges, effort.fit_starts + 1, rng)[1:]
        refits = fit(make("exponential"), starts, method="least-squares", max_evaluations=3000)
    best = np.array(PAPER_P) if refits is None else refits.p
    directions = analyse_directions(problem, np.array(PAPER_P))
    scores = {"published p1…p4": problem.score(PAPER_P)}
    scores |= {f"preset {name}": _score_preset(name, make("scale")) for name in _FAMILIES}
    controls = {"": refits} | _fit_controls(make, effort.control_starts, rng)
    scores |= {
        f"refitted {name}": (found.measured, found.error, found.symmetric_accuracy)
        for name, found in controls.items()
        if found is not None
    }
    return SimpleNamespace(
        scores=scores,
        refits=refits,
        directions=directions,
        walked=walk_sloppy_direction(problem, directions, _WALK),
        profiles=(
            compute_profiles(problem, best, n_places=effort.error_places, refits=6)
            if effort.error_places
            else None
        ),
        draws=bootstrap(
            problem,
            np.array(PAPER_P),
            rng,
            n_draws=effort.draws,
            refits=effort.refits,
            directions=directions,
        ),
    )


def _score_preset(name: str, problem: Problem) -> tuple[Measured, float, float]:
    same = Problem(
        hinges=make_hinges("scale", cockroach(name)),
        targets=problem.targets,
        protocol=problem.protocol,
    )
    return same.score((1.0, 1.0))


def _fit_controls(make, n_starts: int, rng: np.random.Generator) -> dict[str, Fit]:
    if not n_starts:
        return {}
    fits = {}
    for name in ("linear", "uniform"):
        problem = make(name)
        fits[name] = fit(
            problem, make_starts(problem.hinges, n_starts, rng, spread=0.5), max_evaluations=60
        )
    return fits
