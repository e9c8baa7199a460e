"""The store: what was reported as finished is there, whole and unchanged, whatever ended the
process.
"""

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
import zarr

from feeler import files as disk
from feeler.errors import InvalidInput, StoreError
from feeler.provenance import to_jsonable
from feeler.tensors import store as module
from feeler.tensors.formats import load, save
from feeler.tensors.store import (
    _find_damage,
    _save_store,
    open_store,
    read_store,
)

from ._sets import CONFIGURATION, N_TRIALS, fill, find_finished, make_set, make_trial


@pytest.fixture
def path(tmp_path):
    return tmp_path / "set.zarr"


@pytest.fixture
def fast():
    """A folder in memory where there is one: waiting for the disk would take most of the time."""
    folder = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    yield folder
    shutil.rmtree(folder)


@pytest.mark.further
@pytest.mark.parametrize("order", [1, -1, 3])
def test_reads_in_trial_order_what_was_written_in_any_order(path, order):
    indices = sorted(range(N_TRIALS), key=lambda n: n * order % 11)
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        for index in indices:
            store.append([index], make_trial(index))
        xr.testing.assert_identical(read_store(path), make_set())
    xr.testing.assert_identical(read_store(path), make_set())


@pytest.mark.further
@pytest.mark.parametrize("dask", [False, True])
def test_xarray_writes_what_was_loaded_as_it_was_stored(path, tmp_path, dask):
    """Without a word about its texts, in the same chunks; a part of it, and as NetCDF, too."""
    fill(path)
    loaded, stored = load(path), zarr.open_group(path, mode="r")["angle"]
    if dask:
        loaded = loaded.chunk(trial=stored.shards[0])
    for number, part in enumerate((loaded, loaded.isel(trial=slice(1, 4)))):
        copy = tmp_path / f"{number}.zarr"
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            part.to_zarr(copy, consolidated=False)  # which Zarr itself warns of
        angle = zarr.open_group(copy, mode="r")["angle"]
        assert (angle.chunks, angle.shards) == (stored.chunks, stored.shards)
        again = xr.open_zarr(copy, consolidated=False).load()
        np.testing.assert_array_equal(again["angle"], part["angle"])
        np.testing.assert_array_equal(again["feature"].values, part["feature"].values)
    loaded.to_netcdf(tmp_path / "set.nc")
    xr.testing.assert_equal(xr.open_dataset(tmp_path / "set.nc").load(), loaded.load())


def test_resuming_gives_what_an_undisturbed_run_gives(path):
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        for index in (5, 1):
            store.append([index], make_trial(index))
    assert read_store(path).sizes["trial"] == 2
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        assert np.flatnonzero(store.finished).tolist() == [1, 5]
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


STRIDES = [5, pytest.param(1, marks=pytest.mark.slow)]


@pytest.mark.long
@pytest.mark.parametrize("stride", STRIDES)
def test_power_may_fail_at_every_single_step(fast, monkeypatch, stride):
    steps = count_syncs(monkeypatch, fast / "undisturbed.zarr")
    whole = read_store(fast / "undisturbed.zarr")
    assert steps > 20
    for step in range(stride // 2, steps, stride):
        path = fast / f"{step}.zarr"

        def child(path=path, step=step):
            fail_at(pytest.MonkeyPatch(), step, lose_power)
            fill(path, n_trials=2)

        _, status = os.waitpid(in_child(child), 0)
        assert os.WTERMSIG(status) == signal.SIGKILL
        before = {*find_finished(path)}
        with open_store(path, CONFIGURATION, 2) as store:
            assert {*np.flatnonzero(store.finished)} == before
            for index in {0, 1} - before:
                store.append([index], make_trial(index))
        xr.testing.assert_identical(read_store(path), whole)
        assert not list(path.rglob("*" + disk.TEMPORARY))


@pytest.mark.long
def test_power_may_fail_while_a_store_grows(fast):
    fill(fast / "undisturbed.zarr")
    whole = read_store(fast / "undisturbed.zarr")
    for step in range(2, 40, 3):
        path = fast / f"{step}.zarr"
        fill(path, n_trials=3)

        def child(path=path, step=step):
            fail_at(pytest.MonkeyPatch(), step, lose_power)
            open_store(path, CONFIGURATION, N_TRIALS).close()

        os.waitpid(in_child(child), 0)
        assert {*find_finished(path)} == {0, 1, 2}
        fill(path)
        xr.testing.assert_identical(read_store(path), whole)


@pytest.mark.parametrize("name", ["location", "position"])
def test_a_store_that_grows_has_all_of_its_arrays_again(path, name):
    fill(path, n_trials=3)
    (path / name / "zarr.json").unlink()
    assert name in read_store(path).variables  # by what the group says of it
    fill(path)
    xr.testing.assert_identical(read_store(path), make_set())
    assert zarr.open_group(path, use_consolidated=False)[name].shape


@pytest.mark.long
@pytest.mark.parametrize("stride", STRIDES)
def test_the_disk_may_be_full_at_every_single_step(fast, monkeypatch, stride):
    steps = count_syncs(monkeypatch, fast / "undisturbed.zarr")
    whole = read_store(fast / "undisturbed.zarr")

    def no_room(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    for step in range(stride // 3, steps, stride):
        path = fast / f"{step}.zarr"
        with (
            pytest.MonkeyPatch().context() as patch,
            pytest.raises(StoreError, match=r"no room left.*Free some space"),
        ):
            fail_at(patch, step, no_room)
            fill(path, n_trials=2)
        fill(path, n_trials=2)
        xr.testing.assert_identical(read_store(path), whole)


def kill_often(tmp_path, n_kills, seed):
    """Kill the writer ``n_kills`` times at random moments; after each, what it reported is
    there.
    """
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
                    if not store.finished[index]:
                        store.append([index], make_trial(index))
                        os.write(out, b"%d\n" % index)

        pid = in_child(child)
        os.close(theirs)
        time.sleep(rng.uniform(0, 2 * step))
        os.kill(pid, signal.SIGKILL)
        _, status = os.waitpid(pid, 0)
        with os.fdopen(reported) as lines:
            claimed = {int(line) for line in lines}
        kills += os.WIFSIGNALED(status)
        assert claimed <= {*find_finished(path)} if path.exists() else not claimed
        if claimed:
            part = read_store(path)
            numbers = sorted({*find_finished(path)})
            xr.testing.assert_identical(
                part.drop_attrs(), whole.isel(trial=numbers).astype(part.dtypes).drop_attrs()
            )
        if len({*find_finished(path)} if path.exists() else ()) == 60:
            path = path.with_name(f"again{kills}.zarr")
    assert kills == n_kills
    return path, whole


@pytest.mark.long
@pytest.mark.parametrize("n_kills", [5, pytest.param(60, marks=pytest.mark.slow)])
def test_killed_at_random_moments_a_fresh_process_resumes(fast, n_kills):
    path, whole = kill_often(fast, n_kills, seed=n_kills)
    code = f"import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n"
    code += f"from tensors._sets import fill; fill({str(path)!r}, n_trials=60)"
    subprocess.run([sys.executable, "-c", code], check=True)
    xr.testing.assert_identical(read_store(path), whole)


@pytest.mark.long
def test_a_second_writer_is_refused_by_name(path):
    code = f"""
import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})
from tensors._sets import CONFIGURATION
from feeler.tensors.store import open_store
with open_store({str(path)!r}, CONFIGURATION, 8) as store:
    print("open", flush=True)
    sys.stdin.read()
"""
    holder = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
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


@pytest.mark.further
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
        ({}, N_TRIALS - 1, "number of trials: 8 → 7"),
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
        (lambda d: d.transpose("time", ...), "trial as first dim"),
        (lambda d: d.rename(angle="../angle"), "a variable's name"),
        (lambda d: d.rename(tip="finished"), "cannot hold 'finished'"),
        (lambda d: d.assign(text=(("trial", "sensor"), np.full((8, 5), "a"))), "keeps numbers"),
        (
            lambda d: d.assign(when=("trial", np.full(8, "2020-01-01", "datetime64[ns]"))),
            "datetime64",
        ),
    ],
)
def test_what_no_store_can_hold_is_refused(path, change, words):
    with pytest.raises(InvalidInput, match=words):
        _save_store(change(make_set()), path)


def damage(path, how):
    file = path / "angle" / "c.1.0.0"
    raw = bytearray(file.read_bytes())
    if how == "flip":
        raw[17] ^= 4
    elif how == "cut":
        del raw[-9:]
    file.write_bytes(raw)
    if how == "gone":
        file.unlink()


@pytest.mark.further
@pytest.mark.parametrize("how", ["flip", "cut", "gone"])
def test_a_damaged_chunk_is_named_and_the_same_command_heals_it(path, how):
    fill(path, group_size=2)
    damage(path, how)
    with pytest.raises(
        InvalidInput, match=r"is damaged|c\.1\.0\.0 \(trials 2 to 3\) is missing"
    ):
        read_store(path).load()
    assert re.search(
        r"angle/c\.1\.0\.0 \(trials 2 to 3\) is missing or damaged", _find_damage(path)[0]
    )
    with (
        pytest.warns(UserWarning, match="will be computed again") as warned,
        open_store(path, CONFIGURATION, N_TRIALS) as store,
    ):
        assert {*np.flatnonzero(~store.finished)} == {2, 3}
    assert re.search(r"trials 2 to 3, in .*c\.1\.0\.0", warned[0].message.details)
    fill(path)
    xr.testing.assert_identical(read_store(path), make_set())


@pytest.mark.further
@pytest.mark.parametrize("place", ["angle/c.0.0.0", "speed/c.0", "finished/c.0"])
def test_a_link_inside_a_store_is_never_followed(path, tmp_path, place):
    fill(path)
    (path / place).unlink()
    (tmp_path / "elsewhere").write_text("{}")
    (path / place).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InvalidInput, match=r"is damaged .* is a link, or missing"):
        read_store(path).load()
    with pytest.warns(UserWarning, match="trials of the store will be computed again"):
        fill(path)
    xr.testing.assert_identical(read_store(path), make_set())
    assert (tmp_path / "elsewhere").read_text() == "{}"


@pytest.mark.parametrize("what", ["file", "folder", "other zarr", "later format"])
def test_nothing_else_is_taken_for_a_store(path, what):
    if what == "file":
        path.write_text("x")
    else:
        path.mkdir()
        (path / "thesis.tex").write_text("x")
    if what in ("other zarr", "later format"):
        about = {"feeler_store": {"format": 99}} if what == "later format" else {}
        (path / "zarr.json").write_text(
            json.dumps({"zarr_format": 3, "node_type": "group", "attributes": about})
        )
    with pytest.raises(
        (StoreError, InvalidInput),
        match=r"is a file|no store|another format; this feeler reads 4",
    ):
        open_store(path, CONFIGURATION, N_TRIALS)
    assert path.read_text() == "x" if what == "file" else (path / "thesis.tex").exists()


@pytest.mark.parametrize("n_trials", [0, -1, 1.5, True, "8", 10**10])
def test_a_wrong_number_of_trials_is_refused(path, n_trials):
    with pytest.raises(InvalidInput, match=r"open_store: n_trials must be"):
        open_store(path, CONFIGURATION, n_trials)


def test_an_interrupted_body_keeps_its_own_error(path):
    with pytest.raises(KeyboardInterrupt), open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append([0], make_trial(0))
        raise KeyboardInterrupt
    assert {*find_finished(path)} == {0}


def test_an_empty_store_says_so(path):
    open_store(path, CONFIGURATION, N_TRIALS).close()
    with pytest.raises(InvalidInput, match="no finished trial yet"):
        read_store(path)


def test_a_store_grows_and_keeps_what_it_has(path):
    fill(path, n_trials=3)
    before = read_store(path).load()
    fill(path)
    xr.testing.assert_identical(read_store(path).load(), make_set())
    xr.testing.assert_identical(read_store(path).isel(trial=slice(3)).load(), before)
    assert xr.open_zarr(path, chunks=None).sizes["trial"] == N_TRIALS


def test_a_few_trials_of_many_are_read_and_gone_on_with(path):
    """Most files of numbers and of labels are not there yet."""
    with open_store(path, CONFIGURATION, 9_000) as store:
        store.append([4, 8_000], xr.concat([make_trial(4), make_trial(7)], "trial"))
    got = read_store(path).load()
    np.testing.assert_array_equal(got["angle"], make_set()["angle"][[4, 7]])
    assert got["feature"].values.tolist() == ["ball", "Wändli"]
    with open_store(path, CONFIGURATION, 9_000) as store:
        assert np.flatnonzero(store.finished).tolist() == [4, 8_000]


def test_an_opening_that_fails_lets_go_of_the_lock(path):
    fill(path, n_trials=3)
    with pytest.raises(StoreError) as kept:  # whose traceback keeps the store that failed alive
        open_store(path, {**CONFIGURATION, "seed": 8}, N_TRIALS)
    fill(path)
    xr.testing.assert_identical(read_store(path), make_set())
    assert "seed: 7 → 8" in str(kept.value)


def test_it_is_read_lazily_and_while_it_is_written(path, monkeypatch):
    with open_store(path, CONFIGURATION, 100, group_size=2) as store:
        store.append(range(N_TRIALS), make_set())
        with monkeypatch.context() as patch:
            patch.setattr(module._Numbers, "_read", lambda *_: pytest.fail("read the numbers"))
            lazy = read_store(path)
            assert lazy.sizes["trial"] == N_TRIALS and lazy.feature.values[3] == "Wändli"
        lazy = read_store(path)
        xr.testing.assert_identical(
            lazy.isel(trial=[5, 2], time=3).load(), make_set().isel(trial=[5, 2], time=3)
        )
        assert xr.open_zarr(path, chunks=None).sizes["trial"] == 100
    shutil.copytree(path, path.with_name("copy.zarr"))
    xr.testing.assert_identical(read_store(path.with_name("copy.zarr")).load(), make_set())


@pytest.mark.long
def test_reading_in_the_same_process_keeps_the_lock(path):
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append([0], make_trial(0))
        shutil.copytree(path, path.with_name("copy.zarr"))
        code = (
            f"from feeler.tensors.store import open_store; open_store({str(path)!r},"
            f" {CONFIGURATION!r}, 8)"
        )
        other = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=False
        )
        assert f"is being written by process {os.getpid()} on" in other.stderr


def test_numbers_are_stored_as_they_are(path):
    odd = make_set()
    odd["angle"] = odd.angle.astype("float32")
    odd["angle"][0, 0, :3] = [-0.0, np.float32(1e-40), np.nan]
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append(range(N_TRIALS), odd)
    got = read_store(path).angle.load()
    assert got.dtype == np.float32 and got.values.tobytes() == odd.angle.values.tobytes()


def test_trials_without_any_value_are_kept_too(path):
    """Touches that end before the contact have no place of contact: a whole shard of nothing."""
    nothing = make_set().map(
        lambda values: values * np.nan if values.dtype.kind == "f" else values, keep_attrs=True
    )
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append(range(N_TRIALS), nothing)
    assert read_store(path).angle.isnull().all()


def test_curvature_is_derived_where_it_is_not_stored(path):
    whole = make_set().assign_coords(segment_length=("sensor", np.full(5, 0.3)))
    with open_store(path, CONFIGURATION, N_TRIALS) as store:
        store.append(range(N_TRIALS), whole.drop_vars("curvature"))
    got = read_store(path)
    np.testing.assert_array_equal(got.curvature, whole.curvature)
    np.testing.assert_array_equal(got.curvature[2, [3, 1], 5], whole.curvature[2, [3, 1], 5])
    assert got.curvature.attrs["units"] == "1/mm" and not (path / "curvature").exists()


@pytest.mark.parametrize("group_size", [1, 3, 8, 31, 33, 37, 100, 200])
def test_groups_may_have_any_size(fast, group_size):
    n = 2 * group_size + 1
    trials = np.arange(float(n))
    tensors = xr.Dataset(
        {"angle": (("trial", "sensor"), np.stack([trials, -trials], axis=1))},
        {"trial": np.arange(n)},
    )
    _save_store(tensors, fast / "a.zarr", group_size=group_size)
    np.testing.assert_array_equal(read_store(fast / "a.zarr").angle, tensors.angle)


def make_old(path, n_finished):
    """A store as feeler 0.3 left it when it was killed: records name what is finished, and labels
    for other readers were copied earlier.
    """
    whole = make_set()
    fill(path, group_size=4)
    names = [name for name, item in whole.variables.items() if item.dims == ("trial",)]
    zarr.open_group(path, mode="r+")["speed"][2:] = np.nan
    kinds = {name: whole[name].dtype.str.replace("<U8", "str") for name in names}
    kinds |= {name: "str" for name in names if whole[name].dtype.kind == "U"}
    (path / "progress").mkdir()
    (path / "progress" / "store.json").write_text(json.dumps({"layout": {"labels": kinds}}))
    for group in (0, 1):
        trials = [k for k in range(4 * group, 4 * group + 4) if k < n_finished]
        labels = {name: to_jsonable(whole[name].values[trials]) for name in names}
        record = {"trials": trials, "labels": labels, "made": [{"speed": k} for k in trials]}
        (path / "progress" / f"{group:06d}.json").write_text(json.dumps(record))


@pytest.mark.further
@pytest.mark.parametrize("n_finished", [3, 7])
def test_a_store_of_an_earlier_version_is_read_converted_and_not_continued(path, n_finished):
    make_old(path, n_finished)
    old = load(path)
    made = json.dumps([{"speed": k} for k in range(n_finished)])
    xr.testing.assert_identical(
        old.load(), make_set().isel(trial=slice(n_finished)).assign_attrs(trials=made)
    )
    with pytest.raises(StoreError, match=r"of feeler 0\.3.*: feeler convert .*a?set\.zarr new"):
        open_store(path, CONFIGURATION, N_TRIALS)
    save(old, path.with_name("new.zarr"))
    xr.testing.assert_identical(load(path.with_name("new.zarr")).load(), old)


def test_an_earlier_store_without_a_finished_trial_says_so(path):
    make_old(path, 0)
    with pytest.raises(InvalidInput, match="no finished trial yet"):
        load(path)
