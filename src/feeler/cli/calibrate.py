"""``feeler calibrate``: find the mechanics that fit an animal, from targets or from recorded traces."""

import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

BAD = 0.15  # [C] relative residual of a trace fit beyond which its interval is not to be trusted
EXAMPLES = """Examples:

  feeler calibrate --profile exponential --starts 4 --checkpoint fit.jsonl

  feeler calibrate --data trace.csv --by trace --out out/calibration

  feeler calibrate --data synthetic_step    (simulated example data that ship with feeler)
"""


def calibrate(
    data: Annotated[
        str, typer.Option(help="CSV of tip displacement: time_ms or time_s, then a column per animal")
    ] = "",
    by: Annotated[
        str, typer.Option(help="with --data: trace (every sample) or targets (frequency and damping)")
    ] = "trace",
    profile: Annotated[str, typer.Option(help="exponential, linear, constant or scale")] = "",
    targets: Annotated[str, typer.Option(help="name of shipped targets, or a TOML file")] = "cockroach",
    method: Annotated[str, typer.Option(help="least-squares, powell or nelder-mead")] = "least-squares",
    starts: Annotated[int, typer.Option(help="number of starts: the family's own, then perturbed ones", min=1)] = 1,
    spread: Annotated[float, typer.Option(help="sd of the perturbation, in logarithms", min=0)] = 0.7,
    seed: Annotated[int, typer.Option(min=0, help="seed of the starts")] = 0,
    evaluations: Annotated[int, typer.Option(help="antennas simulated per start, at most", min=2)] = 1500,
    checkpoint: Annotated[
        Path | None, typer.Option(help="file that keeps every simulated antenna; an interrupted fit goes on from it")
    ] = None,
    engine: Annotated[str, typer.Option(help="chain-consistent, chain or mujoco")] = "chain-consistent",
    out: Annotated[
        Path | None, typer.Option(help="with --data: folder for page (HTML), figure, numbers (JSON) and antenna.toml")
    ] = None,
) -> None:
    """Fit hinge stiffness and damping to targets, or to recorded free responses of your own animals."""
    if data:
        _fit_data(data, by, profile or "scale", engine, out)
    else:
        _fit_targets(targets, profile or "exponential", method, starts, spread, seed, evaluations, checkpoint, engine)


def _fit_data(data: str, by: str, profile: str, engine: str, out: Path | None) -> None:
    from feeler.calibration import Protocol, fit_traces, load_traces, make_hinges
    from feeler.presets import cockroach

    traces, antenna = load_traces(data), cockroach()
    hinges = make_hinges(profile, antenna)
    result = fit_traces(traces, antenna, by=by, hinges=hinges, protocol=Protocol(engine=engine))
    count = len(result.animals)
    typer.echo(f"{count} trace{'s' * (count > 1)} ({traces.source}), fitted by {by}: {_explain(profile)}")
    typer.echo(f"{'':20} {' '.join(f'{name:>11}' for name in result.names)}   residual")
    for name, p, residual in zip(result.animals, result.each, result.residual, strict=True):
        typer.echo(f"{name:20} {' '.join(f'{value:11.5g}' for value in p)}   {residual:.3g}")
    for name, unit, p, low, high in zip(result.names, hinges.units, result.p, result.low, result.high, strict=True):
        typer.echo(f"{name} = {p:.5g}{_unit(unit)}  (95 %: {low:.5g} to {high:.5g}; {result.interval})")
    if by == "trace" and result.residual.max() > BAD:
        typer.echo(
            f"a residual above {BAD:g} of the trace means that this antenna does not swing like the animal; "
            "its interval then says nothing",
            err=True,
        )
    if out is not None:
        _save(out, traces, hinges, result)


def _save(out: Path, traces: Any, hinges: Any, result: Any) -> None:
    """calibration.html, calibration.png, calibration.json and antenna.toml, the antenna of the mean parameters."""
    from feeler.antenna.file import save_antenna
    from feeler.report import Section, write_page
    from feeler.report.section import to_json

    out.mkdir(parents=True, exist_ok=True)
    antenna = hinges.build(result.p).replace(name=f"fitted to {traces.source} traces")
    save_antenna(antenna, out / "antenna.toml")
    section = Section(name="calibration", title="Traces and fits", folder=out, vector=False)
    caption = "Dots: the tip as recorded, as a share of its first displacement; lines: the fitted antenna."
    section.figure("calibration", caption, lambda figure: _plot(figure, traces, result), height=3.2)
    rows = zip(result.names, hinges.units, result.p, result.low, result.high, strict=True)
    section.table(["parameter", "unit", "value", "from", "to"], list(rows), f"95 % intervals: {result.interval}.")
    each = [[name, *p, r] for name, p, r in zip(result.animals, result.each, result.residual, strict=True)]
    section.table(["trace", *result.names, "residual"], each)
    write_page(
        out / "calibration.html", "Mechanics that fit", f"{hinges.name} hinges, {traces.source} traces.", section
    )
    (out / "calibration.json").write_text(json.dumps(to_json(vars(result)), indent=1) + "\n", encoding="utf-8")
    typer.echo(f"wrote {out}/calibration.html, calibration.png, calibration.json, antenna.toml", err=True)


def _plot(figure: Any, traces: Any, result: Any) -> None:
    ax = figure.subplots()
    for name, recorded, simulated in zip(traces.names, traces.displacement, result.simulated, strict=True):
        (line,) = ax.plot(traces.time, recorded / recorded[0], ".", ms=3, label=name)
        ax.plot(traces.time, simulated, color=line.get_color())
    ax.set(xlabel="time since release [ms]", ylabel="tip [share of the first displacement]")
    ax.legend()


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _explain(profile: str) -> str:
    if profile == "scale":
        return "p1 multiplies the cockroach's stiffness, p2 its damping"
    return f"{profile} hinges on the cockroach's segments"


def _fit_targets(targets, profile, method, starts, spread, seed, evaluations, checkpoint, engine) -> None:
    import numpy as np

    from feeler.calibration import Problem, Protocol, fit, load_targets, make_hinges, make_starts
    from feeler.presets import cockroach

    goal = load_targets(targets)
    problem = Problem(hinges=make_hinges(profile, cockroach()), targets=goal, protocol=Protocol(engine=engine))
    begin = make_starts(problem.hinges, starts, np.random.default_rng(seed), spread=spread)
    watch = problem.watch = _Watch()
    try:
        found = fit(
            problem, begin, method=method, max_evaluations=evaluations, checkpoint=checkpoint, progress=watch.end_start
        )
    except KeyboardInterrupt:
        watch.clear()
        _report_interrupt(watch.best, checkpoint)
        raise typer.Exit(130) from None
    typer.echo(f"targets '{goal.name}' ({goal.status}); {profile}, {method}, {starts} start(s)")
    for name, unit, value in zip(found.names, problem.hinges.units, found.p, strict=True):
        typer.echo(f"{name} = {value:.6g}{_unit(unit)}")
    for target, value in zip(goal.targets, found.measured.values, strict=True):
        typer.echo(f"{target.name:14} {value:.5g}{_unit(target.unit)}, target {target.value:g} [{target.tag}]")
    if found.measured.overdamped:
        typer.echo("the fitted antenna is over-damped: it has no damped frequency (its entry is 0)")
    typer.echo(f"error {found.error:.4g}, median symmetric accuracy {found.symmetric_accuracy:.4g}")


class _Watch:
    """The best error so far, on one line of a terminal; a line per finished start anywhere."""

    def __init__(self) -> None:
        self.best, self._live = math.inf, sys.stderr.isatty()

    def __call__(self, evaluations: int, best: float) -> None:
        self.best = min(self.best, best)
        if self._live:
            typer.echo(f"\r{evaluations} antennas, best error {self.best:.4g}   ", err=True, nl=False)

    def end_start(self, done: int, total: int, minimum, best: float) -> None:
        self.clear()
        typer.echo(
            f"start {done}/{total}: error {minimum.error:.4g} after {minimum.evaluations} antennas, "
            f"{minimum.seconds:.1f} s; best {best:.4g}",
            err=True,
        )

    def clear(self) -> None:
        """Leave the terminal's line empty."""
        if self._live:
            typer.echo("\r" + 50 * " " + "\r", err=True, nl=False)


def _report_interrupt(best: float, checkpoint: Path | None) -> None:
    kept = (
        f"every simulated antenna is in {checkpoint}; the same command goes on from there"
        if checkpoint
        else "nothing was kept; with --checkpoint FILE the same command would go on where it stopped"
    )
    typer.echo(f"feeler: interrupted at a best error of {best:.4g}; {kept}", err=True)


def register(app: typer.Typer) -> None:
    """Add ``calibrate`` to the command line."""
    app.command("calibrate", epilog=EXAMPLES)(calibrate)
