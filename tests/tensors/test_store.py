"""The store: what was reported as finished is there, whole and unchanged, whatever ended the process."""

import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from feeler.errors import InvalidInput, StoreError
from feeler.tensors import disk
from feeler.tensors.finished import read_store
from feeler.tensors.store import open_store

from ._sets import CONFIGURATION, N_TRIALS, fill, make_set, make_trial


@pytest.fixture
def path(tmp_path):
    return tmp_path / "set.zarr"


@pytest.fixture
def fast():
    """A folder in memory where there is one: waiting for the disk would take most of the time."""
    folder = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    yield folder
    shutil.rmtree(folder)


def finished_numbers(path):
    return {int(file.stem) for file in (path / "progress").glob("[0-9]*.json")}


@pytest.mark.parametrize("order", [1, -1, 3])
def test_reads_in_trial_order_what_was_written_in_any_order(path, order):
    indices = sorted(range(N_TRIALS), key=lambda n: n * order % 11)
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        for index in indices:
            store.append(index, make_trial(index))
        xr.testing.assert_identical(store.read(), make_set())
    xr.testing.assert_identical(read_store(path), make_set())


def test_any_zarr_reader_sees_the_same_numbers(path):
    fill(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        plain = xr.open_zarr(path, consolidated=False).load()
    whole = make_set()
    for name in whole.variables:
        np.testing.assert_array_equal(plain[name].values.astype(whole[name].dtype), whole[name].values)
        assert plain[name].dims == whole[name].dims
    assert plain.attrs["configuration"] == whole.attrs["configuration"]
    assert plain.angle.attrs["units"] == "rad"


def test_resuming_gives_what_an_undisturbed_run_gives(path):
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        for index in (5, 1):
            store.append(index, make_trial(index))
    assert read_store(path).sizes["trial"] == 2
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        assert store.finished == {1, 5}
    fill(path)
    xr.testing.assert_identical(read_store(path), make_set())


def in_child(function):
    """Run ``function`` in a forked process and return its wait status once it has ended."""
    pid = os.fork()
    if pid == 0:
        try:
            function()
            os._exit(0)
        except BaseException:
            os._exit(3)
    return pid


def count_syncs(monkeypatch, path):
    calls = []
    with monkeypatch.context() as patch:
        for name in ("fsync", "replace"):
            real = getattr(os, name)
            patch.setattr(os, name, lambda *a, real=real: (calls.append(1), real(*a))[1])
        fill(path, n_trials=2)
    return len(calls)


def fail_at(patch, number, action):
    """Let the numbered call of fsync or rename perform ``action`` on the file instead."""
    left = [number]
    for name in ("fsync", "replace"):
        real = getattr(os, name)

        def call(*args, real=real, name=name):
            left[0] -= 1
            if left[0] < 0:
                action(args[0])
            return real(*args)

        patch.setattr(os, name, call)


def lose_power(target):
    """What was not yet synced is half lost; then nothing runs any more."""
    file = f"/proc/self/fd/{target}" if isinstance(target, int) else target
    if os.path.isfile(file):
        os.truncate(os.path.realpath(file), os.path.getsize(file) // 2)
    os.kill(os.getpid(), signal.SIGKILL)


def test_power_may_fail_at_every_single_step(fast, monkeypatch):
    steps = count_syncs(monkeypatch, fast / "undisturbed.zarr")
    whole = read_store(fast / "undisturbed.zarr")
    assert steps > 20
    for step in range(steps):
        path = fast / f"{step}.zarr"

        def child(path=path, step=step):
            fail_at(pytest.MonkeyPatch(), step, lose_power)
            fill(path, n_trials=2)

        _, status = os.waitpid(in_child(child), 0)
        assert os.WTERMSIG(status) == signal.SIGKILL
        before = finished_numbers(path)
        with open_store(path, CONFIGURATION, 2) as store:
            assert store.finished == before
        fill(path, n_trials=2)
        xr.testing.assert_identical(read_store(path), whole)
        assert not list(path.rglob("*" + disk.TEMPORARY))


def test_the_disk_may_be_full_at_every_single_step(fast, monkeypatch):
    steps = count_syncs(monkeypatch, fast / "undisturbed.zarr")
    whole = read_store(fast / "undisturbed.zarr")

    def no_room(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    for step in range(steps):
        path = fast / f"{step}.zarr"
        with pytest.MonkeyPatch().context() as patch, pytest.raises(StoreError, match=r"no room left.*Free some space"):
            fail_at(patch, step, no_room)
            fill(path, n_trials=2)
        fill(path, n_trials=2)
        xr.testing.assert_identical(read_store(path), whole)


def kill_often(tmp_path, n_kills, seed):
    """Kill the writer ``n_kills`` times at random moments; after each, what it reported is there."""
    rng = np.random.default_rng(seed)
    path, began = tmp_path / "set.zarr", time.perf_counter()
    os.waitpid(in_child(lambda: fill(tmp_path / "undisturbed.zarr", n_trials=60)), 0)
    whole = read_store(tmp_path / "undisturbed.zarr")
    step = (time.perf_counter() - began) / n_kills
    kills = 0
    for _ in range(20 * n_kills):
        if kills == n_kills:
            break
        reported, theirs = os.pipe()

        def child(out=theirs, path=path):
            with open_store(path, CONFIGURATION, 60) as store:
                for index in range(60):
                    if index not in store.finished:
                        store.append(index, make_trial(index))
                        os.write(out, b"%d\n" % index)

        pid = in_child(child)
        os.close(theirs)
        time.sleep(rng.uniform(0, 2 * step))
        os.kill(pid, signal.SIGKILL)
        _, status = os.waitpid(pid, 0)
        with os.fdopen(reported) as lines:
            claimed = {int(line) for line in lines}
        kills += os.WIFSIGNALED(status)
        assert claimed <= finished_numbers(path) if path.exists() else not claimed
        if claimed:
            part = read_store(path)
            numbers = sorted(finished_numbers(path))
            xr.testing.assert_identical(part.drop_attrs(), whole.isel(trial=numbers).astype(part.dtypes).drop_attrs())
        if len(finished_numbers(path) if path.exists() else ()) == 60:
            path = path.with_name(f"again{kills}.zarr")
    assert kills == n_kills
    return path, whole


@pytest.mark.parametrize("n_kills", [5, pytest.param(60, marks=pytest.mark.slow)])
def test_killed_at_random_moments_a_fresh_process_resumes(fast, n_kills):
    path, whole = kill_often(fast, n_kills, seed=n_kills)
    code = f"import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n"
    code += f"from tensors._sets import fill; fill({str(path)!r}, n_trials=60)"
    subprocess.run([sys.executable, "-c", code], check=True)
    xr.testing.assert_identical(read_store(path), whole)


FULL = """
import sys; sys.path.insert(0, {tests!r})
from tensors._sets import make_trial, make_set, CONFIGURATION
from feeler.tensors.finished import read_store
from feeler.tensors.store import open_store
from feeler.errors import StoreError
import xarray, pathlib
try:
    with open_store("{folder}/set.zarr", CONFIGURATION, 8) as store:
        for index in range(8):
            store.append(index, make_trial(index, 2000))
            print("stored", index, flush=True)
except StoreError as error:
    print(error)
finished = read_store("{folder}/set.zarr")
print("readable", finished.sizes["trial"])
pathlib.Path("{folder}/ballast").unlink()
with open_store("{folder}/set.zarr", CONFIGURATION, 8) as store:
    for index in range(8):
        if index not in store.finished:
            store.append(index, make_trial(index, 2000))
    whole = [store.read().angle[n].equals(make_trial(n, 2000).angle[0]) for n in range(8)]
    print("complete", all(whole))
"""


def test_a_small_file_system_fills_up_and_nothing_is_lost(tmp_path):
    script = tmp_path / "full.py"
    script.write_text(FULL.format(tests=str(Path(__file__).parents[1]), folder=tmp_path / "disk"))
    (tmp_path / "disk").mkdir()
    steps = f"mount -t tmpfs -o size=2m none {tmp_path}/disk && head -c 1000000 /dev/zero > {tmp_path}/disk/ballast"
    command = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]
    if subprocess.run([*command, steps], capture_output=True).returncode:
        pytest.skip("no right to mount a small file system here")
    run = subprocess.run([*command, f"{steps} && {sys.executable} {script}"], capture_output=True, text=True)
    stored = len(re.findall(r"^stored \d", run.stdout, re.MULTILINE))
    assert 0 < stored < 8, run.stderr
    assert "no room left for the store" in run.stdout
    assert f"readable {stored}" in run.stdout
    assert "complete True" in run.stdout


def test_a_limit_on_file_sizes_stops_the_writer_by_name_and_nothing_is_lost(fast):
    path, chunk = fast / "set.zarr", make_trial(0, 2000).angle.nbytes

    def child():
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (chunk // 2, chunk // 2))
        with (
            pytest.raises(StoreError, match=r"no room left.*Free some space"),
            open_store(path, CONFIGURATION, 8) as store,
        ):
            store.append(0, make_trial(0, 2000))

    _, status = os.waitpid(in_child(child), 0)
    assert status == 0
    assert finished_numbers(path) == set()
    with open_store(path, CONFIGURATION, 8) as store:
        store.append(0, make_trial(0, 2000))
        assert store.read().angle.equals(make_trial(0, 2000).angle)


def test_a_second_writer_is_refused_by_name(path):
    code = f"""
import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})
from tensors._sets import CONFIGURATION
from feeler.tensors.store import open_store
with open_store({str(path)!r}, CONFIGURATION, 8) as store:
    print("open", flush=True)
    sys.stdin.read()
"""
    holder = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "open\n"
    with pytest.raises(StoreError, match=f"is being written by process {holder.pid} on"):
        open_store(path, CONFIGURATION, N_TRIALS)
    holder.kill()
    holder.communicate()
    fill(path)


def test_one_process_cannot_write_a_store_twice_at_once(path):
    with open_store(path, CONFIGURATION, N_TRIALS):
        for _ in range(2):
            with pytest.raises(StoreError, match="already open for writing in this process"):
                open_store(path, CONFIGURATION, N_TRIALS)
    open_store(path, CONFIGURATION, N_TRIALS).close()


@pytest.mark.parametrize(
    ("changes", "n_trials", "words"),
    [
        ({"timestep": 0.02}, N_TRIALS, r"timestep: 0\.01 → 0\.02"),
        (
            {"antenna": {"stiffness": [37.78, 1 / 3 + 1e-16], "name": "exponential"}},
            N_TRIALS,
            r"antenna\.stiffness\[1\]",
        ),
        ({"more": 1}, N_TRIALS, "more: nothing → 1"),
        ({}, N_TRIALS + 1, "number of trials: 8 → 9"),
    ],
)
def test_another_configuration_is_never_mixed_in(path, changes, n_trials, words):
    fill(path)
    with pytest.raises(StoreError, match=words):
        open_store(path, {**CONFIGURATION, **changes}, n_trials)
    xr.testing.assert_identical(read_store(path), make_set())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.assign_attrs(engine="other"), "attribute engine: none → other"),
        (lambda d: d.drop_vars("tip"), "variable 'tip'"),
        (lambda d: d.assign(angle=d.angle.astype("float32")), r"angle: float64"),
        (lambda d: d.isel(time=slice(0, 9)), "the values of time"),
        (lambda d: d.assign_coords(position=d.position + 1e-9), "the values of position"),
    ],
)
def test_a_trial_unlike_the_others_is_refused(path, change, words):
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append(0, make_trial(0))
        with pytest.raises(StoreError, match=words):
            store.append(1, change(make_trial(1)))
        store.append(1, make_trial(1))


@pytest.mark.parametrize(
    ("index", "trial", "words"),
    [
        (8, make_trial(0), "trials 0 to 7, got trial 8"),
        (-1, make_trial(0), "got trial -1"),
        (1, make_set(2), "takes a Dataset of one trial"),
        (1, make_trial(1).transpose("time", ...), "trial must come first"),
        (1, make_trial(1).rename(angle="../angle"), "a variable's name"),
        (1, make_trial(1).assign(when=("trial", np.array(["2020-01-01"], "datetime64[ns]"))), "datetime64"),
    ],
)
def test_what_is_no_trial_is_refused(path, index, trial, words):
    with open_store(path, CONFIGURATION, N_TRIALS) as store, pytest.raises((InvalidInput, StoreError), match=words):
        store.append(index, trial)
        store.append(index + 1, trial)


def test_a_trial_is_stored_once(path):
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append(3, make_trial(3))
        with pytest.raises(StoreError, match="trial 3 is already stored"):
            store.append(3, make_trial(3))


def damage(path, how):
    file = path / "angle" / "c.2.0.0"
    raw = bytearray(file.read_bytes())
    if how == "flip":
        raw[17] ^= 4
    elif how == "cut":
        del raw[-9:]
    elif how == "swap":
        raw = bytearray((path / "angle" / "c.3.0.0").read_bytes())
    file.write_bytes(raw)
    if how == "gone":
        file.unlink()


@pytest.mark.parametrize("how", ["flip", "cut", "swap", "gone"])
def test_a_damaged_chunk_is_named_and_the_same_command_heals_it(path, how):
    fill(path)
    damage(path, how)
    with pytest.raises(InvalidInput, match=r"angle/c\.2\.0\.0"):
        read_store(path)
    with (
        pytest.warns(UserWarning, match="trial 2 will be computed again"),
        open_store(path, CONFIGURATION, N_TRIALS) as store,
    ):
        assert store.finished == set(range(N_TRIALS)) - {2}
    fill(path)
    xr.testing.assert_identical(read_store(path), make_set())


@pytest.mark.parametrize("place", ["angle/c.2.0.0", "progress/000002.json", "angle/zarr.json", "link"])
def test_a_link_inside_a_store_is_refused(path, tmp_path, place):
    fill(path)
    target = path / place
    target.unlink(missing_ok=True)
    (tmp_path / "elsewhere").write_text("{}")
    target.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InvalidInput, match=r"link|cannot read"):
        read_store(path)
    with pytest.raises(InvalidInput, match="is a symbolic link"):
        open_store(path, CONFIGURATION, N_TRIALS)
    assert (tmp_path / "elsewhere").read_text() == "{}"


@pytest.mark.parametrize("what", ["file", "folder", "other zarr", "later format"])
def test_nothing_else_is_taken_for_a_store(path, what):
    if what == "file":
        path.write_text("x")
    else:
        path.mkdir()
        (path / "thesis.tex").write_text("x")
    if what in ("other zarr", "later format"):
        label = {"n_trials": 8, "format": 99} if what == "later format" else None
        attributes = {"feeler_store": label} if label else {}
        (path / "zarr.json").write_text(json.dumps({"zarr_format": 3, "node_type": "group", "attributes": attributes}))
    with pytest.raises((StoreError, InvalidInput), match=r"is a file|no store|format 99"):
        open_store(path, CONFIGURATION, N_TRIALS)
    assert path.read_text() == "x" if what == "file" else (path / "thesis.tex").exists()


@pytest.mark.parametrize("n_trials", [0, -1, 1.5, True, "8", 10**9])
def test_a_wrong_number_of_trials_is_refused(path, n_trials):
    with pytest.raises(InvalidInput, match="n_trials must be a whole number"):
        open_store(path, CONFIGURATION, n_trials)


def test_an_interrupted_body_keeps_its_own_error(path):
    with pytest.raises(KeyboardInterrupt), open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append(0, make_trial(0))
        raise KeyboardInterrupt
    assert finished_numbers(path) == {0}


def test_an_empty_store_says_so(path):
    open_store(path, CONFIGURATION, N_TRIALS).close()
    with pytest.raises(InvalidInput, match="no finished trial yet"):
        read_store(path)
