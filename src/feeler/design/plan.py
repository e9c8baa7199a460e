"""Plans: one TOML file says what is to be told apart, which antennas may be tried, what they must
keep, and how to search.
"""

import os
from dataclasses import field
from pathlib import Path
from typing import Any

from feeler.antenna.antenna import Antenna
from feeler.antenna.file import load_antenna
from feeler.design.constraints import Constraints
from feeler.design.search import SEARCHES
from feeler.design.space import Space
from feeler.design.task import DesignTask
from feeler.disk.toml import make_record, read_toml
from feeler.errors import InvalidInput
from feeler.presets import PRESETS, make_preset
from feeler.records.checked import checked
from feeler.records.record import Record
from feeler.records.rules import show
from feeler.tensors.formats import Format

_NO_CONSTRAINTS = Constraints()
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
antenna = "exponential"     # where to begin, and what to beat: a preset or an antenna file

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
    name, space = str(content.pop("antenna", "exponential")), content.pop("space", {})
    if not isinstance(space, dict):
        raise InvalidInput(f"{path.name}: [space] must be a table, got {show(space)}.")
    antenna = make_preset(name) if name in PRESETS else load_antenna(path.parent / name)
    content = {"task": {}, **content, "space": {**space, "reference": antenna}}
    return make_record(DesignPlan, content, path.name)


def _describe(plan: DesignPlan) -> list[str]:
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
        tell=_describe,
    ),
}
