"""Fronts of designs, each point drawn as its antenna's stiffness profile."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.transforms import Affine2D
from numpy.typing import ArrayLike

WIDTH, HEIGHT = 15.0, 8.0  # points, of one curve and of a factor of ten


def plot_profile_points(
    ax: Axes, places: ArrayLike, profiles: Sequence[np.ndarray], *, color: str, label: str = ""
) -> None:
    """A small curve through each of ``places`` (point, 2): its antenna's profile from base to tip,
    on a logarithmic scale.
    """
    curves = []
    for profile in profiles:
        height = HEIGHT * np.log10(np.asarray(profile, dtype=float))
        curves.append(np.stack([np.linspace(-WIDTH / 2, WIDTH / 2, height.size), height], axis=1))
    lines = LineCollection(
        curves, offsets=places, offset_transform=ax.transData, color=color, lw=1.0
    )
    figure = ax.get_figure(root=True)
    assert figure is not None
    lines.set_transform(Affine2D().scale(1 / 72) + figure.dpi_scale_trans)
    ax.add_collection(lines)
    ax.plot(*np.asarray(places, dtype=float).T, "o", ms=2, color=color, label=label)
