"""Pages of an animal: its fitted antenna, and what it predicts."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler.antenna.files import save_antenna
from feeler.calibration import Film, MeasurementFit, Measurements, Prediction
from feeler.files import ensure_folder, write_text
from feeler.plotting.results import draw_forces, draw_measurements
from feeler.report import Section, write_page
from feeler.report.page import to_json

_INSTANTS = 5  # postures that an overlay draws


def add_fit(section: Section, fit: MeasurementFit, animals: Sequence[Measurements]) -> None:
    """The fitted parameters with intervals, and force curves, in a page's section."""
    section.figure(
        "parameters",
        "Factors on the antenna that the fit began with, with 95 % intervals"
        f" ({fit.interval}), and its hinges.",
        lambda figure: draw_measurements(fit, figure),
    )
    rows = zip(fit.names, fit.p, fit.low, fit.high, fit.determined, strict=True)
    section.table(
        ["parameter", "value", "from", "to", "determined by these data"],
        [
            [name, p, low, high, "yes" if known else "hardly"]
            for name, p, low, high, known in rows
        ],
    )
    for name, why in fit.held.items():
        section.text(f"{name.replace('_', ' ')} is as given: {why}.")
    if len(fit.names) > 1:
        section.text(fit.directions.describe("measurements"))
    section.table(
        ["measurement", "left by the fit, as a share of its largest value"],
        [[name, left] for name, left in fit.residual.items()],
    )
    if curves := list({id(one): one for animal in animals for one in animal.forces}.values()):
        section.figure(
            "forces",
            "Force against deflection: as measured (dots) and of the fitted antenna (lines).",
            lambda figure: draw_forces(curves, fit.antenna, figure),
        )


def save_fit(out: Path, fit: MeasurementFit, animals: Sequence[Measurements]) -> None:
    """calibration.html with its pictures, calibration.json, and antenna.toml of the mean
    parameters.
    """
    ensure_folder(out)
    section = Section(name="calibration", title="The fitted antenna", folder=out, vector=False)
    add_fit(section, fit, animals)
    save_antenna(fit.antenna, out / "antenna.toml")
    write_page(out / "calibration.html", "Mechanics that fit", fit.antenna.name, section)
    write_text(out / "calibration.json", json.dumps(to_json(fit.to_plain()), indent=1) + "\n")


def draw_overlay(
    film: Film, found: Prediction, figure: Figure, frame: np.ndarray | None = None
) -> None:
    """Filmed points and the simulated antenna over each other, at some moments after the release;
    on the video's frame of the release where there is one.
    """
    ax = figure.subplots()
    along, across = film.axes
    scale = _find_scale(film, found)
    origin = film.origin + (film.rest[0] if film.place[0] == 0 else 0.0)
    begin = len(film.position) - found.time.size
    first = int(np.argmin(found.simulated[-1])) or found.time.size // 4
    moments = np.unique(
        np.linspace(0, min(2 * first, found.time.size - 1), _INSTANTS).astype(int)
    )
    if frame is not None:
        ax.imshow(frame, cmap="gray", extent=(0, frame.shape[1], -frame.shape[0], 0))
    for k, moment in enumerate(moments):
        colour = f"C{k}"
        x, y = (found.posture[moment] * scale).T
        shown = origin + x[:, None] * across + y[:, None] * along
        label = f"{found.time[moment]:.0f} ms"
        ax.plot(*shown.T, "-", color=colour, lw=1.5, label=label)
        points = film.origin + film.position[begin + moment]
        ax.plot(*points.T, "o", color=colour, ms=4, mec="white", mew=0.5)
    ax.set_aspect("equal")
    ax.set(xlabel=f"x in the film [{film.unit}]", ylabel=f"y [{film.unit}]")
    ax.legend(title="dots: filmed\nlines: simulated", fontsize=7, title_fontsize=7)


def _find_scale(film: Film, found: Prediction) -> float:
    """Film's units per mm: 1 if the film is in mm, else such that the resting antenna is as long
    as the simulated one.
    """
    if film.unit == "mm":
        return 1.0
    reach = np.linalg.norm(film.rest[-1] - (film.rest[0] if film.place[0] == 0 else 0.0))
    length = float(np.linalg.norm(np.diff(found.posture[0], axis=0), axis=1).sum())
    return float(reach / (length * film.place[-1]))
