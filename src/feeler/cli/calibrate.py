"""``feeler calibrate``: find the mechanics that fit an animal, from targets or from recorded
traces.

Examples:

  feeler calibrate --profile exponential --starts 4 --checkpoint fit.jsonl

  feeler calibrate --data synthetic_step --out out/calibration    (simulated example data that \
ship with feeler)

  feeler calibrate --data walkDLC.h5 --points base,tip --frame-rate 500 --antenna mine.toml --at 6

  feeler calibrate --data force.csv --at 8 --antenna mine.toml      columns deflection_um, force_uN

  feeler calibrate --data video.csv --frame-rate 1000 --antenna cricket --profile tilt --at 5 \
--out out/cricket
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from types import SimpleNamespace
from typing import Annotated, Any

import typer

from feeler.cli.options import EngineName, Json, say
from feeler.errors import FeelerError, InvalidInput
from feeler.files import write_text
from feeler.progress import ProgressBar

_BAD = (
    0.15  # [C] relative residual of a trace fit beyond which its interval is not to be trusted
)


def calibrate(
    data: Annotated[
        list[str],
        typer.Option(
            help=(
                "releases or force–deflection; once for each file. A tracker's file with --points;"
                " a table with time_ms, time_s or frame, and a column per animal; or deflection_um,"
                " force_uN"
            )
        ),
    ] = [],  # noqa: B006
    points: Annotated[
        str,
        typer.Option(
            help="landmarks of a tracker's file along the antenna, base to tip: base,tip"
        ),
    ] = "",
    individual: Annotated[
        str | None, typer.Option(help="which animal, of a tracker's file with several")
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option(help="pixels per mm of a tracker's file; not needed for a fit"),
    ] = None,
    max_gap: Annotated[
        int,
        typer.Option(
            help="longest gap that is filled in [frames]; not counted in the fit", min=0
        ),
    ] = 5,
    by: Annotated[
        str,
        typer.Option(
            help="with --data: trace (every sample) or targets (frequency and damping)"
        ),
    ] = "trace",
    profile: Annotated[
        str,
        typer.Option(
            help="exponential, linear, uniform, scale, tilt …; an unknown name lists all"
        ),
    ] = "",
    antenna: Annotated[
        str, typer.Option(help="preset or antenna file (TOML) that gives segments and masses")
    ] = "cockroach",
    frame_rate: Annotated[
        float | None, typer.Option(help="frames per second, if the column is frame")
    ] = None,
    release: Annotated[
        str,
        typer.Option(help="first (sample) or found; by default found where frames are counted"),
    ] = "",
    at: Annotated[
        float | None,
        typer.Option(
            help="with --data: where it was held or loaded [mm from the base]; default 10"
        ),
    ] = None,
    force_at: Annotated[
        float | None,
        typer.Option(
            help="where a force acts [mm from the base], if not at --at nor in a column"
        ),
    ] = None,
    targets: Annotated[
        str, typer.Option(help="name of shipped targets, or a TOML file")
    ] = "cockroach",
    method: Annotated[
        str,
        typer.Option(help="least-squares, powell, nelder-mead …; an unknown name lists all"),
    ] = "least-squares",
    starts: Annotated[
        int,
        typer.Option(
            help="number of searches; the first begins at usual values, others near them", min=1
        ),
    ] = 1,
    spread: Annotated[
        float, typer.Option(help="sd of the perturbation, in logarithms", min=0)
    ] = 0.7,
    seed: Annotated[int, typer.Option(min=0, help="seed of the starts")] = 0,
    evaluations: Annotated[
        int, typer.Option(help="antennas simulated per start, at most", min=2)
    ] = 1500,
    checkpoint: Annotated[
        Path | None,
        typer.Option(
            help="file that keeps every simulated antenna; an interrupted fit goes on from it"
        ),
    ] = None,
    engine: EngineName = "chain-consistent",
    out: Annotated[
        Path | None,
        typer.Option(
            help="with --data: folder for page (HTML), figure, numbers (JSON) and antenna.toml"
        ),
    ] = None,
    session_start: Annotated[
        str,
        typer.Option(
            help=(
                "with --data and --out: when it was recorded, 2026-05-01T09:00:00+02:00; writes"
                " NWB too"
            )
        ),
    ] = "",
    as_json: Json = False,
) -> None:
    """Fit hinge stiffness and damping to measurements.

    Fit hinge stiffness and damping to targets, or to recorded free responses of your own
    animals.
    """
    said = SimpleNamespace(**locals())
    from feeler.cli.choose import choose_antenna

    chosen = choose_antenna(said.antenna)
    if any(map(_is_forces, said.data)):
        _fit_measured(said, chosen)
    elif said.data:
        _fit_data(said, chosen, said.profile or "scale")
    else:
        _fit_targets(said, chosen, said.profile or "exponential")


def _is_forces(file: str) -> bool:
    from feeler.calibration.measurements import is_force_table

    return is_force_table(file)


def _load_releases(said: SimpleNamespace, files: list[str]) -> tuple[Any, list[Any]]:
    """Traces of the releases in these files, and the films that they are of."""
    from feeler.calibration import join_films, load_film, load_traces

    if said.points:
        points = [point.strip() for point in said.points.split(",")]
        options: dict[str, Any] = {"frame_rate": said.frame_rate, "individual": said.individual}
        films = [
            load_film(file, points, scale=said.scale, max_gap=said.max_gap, **options)
            for file in files
        ]
        return join_films(films), films
    if len(files) > 1:
        raise InvalidInput(
            "several tables of releases: join them, with a column for each animal. Several files of"
            " a tracker: say the landmarks (--points base,tip)."
        )
    release = said.release or ("first" if said.frame_rate is None else "found")
    try:
        traces = load_traces(
            files[0], frame_rate=said.frame_rate, release=release, max_gap=said.max_gap
        )
        return traces, []
    except InvalidInput as error:
        raise _name_landmarks(files[0]) or error from None


def _name_landmarks(file: str) -> Exception | None:
    """What to say of a file that holds tracked landmarks; None of others."""
    from feeler.tracking import load_tracks

    for rate in (None, 1e3):
        try:
            names = load_tracks(file, frame_rate=rate).landmarks
        except FeelerError:
            continue
        return InvalidInput(
            f"{Path(file).name} holds tracked landmarks ({', '.join(names[:12])}): say which of"
            " them lie along the antenna, base to tip, as in --points base,tip."
        )
    return None


def _fit_measured(said: SimpleNamespace, antenna: Any) -> None:
    """Force–deflection curves, and releases if there are any, in one fit."""
    from feeler.animal import save_fit
    from feeler.calibration import Measurements, Protocol, fit_measurements, load_forces

    place = said.at if said.force_at is None else said.force_at
    curves = [
        curve for file in said.data if _is_forces(file) for curve in load_forces(file, at=place)
    ]
    others = [file for file in said.data if not _is_forces(file)]
    traces, films = _load_releases(said, others) if others else (None, [])
    held = (
        {}
        if said.at is None or traces is None
        else {"at": said.at, "deflection": 0.1 * said.at}
    )
    protocol = Protocol(engine=said.engine, **held)
    aside = {film.name: film.match_protocol(antenna, protocol).deflection for film in films}
    if traces is None:
        each = [
            Measurements(name=name, forces=tuple(one for one in curves if one.name == name))
            for name in dict.fromkeys(curve.name for curve in curves)
        ]
    else:
        each = [
            Measurements(
                name=name,
                releases=(traces.select(name),),
                forces=tuple(curves),
                deflection=aside.get(name),
            )
            for name in traces.animals
        ]
    with ProgressBar("animals") as progress:
        fit = fit_measurements(each, antenna, protocol=protocol, progress=progress)
    lines = [
        f"{len(each)} animal{'s' * (len(each) > 1)}, factors on {antenna.name}",
        *fit.describe(),
        *_say_modulus(said.antenna, fit),
        *(
            f"{name}: {left:.2g} of its largest value is left"
            + " (much: does it begin before contact, or slip?)"
            * ("force" in name and left > 0.05)
            for name, left in fit.residual.items()
        ),
    ]
    say(said.as_json, fit.to_plain(), lines)
    if said.out is not None:
        save_fit(said.out, fit, each)
        typer.echo(
            f"wrote {said.out}/calibration.html, calibration.json, antenna.toml", err=True
        )


def _say_modulus(name: str, fit: Any) -> list[str]:
    """Young's modulus, where the antenna's file says what it began with."""
    from feeler.antenna.files import read_antenna_file

    if not name.endswith(".toml") or "stiffness" not in fit.names:
        return []
    source = read_antenna_file(name).sources.get("beam.modulus")
    try:
        modulus = float(source.formula) if source else float("nan")
    except ValueError:
        return []
    k = fit.names.index("stiffness")
    ends = f"{fit.low[k] * modulus:.4g} to {fit.high[k] * modulus:.4g}"
    return [f"modulus = {fit.p[k] * modulus:.4g} MPa  (95 %: {ends})"] * (modulus > 0)


def _fit_data(said: SimpleNamespace, antenna: Any, profile: str) -> None:
    from feeler.calibration import Protocol, fit_traces, make_hinges

    traces, films = _load_releases(said, said.data)
    hinges = make_hinges(profile, antenna)
    held = {} if said.at is None else {"at": said.at, "deflection": 0.1 * said.at}
    protocol = Protocol(engine=said.engine, **held)
    if films:
        aside = [film.match_protocol(antenna, protocol).deflection for film in films]
        protocol = protocol.replace(deflection=median(aside))
    with ProgressBar("animals") as progress:
        result = fit_traces(
            traces,
            antenna,
            by=said.by,
            hinges=hinges,
            protocol=protocol,
            progress=progress,
        )
    origin = "as in the film" if films else "a choice"
    lines = [
        *_describe_fit(traces, hinges, result, said.by, _explain(profile, antenna.name)),
        f"simulated as held {protocol.deflection:.3g} mm aside ({origin}), {protocol.at:g} mm from"
        " the base",
    ]
    say(said.as_json, _make_plain(result, hinges), lines)
    if said.by == "trace" and result.residual.max() > _BAD:
        typer.echo(
            f"a residual above {_BAD:g} of the trace means that this antenna does not swing like"
            " the animal; its interval then says nothing",
            err=True,
        )
    if said.out is not None:
        parts = zip(result.names, result.p, result.low, result.high, strict=True)
        answer = ", ".join(f"{n} = {p:.4g} ({a:.4g} to {b:.4g})" for n, p, a, b in parts)
        words = (
            f"{answer}, values with 95 % intervals: {_explain(profile, antenna.name)}, fitted to"
            f" {traces.source} traces."
        )
        _save(said.out, traces, antenna, hinges, result, said.session_start, words)


def _make_plain(result: Any, hinges: Any) -> dict[str, Any]:
    """The fit as plain data."""
    whole = {
        name: value
        for name, value in vars(result).items()
        if name not in ("band", "directions")
    }
    if result.directions is not None:
        whole |= {
            "directions": {
                name: getattr(result.directions, name) for name in ("sensitivity", "direction")
            }
        }
    return {
        **whole,
        "units": hinges.units,
        "band": None if result.band is None else vars(result.band),
    }


def _describe_fit(
    traces: Any, hinges: Any, result: Any, by: str, explained: str
) -> Iterator[str]:
    from feeler.calibration.joint import question_stiffness

    count = len(result.animals)
    if filled := int(traces.bridged.sum()):
        yield f"{filled} missing samples are filled in and do not count in the fit"
    yield f"{count} animal{'s' * (count > 1)} ({traces.source}), fitted by {by}: {explained}"
    yield f"{'':20} {' '.join(f'{name:>11}' for name in result.names)}   residual"
    for name, p, residual in zip(result.animals, result.each, result.residual, strict=True):
        yield f"{name:20} {' '.join(f'{value:11.5g}' for value in p)}   {residual:.3g}"
    for name, unit, p, low, high in zip(
        result.names, hinges.units, result.p, result.low, result.high, strict=True
    ):
        yield (
            f"{name} = {p:.5g}{_unit(unit)}  (95 %: {low:.5g} to {high:.5g}; {result.interval})"
        )
    if hinges.name in ("scale", "tilt"):
        yield from question_stiffness(result.p[0])
    if result.band is not None:
        yield result.band.describe()
    if result.directions is not None and len(result.names) > 1:
        yield result.directions.describe("data")


def _save(
    out: Path, traces: Any, start: Any, hinges: Any, result: Any, session_start: str, lead: str
) -> None:
    """calibration.html, calibration.png, profile.png, calibration.json and antenna.toml, the
    antenna of the mean parameters.
    """
    from feeler.antenna.files import save_antenna
    from feeler.provenance import to_json
    from feeler.report import Section, write_page

    out.mkdir(parents=True, exist_ok=True)
    antenna = hinges.build(result.p).replace(name=f"fitted to {traces.source} traces")
    save_antenna(antenna, out / "antenna.toml")
    section = Section(name="calibration", title="Traces and fits", folder=out, vector=False)
    caption = (
        "Dots: as recorded, as a share of the outermost point's first displacement; lines: the"
        " fitted antenna."
    )
    section.figure(
        "calibration", caption, lambda figure: _plot(figure, traces, result), height=3.2
    )
    rows = zip(result.names, hinges.units, result.p, result.low, result.high, strict=True)
    section.table(
        ["parameter", "unit", "value", "from", "to"],
        list(rows),
        f"95 % intervals: {result.interval}.",
    )
    each = [
        [name, *p, r]
        for name, p, r in zip(result.animals, result.each, result.residual, strict=True)
    ]
    section.table(["animal", *result.names, "residual"], each)
    if result.band is not None:
        caption = (
            "The fitted hinges with their 95 % intervals, as far as this family of profiles goes;"
            " dashed: where it began."
        )
        section.figure(
            "profile",
            caption,
            lambda figure: _plot_band(figure, result.band, start),
            height=3.0,
        )
        section.text(result.band.describe())
    if result.directions is not None and len(result.names) > 1:
        section.text(result.directions.describe("data"))
    write_page(
        out / "calibration.html",
        "Fitted mechanics",
        lead,
        section,
    )
    write_text(
        out / "calibration.json",
        json.dumps(to_json(_make_plain(result, hinges)), indent=1) + "\n",
    )
    kept = "calibration.html, calibration.png, calibration.json, antenna.toml"
    if session_start:
        _save_nwb(out / "calibration.nwb", traces, result, session_start)
        kept += ", calibration.nwb"
    typer.echo(f"wrote {out}/{kept}", err=True)


def _save_nwb(path: Path, traces: Any, result: Any, session_start: str) -> None:
    """Recordings and fits as NWB, one trial a trace."""
    import xarray as xr

    from feeler.tensors.writers import save_nwb

    shares = {"displacement": traces.displacement, "fitted": result.simulated}
    dataset = xr.Dataset(
        {name: (("trial", "time"), values, {"units": "1"}) for name, values in shares.items()},
        coords={
            "time": ("time", traces.time, {"units": "ms"}),
            "animal": ("trial", list(traces.names)),
        },
    )
    save_nwb(
        dataset,
        path,
        session_start=session_start,
        identifier=f"calibration {path.resolve().parent.name}",
        subject=", ".join(result.animals),
    )


def _plot(figure: Any, traces: Any, result: Any) -> None:
    ax = figure.subplots()
    for name, recorded, simulated in zip(
        traces.names, traces.displacement, result.simulated, strict=True
    ):
        outermost = traces.take(name.partition("@")[0])[1][-1]
        (line,) = ax.plot(traces.time, recorded / outermost[0], ".", ms=3, label=name)
        ax.plot(traces.time, simulated, color=line.get_color())
    ax.set(xlabel="time since release [ms]", ylabel="share of the first displacement")
    ax.legend()


def _plot_band(figure: Any, band: Any, start: Any) -> None:
    units = {"stiffness": "N·mm/rad", "damping": "N·mm·ms/rad"}
    for k, (ax, name) in enumerate(zip(figure.subplots(1, 2), units, strict=True)):
        ax.plot(band.place, band.middle[k])
        ax.fill_between(band.place, band.low[k], band.high[k], alpha=0.3)
        ax.plot(band.place, getattr(start, name), "k--", lw=0.8)
        ax.set(yscale="log", xlabel="place (0 base, 1 tip)", ylabel=f"{name} [{units[name]}]")


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _explain(profile: str, name: str) -> str:
    if profile in ("scale", "tilt"):
        return f"p1 multiplies the stiffness of {name}, p2 its damping" + ", both tilted" * (
            profile == "tilt"
        )
    return f"{profile} hinges on the segments of {name}"


def _fit_targets(said: SimpleNamespace, antenna: Any, profile: str) -> None:
    import numpy as np

    from feeler.calibration import (
        Problem,
        Protocol,
        fit,
        load_targets,
        make_hinges,
        make_starts,
    )

    goal = load_targets(said.targets)
    problem = Problem(
        hinges=make_hinges(profile, antenna),
        targets=goal,
        protocol=Protocol(engine=said.engine),
    )
    begin = make_starts(
        problem.hinges, said.starts, np.random.default_rng(said.seed), spread=said.spread
    )
    errors = [math.inf]
    with ProgressBar("antennas of this start") as bar:

        def watch(count: int, error: float) -> None:
            errors.append(error)
            bar(min(count, said.evaluations), said.evaluations)

        problem.watch = watch
        try:
            found = fit(
                problem,
                begin,
                method=said.method,
                max_evaluations=said.evaluations,
                checkpoint=said.checkpoint,
                progress=_say_start,
            )
        except KeyboardInterrupt:
            words = (
                f"every simulated antenna is in {said.checkpoint}; the same command goes on from"
                " there"
                if said.checkpoint
                else "nothing was kept; with --checkpoint FILE the same command would go on where"
                " it stopped"
            )
            best = f"{min(errors):.4g}"
            typer.echo(f"feeler: interrupted at a best error of {best}; {words}", err=True)
            raise typer.Exit(130) from None
    measured = dict(zip(found.measured.names, map(float, found.measured.values), strict=True))
    parameters = dict(zip(found.names, map(float, found.p), strict=True))
    lines = [
        f"targets '{goal.name}' ({goal.status}); {profile}, {said.method}, {said.starts} start(s)"
    ]
    for name, unit in zip(found.names, problem.hinges.units, strict=True):
        lines.append(f"{name} = {parameters[name]:.6g}{_unit(unit)}")
    for target, value in zip(goal.targets, found.measured.values, strict=True):
        lines.append(
            f"{target.name:14} {value:.5g}{_unit(target.unit)}, target {target.value:g}"
            f" [{target.tag}]"
        )
    if found.measured.overdamped:
        lines.append(
            "the fitted antenna is over-damped: it has no damped frequency (its entry is 0)"
        )
    lines.append(
        f"error {found.error:.4g}, median symmetric accuracy {found.symmetric_accuracy:.4g}"
    )
    plain = {"parameters": parameters, "measured": measured, "error": found.error}
    say(said.as_json, plain, lines)


def _say_start(done: int, total: int, minimum, best: float) -> None:
    """The end of one search."""
    typer.echo(
        f"start {done}/{total}: error {minimum.error:.4g} after {minimum.evaluations} antennas,"
        f" {minimum.seconds:.1f} s; best {best:.4g}",
        err=True,
    )
