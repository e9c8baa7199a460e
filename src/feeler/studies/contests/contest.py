"""The contest of policies: what an ideal observer knows by each deadline, and what the way there
costs.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr

from feeler.active.observer import Observer
from feeler.active.policies import parse_policy
from feeler.active.tasks import TouchTask
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.progress import show_progress
from feeler.provenance import Journal, compute_digest, make_key
from feeler.records import Ge, Gt, Len, Record, Unit
from feeler.studies.shipped import read_shipped
from feeler.validation import checked

_FIELDS = ("accuracy", "hits", "work")


class Contest(Record):
    """What is compared, and how much of it; :func:`load_contest` reads what was declared.

    Attributes
    ----------
    sets : int
        How often all touches are drawn anew.
    known : int
        Touches of a set.
    copies : int
        How often each is felt.
    noise : str
        As text, such as ``"common:0.03"``; see :func:`feeler.objects.parse_noise`.
    duration : float
        Of an episode [ms].
    period : float
        Between two decisions [ms].
    deadlines : tuple[float, ...]
        [ms]
    budgets : tuple[float, ...]
        [µJ]
    fixed : tuple[str, ...]
        Policies that steering is held against.
    ahead : tuple[str, ...]
        Policies that look ahead, on ``ahead_sets`` sets with ``ahead_copies`` copies.
    gain : float
        Points that steering must gain to count.
    confirm : dict[str, Any]
        Fresh sets for the policies that were chosen.
    places : dict[str, Any]
        Where to touch next.
    learning : dict[str, Any]
        The learned policy.
    wall : dict[str, Any]
        Wall following.
    """

    sets: Annotated[int, Ge(1)]
    known: Annotated[int, Ge(2)]
    copies: Annotated[int, Ge(1)]
    seed: int
    noise: str
    duration: Annotated[float, Gt(0), Unit("ms")]
    period: Annotated[float, Gt(0), Unit("ms")]
    deadlines: Annotated[tuple[float, ...], Len(1)]
    budgets: tuple[float, ...]
    fixed: tuple[str, ...]
    steered: tuple[str, ...]
    ahead: tuple[str, ...]
    ahead_sets: Annotated[int, Ge(1)]
    ahead_copies: Annotated[int, Ge(1)]
    gain: float
    confirm: dict[str, Any]
    places: dict[str, Any]
    learning: dict[str, Any]
    wall: dict[str, Any]

    def _check(self) -> None:
        if max(self.deadlines) > self.duration or any(d % self.period for d in self.deadlines):
            raise InvalidInput(
                f"deadlines must be multiples of {self.period:g} ms up to {self.duration:g} ms."
            )

    def make_task(self, antenna: Antenna, number: int) -> TouchTask:
        """Set ``number`` of touches; the same for all policies, and in place and size for all
        antennas.
        """
        return TouchTask(
            antenna,
            noise=self.noise,
            duration=self.duration,
            pool=self.known,
            seed=self.seed * 1000 + number,
        )

    def make_observer(self, antenna: Antenna, number: int) -> Observer:
        """Who knows set ``number`` of touches."""
        task = self.make_task(antenna, number)
        return Observer(task, period=self.period, random_state=number)

    @checked
    def run(
        self,
        antenna: Antenna,
        policies: Sequence[str] | None = None,
        *,
        journal: Path | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> xr.Dataset:
        """What an ideal observer knows that moves by each policy, and the work on its antenna.

        Parameters
        ----------
        policies
            As :func:`feeler.active.parse_policy` takes them; default: all that are declared.
        journal
            File to which each policy and set is written as it finishes, and from which they are
            taken where they are there.
        progress
            Called with (policies and sets done, in all); default: a bar after 5 s.

        Returns
        -------
        xarray.Dataset
            ``accuracy`` (the observer's own expectation, which is unbiased), ``hits`` (share named
            right) and ``work`` [µJ] by (policy, set, deadline); NaN where a policy that looks ahead
            was not run on a set.

        Raises
        ------
        InvalidInput
            No policy, or the journal of another contest.
        """
        listed = (*self.fixed, *self.steered, *self.ahead)
        names = [*dict.fromkeys(listed if policies is None else policies)]
        if not names:
            raise InvalidInput("there is no policy to compare; name at least one.")
        for name in names:
            parse_policy(name)  # refuses what is no policy before anything is run
        found = np.full((len(_FIELDS), len(names), self.sets, len(self.deadlines)), np.nan)
        jobs = [
            (number, k)
            for number, k in product(range(self.sets), range(len(names)))
            if names[k] not in self.ahead or number < self.ahead_sets
        ]
        with (
            Journal(journal, self._make_key(antenna), of="contest") as kept,
            show_progress(progress, "policies and sets") as advance,
        ):
            for done, (number, k) in enumerate(jobs, start=1):
                name, copies = names[k], self._count_copies(names[k])
                measure = partial(self._measure, antenna, name, number)
                found[:, k, number] = kept.get_or(
                    measure, name, number, copies, _describe_own(name)
                )
                advance(done, len(jobs))
        return xr.Dataset(
            {
                field: (("policy", "set", "deadline"), values)
                for field, values in zip(_FIELDS, found, strict=True)
            },
            {"policy": names, "deadline": list(self.deadlines)},
            {"antenna": antenna.name},
        )

    def _make_key(self, antenna: Antenna) -> str:
        """What all results of a journal follow from; names of results say the rest."""
        task = self.make_task(antenna, 0)
        shared = ("known", "seed", "duration", "period", "deadlines")
        made_with = {name: getattr(self, name) for name in shared}
        made_with |= {"antenna": antenna, "noise": str(task.noise)}
        return make_key(made_with)

    def _count_copies(self, name: str) -> int:
        return self.ahead_copies if name in self.ahead else self.copies

    def _measure(self, antenna: Antenna, name: str, number: int) -> list[np.ndarray]:
        """Accuracy, hits and work [µJ] at each deadline, of one policy on one set."""
        observer = self.make_observer(antenna, number)
        episodes = observer.run(parse_policy(name), self._count_copies(name))
        rows = [round(deadline / self.period) for deadline in self.deadlines]
        columns = (episodes.accuracy, episodes.hits, episodes.work.mean(axis=1))
        return [column[rows] for column in columns]


def _describe_own(policy: str) -> str:
    """What the code of a policy from outside says now: another text, another result."""
    name = policy.partition(":")[0]
    if name.endswith(".py"):
        return compute_digest(Path(name).read_text(encoding="utf-8"))[:16]
    return ""


def load_contest(**changes: Any) -> Contest:
    """The choices of declared.toml, less what ``changes`` replace."""
    return Contest(**read_shipped("contests", "declared.toml") | changes)
