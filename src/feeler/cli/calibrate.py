"""``feeler calibrate``: find the mechanics that fit an animal, from targets or from recorded traces."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

EXAMPLES = """Examples:

  feeler calibrate --profile exponential --starts 4 --checkpoint fit.json

  feeler calibrate --data trace.csv --by trace

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
    starts: Annotated[int, typer.Option(help="number of starts: the family's own, then perturbed ones")] = 1,
    spread: Annotated[float, typer.Option(help="sd of the perturbation, in logarithms")] = 0.7,
    seed: Annotated[int, typer.Option(help="seed of the starts")] = 0,
    evaluations: Annotated[int, typer.Option(help="antennas simulated per start, at most", min=2)] = 1500,
    checkpoint: Annotated[Path | None, typer.Option(help="file from which an interrupted fit goes on")] = None,
    engine: Annotated[str, typer.Option(help="chain-consistent, chain or mujoco")] = "chain-consistent",
) -> None:
    """Fit hinge stiffness and damping to targets, or to recorded free responses of your own animals."""
    if data:
        _fit_data(data, by, profile or "scale", engine)
    else:
        _fit_targets(targets, profile or "exponential", method, starts, spread, seed, evaluations, checkpoint, engine)


def _fit_data(data: str, by: str, profile: str, engine: str) -> None:
    from feeler.calibration import Protocol, fit_traces, load_traces, make_hinges
    from feeler.presets import cockroach

    traces, antenna = load_traces(data), cockroach()
    result = fit_traces(traces, antenna, by=by, hinges=make_hinges(profile, antenna), protocol=Protocol(engine=engine))
    typer.echo(f"{len(result.animals)} traces ({traces.source}), fitted by {by}")
    for name, p, residual in zip(result.animals, result.each, result.residual, strict=True):
        typer.echo(f"{name:20} {' '.join(f'{value:11.5g}' for value in p)}   residual {residual:.3g}")
    for name, p, low, high in zip(result.names, result.p, result.low, result.high, strict=True):
        typer.echo(f"{name} = {p:.5g}  (95 %: {low:.5g} to {high:.5g}; {result.interval})")


def _fit_targets(targets, profile, method, starts, spread, seed, evaluations, checkpoint, engine) -> None:
    from feeler.calibration import Problem, Protocol, fit, load_targets, make_hinges, make_starts
    from feeler.presets import cockroach

    goal = load_targets(targets)
    problem = Problem(hinges=make_hinges(profile, cockroach()), targets=goal, protocol=Protocol(engine=engine))
    begin = make_starts(problem.hinges, starts, np.random.default_rng(seed), spread=spread)

    def show(done: int, total: int, minimum, best: float) -> None:
        typer.echo(
            f"start {done}/{total}: error {minimum.error:.4g} after {minimum.evaluations} evaluations, "
            f"{minimum.seconds:.1f} s; best {best:.4g}",
            err=True,
        )

    found = fit(problem, begin, method=method, max_evaluations=evaluations, checkpoint=checkpoint, progress=show)
    typer.echo(f"targets '{goal.name}' ({goal.status}); {profile}, {method}, {starts} start(s)")
    for name, unit, value in zip(found.names, problem.hinges.units, found.p, strict=True):
        typer.echo(f"{name} = {value:.6g} {unit}")
    for target, value in zip(goal.targets, found.measured.values, strict=True):
        typer.echo(f"{target.name:14} {value:.5g} {target.unit}, target {target.value:g} [{target.tag}]")
    if found.measured.overdamped:
        typer.echo("the fitted antenna is over-damped: it has no damped frequency (its entry is 0)")
    typer.echo(f"error {found.error:.4g}, median symmetric accuracy {found.symmetric_accuracy:.4g}")


def register(app: typer.Typer) -> None:
    """Add ``calibrate`` to the command line."""
    app.command("calibrate", epilog=EXAMPLES)(calibrate)
