"""The mark, the preview picture of links, badges and a page to hand out, from a simulated touch and
from README's own words.

python -m docs.make_face [docs/images]
"""

import re
import sys
import textwrap
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Circle

import feeler

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
MOMENT, RADIUS = 140, 3.0  # ms of a slow touch by a ball of this radius [mm]
AMBER, GREEN, INK, PAPER, SOFT = "#a8540f", "#16866a", "#1b1f24", "#fbfaf8", "#59636e"
PAPER_CITED = (
    "Meng, McDonnell, Jayaram & Mongeau 2025, Physically intelligent soft antennae enhance tactile"
    " perception by active touch, doi:10.1101/2025.10.20.683587"
)


def touch():
    """Points of the antenna (point, 2) and the middle of the ball, base at the bottom [mm]."""
    antenna = feeler.presets.cockroach()
    trial = feeler.Trial(feature=feeler.Ball(radius=RADIUS), location=0.7, speed=0.06)
    simulation = feeler.Simulation(antenna, [trial])
    simulation.step(float(MOMENT))
    ball = simulation.objects[0]
    return antenna.shape(simulation.angle), np.subtract(
        ball.place, RADIUS * np.array(ball.forward)
    )


def draw(ax, points, ball, thick):
    """The antenna, thinner towards its tip, and the ball."""
    ax.add_patch(Circle(ball, RADIUS, color=GREEN, lw=0))
    for k, (a, b) in enumerate(pairwise(points)):
        width = thick * (1 - 0.6 * k / len(points))
        ax.plot(*np.transpose([a, b]), color=AMBER, lw=width, solid_capstyle="round")
    ax.set(aspect="equal", xlim=(-9, 21), ylim=(-3, 45))
    ax.axis("off")


def write_mark(path, points, ball):
    """The mark as SVG, 48 × 48."""
    x, y = np.transpose(points[:: len(points) // 20])
    line = " L".join(f"{12 + a:.1f} {45 - b:.1f}" for a, b in zip(x, y, strict=True))
    dot = (
        f'<circle cx="{12 + ball[0]:.1f}" cy="{45 - ball[1]:.1f}" r="{RADIUS}" fill="{GREEN}"/>'
    )
    stroke = f'fill="none" stroke="{AMBER}" stroke-width="2.6" stroke-linecap="round"'
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 48 48" role="img">'
    title = "<title>feeler: an antenna bent by a ball</title>"
    path.write_text(f'{head}{title}<path d="M{line}" {stroke}/>{dot}</svg>\n', encoding="utf-8")


def write_preview(path, points, ball, claim):
    """The picture that a link to the repository shows, 1280 × 640."""
    figure = Figure(figsize=(12.8, 6.4), dpi=100, facecolor=PAPER)
    FigureCanvasAgg(figure)
    draw(figure.add_axes((0.0, 0.04, 0.4, 0.92)), points, ball, 14)
    figure.text(0.38, 0.66, "feeler", fontsize=72, weight="bold", color=INK)
    figure.text(0.38, 0.36, textwrap.fill(claim, 38), fontsize=26, color=INK, linespacing=1.4)
    figure.text(0.38, 0.13, "Python · MIT · computed, not drawn", fontsize=18, color=SOFT)
    figure.savefig(path, facecolor=PAPER)


def write_handout(path, points, ball, claim):
    """One page A4 to hand out: what it is, what was found, how to begin."""
    figure = Figure(figsize=(8.27, 11.69), facecolor="white")
    FigureCanvasPdf(figure)
    draw(figure.add_axes((0.04, 0.80, 0.2, 0.17)), points, ball, 5)
    figure.text(0.25, 0.925, "feeler", fontsize=34, weight="bold", color=INK)
    figure.text(0.25, 0.855, textwrap.fill(claim, 62), fontsize=13, color=INK, linespacing=1.4)
    found = re.search(r"<!-- result[^>]*-->\s*(.+?)\s*<!--", README, re.DOTALL)[1]
    figure.text(0.07, 0.775, "What we found", fontsize=15, weight="bold", color=AMBER)
    words = textwrap.fill(found, 96)
    figure.text(0.07, 0.765, words, fontsize=10.5, va="top", color=INK, linespacing=1.45)
    picture = imread(ROOT / "paper" / "kept" / "front" / "front.webp")
    ax = figure.add_axes((0.06, 0.36, 0.88, 0.28))
    ax.imshow(picture)
    ax.axis("off")
    caption = re.search(r"front\.webp\)\s+\*(.+?)\*\n", README, re.DOTALL)[1]
    short = textwrap.fill(" ".join(caption.split()), 118)
    figure.text(0.07, 0.35, short, fontsize=8.5, va="top", color=SOFT, linespacing=1.4)
    figure.text(0.07, 0.245, "To begin", fontsize=15, weight="bold", color=AMBER)
    begin = (
        "pip install .        # in a clone of the repository\n"
        "feeler studio        # an antenna in your browser, to touch by hand\n"
        "feeler touch         # one touch: page, tensor, picture, movie\n"
        "feeler animal --new animal.toml    # from your films to a tested model"
    )
    figure.text(0.07, 0.235, begin, fontsize=10, va="top", family="monospace", linespacing=1.5)
    cited = textwrap.fill(f"Reproduces {PAPER_CITED}. MIT licence.", 110)
    figure.text(0.07, 0.06, cited, fontsize=9, color=SOFT, linespacing=1.4)
    figure.savefig(path, metadata={"CreationDate": None, "Title": "feeler"})


def write_badge(path, label, value):
    """A badge as SVG; its words are those of pyproject.toml."""
    left, right = 7 * len(label) + 14, 7 * len(value) + 14
    text = 'y="14" fill="#fff" font-family="Verdana, sans-serif" font-size="11"'
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="20" role="img">'
        f"<title>{label}: {value}</title>"
        f'<rect width="{left}" height="20" rx="3" fill="#444"/>'
        f'<rect x="{left - 3}" width="{right + 3}" height="20" rx="3" fill="{AMBER}"/>'
        f'<text x="7" {text}>{label}</text><text x="{left + 7}" {text}>{value}</text></svg>\n',
        encoding="utf-8",
    )


def main(folder):
    """Write them all."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    claim = README.split("\n\n")[1]
    points, ball = touch()
    write_mark(folder / "mark.svg", points, ball)
    write_preview(folder / "preview.png", points, ball, claim)
    write_handout(folder / "handout.pdf", points, ball, claim)
    needs = project["requires-python"].replace(">=", "≥ ").partition(",")[0]
    write_badge(folder / "badge-python.svg", "Python", needs)
    write_badge(folder / "badge-licence.svg", "licence", str(project["license"]))
    write_badge(folder / "badge-version.svg", "version", str(feeler.__version__))


if __name__ == "__main__":
    main(Path(sys.argv[1] if sys.argv[1:] else ROOT / "docs" / "images"))
