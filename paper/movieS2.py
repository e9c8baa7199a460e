"""Movie S2: a tensor grows, slow beside fast on one clock."""

from feeler import touch
from feeler.experiments.tactile import DURATION
from feeler.objects import Ball, Trial
from feeler.objects.trials import SPEEDS
from feeler.plotting import SLOWER, write_touches_movie
from feeler.report.page import Section
from paper.context import Context

_TOGETHER = "movieS2_speeds"


def show(context: Context, section: Section) -> None:
    """A ball at the middle, at all speeds together."""
    fps, touches = context.effort.fps, {}
    for speed in reversed(context.effort.speeds):
        trial = Trial(feature=Ball(radius=1.53), location=0.5, speed=SPEEDS[speed])
        touches[speed] = (
            trial,
            touch(
                context.antenna, trial, duration=DURATION, all_hinges=True, **context.physics
            ),
        )
    path = section.folder / f"{_TOGETHER}.mp4"
    titles = {f"{speed}\n{SPEEDS[speed]:g} m/s": found for speed, found in touches.items()}
    write_touches_movie(context.antenna, titles, path, fps=fps)
    section.movie(
        path,
        f"One ball of 1.53 mm touches the antenna at {len(touches)} speeds, {SLOWER:g} times slower"
        " than life. Below: the curvature that its sensors feel, the tensor. A slow touch fills it,"
        " a fast one is over in a few samples. (Movie S2)",
    )
