"""``feeler compare``: antennas side by side on the same touches."""

import tempfile
from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """Examples:

  feeler compare exponential constant

  feeler compare exponential mine.toml --out mine.html --scale quick
"""


def compare(
    antennas: Annotated[list[str], typer.Argument(help="presets or antenna files (TOML), at least two")],
    out: Annotated[Path, typer.Option(help="page to write")] = Path("out/compare.html"),
    scale: Annotated[str, typer.Option(help="smoke, quick or paper")] = "quick",
    seed: Annotated[int, typer.Option(min=0, help="seed of noise and encoder")] = 0,
) -> None:
    """Dispersion, entropy and accuracy against noise of several antennas, on one page."""
    from feeler.cli.choose import choose_antenna
    from feeler.comparison import compare_antennas, write_comparison
    from feeler.errors import InvalidInput
    from feeler.experiment.touch import touch
    from feeler.physics.engine import DEFAULT_ENGINE, get_engine
    from feeler.provenance import list_versions
    from feeler.scale import SCALES
    from feeler.stimulus.ninety import SPEEDS, trials

    effort = SCALES[scale]
    if len(set(antennas)) < 2:
        raise InvalidInput(
            "give at least two different antennas to compare, as in: feeler compare exponential constant."
        )
    chosen = {Path(name).stem if name.endswith(".toml") else name: choose_antenna(name) for name in antennas}
    if len(chosen) < len(set(antennas)):
        raise InvalidInput(f"two antennas have the same name ({', '.join(antennas)}); rename one of the files.")
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=out.parent):
        pass  # refused now, before anything is simulated, where nothing can be written
    touches = trials((SPEEDS["slow"],))
    tensors = {}
    for name, antenna in chosen.items():
        tensors[name] = touch(antenna, touches, seed=seed)
        typer.echo(f"{name}: touched {len(touches)} times")
    encoder = effort.make_encoder(random_state=seed)
    data = compare_antennas(tensors, encoder, plan=effort.plan, random_state=seed, report=typer.echo)
    for title, *cells in data.list_rows():
        typer.echo(f"{title:52}" + "".join(f"{cell:>28}" for cell in cells))
    conditions = (
        f"Scale {scale}, seed {seed}, engine {DEFAULT_ENGINE}, timestep {get_engine(DEFAULT_ENGINE).timestep:g} ms, "
        f"{len(touches)} touches at "
        f"{SPEEDS['slow']:g} m/s. " + ", ".join(f"{name} {version}" for name, version in list_versions().items())
    )
    typer.echo(f"page: {write_comparison(data, out, conditions)}")


def register(app: typer.Typer) -> None:
    """Add ``compare`` to the command line."""
    app.command("compare", epilog=EXAMPLES)(compare)
