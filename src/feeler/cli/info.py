"""``feeler info``: what a file holds.

Examples:

  feeler info set.zarr

  feeler info tensor.nc antenna.toml

  feeler walkDLC.h5                                    a file alone asks the same
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.cli.options import Json, say_json
from feeler.errors import FeelerError, InvalidInput, escape
from feeler.sandbox import Limits

_NEXT = {
    "tensors": "feeler convert {0} NAME.nwb writes it in another format; feeler validate {0}",
    "model": "load_encoder, StreamDecoder.load or TouchNetwork.load take it, in Python",
    "antenna": "feeler touch --antenna {0} touches with it",
    "robot": "feeler robot classify RECORDING --antenna {0} takes it",
    "bench": "feeler robot calibrate {0} fits lines to it",
    "calibration": "feeler robot check RECORDING --calibration {0} takes it",
    "objects": "feeler robot classify RECORDING --objects {0} discriminates them",
    "design": "feeler design {0} takes it",
}
"""What to do with a file, by the kind of what is in it."""


def info(
    files: Annotated[
        list[Path],
        typer.Argument(help="a file of touches, an antenna, model, robot, recording or tracks"),
    ],
    max_gib: Annotated[float, typer.Option(help="largest content that is read [GiB]")] = 4.0,
    as_json: Json = False,
) -> None:
    """Print what files hold, executing nothing in them.

    Sizes, units, labels, configuration, versions, licence.
    """
    from feeler.cli.app import put_in_shell
    from feeler.tensors.formats import describe_file

    verbs = ["robot", "check"], ["tracks"]  # what readers say is in the options of these
    limits, also = Limits(max_bytes=int(max_gib * 2**30)), list_rooms()
    found, refused = {}, []
    for file in files:
        try:
            found[file] = describe_file(file, limits, also, _NEXT)
        except FeelerError as error:
            refused.append(str(error))
    if as_json:
        say_json([{"file": file, "says": lines} for file, lines in found.items()])
    for lines in [] if as_json else found.values():
        typer.echo(put_in_shell("\n".join(escape(line) for line in lines), *verbs))
    for words in refused:
        typer.echo(f"feeler: {escape(put_in_shell(words, *verbs), lines=True)}", err=True)
    if refused:
        raise typer.Exit(2)


def name_instead(path: str | Path, kind: str) -> FeelerError | None:
    """What a file is that holds nothing of this kind, and the command that takes it; None where it
    may be of the kind, but is at fault, or is unknown.
    """
    from feeler.tensors.formats import find_advice, find_formats, open_file

    if not Path(path).exists():
        return None
    name, likely = Path(path).name, set()
    try:
        likely = {form.kind for form in find_formats(path, list_rooms()).values()}
        form, content = open_file(path, None, list_rooms())
    except FeelerError as error:
        return error if "cannot" not in str(error) and kind not in likely else None
    if form.kind == kind or (form.kind == "table" and kind != "tensors"):
        return None
    wanted = {"tracks": "tracks", "recording": "recording of a robot"}.get(kind, kind)
    said = f"{name} holds no {wanted}. It is of another kind: {form.words}."
    table = {"table": "feeler info {0} says what the commands ask for"}
    advice = find_advice(form, content, name, _NEXT | table)
    return InvalidInput(f"{said} Next: {advice}." if advice else said)


def list_rooms() -> dict[str, Any]:
    """The formats that stand beside tensors' own: what designs, robots and trackers write, and
    tables that no verb reads as they are.
    """
    from feeler.calibration.measurements import CALIBRATION_FILES
    from feeler.design.plan import DESIGN_FILES
    from feeler.robot.recordings import ROBOT_FILES
    from feeler.spikes.recordings import SPIKE_FILES
    from feeler.tensors.formats import PLAIN_TABLES, Format
    from feeler.tracking.tracks import TRACK_FILES

    def find_page(path: Path) -> Path:
        return path.with_suffix(".html")

    # the files of numbers that a verb writes beside its page, by the page's name
    results = Format(
        words="the numbers of a page that feeler wrote",
        kind="table",
        detect=lambda path, start: (
            path.suffix in (".csv", ".json") and find_page(path).is_file()
        ),
        load=lambda path, limits, trusted: [f"next        open {find_page(path).name}"],
        tell=list,
    )
    tables = {**CALIBRATION_FILES, "results": results, **PLAIN_TABLES}
    return {**DESIGN_FILES, **SPIKE_FILES, **ROBOT_FILES, **TRACK_FILES, **tables}
