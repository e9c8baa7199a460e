"""Movies that a browser plays: H.264 in mp4, drawn in the plane, without OpenGL or a screen."""

import base64
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from feeler.errors import InvalidInput, require_extra
from feeler.files import writing
from feeler.plotting.style import fix_layout
from feeler.records import Ge, Gt, Le
from feeler.validation import checked

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
    path: Path, figure: Figure, draw_frame: _DrawFrame, n_frames: int, fps: int = FPS
) -> Path:
    """Write ``n_frames`` frames of ``figure``; ``draw_frame(k)`` changes its artists to frame k.

    Where ``draw_frame`` returns the artists it changed, only these are drawn anew on the unchanging
    rest, which is many times faster. The file appears under its name only when it is whole; a frame
    at two thirds of it stands beside it as a still, ``.jpg``, for paper and for those who want no
    moving pictures.

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
                background = _draw(figure, canvas, draw_frame(k), background)
                frame = np.ascontiguousarray(
                    np.asarray(canvas.buffer_rgba())[: size[1], : size[0]]
                )
                writer.send(frame)
                if k == _STILL * n_frames // 100:
                    Image.fromarray(frame).convert("RGB").save(
                        path.with_suffix(".jpg"), quality=80
                    )
        finally:
            writer.close()
    return Movie(path)


def _draw(
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
