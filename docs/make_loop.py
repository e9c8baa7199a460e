"""The loop at the top of the README and of the docs: one antenna meets one post at three speeds, on
one clock, and three tensors paint themselves. The last second says how often each touch is named.

python docs/make_loop.py [docs/images/loop.webp]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from PIL import Image

import feeler
from feeler.analysis import compute_information

WIDTH, HEIGHT, RATE, SECONDS, LAST = 1080, 600, 30, 10, 1.0
DURATION = 380.0  # ms, the paper's window
NOISE = 0.03  # rad on every sample of every sensor, the level that the trade-off's figures show
SPEEDS = {"slow": 0.06, "medium": 0.3, "fast": 0.6}
RADIUS, LOCATION = 1.53, 0.6  # mm, share of the length
DARK, INK, SOFT, AMBER = "#0d0c12", "#f2ece2", "#a49c92", "#ffab5e"


def touch(antenna, speed):
    """Points (sample, point, 2) and angles (sample, segment) of a touch, the post, and the tensor
    (sensor, time).
    """
    trial = feeler.Trial(feature=feeler.Ball(radius=RADIUS), location=LOCATION, speed=speed)
    felt = feeler.touch(antenna, trial, duration=DURATION, all_hinges=True)["angle"].values[0].T
    start = feeler.objects.place(antenna, trial)
    ms = np.arange(len(felt))[:, None]
    post = start.origin - RADIUS * start.forward + ms * start.velocity
    return antenna.shape(felt), felt, post, felt[:, antenna.sensors - 1].T


def find_share(antenna, speed):
    """How often an ideal observer names one of the paper's thirty touches in the noise."""
    tensors = feeler.touch(antenna, feeler.presets.paper_trials([speed]), duration=DURATION)[
        "angle"
    ].values
    return compute_information(tensors, NOISE, n_draws=200).accuracy


class Column:
    """One speed: the scene above, its tensor below, and words."""

    def __init__(self, figure, number, name, antenna, peak):
        speed = SPEEDS[name]
        self.points, self.angle, self.post, self.tensor = touch(antenna, speed)
        self.share, self.peak = find_share(antenna, speed), peak
        left = 0.02 + number * 0.328
        figure.text(left, 0.865, name, color=INK, size=19, weight="bold", va="bottom")
        figure.text(
            left + 0.3, 0.868, f"{speed:g} m/s", color=SOFT, size=14, ha="right", va="bottom"
        )
        ax = figure.add_axes((left, 0.36, 0.3, 0.49), facecolor=DARK)
        reach = antenna.length
        ax.set(
            xlim=(-0.04 * reach, 1.06 * reach),
            ylim=(0.72 * reach, -0.2 * reach),
            aspect="equal",
        )
        ax.axis("off")
        below = figure.add_axes((left, 0.13, 0.3, 0.21), facecolor="#000004")
        below.set(xticks=[], yticks=[])
        below.spines[:].set_color("#3a3640")
        self.body = LineCollection(
            [], cmap="magma", clim=(-0.45 * peak, peak), capstyle="round"
        )
        self.body.set_linewidth(np.linspace(7, 2.4, antenna.n_segments))
        self.round = Circle((0, 0), RADIUS, facecolor="#8fa1b0", edgecolor=INK, linewidth=1.2)
        ax.add_collection(self.body)
        ax.add_patch(self.round)
        ax.add_patch(Circle((0, 0), 1.1, color=SOFT))
        extent = (0, DURATION, 0, 1)
        norm = PowerNorm(0.5, 0, peak)  # by the square root small bends are seen, too
        style = {"cmap": "magma", "norm": norm, "aspect": "auto", "origin": "lower"}
        self.picture = below.imshow(np.zeros_like(self.tensor), extent=extent, **style)
        self.now = below.axvline(0, color=AMBER, linewidth=1.6)
        middle = left + 0.15
        self.verdict = figure.text(
            middle, 0.41, "", color=INK, size=30, weight="bold", ha="center", va="center"
        )

    def draw(self, time, ended):
        """Show the moment [ms]; ``ended``: with the verdict."""
        k = min(time, len(self.points) - 1.001)
        low, share = int(k), k - int(k)
        at = [
            (1 - share) * x[low] + share * x[low + 1]
            for x in (self.points, self.angle, self.post)
        ]
        points = at[0][:, ::-1]  # along the antenna to the right
        self.body.set_segments(np.stack([points[:-1], points[1:]], axis=1))
        self.body.set_array(np.abs(at[1]))
        self.round.center = tuple(at[2][::-1])
        shown = np.where(
            np.arange(self.tensor.shape[1]) <= low, np.clip(self.tensor, 0, None), 0
        )
        self.picture.set_data(shown)
        self.now.set_xdata([time, time])
        self.now.set_visible(not ended)
        self.verdict.set_text(f"{100 * self.share:.0f} of 100" if ended else "")


def draw_frames():
    """Pictures (height, width, 3), one after the other."""
    antenna = feeler.presets.cockroach()
    peak = 0.8 * touch(antenna, SPEEDS["slow"])[3].max()
    figure = Figure(figsize=(WIDTH / 100, HEIGHT / 100), dpi=100, facecolor=DARK)
    canvas = FigureCanvasAgg(figure)
    figure.text(
        0.02, 0.945, "One post, three speeds", color=AMBER, size=21, weight="bold", va="center"
    )
    clock = figure.text(0.976, 0.945, "", color=SOFT, size=15, ha="right", va="center")
    words = figure.text(0.5, 0.065, "", color=SOFT, size=14.5, ha="center", va="center")
    columns = [Column(figure, k, name, antenna, peak) for k, name in enumerate(SPEEDS)]
    moving = int(RATE * (SECONDS - LAST))
    slower = 1000 * moving / RATE / DURATION
    for frame in range(RATE * SECONDS):
        ended = frame >= moving
        time = min(frame / moving, 1.0) * (DURATION - 1)
        clock.set_text(f"{time:.0f} ms, {slower:.0f} × slower than life")
        words.set_text(
            f"how many of 100 touches are classified correctly (thirty kinds, noise of"
            f" {NOISE:g} rad)"
            if ended
            else "what each sensor feels, base (below) to tip, over time; colours by square root"
        )
        for column in columns:
            column.draw(time, ended)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def main(path):
    """Write the loop as WebP."""
    frames = [Image.fromarray(frame) for frame in draw_frames()]
    options = {"duration": round(1000 / RATE), "loop": 0, "quality": 75, "method": 3}
    frames[0].save(path, save_all=True, append_images=frames[1:], **options)
    print(f"{path}: {path.stat().st_size / 1e6:.2f} MB, {len(frames)} frames")


if __name__ == "__main__":
    main(Path(sys.argv[1] if sys.argv[1:] else "docs/images/loop.webp"))
