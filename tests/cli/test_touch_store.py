"""``feeler touch --store``: resumes, reports to machines, and stops as asked, in real processes
where it is stopped.
"""

import json
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
import xarray as xr
from tensors._sets import find_finished as list_finished
from tensors._sets import forget

from feeler.tensors.formats import load

from ._command import run

FEELER = [sys.executable, "-c", "from feeler.cli import main; main()"]
SET = ["touch", "--store", "set.zarr", "--duration", "30", "--workers", "2"]
SET += [word for place in range(20) for word in ("--location", f"{0.4 + 0.02 * place:g}")]
# far more than the groups of eight that two workers have at hand when they are interrupted
N_SLOW = 200
SLOW = [
    "touch",
    "--store",
    "set.zarr",
    "--duration",
    "4",
    "--workers",
    "2",
    "--engine",
    "mujoco",
]
SLOW += [word for place in range(N_SLOW) for word in ("--location", f"{0.4 + 0.002 * place:g}")]


def start(*arguments, cwd):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    hear = partial(
        signal.signal, signal.SIGINT, signal.SIG_DFL
    )  # also where these tests were started with it ignored
    return subprocess.Popen(
        [*FEELER, *arguments], cwd=cwd, start_new_session=True, preexec_fn=hear, **pipes
    )


def find_finished(folder):
    return {*list_finished(folder / "set.zarr")}


def wait_for(condition, seconds=300):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def list_session(leader):
    """Living processes of a session, zombies apart."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            words = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(words[3]) == leader and words[0] != "Z":
            found.append(int(path.parent.name))
    return found


@pytest.mark.long
def test_the_same_command_resumes_and_tells_machines(tmp_path):
    first = run(*SET, cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    assert "set.zarr: 20 of 20 touches finished (2 threads in this process)" in first.stdout
    assert first.stderr == "" or "compiling" in first.stderr  # quiet where nobody looks
    whole = load(tmp_path / "set.zarr").load()
    forget(tmp_path / "set.zarr", 8, 15)
    again = run(*SET, "--log-json", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    events = [json.loads(line) for line in again.stderr.splitlines() if line.startswith("{")]
    assert [event["done"] for event in events] == [20]
    assert all(
        event["total"] == 20 and event["seconds_left"] >= 0 and event["per_second"] > 0
        for event in events
    )
    xr.testing.assert_identical(load(tmp_path / "set.zarr"), whole)
    other = run(*SET, "--speed", "0.3", cwd=tmp_path)
    assert other.returncode == 2
    assert "trial 0.speed: 0.6 → 0.3" in other.stderr and "Traceback" not in other.stderr


def test_many_touches_need_a_store(tmp_path):
    result = run("touch", "--location", "0.3", "--location", "0.5", cwd=tmp_path)
    assert result.returncode == 2
    assert "2 touches need a --store" in result.stderr
    assert "goes on where it stopped" in " ".join(
        run("touch", "--help", cwd=tmp_path).stdout.split()
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "workers",
    [[], pytest.param(["--processes"], marks=pytest.mark.slow)],
    ids=["threads", "processes"],
)
def test_one_interrupt_keeps_what_runs_and_ends(tmp_path, workers):
    process = start(*SLOW, *workers, cwd=tmp_path)
    wait_for(lambda: find_finished(tmp_path))
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 130, err
    assert "stopping after the trials that are running" in err
    assert (
        "finished touches are in set.zarr, and the same command goes on" in err
        and "Traceback" not in err
    )
    assert 0 < len(find_finished(tmp_path)) < N_SLOW
    assert load(tmp_path / "set.zarr").sizes["trial"] == len(find_finished(tmp_path))
    assert list_session(process.pid) == []


@pytest.mark.long
@pytest.mark.parametrize(
    "workers",
    [["--processes"], pytest.param([], marks=pytest.mark.slow)],
    ids=["processes", "threads"],
)
def test_two_interrupts_end_at_once_and_leave_no_orphans(tmp_path, workers):
    process = start(*SLOW, *workers, cwd=tmp_path)
    wait_for(lambda: find_finished(tmp_path))
    session = list_session(process.pid)
    assert len(session) >= (3 if workers else 1)
    process.send_signal(signal.SIGINT)
    said = next(
        line for line in process.stderr if line.strip()
    )  # after the newline that leaves the ^C behind
    assert "stopping after the trials that are running" in said
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    wait_for(lambda: list_session(process.pid) == [])
    assert load(tmp_path / "set.zarr").sizes["trial"] == len(find_finished(tmp_path)) < N_SLOW


@pytest.mark.further
@pytest.mark.parametrize("workers", [[], ["--processes"]], ids=["threads", "processes"])
def test_too_few_addresses_are_said_in_one_line(tmp_path, workers):
    """Compiled libraries would end Python itself."""
    resource = pytest.importorskip("resource")
    few = partial(resource.setrlimit, resource.RLIMIT_AS, (7 * 10**8, 7 * 10**8))
    ended = subprocess.run(
        [*FEELER, *SET, *workers],
        cwd=tmp_path,
        check=False,
        capture_output=True,
        preexec_fn=few,
    )
    assert ended.returncode == 2
    assert ended.stderr.decode().startswith("feeler: there is not enough memory")
    assert len(ended.stderr.splitlines()) == 1
