"""How many trials are run: threads, processes or any executor with ``submit``, behind one small interface."""

from feeler.execute.batch import Executor, Outcome, run_batch
from feeler.execute.groups import run_groups
from feeler.execute.processes import CRASHES, OutOfMemory, ProcessExecutor, WorkerCrashed
from feeler.execute.threads import ThreadExecutor

__all__ = [
    "CRASHES",
    "Executor",
    "OutOfMemory",
    "Outcome",
    "ProcessExecutor",
    "ThreadExecutor",
    "WorkerCrashed",
    "run_batch",
    "run_groups",
]
