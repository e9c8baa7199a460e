"""Workers that share the machine have one thread each within BLAS and PyTorch."""

import os

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info


@pytest.mark.skipif("PYTEST_XDIST_WORKER" not in os.environ, reason="of workers, -n 2")
def test_a_worker_has_one_thread_within_its_libraries():
    """They were set too late: on a busy machine two threads took 4.7 s of processor time for a
    cricket's response, one takes 0.05 s; a network learned in 22.9 s, with one thread in 2.7 s.
    """
    scipy.linalg.solve(np.eye(2), np.ones(2))  # SciPy brings a BLAS of its own
    found = [blas["num_threads"] for blas in threadpool_info() if blas["user_api"] == "blas"]
    assert found and set(found) == {1}
    assert os.environ["OMP_NUM_THREADS"] == "1"  # PyTorch reads it, and takes seconds to load
