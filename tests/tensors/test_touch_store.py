"""Touches kept in a store: killed and resumed, on any workers, the numbers are those of an
undisturbed run.
"""

import importlib
import os
import shutil
import tempfile
from pathlib import Path

import pytest
import xarray as xr

import feeler
from feeler import provenance
from feeler.errors import InvalidInput, SimulationDivergedError, StoreError
from feeler.execute import ProcessExecutor, ThreadExecutor
from feeler.experiments import tactile as job
from feeler.tensors.formats import load

from ._sets import forget
from ._touches import N_TRIALS, antenna, options, pick, run, trials

verb = importlib.import_module("feeler.experiments.tactile")  # the module


@pytest.fixture(scope="module")
def undisturbed():
    return feeler.touch(antenna, trials, **options)


@pytest.fixture
def tmp_path():
    """A folder in memory where there is one: waiting for the disk would take most of the time."""
    folder = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    yield folder
    shutil.rmtree(folder)


@pytest.mark.further
@pytest.mark.parametrize(
    "make",
    [lambda: ThreadExecutor(3), lambda: ProcessExecutor(2)],
    ids=["threads", "processes"],
)
def test_workers_do_not_change_the_numbers(tmp_path, undisturbed, make):
    with make() as executor:
        xr.testing.assert_identical(
            run(store=tmp_path / "a.zarr", executor=executor), undisturbed
        )


@pytest.mark.long
@pytest.mark.parametrize("engine", ["chain", pytest.param("mujoco", marks=pytest.mark.slow)])
def test_any_part_may_be_missing(tmp_path, engine):
    whole = run(store=tmp_path / "a.zarr", engine=engine)
    for missing in ((0, 7), (8, 23), (3, 9), (22, 22)):
        forget(tmp_path / "a.zarr", *missing)
        xr.testing.assert_identical(run(store=tmp_path / "a.zarr", engine=engine), whole)


@pytest.mark.further
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seed": 4}, "seed: 3 → 4"),
        ({"timestep": 0.01}, r"clock\.timestep: 0\.02 → 0\.01"),
        ({"engine": "mujoco"}, r'engine: "chain[a-z-]*" → "mujoco"'),
        ({"duration": 61.0}, "clock.duration"),
        ({"contact": "hard"}, r"contact\."),
        ({"dtype": "float32"}, 'dtype: "float64" → "float32"'),
    ],
)
def test_another_configuration_is_refused(tmp_path, changes, words):
    run(store=tmp_path / "a.zarr")
    with pytest.raises(StoreError, match=words):
        run(store=tmp_path / "a.zarr", **changes)


def test_what_says_the_same_in_other_words_is_the_same_configuration(tmp_path, undisturbed):
    """All of 12 hinges are recorded anyway."""
    run(store=tmp_path / "a.zarr")
    xr.testing.assert_identical(run(store=tmp_path / "a.zarr", all_hinges=True), undisturbed)


def test_other_trials_are_refused_by_name(tmp_path):
    run(store=tmp_path / "a.zarr")
    other = [
        *trials[:5],
        feeler.Trial(feature=feeler.Ball(radius=1.1), location=0.6, speed=0.3),
        *trials[6:],
    ]
    with pytest.raises(StoreError, match=r"trial 5\.feature"):
        feeler.touch(antenna, other, store=tmp_path / "a.zarr", **options)


def test_a_lone_touch_is_that_of_workers_to_the_last_bit(tmp_path):
    alone = feeler.touch(antenna, trials[3], **options)
    with ThreadExecutor(2) as executor:
        xr.testing.assert_identical(
            feeler.touch(antenna, trials[3], executor=executor, **options), alone
        )
    stored = feeler.touch(antenna, [trials[3]], store=tmp_path / "a.zarr", **options)
    xr.testing.assert_identical(stored, alone)
    with pytest.raises(InvalidInput, match="workers must be a whole number"):
        feeler.touch(antenna, trials[3], workers=0, **options)


def test_a_trial_that_diverges_keeps_the_others(tmp_path, monkeypatch, undisturbed):
    from feeler.experiments import tactile as module

    real = module._run_lanes

    def sabotage(scenes, *how):
        outcomes = real(scenes, *how)
        return [
            SimulationDivergedError(s.label, 3.0) if "0.56 L" in s.label else o
            for s, o in zip(scenes, outcomes, strict=True)
        ]

    monkeypatch.setattr(module, "_run_lanes", sabotage)
    with pytest.raises(SimulationDivergedError, match=r"0\.56 L") as caught:
        run(store=tmp_path / "a.zarr")
    rest = [n for n in range(N_TRIALS) if n != 6]
    xr.testing.assert_identical(caught.value.tensors, pick(undisturbed, rest))
    monkeypatch.setattr(module, "_run_lanes", real)
    xr.testing.assert_identical(run(store=tmp_path / "a.zarr"), undisturbed)


@pytest.mark.long
def test_other_physics_is_refused(tmp_path, monkeypatch):
    whole = run(store=tmp_path / "a.zarr")
    forget(tmp_path / "a.zarr", 8, 15)
    with monkeypatch.context() as patch:
        patch.setattr(verb, "PHYSICS", verb.PHYSICS + 1)
        with pytest.raises(
            StoreError, match=r"another configuration .*physics: 1 → 2\. Use a new store"
        ):
            run(store=tmp_path / "a.zarr")
    assert load(tmp_path / "a.zarr").sizes["trial"] == N_TRIALS - 8
    xr.testing.assert_identical(run(store=tmp_path / "a.zarr"), whole)


@pytest.mark.long
def test_other_packages_and_a_patch_release_resume(tmp_path, monkeypatch):
    whole = run(store=tmp_path / "a.zarr")
    forget(tmp_path / "a.zarr", 8, 15)
    other = {**provenance.list_versions(), "scikit-learn": "99.0", "feeler": "0.3.99"}
    monkeypatch.setattr(verb, "list_versions", lambda: other)
    monkeypatch.setattr(job, "find_version", lambda name: other[name])
    again = run(store=tmp_path / "a.zarr")
    xr.testing.assert_equal(again, whole)


def test_a_disk_too_small_is_said_before_anything_is_simulated(tmp_path, monkeypatch):
    import shutil as system
    from collections import namedtuple

    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(system, "disk_usage", lambda path: usage(0, 0, 50_000))
    # 12 sensors and 60 samples of 8 bytes, and what goes with them: over 100 kB for 24 trials
    with pytest.raises(
        StoreError, match=r"24 trials need about [\d.]+ GiB .* are free\. Free some space"
    ):
        run(store=tmp_path / "a.zarr")
    assert not list((tmp_path / "a.zarr").rglob("c.*"))
