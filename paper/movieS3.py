"""Movie S3: a wall comes nearer, each antenna's point of greatest curvature marked; and a body that
follows a wall by it.
"""

from itertools import islice

from feeler.errors import InvalidInput
from feeler.plotting.walls import (
    APPROACH_SLOWER,
    FOLLOW_SLOWER,
    SHOWN,
    write_drives_movie,
    write_run_movie,
)
from feeler.report.page import Section
from feeler.wall.following import follow
from paper.context import Context
from paper.fig3 import describe_posture, get_lead, load


def show(context: Context, section: Section) -> None:
    """The movies, and how well bodies follow."""
    path = write_drives_movie(
        load(context).drives, section.folder / "movieS3_wall.mp4", context.effort.fps
    )
    section.movie(
        path,
        f"A wall (grey) comes nearer to each antenna, {APPROACH_SLOWER:g} times slower than life;"
        f" colours: curvature beyond rest, on one scale, which {100 * (1 - SHOWN):.0f} % of bends"
        " exceed; red: the point of greatest bend while in contact. (Movie S3)",
    )
    if context.effort.followers != 0:
        _follow(context, section)


def _follow(context: Context, section: Section) -> None:
    rows: list[list[object]] = []
    section.heading("Following a wall by it")
    shown = False
    for name, antenna in islice(context.profiles.items(), context.effort.followers):
        try:
            run = follow(antenna, posture=get_lead())
        except InvalidInput:  # its peak stays at the base hinge: that is the result
            rows.append([name, *["no map to steer by"] * 4])
            continue
        rows.append(
            [name, run.error, run.estimate_error, run.nearest, "yes" if run.collided else "no"]
        )
        if not shown:
            shown = True
            path = section.folder / "movieS3_following.mp4"
            write_run_movie(run, path, context.effort.fps)
            section.movie(
                path,
                "A point body runs at 0.45 m/s along a wall with a turn and steers by where the"
                f" antenna '{name}' bends most, {FOLLOW_SLOWER:g} times slower than life; colours:"
                " curvature beyond rest. (Movie S3)",
            )
    section.table(
        ["profile", "tracking error [mm]", "estimate error [mm]", "nearest [mm]", "collided"],
        rows,
        "A point body at 0.45 m/s along a wall with turns, steering by the estimated distance, in"
        f" the leading set-up ({describe_posture(get_lead())}). With friction it sticks and slips,"
        " so that a rounding can lead to another run, such as that of another kind of processor.",
    )
