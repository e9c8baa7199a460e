"""A Dask client fits where any executor does."""

import pytest

from feeler.execute import run_batch

from . import _tasks

distributed = pytest.importorskip("distributed", reason="needs the extra `cluster`")


def test_a_dask_client_runs_a_batch():
    with distributed.Client(
        processes=False, n_workers=1, threads_per_worker=2, dashboard_address=None
    ) as client:
        outcomes = {
            o.index: o.value
            for o in run_batch(_tasks.double, enumerate(range(12)), executor=client)
        }
        assert outcomes == {i: 2 * i for i in range(12)}
        failed = next(iter(run_batch(_tasks.refuse, [(0, 7)], executor=client)))
        assert isinstance(failed.error, ValueError) and "no 7" in str(failed.error)
