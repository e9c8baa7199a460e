"""Tactile tensors: what the antenna feels."""

import numpy as np

from feeler.experiment.touch import touch
from feeler.paper import fig2
from feeler.paper.context import Context
from feeler.paper.data import list_profiles, load_tensors, select_speed
from feeler.paper.trials import SPEEDS
from feeler.plotting.touch import FRAMES, write_touch_movie
from feeler.report.section import Section
from feeler.stimulus.shapes import Ball
from feeler.stimulus.trial import Trial
from feeler.tensors.export import save

MOVIE_MS = {"fast": 80.0, "medium": 120.0, "slow": 380.0}  # what is worth watching at each speed


def make(context: Context, section: Section) -> None:
    """Figs. 2D, 2E and S3, Movie S2, and how long each touch lasts."""
    names, first = list_profiles(context), next(iter(context.profiles))
    sets = {name: load_tensors(context, name) for name in names}
    section.figure(
        "fig2d_stimuli",
        "What touches, and where. (Fig. 2D)",
        lambda figure: fig2.plot_stimuli(context.antenna, figure),
    )
    slow = select_speed(sets[first], SPEEDS["slow"])
    section.numbers("fig2d_stimuli", feature=slow["feature"], size=slow["size"], location=slow["location"])
    _draw_sets(context, section, sets)
    _write_movies(context, section)
    _tabulate(section, sets)
    angle = sets[first]["angle"]
    section.values |= {
        "tensors.count": int(angle.sizes["trial"]),
        "tensors.sensors": int(angle.sizes["sensor"]),
        "tensors.samples": int(angle.sizes["time"]),
        "tensors.negative_energy_slow": _negative_share(select_speed(sets[first], SPEEDS["slow"])["angle"].values),
    }


def _draw_sets(context: Context, section: Section, sets: dict) -> None:
    for name, tensors in sets.items():
        figure_name = "fig2e" if name == next(iter(sets)) else "figS3"
        where = "Fig. 2E and Fig. S3" if figure_name == "fig2e" else "Fig. S3"
        section.figure(
            f"{figure_name}_{name}",
            f"Curvature over time at slow touch (0.06 m/s), profile '{name}'. Rows: locations from the middle to the tip; "
            f"columns: features. One colour scale within the picture. ({where})",
            lambda figure, tensors=tensors: fig2.plot_tensors(tensors, SPEEDS["slow"], figure),
            height=4.6,
        )
        slow = select_speed(tensors, SPEEDS["slow"])
        save(slow, section.folder / f"{figure_name}_{name}.nc")


def _write_movies(context: Context, section: Section) -> None:
    speeds = ("fast",) if context.scale == "smoke" else tuple(MOVIE_MS)
    for speed in speeds:
        trial = Trial(feature=Ball(radius=1.53), location=0.5, speed=SPEEDS[speed])
        options = {"timestep": context.timestep, "engine": context.engine}
        everything = touch(context.antenna, trial, duration=MOVIE_MS[speed], all_hinges=True, **options)
        frames = context.pick(smoke=12, quick=32, paper=FRAMES)
        path = write_touch_movie(context.antenna, trial, everything, section.folder / f"movieS2_{speed}.mp4", frames)
        section.movie(
            path, f"A ball of 1.53 mm at the middle, {SPEEDS[speed]:g} m/s ({speed}), slowed down. (Movie S2)"
        )


def _tabulate(section: Section, sets: dict) -> None:
    rows = []
    for name, tensors in sets.items():
        for speed in np.unique(tensors["speed"].values)[::-1]:
            chosen = select_speed(tensors, speed)
            peak = np.degrees(chosen["angle"].max(("sensor", "time")).values)
            lasting = (abs(chosen["force"]).sum("axis") > 0).isel(time=-1).values
            rows.append(
                [name, speed, peak.min(), peak.max(), chosen["curvature"].max().item(), int(lasting.sum()), peak.size]
            )
    section.table(
        [
            "profile",
            "speed [m/s]",
            "peak angle, least [°]",
            "largest [°]",
            "peak curvature [1/mm]",
            "in contact at the end",
            "trials",
        ],
        rows,
        "Peaks over sensors and time. A touch that is still in contact at the end is cut by the window.",
    )


def _negative_share(angle: np.ndarray) -> float:
    return float(np.sum(np.minimum(angle, 0) ** 2) / np.sum(angle**2))
