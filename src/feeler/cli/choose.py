"""Options that several verbs share: which antenna, single numbers set on the command line, and who
computes.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, suggest
from feeler.files import load_function
from feeler.presets import PRESETS, make_preset
from feeler.renamed import rename_antenna

_SETTABLE = ("stiffness", "damping", "mass", "length", "radius")


def choose_antenna(name: str) -> Antenna:
    """A preset by name, or an antenna file or robot file by path."""
    if (known := rename_antenna(name)) in PRESETS:
        return make_preset(known)
    if name.endswith(".toml") or Path(name).exists():
        from feeler.robot.description import is_robot_file, load_robot

        if is_robot_file(name):
            return load_robot(name).antenna
        from feeler.antenna.files import load_antenna

        return load_antenna(Path(name))
    raise InvalidInput(
        f"unknown antenna {name!r}; give a preset ({', '.join(PRESETS)}) or the path of a TOML"
        f" file.{suggest(name, PRESETS)}"
    )


def name_classifier(text: str) -> str:
    """The name of a classifier: of a known one, or of the function of a file, ``mine.py:make``,
    which gives anything with ``fit`` and ``predict`` and is known by this text from now on.
    """
    from feeler.decoding.classifiers import CLASSIFIERS, adopt

    file, _, name = text.partition(":")
    if file.endswith(".py") and text not in CLASSIFIERS:
        make = load_function(Path(file), name or "make", "a classifier")
        CLASSIFIERS.register(text, lambda: adopt(make(), text))
    CLASSIFIERS[text]
    return text


def choose_planar(name: str) -> Antenna:
    """As :func:`choose_antenna`; of an antenna in space its planar twin, which is said."""
    antenna = choose_antenna(name)
    if not antenna.spatial:
        return antenna
    typer.echo(f"{name}: its planar twin, since walls are met in the plane", err=True)
    return antenna.flatten()


def name_antennas(
    names: Sequence[str], choose: Callable[[str], Antenna] = choose_antenna
) -> dict[str, Antenna]:
    """The chosen antennas by what a page calls them: a file by its name without ending, but with it
    where something else has that name, and so a colour, already.
    """
    from feeler.objects.trials import SPEEDS, make_features

    taken = {*PRESETS, *SPEEDS, *(feature.kind for feature in make_features())}
    names = [rename_antenna(name) for name in names]
    short = {name: Path(name).stem for name in names}
    return {
        Path(name).name if short[name] in taken else short[name]: choose(name) for name in names
    }


def change_antenna(antenna: Antenna, changes: list[str]) -> Antenna:
    """The antenna with whole quantities scaled: ``stiffness=2`` doubles every hinge's stiffness.

    A name may carry a prefix (``cockroach.mass=1.2``); ``mass`` and ``length`` scale the segments.
    """
    fields = {"mass": "segment_mass", "length": "segment_length"}
    for change in changes:
        name, _, text = change.partition("=")
        quantity = name.strip().split(".")[-1]
        if quantity not in _SETTABLE:
            raise InvalidInput(
                f"--set cannot change {name!r}; valid: {', '.join(_SETTABLE)}, as in --set"
                " stiffness=2."
            )
        try:
            factor = float(text)
        except ValueError:
            raise InvalidInput(
                f"--set {change!r}: give a factor, as in --set {quantity}=1.5."
            ) from None
        field = fields.get(quantity, quantity)
        antenna = antenna.replace(
            **{field: getattr(antenna, field) * factor},
            name=f"{antenna.name} {quantity}×{factor:g}",
        )
    return antenna


@contextmanager
def choose_executor(
    workers: int | None, cluster: str | None, *, processes: bool = False
) -> Iterator[Any]:
    """Threads, processes, or a cluster's workers, for as long as they are needed."""
    from feeler.execute import ClusterExecutor, ProcessExecutor, ThreadExecutor, open_cluster
    from feeler.execute.workers import hush

    if cluster is not None and (processes or workers is not None):
        raise InvalidInput("give either --cluster, or --workers and --processes.")
    if cluster is None:
        with ProcessExecutor(workers) if processes else ThreadExecutor(workers) as executor:
            yield executor
        return
    hush()
    with open_cluster(cluster) as client:
        yield ClusterExecutor(client)
