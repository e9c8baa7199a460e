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

  feeler tracks walk.csv --frame-rate 200 --contact 310,80,310,400 --within 4     a wall [px]

  feeler tracks walks/*.csv --frame-rate 200 --sheet animals.csv    columns file, animal, group

  feeler tracks walk.csv --frame-rate 60 --origin bottom-left --landmarks \
left_tip,right_tip,head,abdomen
"""

import json
import os
import warnings
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.options import Json, say
from feeler.errors import InvalidInput, ModelValidityWarning, suggest

_SIDES = ("left", "right")


def tracks(
    files: Annotated[
        list[Path],
        typer.Argument(
            help=(
                "DeepLabCut CSV or H5, SLEAP project or analysis H5, Anipose, movement, DLTdv, long"
                " tables, Motive, TRex, idtracker.ai, FicTrac …, or NAME_x, NAME_y"
            )
        ),
    ],
    frame_rate: Annotated[
        float | None,
        typer.Option(
            help="frames per second, unless the file holds it or times (time_s, time_ms)"
        ),
    ] = None,
    origin: Annotated[
        str, typer.Option(help="top-left (most trackers) or bottom-left (older DLTdv)")
    ] = "top-left",
    landmarks: Annotated[
        str, typer.Option(help="names of DLTdv's points in order, separated by commas")
    ] = "",
    tips: Annotated[
        str,
        typer.Option(
            help=(
                "landmarks of the left and right tip, default left_tip,right_tip; one antenna:"
                " NAME, whose side is seen (NAME, is the left, ,NAME the right one)"
            )
        ),
    ] = "",
    bases: Annotated[
        str,
        typer.Option(
            help="landmarks of the antennae's bases, left,right, or one; default: the head"
        ),
    ] = "",
    body: Annotated[
        str, typer.Option(help="landmarks of head and abdomen, default head,abdomen")
    ] = "",
    points: Annotated[
        str,
        typer.Option(
            help="landmarks along a flagellum, base to tip: its posture in place of speeds"
        ),
    ] = "",
    min_likelihood: Annotated[
        float | None,
        typer.Option(
            help="positions less likely than this count as not seen; 0 takes all; default 0.6"
        ),
    ] = None,
    individual: Annotated[str | None, typer.Option(help="which animal, of several")] = None,
    plane: Annotated[
        str | None, typer.Option(help="for tracks in three dimensions: xy, xz, yz, or space")
    ] = None,
    camera: Annotated[int, typer.Option(help="which camera, of a DLTdv file with several")] = 1,
    scale: Annotated[float | None, typer.Option(help="pixels per mm")] = None,
    cutoff: Annotated[
        str,
        typer.Option(
            help=(
                "cut-off of the low-pass filter: a number [Hz], paper (6 Hz), or auto, the default:"
                " from each antenna's spectrum"
            )
        ),
    ] = "",
    max_gap: Annotated[
        int | None,
        typer.Option(
            help="longest gap bridged by a cubic spline [frames], default 5; 0 bridges none"
        ),
    ] = None,
    outliers: Annotated[
        str,
        typer.Option(
            help=(
                "remove, the default, leaves out jumps, repeated places and exchanged landmarks;"
                " keep takes every position"
            )
        ),
    ] = "",
    contact: Annotated[
        str,
        typer.Option(
            help=(
                "what is touched: a landmark, X,Y, the ends of a wall X,Y,X,Y, the corners of a"
                " region X,Y,X,Y,X,Y… [px, as in the file], or bend, with --points"
            )
        ),
    ] = "",
    within: Annotated[
        float | None,
        typer.Option(
            help="with --contact: greatest distance that is contact [px; mm with --scale]; for"
            " bend: degrees beyond the median posture"
        ),
    ] = None,
    sheet: Annotated[
        Path | None,
        typer.Option(
            help="table (CSV) with columns file, animal and group: compares the groups"
        ),
    ] = None,
    length: Annotated[
        float | None, typer.Option(help="antenna length [mm], for the tip's lateral speed")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="folder for page (HTML), table (CSV), figure (PNG, SVG) and numbers (JSON)"
        ),
    ] = None,
    session_start: Annotated[
        str,
        typer.Option(
            help=(
                "with --out: when it was filmed, 2026-05-01T09:00:00+02:00; writes poses as NWB too"
            )
        ),
    ] = "",
    subject: Annotated[str, typer.Option(help="id of the NWB file's animal")] = "",
    as_json: Json = False,
) -> None:
    """Measure tracked antennae: speed, posture.

    Average maximum angular speed per trial and side, and the equivalent lateral speed; or a
    flagellum's posture.
    """
    said = SimpleNamespace(**locals())
    from feeler.cli.tracks_pages import (
        _compare_animals,
        _find_touched,
        _read_sheet,
        _save_pages,
    )
    from feeler.tracking import measure_exploration
    from feeler.tracking.quality import leave_out_errors

    how: dict[str, Any] = {
        "frame_rate": said.frame_rate,
        "origin": said.origin,
        "landmarks": _split(said.landmarks),
        "min_likelihood": said.min_likelihood,
        "individual": said.individual,
        "plane": said.plane,
        "camera": said.camera,
    }
    said.names = _name_trials(said.files)
    owners = None if said.sheet is None else _read_sheet(said.sheet, said.files)
    trials = [_load(file, how) for file in said.files]
    if said.scale is not None:
        trials = [trial.scaled(said.scale) for trial in trials]
    settings = _settle(said, trials)
    ends, cutoff, (head, abdomen) = (settings[name] for name in ("tips", "cutoff", "body"))
    stalks = settings["bases"] or (head, head)
    marks = {"tips": ends, "bases": stalks, "head": head, "abdomen": abdomen}
    lines = [
        (side, [base or head, tip])
        for side, base, tip in zip(_SIDES, stalks, ends, strict=True)
        if tip
    ]
    if not said.points:
        _check_tips(ends, trials)
    if said.session_start:
        edges = [*(tuple(line) for _, line in lines), (head, abdomen)]
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
            cutoff=cutoff if isinstance(cutoff, str) else cutoff * 1e-3,
            max_gap=settings["max_gap"],
            outliers=settings["outliers"],
            landmarks=marks,
        )
    found = _describe(said.names, trials, result, settings)
    seen = trials
    if said.contact and settings["outliers"] == "remove":
        seen = [
            leave_out_errors(one, **marks, max_gap=settings["max_gap"])[0] for one in trials
        ]
    touched = _find_touched(said, seen, lines)
    if touched is not None:
        for row, one in zip(found["trials"], touched, strict=True):
            row["contacts"] = one.to_dict("records")
    groups = None if owners is None else _compare_animals(owners, result)
    if groups is not None:
        found["groups"] = {
            "table": groups.table.to_dict("records"),
            "animals": groups.animals.to_dict("records"),
            **{name: getattr(groups, name) for name in ("test", "p", "difference")},
            "left_out": [
                name for name, few in zip(said.names, result.too_few, strict=True) if few
            ],
        }
    say(said.as_json, found, _write_words(found))
    if said.out is not None:
        _save_pages(said.out, said.names, trials, result, found, touched)


def _name_trials(files: list[Path]) -> list[str]:
    """What each file is called in tables: by its folders too where names are alike."""
    paths = [file.resolve() for file in files]
    if twice := [
        file for file, path in zip(files, paths, strict=True) if paths.count(path) > 1
    ]:
        raise InvalidInput(f"{twice[0]} is given twice; give each film once.")
    if len({path.stem for path in paths}) == len(paths):
        return [path.name for path in paths]
    shared = os.path.commonpath([path.parent for path in paths])
    return [path.relative_to(shared).as_posix() for path in paths]


def _settle(said: SimpleNamespace, trials: list) -> dict[str, Any]:
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
        "contact": said.contact or None,
        "within": said.within,
        "length": said.length,
        "feeler": feeler.__version__,
    }


def _settle_tips(said: SimpleNamespace, trials: list) -> tuple[str, str]:
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


def _settle_bases(said: SimpleNamespace, trials: list) -> tuple[str, str]:
    """The bases of the left and the right antenna; a single one is that of the single tip."""
    names = _split(said.bases) or ()
    if len(names) != 1 or len(_split(said.tips) or ()) != 1:
        return _pair("--bases", said.bases)
    return (names[0], "") if _settle_tips(said, trials)[0] else ("", names[0])


def _read_cutoff(text: str) -> float | str:
    """A cut-off [Hz], or the word for one, which the library knows."""
    try:
        return float(text)
    except ValueError:
        return text


def _load(file: Path, how: dict[str, Any]) -> Any:
    from feeler.cli.info import name_instead
    from feeler.tracking import load_tracks

    try:
        return load_tracks(file, **how)
    except InvalidInput as error:
        raise name_instead(file, "tracks") or error from None


def _describe(
    names: list[str], trials: list, result: Any, settings: dict[str, Any]
) -> dict[str, Any]:
    """All numbers, in degrees per second, and what they were measured with."""
    from feeler.cli.app import put_in_shell

    rows = []
    for k, (name, trial) in enumerate(zip(names, trials, strict=True)):
        mean, error = (
            _drop_nan(np.rad2deg(values[k]) * 1e3)
            for values in (result.mean_peak, result.error)
        )
        rows.append(
            {
                "file": name,
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
                "rhythm": _describe_rhythm(result.sweeps[k], trial.interval),
                "remarks": [put_in_shell(words, ["tracks"]) for words in result.remarks[k]],
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
            "frequency": "Hz",
            "amplitude": "deg, half of peak to peak",
            "offset": "deg",
            "phase": "deg",
            "lag": "ms",
            "max_gap": "frames",
            "scale": "px/mm",
        },
    }


def _describe_rhythm(pair: Any, interval: float) -> dict[str, Any]:
    """Amplitude, frequency and offset of each side, and left against right; angles in degrees."""
    from feeler.tracking import compare_sides, measure_rhythm

    plain: dict[str, Any] = {}
    for side, sweeps in zip(_SIDES, pair, strict=True):
        if not 0 < sweeps.frequency * 2 * interval < 0.5:
            continue
        one = measure_rhythm(sweeps.angle, interval, sweeps.frequency)
        if np.isfinite(one.frequency):
            plain[side] = {
                "frequency": one.frequency * 1e3,
                "amplitude": float(np.rad2deg(one.mean_amplitude)),
                "offset": float(np.rad2deg(np.nanmedian(one.offset))),
            }
    if all(np.isfinite(sweeps.angle).any() for sweeps in pair):
        left, right = pair
        both = compare_sides(left, right, interval)
        plain["left against right"] = {
            "correlation": both.correlation,
            "phase": float(np.rad2deg(both.phase)),
            "locking": both.locking,
            "lag": both.lag,
            "best_correlation": both.best_correlation,
        }
    return plain


def _drop_nan(values: Any) -> list[float | None]:
    return [None if np.isnan(value) else float(value) for value in values]


def _write_words(found: dict[str, Any]) -> list[str]:
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
        lines += [f"  {words}" for words in _list_rhythms(row)]
        lines += [f"  {words}" for words in _list_contacts(row)]
        lines += [f"  {words}" for words in _list_settings(row, found["settings"])]
    return [*lines, _write_mean(found), *_list_groups(found)]


def _list_rhythms(row: dict[str, Any]) -> list[str]:
    """How the antennae swing, and left against right."""
    lines = [
        f"{side} swings at {one['frequency']:.3g} Hz by ± {one['amplitude']:.3g}° about"
        f" {one['offset']:.3g}°"
        for side, one in row["rhythm"].items()
        if side in _SIDES
    ]
    lines = ["; ".join(lines)] if lines else []
    both = row["rhythm"].get("left against right")
    if both and np.isfinite(both["correlation"]):
        words = f"left against right, outward angles: r = {both['correlation']:.2f}"
        if np.isfinite(both["phase"]):
            words += f", phase {both['phase']:.0f}° (locking {both['locking']:.2f})"
        lines.append(
            f"{words}; r = {both['best_correlation']:.2f} with the right one"
            f" {both['lag']:.3g} ms later"
        )
    return lines


def _list_contacts(row: dict[str, Any]) -> list[str]:
    """How often and how long each side touches."""
    lines = []
    if "contacts" in row and not row["contacts"]:
        lines.append("no contact")
    for side in dict.fromkeys(one["side"] for one in row.get("contacts", ())):
        mine = [one for one in row["contacts"] if one["side"] == side]
        whole = [one["duration_ms"] for one in mine if one["whole"]]
        words = f"{side}: {len(mine)} contact(s) with {mine[0]['target']}"
        if whole:
            words += f", {np.mean(whole):.4g} ms in the mean over {len(whole)} whole ones"
        lines.append(
            f"{words}, at {np.median([one['place'] for one in mine]):.0%} of the length"
        )
    return lines


def _list_groups(found: dict[str, Any]) -> list[str]:
    """The groups of animals and their test."""
    if "groups" not in found:
        return []
    groups = found["groups"]
    lines = ["means of animals, with 95 % intervals (t):"]
    for row in groups["table"]:
        ends = "" if np.isnan(row["low"]) else f" ({row['low']:.2f} to {row['high']:.2f})"
        lines.append(f"  {row['group']}: {row['mean']:.2f} °/s{ends}, {row['n']} animal(s)")
    if groups["left_out"]:
        files = ", ".join(groups["left_out"])
        lines.append(f"  without films that lack too many frames for a mean: {files}")
    if groups["test"]:
        words = f"  {groups['test']} test: p = {groups['p']:.3g}"
        if np.isfinite(groups["difference"][0]):
            apart, low, high = groups["difference"]
            words += f"; difference {apart:.2f} °/s ({low:.2f} to {high:.2f})"
        return [*lines, words]
    return [*lines, "  no test: that needs two groups of two animals"]


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
    lines += _list_left_out(row)
    lines += [
        f"{name}: {words}"
        for name, words in row["notes"].items()
        if name.startswith("(") or name in ("left out", "tracked", "frame rate", "clock")
    ]
    if any(row["unmeasured"]):
        lines.append(
            f"peaks in bridged gaps, not counted: {_pair_counts(row['unmeasured'])} (left, right)"
        )
    return lines + [f"note: {words}" for words in row["remarks"]]


def _list_left_out(row: dict[str, Any]) -> list[str]:
    """What was left out of a film as tracking errors."""
    named = ", ".join(f"{words} ({count})" for words, count in row["left_out"].items())
    words = f"left out as tracking errors (frames): {named}; --outliers keep takes them"
    return [words] if named else []


def _pair_counts(counts: list[int | None]) -> str:
    """Frames of the left and the right antenna."""
    return ", ".join("-" if count is None else str(count) for count in counts)


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


def _save_poses(
    said: SimpleNamespace, trials: list, edges: list, settings: dict[str, Any]
) -> None:
    """tracks.nwb: all landmarks of all trials."""
    from feeler.tracking import save_poses

    if said.out is None:
        raise InvalidInput(
            "--session-start is for tracks.nwb in the folder --out; give --out too."
        )
    said.out.mkdir(parents=True, exist_ok=True)
    save_poses(
        trials,
        said.out / "tracks.nwb",
        session_start=said.session_start,
        identifier=f"tracks {said.out.resolve().name}",
        edges=edges,
        subject=said.subject,
        settings=settings | {"frame_rate": [1e3 / trial.interval for trial in trials]},
    )
    typer.echo(f"wrote {said.out}/tracks.nwb", err=True)


def _measure_posture(said: SimpleNamespace, trials: list, settings: dict[str, Any]) -> None:
    """Say how a flagellum bends and when it touches, and save it as netCDF."""
    from feeler.cli.tracks_pages import _find_touched, _save_contacts
    from feeler.tracking import measure_posture
    from feeler.tracking.quality import leave_out_errors

    names = ("min_likelihood", "origin", "plane", "individual", "scale", "feeler")
    used = {name: settings[name] for name in names} | {"points": said.points}
    used |= {name: settings[name] for name in ("outliers", "max_gap")}
    points = [*(_split(said.points) or ())]
    left_out: list[dict[str, int]] = [{} for _ in trials]
    if used["outliers"] == "remove" and all(points):
        ends: dict[str, Any] = {"tips": (points[-1], ""), "bases": (points[0], "")}
        ends["points"] = points[1:-1]
        seen = [leave_out_errors(one, **ends, max_gap=used["max_gap"]) for one in trials]
        trials, left_out = [one for one, _, _ in seen], [errors for _, errors, _ in seen]
    postures = [measure_posture(trial, points) for trial in trials]
    touched = _find_touched(said, trials, [("antenna", points)])
    found, lines = [], []
    for k, (name, trial) in enumerate(zip(said.names, trials, strict=True)):
        one = _describe_posture(name, trial, postures[k])
        one |= {"left_out": left_out[k], "settings": used}
        if touched is not None:
            one["contacts"] = touched[k].to_dict("records")
        largest = ", ".join(
            f"{joint} {value:.1f}°" for joint, value in one["largest_bend"].items()
        )
        lines.append(
            f"{one['file']}: {one['length']:.4g} {one['units']['length']} long, {one['whole']}"
            f" of {one['frames']} frames whole; largest bend {largest}"
        )
        lines += [f"  {words}" for words in (*_list_left_out(one), *_list_contacts(one))]
        found.append(one)
    say(said.as_json, found, lines)
    if said.out is None:
        return
    said.out.mkdir(parents=True, exist_ok=True)
    alike = len({Path(name).stem for name in said.names}) < len(said.names)
    for name, posture in zip(said.names, postures, strict=True):
        posture.attrs["settings"] = json.dumps(used)
        stem = name.replace("/", "_") if alike else Path(name).stem
        posture.to_netcdf(said.out / f"{stem}.posture.nc", engine="h5netcdf")
        typer.echo(f"wrote {said.out}/{stem}.posture.nc", err=True)
    if touched is not None:
        _save_contacts(said.out, said.names, touched)


def _describe_posture(name: str, trial: Any, posture: Any) -> dict[str, Any]:
    """All that is said of a flagellum; bends in degrees."""
    largest = np.rad2deg(np.abs(posture.bend).max("time")).values
    return {
        "file": name,
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
    names = _split(text) or ()
    if len(names) != 2 or not any(names):
        raise InvalidInput(f"{option} takes two landmarks separated by a comma, got {text!r}.")
    return names[0], names[1]


def _check_tips(tips: tuple[str, str], trials: list) -> None:
    """Say how one antenna is measured, where the other one's tip was not tracked."""
    for trial in trials:
        seen = [tip in trial.landmarks for tip in tips]
        if all(tips) and sum(seen) == 1:
            there, missing = tips if seen[0] else tips[::-1]
            raise InvalidInput(
                f"no landmark {missing!r}; the tracks hold {', '.join(trial.landmarks)}."
                f"{suggest(missing, trial.landmarks)} To measure one antenna alone: --tips {there}"
            )
