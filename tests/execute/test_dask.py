"""A Dask client fits where any executor does."""

from types import SimpleNamespace

import pytest

from feeler.errors import ModelValidityWarning
from feeler.execute import cluster, run_batch

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


class Deserted:
    """A client whose scheduler keeps tasks that nobody takes."""

    def nthreads(self):
        return {}

    def submit(self, *_, **__):
        return SimpleNamespace(key="one", add_done_callback=lambda call: None)


def test_a_cluster_without_workers_is_told_of_once(monkeypatch):
    monkeypatch.setattr(cluster, "_PATIENCE", 0.05)
    monkeypatch.setattr(cluster, "_GLANCE", 0.02)
    executor = cluster.ClusterExecutor(Deserted())
    with pytest.warns(
        ModelValidityWarning, match="has no workers. Start one, .* in the store"
    ) as told:
        executor.submit(abs, -1)
        executor._watch.join()
    assert len(told) == 1
