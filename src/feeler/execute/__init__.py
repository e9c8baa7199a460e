"""How many trials are run: threads, processes or any executor with ``submit``, behind one small interface."""

from feeler.execute.batch import Executor, Outcome, run_batch
from feeler.execute.processes import ProcessExecutor, WorkerCrashed
from feeler.execute.threads import ThreadExecutor

__all__ = ["Executor", "Outcome", "ProcessExecutor", "ThreadExecutor", "WorkerCrashed", "run_batch"]
