"""Style and primitives: take an Axes, draw, compute nothing."""

from feeler.plotting.bases import plot_bases
from feeler.plotting.look import style
from feeler.plotting.movie import write_movie
from feeler.plotting.posture import make_patch, plot_posture, plot_profiles
from feeler.plotting.tensor import plot_tensor, plot_tensor_grid
from feeler.plotting.touch import plot_touch, write_touch_movie, write_touches_movie

__all__ = [
    "make_patch",
    "plot_bases",
    "plot_posture",
    "plot_profiles",
    "plot_tensor",
    "plot_tensor_grid",
    "plot_touch",
    "style",
    "write_movie",
    "write_touch_movie",
    "write_touches_movie",
]
