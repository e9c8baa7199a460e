"""What workers and threads start with."""

import os
import subprocess
import sys

from threadpoolctl import threadpool_info

from feeler.execute import ProcessExecutor
from feeler.execute.threads import hold_blas

from . import _tasks


def test_a_worker_has_what_was_imported_for_it_and_its_caller_has_not():
    code = (
        "import sys\nfrom feeler.execute.processes import USUAL, ProcessExecutor,"
        " prepare_workers\nfrom tests.execute import _tasks\nprepare_workers([*USUAL,"
        " 'colorsys'])\nwith ProcessExecutor(1) as executor:\n   "
        " print(executor.submit(_tasks.has_loaded, 'colorsys').result(), 'colorsys' in"
        " sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert (done.stdout.split(), done.stderr) == (["True", "False"], "")


def test_workers_are_processes_of_their_own_that_fork_no_further():
    with ProcessExecutor(2) as executor:
        found = [executor.submit(_tasks.name_process, None).result() for _ in range(2)]
    assert {method for _, method in found} == {"spawn"}
    assert os.getpid() not in {number for number, _ in found}


def test_every_blas_is_held_to_one_thread_and_let_go_again():
    before = [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]
    with hold_blas():
        held = [lib for lib in threadpool_info() if lib["user_api"] == "blas"]
        assert len(held) >= 2  # NumPy's and SciPy's
        assert {lib["num_threads"] for lib in held} == {1}
    after = [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]
    assert after[: len(before)] == before
