"""The robotic antenna: simulation, a surrogate robot, and the transfer between them."""

import numpy as np
from matplotlib.figure import Figure

from feeler.paper import fig6, fig6_plot, figS7
from feeler.paper.context import Context
from feeler.plotting.movie import write_movie
from feeler.plotting.style import style
from feeler.report.section import Section
from feeler.robot.comparison import compute_comparison


def make(context: Context, section: Section) -> None:
    """Fig. 6, Fig. S7, Movie S4 and the eight-segment comparison."""
    section.text(
        "The robot's recordings are not public. Everything here that stands for the real robot is a surrogate: a second, "
        "independent model with drawn parameters, noise, quantisation, drift and dropped samples. It shows the method; it is "
        "not evidence about the paper's robot, whose 5 of 6 stands as published."
    )
    data = fig6.compute(context.scale, seed=context.seed)
    section.figure(
        "fig6_robot",
        "Simulation (training) and surrogate robots (test). Panels as in Fig. 6A–E; below them what lies beyond the paper: "
        "accuracy against the size of the reality gap, what closes it, and accuracy against time since contact.",
        lambda figure: fig6_plot.plot(data, figure),
        height=9.0,
    )
    section.figure(
        "figS7_tensors",
        "Six tip contacts: simulation above, surrogate robot below. (Fig. S7)",
        lambda figure: figS7.plot(data, figure),
        height=3.4,
    )
    differences = {" ".join(map(str, label)): value for label, value in figS7.compute_differences(data).items()}
    section.numbers("figS7_tensors", relative_difference=differences)
    _write_movie(context, section, data)
    _list_scores(section, data)
    if context.scale != "smoke":
        _compare(context, section)


def _write_movie(context: Context, section: Section, data: fig6.Fig6Data) -> None:
    with style():
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        move = fig6_plot.draw_release(data, figure.subplots())
        n_frames = context.pick(smoke=10, quick=40, paper=100)
        path = write_movie(section.folder / "movieS4_release.mp4", figure, lambda k: move(10.0 * k), n_frames)
    section.movie(path, "Release of the surrogate robot and of the model fitted to it, slowed down. (Movie S4)")


def _list_scores(section: Section, data: fig6.Fig6Data) -> None:
    parts = list(data.score.correct)
    rows = [
        [f"{size:g}", *(f"{score.share(part)[0]:.2f}" for part in parts), score.total]
        for size, score in zip(data.sizes, data.by_size, strict=True)
    ]
    section.table(
        ["reality gap", *parts, "contacts"],
        rows,
        "Share of the surrogate robots' tip contacts read right. The paper's real robot: 5 of 6.",
    )
    value, low, high = data.score.share("all")
    speed_location = np.mean([t[1:] == p[1:] for t, p in zip(data.score.true, data.score.predicted, strict=True)])
    section.values |= {
        "robot.transfer": {"value": value, "low": low, "high": high},
        "robot.speed_location": float(speed_location),
        "robot.p1": data.fit.stiffness_factor,
        "robot.p2": data.fit.damping_factor,
        "robot.fit_error": data.fit.error,
        "robot.resolution": float(np.degrees(np.max(data.calibration.resolution))),
    }
    section.numbers(
        "fig6_robot",
        sizes=data.sizes,
        shares=[score.share("all") for score in data.by_size],
        variants=data.variants,
        by_variants=[score.share("all") for score in data.by_variants],
        shots=data.shots,
        by_shots=[score.share("all") for score in data.by_shots],
        early=data.early.accuracy,
        since_contact=data.early.since_contact,
    )


def _compare(context: Context, section: Section) -> None:
    found = compute_comparison(n_repeats=context.pick(smoke=1, quick=2, paper=10), random_state=context.seed)
    section.heading("The eight-segment model, compared as the 140-link one")
    for comparison, groups in found.items():
        measures = list(next(iter(groups.values())))
        section.table([comparison, *measures], [[name, *(float(g[m]) for m in measures)] for name, g in groups.items()])
    speeds = list(found["speed"].values())
    section.values |= {
        "robot.nmi.fast": float(speeds[0]["nmi"]),
        "robot.nmi.slow": float(speeds[-1]["nmi"]),
        "robot.nmi.graded": float(found["profile"]["linear"]["nmi"]),
        "robot.nmi.constant": float(found["profile"]["constant"]["nmi"]),
    }
