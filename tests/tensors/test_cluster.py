"""Real touches on a Dask cluster of two processes: shards written by workers, one of which is
killed; the same numbers.
"""

import os
import signal

import pytest
import xarray as xr
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput, StoreError
from feeler.execute import open_cluster
from feeler.experiments import tactile as job
from feeler.tensors.formats import load

from ._touches import run

pytestmark = pytest.mark.long

pytest.importorskip("distributed", reason="needs the extra `cluster`")


@pytest.fixture(scope="module")
def client():
    from distributed import LocalCluster

    options = {"threads_per_worker": 1, "dashboard_address": None}
    with (
        LocalCluster(n_workers=2, **options) as cluster,
        open_cluster(cluster.scheduler_address) as client,
    ):
        yield client


def test_a_killed_worker_costs_its_group_and_no_number_changes(client, tmp_path):
    killed, writers = [], set()

    def progress(done, total):
        if not killed:
            pids = client.run(os.getpid)
            writers.update(pids.values())
            killed.append(next(iter(pids.values())))
            os.kill(killed[0], signal.SIGKILL)

    stored = run(store=tmp_path / "a.zarr", executor=client, progress=progress)
    assert killed and os.getpid() not in writers
    xr.testing.assert_identical(stored, run())
    xr.testing.assert_identical(load(tmp_path / "a.zarr"), stored)


def test_shards_do_not_pass_the_scheduler(client, tmp_path):
    run(store=tmp_path / "a.zarr", executor=client)
    sent = client.run_on_scheduler(
        lambda dask_scheduler: sum(
            ts.nbytes for ts in dask_scheduler.tasks.values() if ts.nbytes > 0
        )
    )
    assert (
        sent < (tmp_path / "a.zarr" / "angle").stat().st_size + 200_000
    )  # records, not tensors


def test_workers_with_another_feeler_are_refused(tmp_path, monkeypatch):
    real = job._check_origin
    monkeypatch.setattr(job, "_check_origin", lambda physics, versions: real(99, versions))
    with pytest.raises(StoreError, match=r"a worker runs feeler .* \(wanted: .* physics 99\)"):
        run(store=tmp_path / "a.zarr")


def test_the_verb_takes_a_cluster(client, tmp_path):
    places = [option for k in range(9) for option in ("--location", str(0.5 + 0.01 * k))]
    command = [
        "touch",
        *places,
        "--duration",
        "8",
        "--store",
        str(tmp_path / "a.zarr"),
        "--cluster",
        client.scheduler.address,
    ]
    said = CliRunner().invoke(app, command).output
    assert "9 of 9 touches finished (a cluster of 2 workers with 2 threads)" in said


def test_no_cluster_there(monkeypatch):
    monkeypatch.setattr("feeler.execute.workers._PATIENCE", 0.2)
    with (
        pytest.raises(InvalidInput, match="no scheduler answers"),
        open_cluster("nowhere"),
    ):
        pass
