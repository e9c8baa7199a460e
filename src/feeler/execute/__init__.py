"""How many trials are run: threads, processes or any executor with ``submit``, behind one small
interface.
"""

from feeler.errors import OutOfMemory
from feeler.execute.batch import Executor, Outcome, run_batch, run_groups
from feeler.execute.workers import (
    ClusterExecutor,
    ProcessExecutor,
    ThreadExecutor,
    WorkerCrashed,
    open_cluster,
)

__all__ = [
    "ClusterExecutor",
    "Executor",
    "OutOfMemory",
    "Outcome",
    "ProcessExecutor",
    "ThreadExecutor",
    "WorkerCrashed",
    "open_cluster",
    "run_batch",
    "run_groups",
]


__dir__ = __all__.copy
