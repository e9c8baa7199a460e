"""Imported first of all, and only, by the process that workers are forked from."""

import gc
import sys
from types import TracebackType

# it imports and forks: there is nothing to collect, and looking for it takes a tenth of the time
gc.disable()


def _say(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Print the traceback of a worker that could not begin; not where its pool has gone meanwhile,
    whose locks it looks for in vain. The executor sees that it ended.
    """
    end = trace
    while end is not None and end.tb_next is not None:
        end = end.tb_next
    place = "" if end is None else end.tb_frame.f_globals.get("__name__", "")
    if not (issubclass(kind, OSError | EOFError) and place.startswith("multiprocessing.")):
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _say
