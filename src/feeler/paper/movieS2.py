"""Movie S2: a tensor grows."""

from typing import Any

from feeler.experiment.touch import touch
from feeler.paper.context import Context
from feeler.plotting.touch import write_touch_movie
from feeler.report.section import Section
from feeler.stimulus.ninety import SPEEDS
from feeler.stimulus.shapes import Ball
from feeler.stimulus.trial import Trial

LASTING = {"fast": 80.0, "medium": 120.0, "slow": 380.0}  # ms, what is worth watching at each speed


def show(context: Context, section: Section) -> None:
    """A ball at the middle, at each speed."""
    for speed in context.effort.movie_speeds:
        trial = Trial(feature=Ball(radius=1.53), location=0.5, speed=SPEEDS[speed])
        options: dict[str, Any] = {"timestep": context.timestep, "engine": context.engine}
        everything = touch(context.antenna, trial, duration=LASTING[speed], all_hinges=True, **options)
        path = section.folder / f"movieS2_{speed}.mp4"
        write_touch_movie(context.antenna, trial, everything, path, context.effort.frames["S2"])
        section.movie(
            path, f"A ball of 1.53 mm at the middle, {SPEEDS[speed]:g} m/s ({speed}), slowed down. (Movie S2)"
        )
