"""``feeler convert``: the same tensors in another format.

Examples:

  feeler convert set.zarr set.nc

  feeler convert set.zarr one.csv --variable curvature --trial 3

  feeler convert set.nc set.nwb --session-start 2026-01-31T10:00:00+01:00 --identifier bench-1

  feeler convert run.mcap:joint_states touch.csv            a ROS 2 recording's topic, as feeler \
robot check FILE names them

  feeler convert set.nc set.nwb --session-start 2026-01-31T10:00:00+01:00 --identifier bench-2 \
--subject c1
    --species "Periplaneta americana" --sex F --age P90D --experimenter "Doe, Jane" --institution \
"Insect lab"
"""

from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.options import require_new
from feeler.errors import InvalidInput
from feeler.sandbox import Limits


def convert(
    source: Annotated[
        Path, typer.Argument(help="store, Zarr, NetCDF, NWB, MATLAB or CSV file, or MCAP:TOPIC")
    ],
    target: Annotated[
        Path, typer.Argument(help="file to write: .zarr, .nc, .mat, .csv, .parquet or .nwb")
    ],
    variable: Annotated[str, typer.Option(help="variable of a CSV")] = "angle",
    trial: Annotated[int, typer.Option(help="trial of a CSV, from 0")] = 0,
    session_start: Annotated[
        str, typer.Option(help="start of an NWB session, ISO 8601 with time zone")
    ] = "",
    identifier: Annotated[str, typer.Option(help="unique name of an NWB file")] = "",
    subject: Annotated[
        str, typer.Option(help="id of an NWB file's animal; default: the antenna's name")
    ] = "",
    species: Annotated[str, typer.Option(help="Latin name of the animal, of an NWB file")] = "",
    sex: Annotated[str, typer.Option(help="M, F, U or O, of an NWB file")] = "U",
    age: Annotated[str, typer.Option(help="age such as P90D, of an NWB file")] = "",
    experimenter: Annotated[str, typer.Option(help="as in 'Doe, Jane', of an NWB file")] = "",
    institution: Annotated[
        str, typer.Option(help="where it was recorded, of an NWB file")
    ] = "",
    max_gib: Annotated[float, typer.Option(help="largest content that is read [GiB]")] = 4.0,
) -> None:
    """Write tensors in another file format.

    Write tensors in another format, with their configuration, units, versions, seeds and
    licence.
    """
    from feeler.cli.info import name_instead
    from feeler.tensors.bags import find_bag
    from feeler.tensors.formats import list_options, load, save

    require_new(target)
    if find_bag(source) is not None:
        # a robot's recording as CSV; tensors need its antenna, which this verb does not ask for
        from feeler.robot import load_recording, save_recording

        recording = load_recording(source, n_channels=None)
        if target.suffix.lower() != ".csv":
            raise InvalidInput(
                f"a recording becomes tensors with its antenna: feeler robot convert {source}"
                f" --antenna robot.toml --out {target}."
            )
        save_recording(recording, target, digits=9)
        typer.echo(
            f"wrote {target}: {recording.n_sensors} channels, {recording.time.size} samples"
        )
        return
    if not source.exists():  # before any option of the target is asked for
        raise InvalidInput(f"cannot read {source}: no such file. Check the path.")
    wanted = list_options(target.suffix.lower())
    given: dict[str, object] = {
        "variable": variable,
        "trial": trial,
        "identifier": identifier,
        "subject": subject,
        "species": species,
        "sex": sex,
        "age": age,
        "experimenter": experimenter,
        "institution": institution,
    }
    if session_start:
        given["session_start"] = session_start
    options = {name: value for name, value in given.items() if name in wanted}
    try:
        tensors = load(source, Limits(max_bytes=int(max_gib * 2**30)))
    except InvalidInput as error:
        raise name_instead(source, "tensors") or error from None
    save(tensors, target, **options)
    typer.echo(f"wrote {target}")
