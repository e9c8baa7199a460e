"""Groups: items that are run together, until a crash tells that one of them must be run alone."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from feeler.execute.batch import Executor, run_batch
from feeler.execute.processes import CRASHES


def run_groups(
    function: Callable[[Any], Any],
    groups: Sequence[Sequence[int]],
    pick: Callable[[Sequence[int]], Any],
    *,
    executor: Executor | None = None,
) -> Iterator[tuple[Sequence[int], Any]]:
    """(group, ``function(pick(group))`` or the error that ended it), as groups finish.

    ``pick`` is called when a group is handed out, so that what it makes does not pile up. Items of
    a group that crashes its worker twice are run again one by one, so that only the guilty one is
    lost.
    """
    while groups:
        items = ((number, pick(group)) for number, group in enumerate(groups))
        alone: list[Sequence[int]] = []
        for done in run_batch(function, items, executor=executor):
            group = groups[done.index]
            if isinstance(done.error, CRASHES) and len(group) > 1:
                alone += [[index] for index in group]
            else:
                yield group, done.value if done.error is None else done.error
        groups = alone
