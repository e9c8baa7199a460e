"""Style and primitives: take an Axes, draw, compute nothing."""

from typing import TYPE_CHECKING, Any

from feeler.plotting.antennas import (
    FPS,
    OBJECT_COLOUR,
    SLOWER,
    MovingAntenna,
    choose_frames,
    make_patch,
    plot_posture,
    plot_profiles,
    say_clock,
    write_movie,
)
from feeler.plotting.style import PALETTE, PROFILE_COLOURS, mark_places, set_decades, style
from feeler.plotting.tensors import (
    plot_tensor,
    plot_tensor_grid,
    plot_touch,
    write_touch_movie,
    write_touches_movie,
)

if TYPE_CHECKING:
    from feeler.plotting.results import plot_bases, plot_raster

__all__ = [
    "FPS",
    "OBJECT_COLOUR",
    "PALETTE",
    "PROFILE_COLOURS",
    "SLOWER",
    "MovingAntenna",
    "choose_frames",
    "make_patch",
    "mark_places",
    "plot_bases",
    "plot_posture",
    "plot_profiles",
    "plot_raster",
    "plot_tensor",
    "plot_tensor_grid",
    "plot_touch",
    "say_clock",
    "set_decades",
    "style",
    "write_movie",
    "write_touch_movie",
    "write_touches_movie",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from feeler.plotting import results  # loads what is analysed and decoded

    return getattr(results, name)


__dir__ = __all__.copy
