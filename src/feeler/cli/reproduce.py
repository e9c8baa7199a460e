"""``feeler reproduce``: the whole paper in one command.

Examples:

  feeler reproduce

  feeler reproduce --scale paper --out paper-run

  feeler reproduce --antenna mine.toml --set stiffness=0.5
"""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

import feeler
from feeler.errors import MissingDependencyError, require_extra
from feeler.execute.workers import USUAL, prepare_workers

_PREPARED = (
    "paper.reproduce",
    "paper.fig2e",
    "feeler.physics.chain",
)
"""What every stage needs. More would keep all workers waiting for what only some of them use."""


def reproduce(
    scale: Annotated[
        str,
        typer.Option(
            help="published (every figure of the paper at its sample sizes), quick (a look),"
            " smoke (a test) or paper (also the network and the questions beyond the paper)"
        ),
    ] = "published",
    out: Annotated[
        Path, typer.Option(help="folder for the report, the figures and the cache")
    ] = Path("out"),
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = "cockroach",
    change: Annotated[
        list[str],
        typer.Option("--set", help="scale a quantity, as in stiffness=2 (repeatable)"),
    ] = [],  # noqa: B006
    engine: Annotated[
        str,
        typer.Option(
            help="simulator: chain-consistent (default), chain (MuJoCo's equations) or mujoco"
        ),
    ] = "chain-consistent",
    timestep: Annotated[float | None, typer.Option(help="integration step [ms]")] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="the same number gives the same results")
    ] = 0,
    workers: Annotated[
        int | None, typer.Option(help="processes side by side; default one per core")
    ] = None,
    log_json: Annotated[
        bool, typer.Option("--log-json", help="progress as lines of JSON on stderr")
    ] = False,
    open_: Annotated[
        bool, typer.Option("--open", help="show the report in the browser when it is there")
    ] = False,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="compute everything again, whatever the cache holds")
    ] = False,
    inputs: Annotated[
        Path | None,
        typer.Option(help="file of what the paper does not publish, like paper/inputs.toml"),
    ] = None,
) -> None:
    """Reproduce the paper in one report.

    From the mechanics up, with a verdict on every claim.
    """
    # Let this process and its workers import the reproduction, which is in the repository:
    # the one that feeler is imported from, or else the one that is the current folder
    for root in (Path(feeler.__file__).parents[2], Path.cwd()):
        if (root / "paper" / "statements.toml").is_file():
            break
    else:
        raise MissingDependencyError(
            "the reproduction of the paper is not installed with feeler: clone its repository and"
            " run make reproduce, or feeler reproduce, there."
        )
    if str(root) not in sys.path:
        sys.path.insert(0, str(root))
        others = os.environ.get("PYTHONPATH")
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(root), others)))
    for library in ("filelock", "pypdf"):
        require_extra(library, "all", "the reproduction of the paper")
    if workers != 1:
        prepare_workers([*USUAL, *_PREPARED])  # while this process imports what it needs itself
    from paper.command import run

    run(
        scale=scale,
        out=out,
        antenna=antenna,
        change=change,
        engine=engine,
        timestep=timestep,
        seed=seed,
        workers=workers,
        log_json=log_json,
        show=open_,
        fresh=fresh,
        inputs=inputs,
    )
