"""Plans from TOML, fabrication tolerances, and a plan carried out."""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from feeler.antenna.files import Source, load_antenna, save_antenna
from feeler.antenna.segments import Antenna, require_plane
from feeler.design.scoring import DesignTask, Score, score
from feeler.design.search import (
    SEARCHES,
    Constraints,
    DesignProblem,
    Optimum,
    Space,
    optimise,
)
from feeler.errors import InvalidInput, require_extra
from feeler.files import (
    ensure_folder,
    make_record,
    parse_json,
    read_bytes,
    read_toml,
    write_text,
)
from feeler.presets import PRESETS, make_preset
from feeler.provenance import compute_digest
from feeler.records import Gt, Record, Shown
from feeler.renamed import rename_antenna
from feeler.robot.description import (
    Flexures,
    RobotFile,
    is_robot_file,
    load_robot,
)
from feeler.tensors.formats import Format
from feeler.validation import Count, Seed, checked, show

# Making: a design as flexure hinges that can be cut, and what is lost when they are cut a
# little wrong.

WIDEST = 20.0  # mm [C]; the device is 16 mm wide [P]
_NO_CONSTRAINTS = Constraints()


@checked
def make_strips(antenna: Antenna, constraints: Constraints = _NO_CONSTRAINTS) -> Flexures:
    """Widths and sheet thicknesses of flexures as stiff as the antenna's hinges: w = 12 k ℓ / (p1 E
    t³), with ``hinge_length`` ℓ, ``stiffness_factor`` p1, ``modulus`` E and ``sheets`` t of the
    constraints.

    Each hinge takes the thickest sheet of which a strip within ``width`` (default: from ℓ to 20 mm)
    is soft enough; where there is none, the sheet whose strip is nearest to that.
    """
    require_plane(antenna, "cutting flexures from sheets")
    length, modulus = constraints.hinge_length, constraints.modulus
    low, high = constraints.width or (length, WIDEST)
    stocks = np.array(sorted(constraints.sheets))
    strip = constraints.stiffness_factor * modulus * stocks**3
    widths = 12 * antenna.stiffness[:, None] * length / strip
    fits = (widths >= low) & (widths <= high)
    chosen = np.where(
        fits.any(axis=1),
        fits.shape[1] - 1 - fits[:, ::-1].argmax(axis=1),
        np.abs(np.log(widths / np.sqrt(low * high))).argmin(axis=1),  # nearest to cut
    )
    hinges = np.arange(antenna.n_segments)
    return Flexures(
        width=widths[hinges, chosen],
        thickness=stocks[chosen],
        length=np.array(length),
        modulus=np.array(modulus),
    )


@checked
def measure_tolerance(
    antenna: Antenna,
    task: DesignTask,
    purpose: str = "test",
    *,
    share: Annotated[float, Gt(0)] = 0.05,
    copies: Count = 6,
    seed: Seed = 0,
    **options: Any,
) -> list[Score]:
    """Scores of copies whose hinges were made wrong: width and thickness each off by up to ±
    ``share``, hinge by hinge.

    Stiffness goes with width and the cube of thickness, and damping with stiffness.
    """
    require_plane(antenna, "the tolerance of flexures")
    rng, found = np.random.default_rng(seed), []
    for _ in range(copies):
        width, thickness = 1 + share * rng.uniform(-1, 1, (2, antenna.n_segments))
        factor = width * thickness**3
        made = antenna.replace(
            stiffness=antenna.stiffness * factor, damping=antenna.damping * factor
        )
        found.append(score(made, task, purpose, **options))
    return found


# Plans: one TOML file says what is to be discriminated, which antennas may be tried, what they
# must keep, and how to search.

_SEARCH = {
    "method": str,
    "evaluations": int,
    "starts": int,
    "far": bool,
    "seed": int,
    "aim": str,
}
_SCHEMA = "feeler.design/1"
TEMPLATE = """\
# Which antenna should I build? Try it: feeler design {file} --out out/design
schema = "feeler.design/1"
antenna = "exponential"     # where to begin, and what to beat: a preset, an antenna file or a
                            # robot file

[task]
objects = [
  "ball:radius=1.5",
  "ball:radius=3",
  "box:half_width=1.5,half_height=1.5",
  "triangle:half_width=1.5,half_height=1.5",
]
locations = [0.5, 0.7, 0.9] # shares of the length; object × location is what must be told
speeds = [0.3]              # m/s
deadline = 100              # ms since contact
noise = "relative:1"        # white; sd as a share of each tensor's peak; or "common:0.03", in rad
train = 4                   # touches of each class to learn from, each within the nuisances,
test = 3                    # and others to be asked about
[task.nuisances]
location = 0.015            # ± share of the length
size = 0.05                 # ± share
approach = 4                # ± degrees
friction = [0.6, 1.0]
[task.seeds]                # of what the search sees, what chooses among its ends, and what is
                            # looked at once
optimiser = 1
test = 2
final = 3

[space]                     # factors on the antenna's profiles: splines of their logarithms
stiffness = 5               # knots: 0 leave it, 1 scales it, 2 the exponential family, …
damping = 3
span = 30                   # greatest factor at a knot, either way

[constraints]               # without them a floppy, ringing tip wins: see the guide
damping_share = 1.0         # each of the first six modes damped at least as the antenna above
softest = 0.2               # no hinge softer than this share of its softest
peak_angle = 0.2            # rad
# stiffest = 5              # no hinge stiffer than this share of its stiffest
# mass = 500                # mg, at most
# width = [3, 12]           # mm: flexures that can be cut
# sheets = [0.025, 0.05, 0.075] # mm: of these sheets

[search]
method = "cma"
evaluations = 100           # antennas simulated from each start
starts = 2                  # the first is the antenna above
seed = 0
"""


class DesignPlan(Record):
    """What a design file holds.

    Attributes
    ----------
    search : dict[str, Any]
        Method, evaluations, starts, far, seed, aim: as for :func:`feeler.design.optimise`.
    """

    task: DesignTask
    space: Space
    constraints: Constraints = _NO_CONSTRAINTS
    search: dict[str, Any] = field(default_factory=dict)

    def _check(self) -> None:
        for key, value in self.search.items():
            if type(value) is not _SEARCH.get(key):
                words = f"must be {_SEARCH[key].__name__}" if key in _SEARCH else "is not known"
                raise InvalidInput(f"[search] {key} {words}, got {value!r}.")
        SEARCHES[self.search.get("method", "cma")]

    @property
    def reference(self) -> Antenna:
        """Where the search begins, and what is to be beaten."""
        return self.space.reference


@checked
def load_plan(path: str | os.PathLike) -> DesignPlan:
    """The plan in a TOML file, as ``feeler design --new`` writes one.

    Raises
    ------
    InvalidInput
        Not TOML of this schema, an unknown key, or a value that cannot be used; the message names
        the table.
    """
    path = Path(path)
    content = read_toml(path, schema=_SCHEMA)
    name, space = (
        rename_antenna(str(content.pop("antenna", "exponential"))),
        content.pop("space", {}),
    )
    if not isinstance(space, dict):
        raise InvalidInput(f"{path.name}: [space] must be a table, got {show(space)}.")
    if name not in PRESETS and is_robot_file(path.parent / name):
        robot = load_robot(path.parent / name)
        antenna = robot.antenna
        given = content.get("constraints", {})
        if isinstance(given, dict):
            content["constraints"] = {**_describe_flexures(robot), **given}
    else:
        antenna = make_preset(name) if name in PRESETS else load_antenna(path.parent / name)
    content = {"task": {}, **content, "space": {**space, "reference": antenna}}
    return make_record(DesignPlan, content, path.name)


def _describe_flexures(robot: RobotFile) -> dict[str, float]:
    """What the constraint ``width`` needs of a robot whose flexures differ in width alone."""
    modulus, length = (np.unique(v) for v in (robot.hinges.modulus, robot.hinges.length))
    found = {"stiffness_factor": robot.factors.stiffness}
    found |= {"modulus": float(modulus[0])} if modulus.size == 1 else {}
    return found | ({"hinge_length": float(length[0])} if length.size == 1 else {})


def _describe_plan(plan: DesignPlan) -> list[str]:
    task = plan.task
    return [
        f"objects     {', '.join(item.name for item in task.objects)}",
        f"locations   {', '.join(f'{place:g}' for place in task.locations)}",
        f"speeds      {', '.join(f'{speed:g}' for speed in task.speeds)} m/s",
        f"deadline    {task.deadline} ms",
        f"noise       {task.noise}",
        f"begins at   {plan.reference.name}",
    ]


DESIGN_FILES = {
    "design": Format(
        words="design (TOML)",
        kind="design",
        detect=lambda path, start: b"feeler.design/" in start,
        load=lambda path, limits, trusted: load_plan(path),
        tell=_describe_plan,
    ),
}


# A plan carried out: searched, judged on tests, the best looked at once on the final draws, all
# kept in one folder.

JOURNAL, _FINALS = "journal.jsonl", "finals.json"
_MAX_BYTES = 2**20  # [C]


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class DesignOutcome(Shown):
    """What a plan came to.

    Attributes
    ----------
    ends : tuple[Optimum, ...]
        Where each start ended, the best on the test draws first.
    tests : tuple[Score, ...]
        Their scores on the test draws.
    final : Score
        The best one's on the final draws.
    looks : int
        How many designs have been judged on these final draws, this one included: 1 is an honest
        test.
    """

    DRAWN = "draw_optimum"

    plan: DesignPlan
    ends: tuple[Optimum, ...]
    tests: tuple[Score, ...]
    reference_test: Score
    final: Score
    reference_final: Score
    looks: int

    @property
    def best(self) -> Antenna:
        """The antenna to build."""
        return self.ends[0].design.antenna

    @property
    def task(self) -> DesignTask:
        """What was to be discriminated."""
        return self.plan.task

    def compare(self, purpose: str = "final") -> tuple[float, float]:
        """Share of the reference's errors that the best one avoids, and its standard error over
        touches met by both.
        """
        mine, other = (
            (self.final, self.reference_final)
            if purpose == "final"
            else (self.tests[0], self.reference_test)
        )
        if other.errors == 0:
            return float("nan"), float("nan")
        touches = (other.wrong - mine.wrong).mean(axis=(0, 1))  # (touch,)
        error = touches.std(ddof=1) / np.sqrt(touches.size) if touches.size > 1 else np.nan
        return float(touches.mean() / other.errors), float(error / other.errors)

    def to_plain(self) -> dict[str, Any]:
        """As JSON: scores, and what each start came to."""
        return {
            "looks": self.looks,
            "fewer_errors": self.compare(),
            "final": _describe(self.final),
            "reference_final": _describe(self.reference_final),
            "reference_test": _describe(self.reference_test),
            "ends": [
                {
                    "x": end.best.x.tolist(),
                    "counts": end.counts,
                    "seconds": end.seconds,
                }
                | {
                    "history": end.history,
                    "optimiser_bits": end.best.bits,
                    "test": _describe(test),
                }
                for end, test in zip(self.ends, self.tests, strict=True)
            ],
            "names": self.plan.space.names,
        }


@checked
def run_plan(
    plan: DesignPlan,
    out: str | os.PathLike,
    *,
    watch: Callable[[DesignProblem], None] | None = None,
    **options: Any,
) -> DesignOutcome:
    """Search as the plan says, choose among the ends by the test draws, judge the choice on the
    final ones.

    The folder receives the journal (the same call goes on from it), ``antenna.toml`` and
    ``design.json``.

    Raises
    ------
    InvalidInput
        As :func:`feeler.design.optimise`, which looks at the task before minutes are spent.
    MissingDependencyError
        The extra ``design`` is not installed.
    """

    require_extra("filelock", "design", "a design's journal")
    out = Path(out)
    ensure_folder(out)
    asked = {"journal": out / JOURNAL, "watch": watch, **plan.search}
    ends = optimise(plan.task, plan.space, plan.constraints, **asked, **options)
    tests = [score(end.design.antenna, plan.task, "test", **options) for end in ends]
    order = sorted(range(len(ends)), key=lambda k: -tests[k].bits)
    best = ends[order[0]].design.antenna
    found = DesignOutcome(
        plan=plan,
        ends=tuple(ends[k] for k in order),
        tests=tuple(tests[k] for k in order),
        reference_test=score(plan.reference, plan.task, "test", **options),
        final=score(best, plan.task, "final", **options),
        reference_final=score(plan.reference, plan.task, "final", **options),
        looks=_count_looks(out / _FINALS, plan.task, best),
    )
    _keep(found, out)
    return found


def _count_looks(path: Path, task: DesignTask, antenna: Antenna) -> int:
    """Note that this antenna was judged on the final draws of this seed; how many have been."""
    damaged = InvalidInput(
        f"{path} is damaged; remove it, and take another final seed in the task."
    )
    from filelock import FileLock

    with FileLock(path.with_name(f".{path.name}.lock")):  # another search in the same folder
        try:
            known = parse_json(read_bytes(path, _MAX_BYTES), str(path)) if path.exists() else {}
        except InvalidInput as error:
            raise damaged from error
        if not all(isinstance(names, list) for names in known.values()):
            raise damaged  # somebody else's file, perhaps
        seen = known.setdefault(str(dict(task.seeds)["final"]), [])
        name = compute_digest(antenna)[:16]
        if name not in seen:
            seen.append(name)
        write_text(path, json.dumps(known))
    return len(seen)


def _keep(found: DesignOutcome, out: Path) -> None:
    note = (
        f"designed: {found.final.bits:.4g} bits on final draws, the reference"
        f" {found.reference_final.bits:.4g}"
    )
    sources = {name: Source(tag="C", note=note) for name in ("stiffness", "damping")}
    save_antenna(found.best, out / "antenna.toml", sources)
    write_text(out / "design.json", json.dumps(found.to_plain(), indent=1, sort_keys=True))


def _describe(one: Score) -> dict[str, Any]:
    names = ("bits", "bits_error", "errors", "errors_error", "peak")
    return {name: getattr(one, name) for name in names}
