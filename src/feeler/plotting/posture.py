"""Draw antennas and what touches them, in the plane."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.transforms import Affine2D
from numpy.typing import ArrayLike

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.plotting.look import ANTENNA_COLOURS, TENSOR_COLOURS, set_decades
from feeler.records.checked import checked
from feeler.stimulus.convex import trace_rim
from feeler.stimulus.feature import Feature

OBJECT_COLOUR = "#8C9196"  # grey: no profile, no kind of object has it
_SPANS_DECADES = (
    30  # largest over smallest [C]: from here on a logarithmic axis has two decades to show
)


@checked
def plot_posture(points: Annotated[np.ndarray, "joint axis"], ax: Axes, **line: Any) -> None:
    """One posture: base, hinges and tip (joint, 2) [mm] as a line."""
    points = np.asarray(points)
    ax.plot(
        points[:, 0],
        points[:, 1],
        **({"color": ANTENNA_COLOURS[0], "solid_capstyle": "round"} | line),
    )


@checked
class MovingAntenna:
    """An antenna that moves: as thick as it is, each segment coloured by its hinge's value, its
    sensors as dots.
    """

    def __init__(
        self, antenna: Antenna, ax: Axes, norm: Normalize, colours: str = TENSOR_COLOURS
    ) -> None:
        self.antenna = antenna
        self._skin = LineCollection([], colors="#1b1f24", capstyle="round", zorder=3)
        self._line = LineCollection([], norm=norm, cmap=colours, capstyle="round", zorder=4)
        for lines in (self._skin, self._line):
            ax.add_collection(lines, autolim=False)
        (self._dots,) = ax.plot([], [], "o", ms=0.9, color="#ffffff", mew=0, zorder=5)

    @property
    def colours(self) -> LineCollection:
        """For a colour bar."""
        return self._line

    def move(self, points: np.ndarray, values: np.ndarray) -> list[Artist]:
        """Artists changed to a posture (joint, 2) [mm]; ``values`` (segment,) colour its hinges."""
        parts = np.stack([points[:-1], points[1:]], axis=1)
        width = self._measure_width()
        for lines, wider in ((self._skin, 1.2), (self._line, 0.0)):
            lines.set_segments(list(parts))
            lines.set_linewidth(list(width + wider))
        self._line.set_array(values)
        self._dots.set_data(*points[self.antenna.sensors - 1].T)
        return [self._skin, self._line, self._dots]

    def _measure_width(self) -> np.ndarray:
        """The true diameter of each segment [points], but never too thin to see its colour."""
        ax = self._line.axes
        assert ax is not None
        per_mm = np.diff(ax.transData.transform([(0.0, 0.0), (1.0, 0.0)])[:, 0])[0]
        return np.maximum(2 * self.antenna.radius * per_mm * 72 / ax.figure.dpi, 2.4)


@checked
def make_patch(
    feature: Feature,
    origin: Annotated[np.ndarray, "axis"],
    forward: Annotated[np.ndarray, "axis"],
    reach: Annotated[float, "> 0"] = 100.0,
) -> PathPatch:
    """A Matplotlib patch of a feature whose frame stands at ``origin`` [mm] and points along
    ``forward``.
    """
    turn = np.stack([forward, [-forward[1], forward[0]]])
    rims = [trace_rim(part, feature.rounding) for part in feature.parts]
    if feature.unbounded:
        rims = [np.array([[0, -reach], [0, reach], [-reach, reach], [-reach, -reach]])]
    paths = [Path(np.vstack([rim, rim[:1]]) @ turn + origin, closed=True) for rim in rims]
    return PathPatch(
        Path.make_compound_path(*paths),
        facecolor=OBJECT_COLOUR,
        edgecolor=OBJECT_COLOUR,
        lw=0.0,
        alpha=0.85,
    )


@checked
def plot_profiles(antenna: Antenna, axes: Sequence[Axes]) -> None:
    """Segment length, mass, hinge stiffness and damping along the antenna, into four Axes; in space
    of both planes of bending, that towards z dashed.
    """
    position = antenna.hinge_position / antenna.length
    quantities = (
        (antenna.segment_length, "segment length [mm]"),
        (1e6 * antenna.segment_mass, "segment mass [µg]"),
        (antenna.stiffness, "stiffness [N·mm/rad]"),
        (antenna.damping, "damping [N·mm·ms/rad]"),
    )
    if len(axes) != len(quantities):
        raise InvalidInput(f"four Axes are needed, got {len(axes)}.")
    for ax, (values, label) in zip(axes, quantities, strict=True):
        for ls, row in zip(("-", "--"), np.atleast_2d(values), strict=False):
            ax.plot(position, row, ls, color="black")
        ax.set(xlabel="position (base 0, tip 1)", ylabel=label)
        if values.max() > _SPANS_DECADES * values.min():
            set_decades(ax)


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
        curves.append(
            np.stack([np.linspace(-WIDTH / 2, WIDTH / 2, height.size), height], axis=1)
        )
    lines = LineCollection(
        curves, offsets=places, offset_transform=ax.transData, color=color, lw=1.0
    )
    figure = ax.get_figure(root=True)
    assert figure is not None
    lines.set_transform(Affine2D().scale(1 / 72) + figure.dpi_scale_trans)
    ax.add_collection(lines)
    ax.plot(*np.asarray(places, dtype=float).T, "o", ms=2, color=color, label=label)
