"""``feeler compare``: antennas side by side on the same touches.

Examples:

  feeler compare exponential uniform

  feeler compare cricket mine.toml --objects objects.toml --speed 0.3 --out mine.html --scale quick

  feeler compare exponential cricket --scale smoke --classifier svm --json
"""

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.options import Json, describe_timesteps, say
from feeler.errors import InvalidInput


def compare(
    antennas: Annotated[
        list[str], typer.Argument(help="presets or antenna files (TOML), at least two")
    ],
    out: Annotated[Path, typer.Option(help="page to write")] = Path("out/compare.html"),
    scale: Annotated[str, typer.Option(help="smoke, quick or paper")] = "quick",
    seed: Annotated[int, typer.Option(min=0, help="seed of noise and encoder")] = 0,
    objects: Annotated[
        Path | None,
        typer.Option(help="TOML with a table [[object]] each; default: the paper's six"),
    ] = None,
    speed: Annotated[float, typer.Option(help="speed of the touches [m/s]")] = 0.06,
    classifier: Annotated[
        str,
        typer.Option(
            "--classifier",
            "--reader",  # its name before 0.4
            help="classifier of the touches, or mine.py:make, a function that gives one;"
            " an unknown name lists all",
        ),
    ] = "lda",
    as_json: Json = False,
) -> None:
    """Compare antennas: dispersion, entropy, accuracy.

    Dispersion, entropy and accuracy against noise of several antennas, on one page.
    """
    from feeler.cli.choose import name_antennas, name_classifier
    from feeler.comparison import EFFORTS, compare_antennas, touch_whole, write_comparison
    from feeler.objects import load_objects
    from feeler.objects.trials import trials
    from feeler.physics.engine import DEFAULT_ENGINE
    from feeler.provenance import describe_versions

    effort = EFFORTS[scale]
    name_classifier(classifier)  # refused before anything is simulated
    if len(set(antennas)) < 2:
        raise InvalidInput(
            "give at least two different antennas to compare, as in: feeler compare exponential"
            " uniform."
        )
    chosen = name_antennas(antennas)
    if len(chosen) < len(set(antennas)):
        raise InvalidInput(
            f"two antennas have the same name ({', '.join(antennas)}); rename one of the files."
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=out.parent):
        pass  # refused now, before anything is simulated, where nothing can be written
    touches = trials((speed,), features=None if objects is None else load_objects(objects))
    tensors, ends = {}, {}
    for name, antenna in chosen.items():
        tensors[name], ends[name] = touch_whole(antenna, touches, seed=seed)
        words = (
            f"{name}: touched {len(touches)} times; the last lets go after {ends[name]:.0f} ms"
        )
        typer.echo(words, err=as_json)
    encoder = effort.make_encoder(random_state=seed)
    data = compare_antennas(
        tensors,
        encoder,
        plan=effort.plan,
        classifier=classifier,
        random_state=seed,
        report=lambda line: typer.echo(line, err=as_json),
    )
    rows = [("", *data.names), *data.list_rows()]
    ratios = ", ".join(f"{100 * ratio:g}" for ratio in effort.plan.ratios)
    conditions = (
        f"Scale {scale}, seed {seed}, engine {DEFAULT_ENGINE}, {describe_timesteps(chosen)},"
        f" {len(touches)} touches at {speed:g} m/s."
        " Complete touches, equally many samples of each antenna until its last touch lets go: "
        + ", ".join(f"{name} {end:.0f} ms" for name, end in ends.items())
        + f". Classified by {classifier}. Accuracies are means over noise of {ratios} %: of each"
        " touch's own signal (relative), or of the greatest signal of all antennae (common)."
        f" {describe_versions()}"
    )
    page = write_comparison(data, out, conditions)
    lines = [f"{row[0]:52}" + "".join(f"  {cell:>27}" for cell in row[1:]) for row in rows]
    say(as_json, {**data.to_plain(), "page": page}, [*lines, f"page: {page}"])
