"""What a page shows, as a picture and as a movie: its quantity, all of its objects, and a run by
hand too.
"""

import io
from typing import Any, NamedTuple

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.disk.files import temporary_folder
from feeler.stimulus.feature import Feature
from feeler.stimulus.trial import Trial
from feeler.studio.touching import SAMPLE_INTERVAL
from feeler.studio.wish import TouchWish

_LABELS = {"angle": "hinge angle [°]", "curvature": "curvature [1/mm]"}
_FPS = 30
_MARGIN = 2.0  # mm around whatever moves


class PageView(NamedTuple):
    """A touch, or a run by hand, from its first to its last sample."""

    antenna: Antenna
    features: list[Feature]
    readings: dict[str, np.ndarray]  # as feeler.studio.touching.Readings has them
    values: np.ndarray  # (segment, sample)
    label: str
    title: str

    @property
    def tensor(self) -> np.ndarray:
        """What the sensors say (sensor, sample)."""
        return self.values[self.antenna.sensors - 1]

    @property
    def side(self) -> float:
        """−1 where the sensors bend most the other way than in a touch from the left, else 1."""
        return -1.0 if -self.tensor.min() > self.tensor.max() else 1.0

    @property
    def time(self) -> np.ndarray:
        """ms."""
        return SAMPLE_INTERVAL * np.arange(self.values.shape[1])


def read_shown(
    wish: TouchWish, readings: dict[str, np.ndarray], quantity: str, *, by_hand: bool
) -> PageView:
    """What the page shows of these readings."""
    antenna, objects = wish.antenna.make(), wish.make_objects()
    angle = readings["angle"].T
    curved = quantity == "curvature"
    values = angle / antenna.segment_length[:, None] if curved else np.rad2deg(angle)
    what = f"{wish.kind} moved by hand" if by_hand else wish.make_trial().label
    more = f", and {len(objects) - 1} more" if len(objects) > 1 else ""
    return PageView(
        antenna=antenna,
        features=[item.shape if isinstance(item, Trial) else item.feature for item in objects],
        readings=readings,
        values=values,
        label=_LABELS["curvature" if curved else "angle"],
        title=f"{antenna.name}: {what}{more}",
    )


def draw(shown: PageView, kind: str) -> bytes:
    """The tensor as a picture, ``svg`` or ``png``."""
    from matplotlib.figure import Figure

    from feeler.plotting.look import style

    with style():
        figure = Figure(figsize=(4.5, 3.2), layout="constrained")
        _draw_tensor(shown, figure, figure.subplots())
        figure.axes[0].set_title(shown.title, fontsize=8)
        out = io.BytesIO()
        figure.savefig(out, format=kind)
    return out.getvalue()


def _draw_tensor(shown: PageView, figure: Any, ax: Any) -> Any:
    from matplotlib.colors import Normalize

    from feeler.plotting import plot_tensor

    facing = shown.side * shown.tensor
    norm = Normalize(0.0, max(float(facing.max()), 1e-9))
    image = plot_tensor(facing, shown.time, ax, norm)
    label = f"{shown.label} (negative drawn as 0)"
    if shown.side < 0:
        label = f"−{shown.label}, as of a touch from the left (negative drawn as 0)"
    figure.colorbar(image, ax=ax, label=label)
    return image


def film(shown: PageView) -> bytes:
    """The antenna as from above, base left, beside its tensor, which grows; slowed down."""
    from matplotlib.figure import Figure
    from matplotlib.transforms import Affine2D

    from feeler.plotting.look import style
    from feeler.plotting.movie import choose_frames, say_clock, write_movie
    from feeler.plotting.posture import MovingAntenna, make_patch

    base, place = shown.readings["base"], shown.readings["place"]
    points = shown.antenna.shape(shown.readings["angle"], base[:, 2:]) + base[:, None, :2]
    frames = choose_frames(shown.time, fps=_FPS)
    with style():
        figure = Figure(figsize=(10.0, 4.0), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1))
        image = _draw_tensor(shown, figure, right)
        clock = right.set_title(say_clock(0.0))
        left.set_title(shown.title, fontsize=8)
        _set_limits(left, points)
        turned = Affine2D().rotate_deg(-90) + left.transData
        antenna = MovingAntenna(shown.antenna, left, image.norm)
        patches: list[Any] = []

        def move(frame: int) -> list[Any]:
            now = frames[frame]
            while patches:
                patches.pop().remove()
            for feature, (x, y, turn) in zip(shown.features, place[now], strict=True):
                forward = np.array([np.sin(turn), np.cos(turn)])
                patch = make_patch(feature, np.array([x, y]), forward)
                patch.set_transform(turned)
                patches.append(left.add_patch(patch))
            image.set_data(
                np.where(shown.time <= shown.time[now], shown.side * shown.tensor, np.nan)
            )
            clock.set_text(say_clock(shown.time[now]))
            seen = points[now, :, ::-1] * (1, -1)
            return [
                image,
                clock,
                *patches,
                *antenna.move(seen, shown.side * shown.values[:, now]),
            ]

        with temporary_folder() as folder:
            return write_movie(
                folder / "touch.mp4", figure, move, len(frames), _FPS
            ).read_bytes()


def _set_limits(ax: Any, points: np.ndarray) -> None:
    """All that the antenna reaches, base left, and the room of the objects before they touch it."""
    along, across = points[..., 1], -points[..., 0]
    reach = 0.25 * (along.max() - along.min())
    ax.set(
        xlim=(along.min() - _MARGIN, along.max() + _MARGIN),
        ylim=(across.min() - reach, across.max() + reach),
        aspect="equal",
        xlabel="along [mm]",
        ylabel="across [mm]",
    )
