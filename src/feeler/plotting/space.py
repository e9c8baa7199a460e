"""Draw antennas in space and what touches them, with Matplotlib alone and without OpenGL."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]
from scipy.spatial import ConvexHull

from feeler.antenna.antenna import Antenna
from feeler.plotting.look import TENSOR_COLOURS
from feeler.plotting.posture import OBJECT_COLOUR
from feeler.stimulus.feature import Feature
from feeler.stimulus.solid import list_solids

_FINENESS = 24  # points around a ball or a peg
_VIEW = (24.0, -60.0)  # degrees: height and turn of the eye


class SpaceScene:
    """Axes in space with an antenna, coloured by what its hinges feel, and an object."""

    def __init__(self, antenna: Antenna, ax: Any, norm: Normalize) -> None:
        self.antenna, self.ax = antenna, ax
        self._drawn: list[Any] = []
        self._line = Line3DCollection([], norm=norm, cmap=TENSOR_COLOURS, capstyle="round")
        self._line.set_linewidth(_measure_width(antenna, ax))
        ax.add_collection3d(self._line, autolim=False)
        reach = antenna.length
        ax.set(xlim=(-reach / 2, reach / 2), ylim=(0, reach), zlim=(-reach / 2, reach / 2))
        ax.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
        ax.set_box_aspect((1, 1, 1), zoom=0.82)  # else its labels lie on those beside it
        ax.view_init(*_VIEW)
        ax.locator_params(nbins=4)
        ax.tick_params(labelsize=6)

    @property
    def colours(self) -> ScalarMappable:
        """For a colour bar."""
        return self._line

    def move(self, points: np.ndarray, values: np.ndarray) -> None:
        """The antenna in another posture (joint, 3) [mm]; ``values`` (segment,) colour it."""
        self._line.set_segments(list(np.stack([points[:-1], points[1:]], axis=1)))
        self._line.set_array(values)

    def place(self, feature: Feature, origin: np.ndarray, axes: np.ndarray) -> None:
        """A feature whose frame stands at ``origin`` [mm] with ``axes`` (3, 3)."""
        for artist in self._drawn:
            artist.remove()
        self._drawn = []
        sheets = [make_sheet(origin, axes, self.antenna.length)]
        if not feature.unbounded:
            sheets = []
        options = {"color": OBJECT_COLOUR, "alpha": 0.45, "linewidth": 0, "shade": True}
        for corners in list_solids(feature):
            own = np.asarray(origin) + corners @ axes
            if len(own) > 2:
                triangles = ConvexHull(own).simplices
                self._drawn.append(self.ax.plot_trisurf(*own.T, triangles=triangles, **options))
            else:
                sheets.append(make_surface(own[0], own[-1], feature.rounding))
        self._drawn += [self.ax.plot_surface(*sheet, **options) for sheet in sheets]


def add_space(figure: Figure, ax: Axes) -> Any:
    """Axes in space in the place of flat ones."""
    place = ax.get_subplotspec()
    ax.remove()
    return figure.add_subplot(place, projection="3d")


def _measure_width(antenna: Antenna, ax: Any) -> np.ndarray:
    """The diameter of each segment [points], but never too thin to see its colour."""
    inches = min(ax.bbox.width, ax.bbox.height) / ax.figure.dpi
    return np.maximum(2 * antenna.radius * 0.6 * 72 * inches / antenna.length, 2.0)


def make_surface(a: np.ndarray, b: np.ndarray, radius: float) -> np.ndarray:
    """x, y, z of the surface about the line from ``a`` to ``b``, of a ball where they are one."""
    along = b - a if np.any(b != a) else np.array([0.0, 0.0, 1.0])
    along = along / np.linalg.norm(along)
    side = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    side /= np.linalg.norm(side)
    other = np.cross(along, side)
    turn, rise = np.linspace(0, 2 * np.pi, _FINENESS), np.linspace(0, np.pi, _FINENESS)
    ring = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
    ends = np.where(np.cos(rise)[:, None, None] > 0, b, a)
    skin = np.sin(rise)[:, None, None] * ring + np.cos(rise)[:, None, None] * along
    return np.moveaxis(ends + radius * skin, -1, 0)


def make_sheet(origin: np.ndarray, axes: np.ndarray, reach: float) -> np.ndarray:
    """x, y, z of a part of a wall."""
    corners = np.array([[[-1, -1], [-1, 1]], [[1, -1], [1, 1]]]) * reach / 3
    return np.moveaxis(np.asarray(origin) + corners @ axes[1:], -1, 0)
