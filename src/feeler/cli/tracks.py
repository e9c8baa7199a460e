"""``feeler tracks``: how fast an animal moves its antennae, and how they bend, from tracked
landmarks.

Examples:

  feeler tracks trial1_xypts.csv trial2_xypts.csv --frame-rate 30

  feeler tracks walkDLC_resnet50_shuffle1.h5 --frame-rate 200 --bases left_base,right_base \
--max-gap 5 --out out/tracks

  feeler tracks walk.analysis.h5 --frame-rate 100 --individual track_0 --points base,p1,p2,p3,tip \
--scale 8

  feeler tracks walk0.csv walk1.csv --frame-rate 200 --out out/walks --session-start \
2026-05-01T09:00:00+02:00 --subject c1

  feeler tracks out/walks/tracks.nwb --individual trial_000001

  feeler tracks walk.csv --frame-rate 60 --origin bottom-left --landmarks \
left_tip,right_tip,head,abdomen
"""

import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.say import Json, say_json
from feeler.disk.files import write_text, writing

_SPEEDS = ("left [°/s] (peaks)", "right [°/s] (peaks)")
_HEADER = ("trial", *_SPEEDS, "frames bridged (left, right)", "frames missing (left, right)")


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
        float | None, typer.Option(help="frames per second, unless the file holds it")
    ] = None
    origin: Annotated[
        str, typer.Option(help="top-left (most trackers) or bottom-left (older DLTdv)")
    ] = "top-left"
    landmarks: Annotated[
        str, typer.Option(help="names of DLTdv's points in order, separated by commas")
    ] = ""
    tips: Annotated[
        str,
        typer.Option(help="landmarks of the left and right tip; one antenna: NAME, or ,NAME"),
    ] = "left_tip,right_tip"
    bases: Annotated[
        str,
        typer.Option(help="landmarks of the antennae's bases, left,right; default: the head"),
    ] = ""
    body: Annotated[str, typer.Option(help="landmarks of head and abdomen")] = "head,abdomen"
    points: Annotated[
        str,
        typer.Option(
            help="landmarks along a flagellum, base to tip: its posture in place of speeds"
        ),
    ] = ""
    min_likelihood: Annotated[
        float, typer.Option(help="places less likely than this count as not seen; 0 takes all")
    ] = 0.6
    individual: Annotated[str | None, typer.Option(help="which animal, of several")] = None
    plane: Annotated[
        str | None, typer.Option(help="for tracks in three dimensions: xy, xz, yz, or space")
    ] = None
    camera: Annotated[int, typer.Option(help="which camera, of a DLTdv file with several")] = 1
    scale: Annotated[float | None, typer.Option(help="pixels per mm")] = None
    cutoff: Annotated[float, typer.Option(help="cut-off of the low-pass filter [Hz]")] = 6.0
    max_gap: Annotated[
        int,
        typer.Option(help="longest gap bridged by a straight line [frames]; 0 bridges none"),
    ] = 0
    length: Annotated[float, typer.Option(help="antenna length [mm]")] = 42.0
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
    """Average maximum angular speed per trial and side, and the equivalent lateral speed; or a
    flagellum's posture.
    """
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
    head, abdomen = _pair("--body", said.body)
    tips = _pair("--tips", said.tips)
    if not said.points:
        _check_tips(tips, trials)
    bases = _pair("--bases", said.bases) if said.bases else None
    if said.session_start:
        joined = zip(bases or (head, head), tips, strict=True)
        edges = [*((base, tip) for base, tip in joined if tip), (head, abdomen)]
        _save_poses(said, trials, list(pairwise(_split(said.points) or ())) or edges)
    if said.points:
        _measure_posture(said, trials)
        return
    result = measure_exploration(
        trials,
        length=said.length,
        cutoff=said.cutoff * 1e-3,
        max_gap=said.max_gap,
        landmarks={"tips": tips, "bases": bases, "head": head, "abdomen": abdomen},
    )
    found = _describe(said.files, trials, result)
    if said.as_json:
        say_json(found)
    else:
        typer.echo(_write_words(found))
    if said.out is not None:
        _save(said.out, said.files, trials, result, found)


def _load(file: Path, how: dict[str, Any]) -> Any:
    from feeler.cli.info import name_instead
    from feeler.errors import InvalidInput
    from feeler.tracking import load_tracks

    try:
        return load_tracks(file, **how)
    except InvalidInput as error:
        raise name_instead(file, "tracks") or error from None


def _describe(files: list[Path], trials: list, result: Any) -> dict[str, Any]:
    """All numbers, in degrees per second."""
    rows = []
    for k, (file, trial) in enumerate(zip(files, trials, strict=True)):
        mean, error = (
            np.rad2deg(values[k]) * 1e3 for values in (result.mean_peak, result.error)
        )
        rows.append(
            {
                "file": file.name,
                "mean_peak": [None if np.isnan(value) else float(value) for value in mean],
                "error": [None if np.isnan(value) else float(value) for value in error],
                "n_peaks": result.n_peaks[k].tolist(),
                "bridged": [side.bridged for side in result.sweeps[k]],
                "missing": [side.missing for side in result.sweeps[k]],
                "doubted": trial.doubted,
            }
        )
    return {
        "trials": rows,
        "mean": float(np.rad2deg(result.mean) * 1e3),
        "lateral_speed": float(result.lateral_speed),
        "length": result.length,
        "source": result.source,
        "units": {
            "mean_peak": "deg/s",
            "error": "deg/s",
            "mean": "deg/s",
            "lateral_speed": "m/s",
            "length": "mm",
        },
    }


def _write_words(found: dict[str, Any]) -> str:
    lines = [
        "trial                            left °/s (peaks)   right °/s (peaks)  frames bridged,"
        " missing (left, right)"
    ]
    for row in found["trials"]:
        left, right = (float("nan") if value is None else value for value in row["mean_peak"])
        n_left, n_right = row["n_peaks"]
        lines.append(
            f"{row['file'][:32]:32} {left:9.2f} ({n_left:3d}) {right:14.2f} ({n_right:3d})"
            f" {_pair_counts(row['bridged']):>15} {_pair_counts(row['missing']):>12}"
        )
        if row["doubted"]:
            named = ", ".join(f"{name} {count}" for name, count in row["doubted"].items())
            lines.append(f"  frames whose likelihood is too low: {named}")
        errors = ["none" if value is None else f"{value:.2g}" for value in row["error"]]
        lines.append(f"  standard error: left {errors[0]}, right {errors[1]} °/s")
    if any(any(row["missing"]) for row in found["trials"]):
        lines.append(
            "Missing frames cut the motion into pieces, whose ends give false peaks or hide true"
            " ones: these means are biased. --max-gap 5 bridges short gaps by straight lines."
        )
    lines.append(
        f"The average maximum angular speed is {found['mean']:.2f} °/s; with an antenna of"
        f" {found['length']:g} mm that is {found['lateral_speed'] * 100:.2f} cm/s sideways. Tracks:"
        f" {found['source']}."
    )
    return "\n".join(lines)


def _list_cells(row: dict[str, Any]) -> list[object]:
    """A trial's row of the page."""
    speeds = [
        "none" if mean is None else f"{mean:.1f} ± {error:.2g} ({count})"
        for mean, error, count in zip(
            row["mean_peak"], row["error"], row["n_peaks"], strict=True
        )
    ]
    return [row["file"], *speeds, _pair_counts(row["bridged"]), _pair_counts(row["missing"])]


def _pair_counts(counts: list[int]) -> str:
    """Frames of the left and the right antenna."""
    return ", ".join(map(str, counts))


def _save(
    out: Path, files: list[Path], trials: list, result: Any, found: dict[str, Any]
) -> None:
    """tracks.html, .csv (trial, side, time, angle, speed), .json, .png and .svg."""
    from matplotlib.figure import Figure

    from feeler.plotting import style
    from feeler.report import Section, write_page

    out.mkdir(parents=True, exist_ok=True)
    with (
        writing(out / "tracks.csv") as part,
        part.open("w", encoding="utf-8", newline="\n") as table,
    ):
        table.write("trial,side,time_ms,angle_deg,speed_deg_per_s\n")
        for file, trial, pair in zip(files, trials, result.sweeps, strict=True):
            for side, sweeps in zip(("left", "right"), pair, strict=True):
                columns = trial.time, np.rad2deg(sweeps.angle), np.rad2deg(sweeps.speed) * 1e3
                table.writelines(
                    f"{file.name},{side},{t:.6g},{a:.6g},{v:.6g}\n"
                    for t, a, v in zip(*columns, strict=True)
                )
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
    section.table(_HEADER, [_list_cells(row) for row in found["trials"]])
    section.text(_write_words(found).splitlines()[-1])
    write_page(
        out / "tracks.html",
        "How fast the antennae move",
        ", ".join(file.name for file in files),
        section,
    )
    typer.echo(
        f"wrote {out}/tracks.html, tracks.csv, tracks.json, tracks.png, tracks.svg", err=True
    )


def _save_poses(said: _TrackOptions, trials: list, edges: list) -> None:
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
    )
    typer.echo(f"wrote {said.out}/tracks.nwb", err=True)


def _plot(figure: Any, files: list[Path], trials: list, result: Any) -> None:
    axes = figure.subplots(len(trials), 2, squeeze=False, sharex="row")
    for row, file, trial, pair in zip(axes, files, trials, result.sweeps, strict=True):
        for side, sweeps in zip(("left", "right"), pair, strict=True):
            row[0].plot(trial.time * 1e-3, np.rad2deg(sweeps.angle), lw=0.8, label=side)
            row[1].plot(trial.time * 1e-3, np.rad2deg(np.abs(sweeps.speed)) * 1e3, lw=0.8)
            row[1].plot(
                sweeps.peak_time * 1e-3, np.rad2deg(sweeps.peak_speed) * 1e3, "k.", ms=3
            )
        row[0].set(title=file.name[:40], xlabel="time [s]", ylabel="angle [°]")
        row[1].set(title="speed, peaks dotted", xlabel="time [s]", ylabel="|speed| [°/s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)


def _measure_posture(said: _TrackOptions, trials: list) -> None:
    """Say how a flagellum bends, and keep it as netCDF."""
    from feeler.tracking import measure_posture

    found: list[dict[str, Any]] = []
    for file, trial in zip(said.files, trials, strict=True):
        posture = measure_posture(trial, _split(said.points) or ())
        found.append(_describe_posture(file, trial, posture))
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
