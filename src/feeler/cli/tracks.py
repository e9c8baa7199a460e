"""``feeler tracks``: how fast an animal moves its antennae, and how they bend, from tracked
landmarks.

Examples:

  feeler tracks trial1_xypts.csv trial2_xypts.csv --frame-rate 30

  feeler tracks walkDLC_resnet50_shuffle1.h5 --frame-rate 200 --bases left_base,right_base \
--out out/tracks

  feeler tracks walk.csv --cutoff paper --length 42                 6 Hz, and the tip's speed

  feeler tracks film.csv --frame-rate 500 --tips whisker_tip        one antenna or whisker

  feeler tracks walk.analysis.h5 --frame-rate 100 --individual track_0 --points base,p1,p2,p3,tip \
--scale 8

  feeler tracks walk0.csv walk1.csv --frame-rate 200 --out out/walks --session-start \
2026-05-01T09:00:00+02:00 --subject c1

  feeler tracks out/walks/tracks.nwb --individual trial_000001

  feeler tracks walk.csv --frame-rate 60 --origin bottom-left --landmarks \
left_tip,right_tip,head,abdomen
"""

import csv
import json
import warnings
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.options import Json, list_options, say_in_shell, say_json
from feeler.files import write_text, writing

_SIDES = ("left", "right")
_HEADER = (
    "trial",
    *(f"{side} [°/s] (peaks)" for side in _SIDES),
    "frames bridged (left, right)",
    "frames missing (left, right)",
)
_COLUMNS = (
    "trial",
    "side",
    "time_ms",
    "angle_deg",
    "speed_deg_per_s",
    "frame",
    "bridged",
    "frame_rate",
    "cutoff_hz",
    "cutoff_choice",
)
_CONSTANT = (
    "tip",
    "base",
    "head",
    "abdomen",
    "min_likelihood",
    "max_gap",
    "outliers",
    "feeler",
)


@dataclass(frozen=True, kw_only=True)
class _TrackOptions:
    """What ``feeler tracks`` is told."""

    files: Annotated[
        list[Path],
        typer.Argument(
            help=(
                "DeepLabCut CSV or H5, SLEAP analysis H5, Anipose CSV, movement netCDF, DLTdv, or"
                " NAME_x, NAME_y"
            )
        ),
    ]
    frame_rate: Annotated[
        float | None,
        typer.Option(
            help="frames per second, unless the file holds it or times (time_s, time_ms)"
        ),
    ] = None
    origin: Annotated[
        str, typer.Option(help="top-left (most trackers) or bottom-left (older DLTdv)")
    ] = "top-left"
    landmarks: Annotated[
        str, typer.Option(help="names of DLTdv's points in order, separated by commas")
    ] = ""
    tips: Annotated[
        str,
        typer.Option(
            help=(
                "landmarks of the left and right tip, default left_tip,right_tip; one antenna:"
                " NAME, whose side is seen (NAME, is the left, ,NAME the right one)"
            )
        ),
    ] = ""
    bases: Annotated[
        str,
        typer.Option(
            help="landmarks of the antennae's bases, left,right, or one; default: the head"
        ),
    ] = ""
    body: Annotated[
        str, typer.Option(help="landmarks of head and abdomen, default head,abdomen")
    ] = ""
    points: Annotated[
        str,
        typer.Option(
            help="landmarks along a flagellum, base to tip: its posture in place of speeds"
        ),
    ] = ""
    min_likelihood: Annotated[
        float | None,
        typer.Option(
            help="positions less likely than this count as not seen; 0 takes all; default 0.6"
        ),
    ] = None
    individual: Annotated[str | None, typer.Option(help="which animal, of several")] = None
    plane: Annotated[
        str | None, typer.Option(help="for tracks in three dimensions: xy, xz, yz, or space")
    ] = None
    camera: Annotated[int, typer.Option(help="which camera, of a DLTdv file with several")] = 1
    scale: Annotated[float | None, typer.Option(help="pixels per mm")] = None
    cutoff: Annotated[
        str,
        typer.Option(
            help=(
                "cut-off of the low-pass filter: a number [Hz], paper (6 Hz), or auto, the default:"
                " from each antenna's spectrum"
            )
        ),
    ] = ""
    max_gap: Annotated[
        int | None,
        typer.Option(
            help="longest gap bridged by a cubic spline [frames], default 5; 0 bridges none"
        ),
    ] = None
    outliers: Annotated[
        str,
        typer.Option(
            help=(
                "remove, the default, leaves out jumps and exchanged landmarks; keep takes every"
                " position"
            )
        ),
    ] = ""
    length: Annotated[
        float | None, typer.Option(help="antenna length [mm], for the tip's lateral speed")
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(
            help="folder for page (HTML), table (CSV), figure (PNG, SVG) and numbers (JSON)"
        ),
    ] = None
    session_start: Annotated[
        str,
        typer.Option(
            help=(
                "with --out: when it was filmed, 2026-05-01T09:00:00+02:00; writes poses as NWB too"
            )
        ),
    ] = ""
    subject: Annotated[str, typer.Option(help="id of the NWB file's animal")] = ""
    as_json: Json = False


def tracks(said: _TrackOptions) -> None:
    """Measure tracked antennae: speed, posture.

    Average maximum angular speed per trial and side, and the equivalent lateral speed; or a
    flagellum's posture.
    """
    from feeler.errors import ModelValidityWarning
    from feeler.tracking import measure_exploration

    how: dict[str, Any] = {
        "frame_rate": said.frame_rate,
        "origin": said.origin,
        "landmarks": _split(said.landmarks),
        "min_likelihood": said.min_likelihood,
        "individual": said.individual,
        "plane": said.plane,
        "camera": said.camera,
    }
    trials = [_load(file, how) for file in said.files]
    if said.scale is not None:
        trials = [trial.scaled(said.scale) for trial in trials]
    settings = _settle(said, trials)
    head, abdomen = settings["body"]
    tips, bases = settings["tips"], settings["bases"]
    if not said.points:
        _check_tips(tips, trials)
    if said.session_start:
        joined = zip(bases or (head, head), tips, strict=True)
        edges = [*((base, tip) for base, tip in joined if tip), (head, abdomen)]
        _save_poses(said, trials, list(pairwise(_split(said.points) or ())) or edges, settings)
    if said.points:
        _measure_posture(said, trials, settings)
        return
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", ModelValidityWarning
        )  # its remarks are printed with the numbers
        result = measure_exploration(
            trials,
            length=said.length,
            cutoff=_scale_cutoff(settings["cutoff"]),
            max_gap=settings["max_gap"],
            outliers=settings["outliers"],
            landmarks={"tips": tips, "bases": bases, "head": head, "abdomen": abdomen},
        )
    found = _describe(said.files, trials, result, settings)
    if said.as_json:
        say_json(found)
    else:
        typer.echo(_write_words(found))
    if said.out is not None:
        _save(said.out, said.files, trials, result, found)


def _settle(said: _TrackOptions, trials: list) -> dict[str, Any]:
    """The options that change a number, as given, else as kept in the files, else as by default."""
    import feeler
    from feeler.tracking.kinematics import MAX_GAP

    kept = trials[0].settings
    if any(trial.settings != kept for trial in trials):
        kept = {}
    given = {
        "tips": _settle_tips(said, trials) if said.tips else None,
        "bases": _settle_bases(said, trials) if said.bases else None,
        "body": _pair("--body", said.body) if said.body else None,
        "cutoff": _read_cutoff(said.cutoff) if said.cutoff else None,
        "max_gap": said.max_gap,
        "outliers": said.outliers or None,
    }
    usual = {
        "tips": ("left_tip", "right_tip"),
        "bases": None,
        "body": ("head", "abdomen"),
        "cutoff": "auto",
        "max_gap": MAX_GAP,
        "outliers": "remove",
    }
    settings: dict[str, Any] = {}
    for name, value in given.items():
        value = kept.get(name, usual[name]) if value is None else value
        settings[name] = tuple(value) if isinstance(value, list) else value
    return settings | {
        "min_likelihood": trials[0].min_likelihood,
        "origin": said.origin,
        "plane": said.plane,
        "individual": said.individual,
        "scale": said.scale,
        "length": said.length,
        "feeler": feeler.__version__,
    }


def _settle_tips(said: _TrackOptions, trials: list) -> tuple[str, str]:
    """The left and the right tip; the side of a single one is that on which it mostly lies."""
    names = _split(said.tips) or ()
    if len(names) != 1:
        return _pair("--tips", said.tips)
    head, abdomen = _pair("--body", said.body or "head,abdomen")
    name, beside = names[0], 0.0
    for trial in trials:
        forward, out = trial.of(head) - trial.of(abdomen), trial.of(name) - trial.of(head)
        if forward.shape[1] == 2:
            beside += np.nansum(np.sign(forward[:, 0] * out[:, 1] - forward[:, 1] * out[:, 0]))
    return (name, "") if beside >= 0 else ("", name)


def _settle_bases(said: _TrackOptions, trials: list) -> tuple[str, str]:
    """The bases of the left and the right antenna; a single one is that of the single tip."""
    names = _split(said.bases) or ()
    if len(names) != 1 or len(_split(said.tips) or ()) != 1:
        return _pair("--bases", said.bases)
    return (names[0], "") if _settle_tips(said, trials)[0] else ("", names[0])


def _read_cutoff(text: str) -> float | str:
    """A cut-off [Hz], or the word for one."""
    from feeler.errors import InvalidInput

    if text in ("auto", "paper"):
        return text
    try:
        return float(text)
    except ValueError:
        raise InvalidInput(
            f"--cutoff must be auto, paper or a number of Hz, got {text!r}."
        ) from None


def _scale_cutoff(cutoff: float | str) -> float | str:
    """The same in kHz, if it is a number."""
    return cutoff if isinstance(cutoff, str) else cutoff * 1e-3


def _load(file: Path, how: dict[str, Any]) -> Any:
    from feeler.cli.info import name_instead
    from feeler.errors import InvalidInput
    from feeler.tracking import load_tracks

    try:
        return load_tracks(file, **how)
    except InvalidInput as error:
        raise name_instead(file, "tracks") or error from None


def _describe(
    files: list[Path], trials: list, result: Any, settings: dict[str, Any]
) -> dict[str, Any]:
    """All numbers, in degrees per second, and what they were measured with."""
    group: Any = _get_group()
    options = list_options(group, ["tracks"])
    rows = []
    for k, (file, trial) in enumerate(zip(files, trials, strict=True)):
        mean, error = (
            _drop_nan(np.rad2deg(values[k]) * 1e3)
            for values in (result.mean_peak, result.error)
        )
        rows.append(
            {
                "file": file.name,
                "mean_peak": mean,
                "error": error,
                "n_peaks": result.n_peaks[k].tolist(),
                "n_frames": trial.n_frames,
                "frame_rate": round(1e3 / trial.interval, 6),
                "cutoff": [
                    side.cutoff * 1e3 if tip else None
                    for tip, side in zip(settings["tips"], result.sweeps[k], strict=True)
                ],
                "bridged": [side.bridged for side in result.sweeps[k]],
                "missing": [
                    side.missing if tip else None
                    for tip, side in zip(settings["tips"], result.sweeps[k], strict=True)
                ],
                "unmeasured": [side.unmeasured for side in result.sweeps[k]],
                "doubted": trial.doubted,
                "left_out": result.left_out[k],
                "notes": trial.notes,
                "remarks": [say_in_shell(words, options) for words in result.remarks[k]],
            }
        )
    overall, lateral = _drop_nan([result.mean, result.lateral_speed])
    return {
        "trials": rows,
        "mean": None if overall is None else float(np.rad2deg(overall) * 1e3),
        "lateral_speed": lateral,
        "length": result.length,
        "source": result.source,
        "settings": settings,
        "units": {
            "mean_peak": "deg/s",
            "error": "deg/s",
            "mean": "deg/s",
            "lateral_speed": "m/s",
            "length": "mm",
            "frame_rate": "1/s",
            "cutoff": "Hz",
            "max_gap": "frames",
            "scale": "px/mm",
        },
    }


def _get_group() -> Any:
    from feeler.cli.app import app

    return typer.main.get_command(app)


def _drop_nan(values: Any) -> list[float | None]:
    return [None if np.isnan(value) else float(value) for value in values]


def _write_words(found: dict[str, Any]) -> str:
    """A row for each trial, with what was done to it below, and the mean over trials."""
    asked = [k for k, tip in enumerate(found["settings"]["tips"]) if tip]
    sides = [_SIDES[k] for k in asked]
    heads = "".join(f"{side + ' °/s (peaks)':>20}" for side in sides)
    lines = [f"{'trial':32}{heads}  frames bridged, missing ({', '.join(sides)})"]
    for row in found["trials"]:
        mean, error, count = (
            [row[name][k] for k in asked] for name in ("mean_peak", "error", "n_peaks")
        )
        cells = "".join(
            f"{'none' if value is None else f'{value:.2f}':>14} ({n:3d})"
            for value, n in zip(mean, count, strict=True)
        )
        bridged, missing = (
            _pair_counts([row[name][k] for k in asked]) for name in ("bridged", "missing")
        )
        lines.append(f"{row['file'][:32]:32}{cells} {bridged:>15} {missing:>12}")
        errors = ["none" if value is None else f"{value:.2g}" for value in error]
        both = ", ".join(f"{side} {one}" for side, one in zip(sides, errors, strict=True))
        lines.append(f"  standard error: {both} °/s")
        lines += [f"  {words}" for words in _list_settings(row, found["settings"])]
    return "\n".join([*lines, _write_mean(found)])


def _list_settings(row: dict[str, Any], settings: dict[str, Any]) -> list[str]:
    """What was done to a trial before its speeds were measured, and what is to be asked of it."""
    whence = {"auto": "from the spectrum", "paper": "as in the paper's measure"}
    cutoffs = ", ".join(
        f"{side} {value:.3g} Hz"
        for side, value in zip(_SIDES, row["cutoff"], strict=True)
        if value is not None
    )
    lines = [
        f"{row['frame_rate']:g} frames/s; low-pass: {cutoffs}"
        f" ({whence.get(settings['cutoff'], 'as given')}); gaps of up to {settings['max_gap']}"
        " frames bridged"
    ]
    if row["doubted"]:
        named = ", ".join(f"{name} {count}" for name, count in row["doubted"].items())
        lines.append(
            f"frames whose likelihood is too low (below {settings['min_likelihood']:g}): {named}"
        )
    if row["left_out"]:
        named = ", ".join(f"{words} ({count})" for words, count in row["left_out"].items())
        lines.append(
            f"left out as tracking errors (frames): {named}; --outliers keep takes them"
        )
    lines += [
        f"{name}: {row['notes'][name]}"
        for name in ("left out", "(0, 0)", "frame rate", "clock")
        if name in row["notes"]
    ]
    if any(row["unmeasured"]):
        lines.append(
            f"peaks in bridged gaps, not counted: {_pair_counts(row['unmeasured'])} (left, right)"
        )
    return lines + [f"note: {words}" for words in row["remarks"]]


def _write_mean(found: dict[str, Any]) -> str:
    """The mean over trials and sides, or why there is none."""
    if found["mean"] is None:
        worst, side, file = max(
            (missing / row["n_frames"], side, row["file"])
            for row in found["trials"]
            for side, missing in zip(_SIDES, row["missing"], strict=True)
            if missing is not None
        )
        return (
            f"No mean over trials and sides: {worst:.0%} of the {side} antenna's frames in {file}"
            " have no angle, so that it would be a mean over the frames that are easy to track."
            " --min-likelihood and --max-gap say which frames count."
        )
    words = f"The average maximum angular speed is {found['mean']:.2f} °/s"
    if found["length"] is not None:
        words += (
            f"; with an antenna of {found['length']:g} mm that is"
            f" {found['lateral_speed'] * 100:.2f} cm/s sideways"
        )
    return f"{words}. Tracks: synthetic." if found["source"] == "synthetic" else f"{words}."


def _list_cells(row: dict[str, Any]) -> list[object]:
    """A trial's row of the page."""
    speeds = [
        "none" if mean is None else f"{mean:.1f}{_show_error(error)} ({count})"
        for mean, error, count in zip(
            row["mean_peak"], row["error"], row["n_peaks"], strict=True
        )
    ]
    return [row["file"], *speeds, _pair_counts(row["bridged"]), _pair_counts(row["missing"])]


def _show_error(error: float | None) -> str:
    return "" if error is None else f" ± {error:.2g}"


def _pair_counts(counts: list[int | None]) -> str:
    """Frames of the left and the right antenna."""
    return ", ".join("-" if count is None else str(count) for count in counts)


def _save(
    out: Path, files: list[Path], trials: list, result: Any, found: dict[str, Any]
) -> None:
    """tracks.html, .csv (a row for each trial, side and frame), .json, .png and .svg."""
    from matplotlib.figure import Figure

    from feeler.plotting import style
    from feeler.report import Section, write_page

    out.mkdir(parents=True, exist_ok=True)
    _save_table(out / "tracks.csv", trials, result, found)
    write_text(out / "tracks.json", json.dumps(found, indent=1) + "\n")
    height = 1.2 + 1.5 * len(trials)

    def draw(figure: Any) -> None:
        _plot(figure, files, trials, result)

    with style():
        draw(figure := Figure(figsize=(6.0, height), layout="constrained"))
        figure.savefig(out / "tracks.svg")
    section = Section(name="tracks", title="Angles and speeds", folder=out, vector=False)
    section.figure(
        "tracks",
        "Left: angle of each antenna to the body. Right: its absolute speed (line) and the peaks"
        " that are averaged (black dots).",
        draw,
        height=height,
    )
    section.table(
        _HEADER,
        [_list_cells(row) for row in found["trials"]],
        "Mean of the peak speeds ± standard error.",
    )
    section.text(_write_mean(found))
    section.heading("How it was measured")
    for row in found["trials"]:
        section.text(f"{row['file']}: {'. '.join(_list_settings(row, found['settings']))}.")
    section.table(
        ["setting", "value"],
        [[name, _show(value)] for name, value in found["settings"].items()],
    )
    write_page(
        out / "tracks.html",
        "How fast the antennae move",
        ", ".join(file.name for file in files),
        section,
    )
    typer.echo(
        f"wrote {out}/tracks.html, tracks.csv, tracks.json, tracks.png, tracks.svg", err=True
    )


def _show(value: Any) -> str:
    """A setting in words."""
    if isinstance(value, tuple | list):
        return ", ".join(map(str, value))
    return "not given" if value is None else str(value)


def _save_table(path: Path, trials: list, result: Any, found: dict[str, Any]) -> None:
    """A row for each trial, side and frame, with what it was measured with."""
    settings = found["settings"]
    head, abdomen = settings["body"]
    bases = settings["bases"] or (head, head)
    with writing(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow((*_COLUMNS, *_CONSTANT))
        for row, trial, pair in zip(found["trials"], trials, result.sweeps, strict=True):
            for k, side in enumerate(_SIDES):
                if not settings["tips"][k]:
                    continue
                same = {**settings, "tip": settings["tips"][k], "base": bases[k] or head}
                same |= {"head": head, "abdomen": abdomen}
                choice = settings["cutoff"] if isinstance(settings["cutoff"], str) else "given"
                last = [f"{row['frame_rate']:g}", f"{row['cutoff'][k]:.6g}", choice]
                last += [same[name] for name in _CONSTANT]
                angle, speed = np.rad2deg(pair[k].angle), np.rad2deg(pair[k].speed) * 1e3
                columns = trial.time, angle, speed, pair[k].is_bridged
                table.writerows(
                    [row["file"], side, f"{t:.6g}", f"{a:.6g}", f"{v:.6g}", n, int(b), *last]
                    for n, (t, a, v, b) in enumerate(zip(*columns, strict=True))
                )


def _save_poses(
    said: _TrackOptions, trials: list, edges: list, settings: dict[str, Any]
) -> None:
    """tracks.nwb: all landmarks of all trials."""
    from feeler.cli.choose import parse_start
    from feeler.errors import InvalidInput
    from feeler.tracking import save_poses

    if said.out is None:
        raise InvalidInput(
            "--session-start is for tracks.nwb in the folder --out; give --out too."
        )
    said.out.mkdir(parents=True, exist_ok=True)
    save_poses(
        trials,
        said.out / "tracks.nwb",
        session_start=parse_start(said.session_start),
        identifier=f"tracks {said.out.resolve().name}",
        edges=edges,
        subject=said.subject,
        settings=settings | {"frame_rate": [1e3 / trial.interval for trial in trials]},
    )
    typer.echo(f"wrote {said.out}/tracks.nwb", err=True)


def _plot(figure: Any, files: list[Path], trials: list, result: Any) -> None:
    axes = figure.subplots(len(trials), 2, squeeze=False, sharex="row")
    for row, file, trial, pair in zip(axes, files, trials, result.sweeps, strict=True):
        for side, sweeps in zip(_SIDES, pair, strict=True):
            row[0].plot(trial.time * 1e-3, np.rad2deg(sweeps.angle), lw=0.8, label=side)
            row[1].plot(trial.time * 1e-3, np.rad2deg(np.abs(sweeps.speed)) * 1e3, lw=0.8)
            row[1].plot(
                sweeps.peak_time * 1e-3, np.rad2deg(sweeps.peak_speed) * 1e3, "k.", ms=3
            )
        row[0].set(title=file.name[:40], xlabel="time [s]", ylabel="angle [°]")
        row[1].set(title="speed, peaks dotted", xlabel="time [s]", ylabel="|speed| [°/s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)


def _measure_posture(said: _TrackOptions, trials: list, settings: dict[str, Any]) -> None:
    """Say how a flagellum bends, and save it as netCDF."""
    from feeler.tracking import measure_posture

    names = ("min_likelihood", "origin", "plane", "individual", "scale", "feeler")
    used = {name: settings[name] for name in names} | {"points": said.points}
    found: list[dict[str, Any]] = []
    for file, trial in zip(said.files, trials, strict=True):
        posture = measure_posture(trial, _split(said.points) or ())
        found.append(_describe_posture(file, trial, posture) | {"settings": used})
        posture.attrs["settings"] = json.dumps(used)
        if not said.as_json:
            one = found[-1]
            largest = ", ".join(
                f"{name} {value:.1f}°" for name, value in one["largest_bend"].items()
            )
            typer.echo(
                f"{one['file']}: {one['length']:.4g} {one['units']['length']} long, {one['whole']}"
                f" of {one['frames']} frames whole; largest bend {largest}"
            )
        if said.out is not None:
            said.out.mkdir(parents=True, exist_ok=True)
            posture.to_netcdf(said.out / f"{file.stem}.posture.nc", engine="h5netcdf")
            typer.echo(f"wrote {said.out}/{file.stem}.posture.nc", err=True)
    if said.as_json:
        say_json(found)


def _describe_posture(file: Path, trial: Any, posture: Any) -> dict[str, Any]:
    """All that is said of a flagellum; bends in degrees."""
    largest = np.rad2deg(np.abs(posture.bend).max("time")).values
    return {
        "file": file.name,
        "length": float(posture.piece_length.sum()),
        "frames": trial.n_frames,
        "whole": int(np.isfinite(posture.bend).all("joint").sum()),
        "largest_bend": dict(
            zip(map(str, posture.joint.values), map(float, largest), strict=True)
        ),
        "units": {"length": posture.position.attrs["units"], "largest_bend": "deg"},
    }


def _split(text: str) -> tuple[str, ...] | None:
    return tuple(name.strip() for name in text.split(",")) if text else None


def _pair(option: str, text: str) -> tuple[str, str]:
    from feeler.errors import InvalidInput

    names = _split(text) or ()
    if len(names) != 2 or not any(names):
        raise InvalidInput(f"{option} takes two landmarks separated by a comma, got {text!r}.")
    return names[0], names[1]


def _check_tips(tips: tuple[str, str], trials: list) -> None:
    """Say how one antenna is measured, where the other one's tip was not tracked."""
    from feeler.errors import InvalidInput

    for trial in trials:
        seen = [tip in trial.landmarks for tip in tips]
        if all(tips) and sum(seen) == 1:
            alone = f"{tips[0]}," if seen[0] else f",{tips[1]}"
            missing = tips[1] if seen[0] else tips[0]
            raise InvalidInput(
                f"no landmark {missing!r}; the tracks hold {', '.join(trial.landmarks)}. To"
                f" measure one antenna alone: --tips {alone}"
            )
