"""Antennae drawn from base to tip, in the plane and in space, and movies."""

import base64
from collections.abc import Callable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Polygon
from PIL import Image

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, require_extra
from feeler.files import writing
from feeler.objects import Trial, place
from feeler.objects.meshes import list_solids
from feeler.objects.shapes import Feature, trace_rim
from feeler.plotting.style import ANTENNA_COLOURS, TENSOR_COLOURS, fix_layout, set_decades
from feeler.records import Ge, Gt, Le
from feeler.tensors.transforms import compute_bend, in_unit, measure_peak, reconstruct_posture
from feeler.validation import checked

# Movies that a browser plays: H.264 in mp4, drawn in the plane, without OpenGL or a screen.

_MOVIE_WIDTH = 1080
"""Pixels across every movie: small text is read, and eight movies stay below 2 MB."""
SLOWER = 30.0
"""Times slower than life, the same in every movie of a touch, so that fast and slow ones can be
compared by eye.
"""
FPS = 24
_MOST_SHOWN = 32 * 2**20  # bytes that are put into a notebook
_STILL = 66  # % of the movie
_DrawFrame = Callable[[int], Sequence[Artist] | None]


class Movie(type(Path())):  # type: ignore[misc]  # until Python 3.12, Path itself has no subclass
    """The path of a film, which a notebook plays."""

    def _repr_html_(self) -> str:
        if not self.is_file() or self.stat().st_size > _MOST_SHOWN:
            return f'<a href="{quote(self.as_posix())}">{escape(self.name)}</a>'
        data = base64.b64encode(self.read_bytes()).decode()
        return f'<video controls loop width="640" src="data:video/mp4;base64,{data}"></video>'


@checked
def choose_frames(
    time: Annotated[np.ndarray, "sample"],
    *,
    slower: Annotated[float, Gt(0)] = SLOWER,
    fps: Annotated[int, Ge(1), Le(1000)] = FPS,
) -> np.ndarray:
    """Samples (frame,) to show of ``time`` [ms] so that the movie is ``slower`` than life; the last
    one is among them.
    """
    time = np.asarray(time)
    if time.size < 1 or not np.isfinite(time).all():
        raise InvalidInput(f"time must be one or more finite numbers [ms], got {time.size}.")
    n_frames = max(2, round((time[-1] - time[0]) * slower * fps / 1000))
    return np.searchsorted(time, np.linspace(time[0], time[-1], n_frames) - 1e-9).clip(
        max=len(time) - 1
    )


@checked
def say_clock(time: float, slower: float = SLOWER) -> str:
    """The words that stand in every movie."""
    return f"{time:.0f} ms, {slower:g}× slower than life"


@checked
def write_movie(
    path: Path,
    figure: Figure,
    draw_frame: _DrawFrame,
    n_frames: int,
    fps: int = FPS,
    still: int | None = None,
) -> Path:
    """Write ``n_frames`` frames of ``figure``; ``draw_frame(k)`` changes its artists to frame k.

    Where ``draw_frame`` returns the artists it changed, only these are redrawn on the unchanging
    rest, which is many times faster. The file appears under its name only when it is whole; the
    frame ``still``, by default at two thirds of it, stands beside it as a picture, ``.jpg``, for
    paper and for those who want no moving pictures.

    Raises
    ------
    MissingDependencyError
        imageio-ffmpeg is not installed.
    """
    require_extra("imageio_ffmpeg", "movie", "a movie")
    import imageio_ffmpeg

    path = Path(path)
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(_MOVIE_WIDTH / figure.get_figwidth())
    fix_layout(figure)
    size = (np.asarray(canvas.get_width_height()) // 2) * 2  # H.264 needs even sides
    with writing(path) as part:
        writer = imageio_ffmpeg.write_frames(
            str(part),
            tuple(int(side) for side in size),
            fps=fps,
            codec="libx264",
            pix_fmt_in="rgba",
            pix_fmt_out="yuv420p",
            macro_block_size=2,
            output_params=[
                "-crf",
                "24",
                "-preset",
                "veryfast",
                "-movflags",
                "+faststart",
                "-threads",
                "1",
            ],
        )
        writer.send(None)
        try:
            background = None
            for k in range(n_frames):
                background = _draw_frames(figure, canvas, draw_frame(k), background)
                frame = np.ascontiguousarray(
                    np.asarray(canvas.buffer_rgba())[: size[1], : size[0]]
                )
                writer.send(frame)
                if k == (_STILL * n_frames // 100 if still is None else still):
                    Image.fromarray(frame).convert("RGB").save(
                        path.with_suffix(".jpg"), quality=80
                    )
        finally:
            writer.close()
    return Movie(path)


def _draw_frames(
    figure: Figure, canvas: FigureCanvasAgg, changed: Sequence[Artist] | None, background: Any
) -> Any:
    """Draw one frame; returns the picture of everything that does not change, if the changing
    artists are known.
    """
    if not changed:
        canvas.draw()
        return None
    if background is None:
        for artist in changed:
            artist.set_animated(True)
        canvas.draw()
        background = canvas.copy_from_bbox(figure.bbox)
    canvas.restore_region(background)
    for artist in changed:
        artist.set_animated(True)
        (artist.axes or figure).draw_artist(artist)
    return background


# Antennas and what touches them, drawn in the plane and in space, without OpenGL.

# Draw antennas and what touches them, in the plane.

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
    sensors as dots; ``colours`` is for a colour bar.
    """

    def __init__(
        self, antenna: Antenna, ax: Axes, norm: Normalize, colours: str = TENSOR_COLOURS
    ) -> None:
        self.antenna = antenna
        self._skin = LineCollection([], colors="#1b1f24", capstyle="round", zorder=3)
        self.colours = LineCollection([], norm=norm, cmap=colours, capstyle="round", zorder=4)
        for lines in (self._skin, self.colours):
            ax.add_collection(lines, autolim=False)
        (self._dots,) = ax.plot([], [], "o", ms=0.9, color="#ffffff", mew=0, zorder=5)

    def move(self, points: np.ndarray, values: np.ndarray) -> list[Artist]:
        """Artists changed to a posture (joint, 2) [mm]; ``values`` (segment,) colour its hinges."""
        parts = np.stack([points[:-1], points[1:]], axis=1)
        ax = self.colours.axes
        assert ax is not None
        per_mm = np.diff(ax.transData.transform([(0.0, 0.0), (1.0, 0.0)])[:, 0])[0]
        # the true diameter [points], but never too thin to see its colour
        width = np.maximum(2 * self.antenna.radius * per_mm * 72 / ax.figure.dpi, 2.4)
        for lines, wider in ((self._skin, 1.2), (self.colours, 0.0)):
            lines.set_segments(list(parts))
            lines.set_linewidth(list(width + wider))
        self.colours.set_array(values)
        self._dots.set_data(*points[self.antenna.sensors - 1].T)
        return [self._skin, self.colours, self._dots]


@checked
def make_patch(
    feature: Feature,
    origin: Annotated[np.ndarray, "axis"],
    forward: Annotated[np.ndarray, "axis"],
    reach: Annotated[float, Gt(0)] = 100.0,
) -> PathPatch:
    """A Matplotlib patch of a feature whose frame stands at ``origin`` [mm] and points along
    ``forward``.
    """
    turn = np.stack([forward, [-forward[1], forward[0]]])
    rims = [trace_rim(part, feature.rounding) for part in feature.parts]
    if feature.unbounded:
        rims = [np.array([[0, -reach], [0, reach], [-reach, reach], [-reach, -reach]])]
    paths = [Polygon(np.vstack([rim, rim[:1]]) @ turn + origin, closed=True) for rim in rims]
    return PathPatch(
        Polygon.make_compound_path(*paths),
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


# Draw antennas in space and what touches them, with Matplotlib alone and without OpenGL.

_FINENESS = 24  # points around a ball or a peg
_VIEW = (24.0, -60.0)  # degrees: height and turn of the eye


class SpaceScene:
    """Axes in space with an antenna, coloured by what its hinges feel, and an object; ``colours``
    is for a colour bar.
    """

    def __init__(self, antenna: Antenna, ax: Any, norm: Normalize) -> None:
        from mpl_toolkits.mplot3d.art3d import (  # type: ignore[import-untyped]
            Line3DCollection,  # slow to load, as ConvexHull is
        )

        self.antenna, self.ax = antenna, ax
        self._drawn: list[Any] = []
        self.colours = Line3DCollection([], norm=norm, cmap=TENSOR_COLOURS, capstyle="round")
        inches, reach = min(ax.bbox.width, ax.bbox.height) / ax.figure.dpi, antenna.length
        # the diameter of each segment [points], but never too thin to see its colour
        self.colours.set_linewidth(
            np.maximum(2 * antenna.radius * 0.6 * 72 * inches / reach, 2.0)
        )
        ax.add_collection3d(self.colours, autolim=False)
        ax.set(xlim=(-reach / 2, reach / 2), ylim=(0, reach), zlim=(-reach / 2, reach / 2))
        ax.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
        ax.set_box_aspect((1, 1, 1), zoom=0.82)  # else its labels lie on those beside it
        ax.view_init(*_VIEW)
        ax.locator_params(nbins=4)
        ax.tick_params(labelsize=6)

    def move(self, points: np.ndarray, values: np.ndarray) -> None:
        """The antenna in another posture (joint, 3) [mm]; ``values`` (segment,) colour it."""
        self.colours.set_segments(list(np.stack([points[:-1], points[1:]], axis=1)))
        self.colours.set_array(values)

    def place(self, feature: Feature, origin: np.ndarray, axes: np.ndarray) -> None:
        """A feature whose frame stands at ``origin`` [mm] with ``axes`` (3, 3)."""
        from scipy.spatial import ConvexHull

        for artist in self._drawn:
            artist.remove()
        self._drawn = []
        sheets = [_make_sheet(origin, axes, self.antenna.length)]
        if not feature.unbounded:
            sheets = []
        options = {"color": OBJECT_COLOUR, "alpha": 0.45, "linewidth": 0, "shade": True}
        for corners in list_solids(feature):
            own = np.asarray(origin) + corners @ axes
            if len(own) > 2:
                self._drawn.append(
                    self.ax.plot_trisurf(*own.T, triangles=ConvexHull(own).simplices, **options)
                )
            else:
                sheets.append(_make_surface(own[0], own[-1], feature.rounding))
        self._drawn += [self.ax.plot_surface(*sheet, **options) for sheet in sheets]


def add_space(figure: Figure, ax: Axes) -> Any:
    """Axes in space in the place of flat ones."""
    place = ax.get_subplotspec()
    ax.remove()
    return figure.add_subplot(place, projection="3d")


def _make_surface(a: np.ndarray, b: np.ndarray, radius: float) -> np.ndarray:
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


def _make_sheet(origin: np.ndarray, axes: np.ndarray, reach: float) -> np.ndarray:
    """x, y, z of a part of a wall."""
    corners = np.array([[[-1, -1], [-1, 1]], [[1, -1], [1, 1]]]) * reach / 3
    return np.moveaxis(np.asarray(origin) + corners @ axes[1:], -1, 0)


# What a turnable view of a touch in space draws: the antenna at every moment and the object's
# edges, as numbers for ``report/turn.js``.

_FRAMES = 100  # [C] moments at most
_LEVELS = 32  # [C] colours of a bend
_EVERY = 4  # [C] of the lines around a ball or a peg, one is drawn


@checked
def describe_turnable(antenna: Antenna, trial: Trial, tensors: xr.Dataset) -> dict[str, Any]:
    """The first touch of a Dataset with all hinges of an antenna in space, for
    :meth:`feeler.report.Section.turnable`.

    Returns
    -------
    dict
        ``time`` (frame,) [ms]; ``points`` (frame, joint, 3) [mm]; ``bend`` (frame, segment), which
        of the ``colours``, by the square root of the curvature; ``top`` [1/mm], the greatest
        curvature, which has the last one; ``lines`` of the object
        (line)(corner)(3) [mm] at time 0; ``shift`` (frame, 3) [mm] of them; ``reach`` [mm].

    Raises
    ------
    InvalidInput
        An antenna in the plane.
    """
    placed = place(antenna, trial)
    if placed.left is None:
        raise InvalidInput(
            f"{antenna.name!r} lies in a plane, which there is nothing to turn: take an antenna in"
            " space (docs/space.md), or write_touch_movie."
        )
    time = in_unit(tensors["time"], "ms").values
    frames = np.unique(
        np.linspace(0, len(time) - 1, min(_FRAMES, len(time))).round().astype(int)
    )
    bend = compute_bend(tensors, antenna)
    top = measure_peak(bend) or 1.0
    edges = _list_lines(trial.shape, np.asarray(placed.origin), placed.axes, antenna.length)
    return {
        "time": time[frames].round(2).tolist(),
        "points": reconstruct_posture(tensors, antenna).values[0][frames].round(3).tolist(),
        "bend": np.floor(np.sqrt(bend[frames] / top) * (_LEVELS - 1e-9)).astype(int).tolist(),
        "colours": [
            mpl.colors.to_hex(c)
            for c in mpl.colormaps[TENSOR_COLOURS](np.linspace(0, 1, _LEVELS))
        ],
        "top": top,
        "lines": [line.round(3).tolist() for line in edges],
        "object": OBJECT_COLOUR,
        "shift": (placed.velocity * time[frames, None]).round(3).tolist(),
        "reach": float(antenna.length),
    }


def _list_lines(
    feature: Feature, origin: np.ndarray, axes: np.ndarray, reach: float
) -> Iterator[np.ndarray]:
    """Edges (corner, 3) [mm] of a feature whose frame stands at ``origin`` with ``axes``."""
    from scipy.spatial import ConvexHull

    if feature.unbounded:
        sheet = np.moveaxis(_make_sheet(origin, axes, reach), 0, -1)
        yield sheet[[0, 0, 1, 1, 0], [0, 1, 1, 0, 0]]
        return
    for corners in list_solids(feature):
        own = origin + corners @ axes
        if len(own) > 2:
            for triangle in ConvexHull(own).simplices:
                yield own[[*triangle, triangle[0]]]
            continue
        skin = np.moveaxis(_make_surface(own[0], own[-1], feature.rounding), 0, -1)
        yield from skin[:, ::_EVERY]
        yield from np.swapaxes(skin, 0, 1)[:, ::_EVERY]
