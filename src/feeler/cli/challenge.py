"""``feeler challenge``: a public task: make its touches, score a method, score the baselines.

Examples:

  feeler challenge make touches.zarr

  feeler challenge score touches.zarr mine.py:make --by "A. Name" --out results.csv

  feeler challenge baseline touches.zarr
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.cli.options import Commands, list_examples, report_interrupt

app = Commands(
    help="Enter a public task: families of unknown objects.",
    no_args_is_help=True,
)
Touches = Annotated[Path, typer.Argument(help="what `feeler challenge make` wrote (.zarr)")]
Noises = Annotated[
    list[str] | None,
    typer.Option(help="absolute, relative or weber, more than once; default: all three"),
]
Results = Annotated[
    Path | None, typer.Option(help="results file (CSV) that gets the rows; others' rows stay")
]
By = Annotated[str, typer.Option(help="whose method it is, for the results file")]


@app.command(name="make")
def make_touches(
    out: Annotated[Path, typer.Argument(help="store to write (.zarr)")] = Path("touches.zarr"),
    workers: Annotated[
        int | None, typer.Option(min=1, help="threads; default one per core")
    ] = None,
) -> None:
    """Simulate the task's touches, under a minute.

    Ctrl-C loses nothing: the same command goes on from what is there.
    """
    from feeler.challenge import N_TOUCHES, make
    from feeler.progress import ProgressBar

    with (
        report_interrupt(f"{out} keeps what was touched"),
        ProgressBar(f"{N_TOUCHES:,} touches") as progress,
    ):
        make(out, workers=workers, progress=progress)
    typer.echo(f"wrote {out}; score a method on it: feeler challenge score {out} mine.py:make")


@app.command()
def score(
    touches: Touches,
    methods: Annotated[
        list[str],
        typer.Argument(
            help="mine.py:make, a function that gives something with fit and predict, or a"
            " classifier's name, such as lda"
        ),
    ],
    noise: Noises = None,
    out: Results = None,
    by: By = "",
) -> None:
    """Score methods on objects that are new to them."""
    from feeler.cli.choose import name_classifier
    from feeler.decoding import CLASSIFIERS

    _score(
        touches, {text: CLASSIFIERS[name_classifier(text)] for text in methods}, noise, out, by
    )


@app.command()
def baseline(
    touches: Touches, noise: Noises = None, out: Results = None, by: By = "feeler"
) -> None:
    """Score the baselines and the ceiling of the task.

    The convolutional network takes minutes, and is left out where PyTorch is not installed.
    """
    from importlib.util import find_spec

    from feeler.challenge import BASELINES

    makers = dict(BASELINES)
    if find_spec("torch") is None:
        makers.pop("convolutional network")
        typer.echo("without the convolutional network: pip install 'feeler[cnn]'", err=True)
    _score(touches, makers, noise, out, by, known=True)


def _score(
    touches: Path,
    makers: dict[str, Callable[[], Any]],
    noises: list[str] | None,
    out: Path | None,
    by: str,
    known: bool = False,
) -> None:
    import feeler
    from feeler.challenge import NOISES, VERSION, Task, write_results

    task = Task(feeler.load(touches))
    typer.echo(
        f"version {VERSION} of the task, {len({*task.labels})} families, test objects unknown"
    )
    for noise in noises or NOISES:
        scores = {name: task.score(make, noise) for name, make in makers.items()}
        scores |= task.score_known(noise) if known else {}
        rows = [
            {"method": name, "by": by, "version": VERSION, **row}
            for name, row in scores.items()
        ]
        for row in rows:
            typer.echo(
                f"{noise:9} {row['method']:34} {row['accuracy']:6.1%}"
                f"  (95 % {row['low']:.1%} to {row['high']:.1%})"
            )
        if out is not None:
            write_results(out, rows)


app.info.epilog = list_examples(sys.modules[__name__])
