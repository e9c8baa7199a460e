"""``feeler calibrate``: find the mechanics that fit an animal, from targets or from recorded
traces.

Examples:

  feeler calibrate --profile exponential --starts 4 --checkpoint fit.jsonl

  feeler calibrate --data synthetic_step --out out/calibration    (simulated example data that \
ship with feeler)

  feeler calibrate --data walkDLC.h5 --points base,tip --frame-rate 500 --antenna mine.toml --at 6

  feeler calibrate --data force.csv --at 8 --antenna mine.toml      columns deflection_um, force_uN

  feeler calibrate --data video.csv --frame-rate 1000 --antenna cricket --at 5 --out out/cricket
"""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import typer

from feeler.cli.options import EngineName, Json, say
from feeler.errors import FeelerError, InvalidInput
from feeler.progress import ProgressBar

_BAD = 0.05  # [C] of a measurement's largest value, beyond which the fit is not to be trusted
_LATE = 0.02  # [C] the same of a release that begins a frame early, beyond which that is asked


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
    profile: Annotated[
        str,
        typer.Option(
            help="for targets: exponential (default), linear, uniform, scale, tilt …; an unknown"
            " name lists all"
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
            help="with --data: where it was held or loaded [mm from the base]; default: a quarter"
            " of the length"
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
    as_json: Json = False,
) -> None:
    """Fit hinge stiffness and damping to measurements.

    Fit hinge stiffness and damping to targets, or to recorded free responses of your own
    animals.
    """
    said = SimpleNamespace(**locals())
    from feeler.cli.choose import choose_antenna

    chosen = choose_antenna(said.antenna)
    if said.data:
        _fit_data(said, chosen)
    else:
        _fit_targets(said, chosen, said.profile or "exponential")


def _load_releases(said: SimpleNamespace, files: list[str]) -> tuple[Any, list[Any]]:
    """Traces of the releases in these files, and the films that they are of."""
    from feeler.calibration import join_films, load_film, load_traces
    from feeler.cli.info import name_instead

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
        raise _name_landmarks(files[0]) or name_instead(files[0], "traces") or error from None


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


def _fit_data(said: SimpleNamespace, antenna: Any) -> None:
    """Releases and force–deflection curves in one fit of each animal."""
    from feeler.animal import save_fit
    from feeler.calibration import Measurements, Protocol, fit_measurements, load_forces
    from feeler.calibration.measurements import is_force_table

    if said.profile:
        raise InvalidInput(
            "--profile is for targets; with --data those factors on the antenna's hinges and masses"
            " are fitted that the measurements determine."
        )
    tables = [file for file in said.data if is_force_table(file)]
    others = [file for file in said.data if file not in tables]
    place = said.at if said.force_at is None else said.force_at
    curves = [curve for file in tables for curve in load_forces(file, at=place)]
    traces, films = _load_releases(said, others) if others else (None, [])
    at = 0.25 * antenna.length if said.at is None else said.at
    if not 0 < at < antenna.length:
        raise InvalidInput(
            f"--at must lie between the antenna's base and its tip at {antenna.length:.4g} mm, got"
            f" {at:g} mm."
        )
    protocol = Protocol(engine=said.engine, at=at, deflection=0.1 * at)
    aside = {film.name: film.match_protocol(antenna, protocol).deflection for film in films}
    names = dict.fromkeys(curve.name for curve in curves) if traces is None else traces.animals
    each = [
        Measurements(
            name=name,
            releases=() if traces is None else (traces.select(name),),
            forces=tuple(one for one in curves if traces is not None or one.name == name),
            deflection=aside.get(name),
        )
        for name in names
    ]
    with ProgressBar("animals") as progress:
        fit = fit_measurements(each, antenna, protocol=protocol, progress=progress)
    lines = [
        f"{len(each)} animal{'s' * (len(each) > 1)}, factors on {antenna.name}",
        *fit.describe(),
        *_say_modulus(said.antenna, fit),
        *(
            f"{name}: {left:.2g} of its largest value is left"
            + " (much: does it slip?)" * ("force" in name and left > _BAD)
            + " (is the first sample the release? If not: --release found)"
            * ("release" in name and left > _LATE and traces is not None and not traces.found)
            for name, left in fit.residual.items()
        ),
    ]
    if traces is not None:
        filled = int(traces.bridged.sum())
        lines += [f"{filled} missing samples are filled in and do not count"] * (filled > 0)
        held = aside.values() or [protocol.deflection]
        origin = "as in the film" if aside else "a choice"
        lines.append(
            f"simulated as held {', '.join(f'{one:.3g}' for one in held)} mm aside ({origin}),"
            f" {at:g} mm from the base"
        )
    if max(fit.residual.values()) > _BAD:
        lines.append(
            f"more than {_BAD:g} is left: this antenna does not move like the animal, and the"
            " intervals say nothing"
        )
    say(said.as_json, fit.to_plain() | {"held_mm": aside or protocol.deflection}, lines)
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


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


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
    say(
        said.as_json,
        {"parameters": parameters, "measured": measured, "error": found.error},
        lines,
    )


def _say_start(done: int, total: int, minimum, best: float) -> None:
    """The end of one search."""
    typer.echo(
        f"start {done}/{total}: error {minimum.error:.4g} after {minimum.evaluations} antennas,"
        f" {minimum.seconds:.1f} s; best {best:.4g}",
        err=True,
    )
