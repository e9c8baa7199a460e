"""``feeler antenna``: write an antenna as a TOML file: a preset, a table of what was measured under
the microscope, or another antenna in space.

Examples:

  feeler antenna mine.toml

  feeler antenna cricket.toml --preset cricket

  feeler antenna soft.toml --preset uniform --sensors all

  feeler antenna mine.toml --from segments.csv --modulus 300      columns length_um, diameter_um

  feeler antenna mine3d.toml --from mine.toml --planes 2          the same antenna in space

  feeler info mine.toml
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.cli.options import require_new
from feeler.errors import InvalidInput


def antenna(
    file: Annotated[Path, typer.Argument(help="TOML file to write")],
    preset: Annotated[
        str, typer.Option("--preset", "--profile", help="which antenna to start from")
    ] = "exponential",
    sensors: Annotated[
        str, typer.Option(help="of the cockroach: even, distal or all")
    ] = "even",
    source: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="table of segments (length_um, diameter_um, base to tip), or an antenna file",
        ),
    ] = None,
    modulus: Annotated[
        float | None, typer.Option(help="of a table: Young's modulus [MPa]; a fit corrects it")
    ] = None,
    density: Annotated[
        float | None, typer.Option(help="of a table [g/mm³], default 0.0011")
    ] = None,
    damping_time: Annotated[
        float | None, typer.Option(help="of a table: damping over stiffness [ms], default 1")
    ] = None,
    planes: Annotated[
        int, typer.Option(help="1, or 2: it bends in space, alike in both planes", min=1, max=2)
    ] = 1,
) -> None:
    """Write an antenna as an editable TOML file.

    With formulas, units and sources; give it to --antenna.
    """
    from dataclasses import replace

    from feeler.antenna.animals import PROFILE_NAMES, cockroach
    from feeler.antenna.files import save_antenna
    from feeler.presets import read_preset

    require_new(file)
    if source is not None:
        made = {"modulus": modulus, "density": density, "damping_time": damping_time}
        _convert(file, source, {k: v for k, v in made.items() if v is not None}, planes)
        return
    if planes != 1 or modulus is not None:
        raise InvalidInput(
            "--planes and --modulus are for an antenna that is read with --from."
        )
    found = read_preset(preset)
    if found.antenna.name in PROFILE_NAMES:
        found = replace(found, antenna=cockroach(found.antenna.name, sensors=sensors))
    elif sensors != "even":
        raise InvalidInput(
            f"--sensors is for the cockroach's profiles; {preset} has its own sensors."
        )
    save_antenna(found.antenna, file, found.sources)
    typer.echo(f"wrote {file}")


def _convert(file: Path, source: Path, made: dict[str, float], planes: int) -> None:
    """The antenna of a table, or of another file, in so many planes."""
    from feeler.antenna.files import Source, read_antenna_file, save_antenna
    from feeler.calibration import load_microscope

    if source.suffix == ".toml":
        if made:
            raise InvalidInput(
                f"{source} says how the antenna is made; leave --{min(made)} out."
            )
        found = read_antenna_file(source)
        if planes == 2 or not found.antenna.spatial:
            save_antenna(found.antenna.unflatten() if planes == 2 else found.antenna, file)
        else:
            save_antenna(found.antenna.flatten(), file)
        typer.echo(f"wrote {file}")
        return
    if "modulus" not in made:
        raise InvalidInput(
            f"{source.name} does not say how stiff the cuticle is: give a first guess, as in"
            " --modulus 1000 [MPa]. feeler calibrate corrects it by a release or a"
            " force–deflection curve."
        )
    usual: dict[str, float] = {"density": 1.1e-3, "damping_time": 1.0}
    told: dict[str, Any] = {**usual, **made}
    beam = load_microscope(source, planes=planes, name=file.stem, **told)
    words = f"{source.name}; modulus {told['modulus']:g} MPa"
    note = (
        f"{words}, density {told['density']:g} g/mm³, damping time {told['damping_time']:g} ms"
    )
    sources = {name: Source(note=source.name) for name in ("segment_length", "radius")}
    sources |= {
        name: Source(note=note, tag="C") for name in ("stiffness", "damping", "segment_mass")
    }
    save_antenna(beam, file, sources)
    assumed = [
        f"{name.replace('_', ' ')} {value:g}"
        for name, value in usual.items()
        if name not in made
    ]
    typer.echo(
        f"{beam.n_segments} segments, {beam.length:.4g} mm, diameter {2e3 * beam.radius[0]:.4g} to"
        f" {2e3 * beam.radius[-1]:.4g} µm, {1e3 * beam.segment_mass.sum():.4g} mg"
        + (f"; assumed: {', '.join(assumed)} [g/mm³, ms]" if assumed else "")
    )
    typer.echo(f"wrote {file}")
