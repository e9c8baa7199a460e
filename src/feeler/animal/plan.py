"""What there is of an animal, as one TOML file: films, tables, and what touches it."""

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Annotated

from feeler.errors import InvalidInput
from feeler.files import make_record, read_toml
from feeler.records import Ge, Gt, Len, Record, Unit
from feeler.validation import checked

ANIMAL_SCHEMA = "feeler.animal/1"
_FILES = ("files", "held_out")


class _Microscope(Record):
    """Segments along an antenna, and guesses that a fit corrects.

    Attributes
    ----------
    file : str
        A table, as :func:`feeler.calibration.load_microscope` reads it.
    modulus : float
        [MPa]
    density : float
        [g/mm³]
    damping_time : float
        Damping over stiffness [ms].
    """

    file: str
    modulus: Annotated[float, Gt(0), Unit("MPa")]
    density: Annotated[float, Gt(0), Unit("g/mm³")] = 1.1e-3
    damping_time: Annotated[float, Gt(0), Unit("ms")] = 1.0


class _Films(Record):
    """Films of antennae that are released or hit, by animal.

    Attributes
    ----------
    files : dict[str, str]
        Animal → film that is fitted.
    held_out : dict[str, str]
        Animal → film that is predicted.
    points : tuple[str, ...]
        Landmarks along the antenna, base to tip.
    at : float | None
        Where the antenna was held [mm from the base].
    speed : float
        Of an object that hits [m/s].
    scale : float | None
        Pixels per mm.
    video : dict[str, str]
        Animal → video of its film, to draw on.
    """

    files: dict[str, str] = field(default_factory=dict)
    held_out: dict[str, str] = field(default_factory=dict)
    points: tuple[str, ...] = ("base", "tip")
    frame_rate: float | None = None
    at: Annotated[float, Gt(0), Unit("mm")] | None = None
    speed: Annotated[float, Gt(0), Unit("m/s")] = 0.2
    scale: Annotated[float, Gt(0), Unit("px/mm")] | None = None
    max_gap: Annotated[int, Ge(0)] = 5
    min_likelihood: float | None = None
    individual: str | None = None
    video: dict[str, str] = field(default_factory=dict)

    def _check(self) -> None:
        if both := {*self.files.values()} & {*self.held_out.values()}:
            raise InvalidInput(
                f"{', '.join(sorted(both))} is in files and in held_out: a film is fitted or"
                " predicted, not both."
            )


class _Forces(Record):
    """Force–deflection tables, by animal; ``at`` [mm from the base] unless a column says it."""

    files: dict[str, str]
    at: Annotated[float, Gt(0), Unit("mm")] | None = None


class _Walks(Record):
    """Films of freely moving animals, and the names of their landmarks.

    Attributes
    ----------
    towards : tuple[str, str]
        Two landmarks that say where the antenna's base points.
    angle : float
        Of the antenna to that direction [degrees], positive to the right.
    """

    files: dict[str, str]
    frame_rate: float | None = None
    scale: Annotated[float, Gt(0), Unit("px/mm")] | None = None
    tips: tuple[str, str] = ("left_tip", "right_tip")
    head: str = "head"
    abdomen: str = "abdomen"
    base: str = ""
    towards: Annotated[tuple[str, ...], Len(2)] | None = None
    angle: Annotated[float, Unit("degrees"), Ge(-180)] = 0.0
    origin: str = "top-left"
    individual: str | None = None


class _Touched(Record):
    """What touches the antenna.

    Attributes
    ----------
    shape : str
        As on the command line: ``ball:radius=1``, ``outline:file=leaf.svg,width=3``,
        ``mesh:file=stone.stl,width=3``.
    landmark : str
        Landmark of the first walk at the object's middle; default: it comes at ``speed`` to
        ``location``.
    """

    shape: str
    location: Annotated[float, Gt(0)] = 0.6
    speed: Annotated[float, Gt(0), Unit("m/s")] = 0.1
    landmark: str = ""


class _WallPlan(Record):
    """A wall that approaches: angle of the antenna to the midline [degrees]; otherwise as
    ``feeler wall``.
    """

    angle: float = 35.0


class _SpikePlan(Record):
    """Recorded spikes: a table with a column ``time_s`` or ``time_ms``."""

    file: str


class AnimalPlan(Record):
    """What there is of an animal.

    Attributes
    ----------
    antenna : str
        A preset or an antenna's file, in the place of ``microscope``.
    folder : str
        What file names are relative to.
    """

    name: str = "animal"
    antenna: str = ""
    microscope: _Microscope | None = None
    force: _Forces | None = None
    releases: _Films | None = None
    impulses: _Films | None = None
    walks: _Walks | None = None
    object: _Touched | None = None
    wall: _WallPlan | None = None
    spikes: _SpikePlan | None = None
    folder: str = "."

    def find(self, file: str) -> Path:
        """The path of a file that the plan names."""
        path = Path(self.folder) / file
        if not path.exists():
            folder = Path(self.folder).resolve()
            raise InvalidInput(f"cannot read {file}: no such file in {folder}. Check the plan.")
        return path


@checked
def load_animal(path: str | Path) -> AnimalPlan:
    """The plan in a TOML file of the schema ``feeler.animal/1``; files may be a list, whose
    animals are then called as the files are.

    Raises
    ------
    InvalidInput
        Another file, a key that there is not, or a value of the wrong kind.
    """
    content = dict(read_toml(path))
    if content.pop("schema", None) != ANIMAL_SCHEMA:
        raise InvalidInput(
            f'{Path(path).name} must begin with schema = "{ANIMAL_SCHEMA}"; feeler animal --new'
            " FILE writes one to fill in."
        )
    for table in content.values():
        for key in _FILES if isinstance(table, Mapping) else ():
            if key in table:
                # Files by animal, also from a list or a single one.
                files = [table[key]] if isinstance(table[key], str) else table[key]
                if isinstance(files, list):
                    table[key] = {Path(str(one)).stem: one for one in files}
    return make_record(
        AnimalPlan, {**content, "folder": str(Path(path).parent)}, Path(path).name
    )
