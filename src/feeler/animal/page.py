"""Pages of an animal: its fitted antenna, and what it predicts."""

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from feeler.antenna.files import save_antenna
from feeler.calibration import (
    Film,
    MeasurementFit,
    Measurements,
    Prediction,
    make_factors,
    predict_release,
)
from feeler.errors import FeelerError, require_extra
from feeler.files import ensure_folder, write_text
from feeler.plotting.results import (
    draw_forces,
    draw_measurements,
    draw_prediction,
    plot_maps,
    plot_trial,
)
from feeler.provenance import to_json
from feeler.report import Section, write_page
from feeler.tensors.formats import save as save_tensors

_INSTANTS = 5  # postures that an overlay draws


def _add_fit(section: Section, fit: MeasurementFit, animals: Sequence[Measurements]) -> None:
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
            "Force against deflection from rest: as measured (dots) and of the fitted antenna"
            " (lines).",
            lambda figure: draw_forces(curves, fit, figure),
        )


def save_fit(out: Path, fit: MeasurementFit, animals: Sequence[Measurements]) -> None:
    """calibration.html with its pictures, calibration.json, and antenna.toml of the mean
    parameters.
    """
    ensure_folder(out)
    section = Section(name="calibration", title="The fitted antenna", folder=out, vector=False)
    _add_fit(section, fit, animals)
    factors = make_factors(fit.start, fit.names)
    for own, animal in zip(fit.each, animals, strict=True):
        held = animal.deflection or fit.protocol.deflection
        protocol = fit.protocol.replace(deflection=held)
        for k, traces in enumerate(animal.releases):
            found = predict_release(traces, factors.build(own), protocol=protocol)
            section.figure(
                f"release_{animal.name}" + (f"_{k + 1}" if k else ""),
                f"The release of {animal.name}, from which this antenna was fitted.",
                partial(draw_prediction, found),
            )
    save_antenna(fit.antenna, out / "antenna.toml")
    lead = "; ".join(fit.describe())
    write_page(
        out / "calibration.html", f"Fitted mechanics of {fit.antenna.name}", lead, section
    )
    write_text(out / "calibration.json", json.dumps(to_json(fit.to_plain()), indent=1) + "\n")


def _draw_overlay(
    film: Film, found: Prediction, figure: Figure, frame: np.ndarray | None = None
) -> None:
    """Filmed points and the simulated antenna over each other, at some moments after the release;
    on the video's frame of the release where there is one.
    """
    ax = figure.subplots()
    along, across = film.axes
    length = float(np.linalg.norm(np.diff(found.posture[0], axis=0), axis=1).sum())
    # film's units per mm: in px such that the resting antenna is as long as the simulated one
    scale = 1.0 if film.unit == "mm" else film.reach / (length * film.place[-1])
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
        ax.plot(*shown.T, "-", color=colour, lw=1.5, label=f"{found.time[moment]:.0f} ms")
        points = film.origin + film.position[begin + moment]
        ax.plot(*points.T, "o", color=colour, ms=4, mec="white", mew=0.5)
    ax.set_aspect("equal")
    ax.set(xlabel=f"x in the film [{film.unit}]", ylabel=f"y [{film.unit}]")
    ax.legend(
        title="dots: filmed\nlines: simulated",
        fontsize=7,
        title_fontsize=7,
        frameon=True,
        facecolor="white",
        framealpha=0.9,
    )


def write_animal_page(study: Any, out: Path) -> list[str]:
    """animal.html, its pictures, animal.json, antenna.toml and antenna_in_space.toml; their names.

    The page opens with a film that was not used in the fit, and the simulated antenna over it.
    """
    ensure_folder(out)
    spread = f"; animals differ by {study.spread:.1%} (standard deviation)"
    if np.isnan(study.spread):
        spread = ""
    section = Section(name="animal", title=study.plan.name, folder=out, vector=False)
    names = ["animal.html", "animal.json"]
    for k, found in enumerate(study.predictions):
        film = study.held_out[found.name]
        name = "overlay" if k == 0 else f"overlay_{found.name}"
        section.figure(
            name,
            f"The release of {found.name}, which was not used in the fit: filmed points, and the"
            " fitted antenna at the same moments.",
            partial(_draw_overlay, film, found, frame=_try_frame(study, found.name, film)),
            height=4.5,
        )
        section.figure(
            f"prediction_{found.name}",
            f"Off by {found.error:.1%} of the held displacement, r.m.s. (the antenna before the fit"
            f" {found.error_before:.1%}){spread}.",
            partial(draw_prediction, found),
        )
    if study.fit is not None:
        section.heading("The fitted antenna")
        _add_fit(section, study.fit, study.animals)
    if not study.contacts.empty:
        section.heading("What it feels")
        section.figure(
            "touch",
            "Angle of every sensor while the object is touched.",
            lambda figure: plot_trial(study.touch, 0, "angle", figure.subplots()),
        )
        rows = study.contacts[["on_ms", "off_ms", "duration_ms", "place"]].to_numpy().tolist()
        section.table(["contact on [ms]", "off [ms]", "duration [ms]", "place (0 base)"], rows)
    if study.wall is not None:
        section.heading("How far a wall is")
        section.figure(
            "wall",
            "Distance of a wall beside the body against the place where the antenna bends most."
            f" This antenna {study.wall.bending}",
            lambda figure: plot_maps({study.antenna.name: study.wall}, figure.subplots()),
        )
    section.heading("All results")
    for words in study.describe():
        section.text(words)
    write_page(
        out / "animal.html",
        study.plan.name,
        study.answer,
        section,
    )
    numbers = {
        "fit": None if study.fit is None else study.fit.to_plain(),
        "predictions": {
            one.name: {"error": one.error, "error_before": one.error_before}
            for one in study.predictions
        },
        "spread": study.spread,
        "contacts": study.contacts.to_dict("records"),
        "tip_error": study.tip_error,
        "spikes": study.spikes,
        "wall": study.wall and {"r2": study.wall.r2, "error_mm": study.wall.error},
        "missing": study.missing,
        "problems": study.problems,
        "plan": study.plan.to_plain(),
        "units": {"spread": "1", "error": "1", "tip_error": "mm", "contacts": "ms"},
    }
    write_text(out / "animal.json", json.dumps(to_json(numbers), indent=1) + "\n")
    if study.antenna is not None:
        save_antenna(study.antenna, out / "antenna.toml")
        save_antenna(study.spatial, out / "antenna_in_space.toml")
        names += ["antenna.toml", "antenna_in_space.toml"]
    if study.touch is not None:
        save_tensors(study.touch, out / "touch.nc")
        names.append("touch.nc")
    return names


def _read_frame(study: Any, name: str, film: Film) -> np.ndarray | None:
    """The video's frame of the release as grey levels, where the plan names a video."""
    films = study.plan.releases
    file = films.video.get(name) if films is not None else None
    if file is None:
        return None
    require_extra("imageio_ffmpeg", "movie", "reading a video")
    import imageio_ffmpeg

    frames = imageio_ffmpeg.read_frames(str(study.plan.find(file)))
    width, height = next(frames)["size"]
    held = len(film.position) - film.make_traces().time.size + film.first
    last = None
    for k, raw in enumerate(frames):
        last = raw
        if k >= held:
            break
    frames.close()
    if last is None:
        return None
    return np.frombuffer(last, np.uint8).reshape(height, width, 3).mean(axis=2)


def _try_frame(study: Any, name: str, film: Film) -> np.ndarray | None:
    """The video's frame; a video that cannot be read is noted, and the page is written without."""
    try:
        return _read_frame(study, name, film)
    except (FeelerError, OSError, ValueError) as error:
        study.problems[f"video of {name}"] = str(error).split("\n", maxsplit=1)[0][:200]
        return None
