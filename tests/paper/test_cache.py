"""Results are found again by what they are made of, and by nothing else."""

import joblib
import numpy as np
import pytest

from paper import cache
from paper.cache import keep, list_sources
from paper.context import Context
from paper.fig4 import CachedNMF
from paper.stage import Stage, run_stage


@pytest.fixture
def double(tmp_path, monkeypatch):
    """Doubles arrays, and notes each call."""
    monkeypatch.setenv("FEELER_CACHE", str(tmp_path / "cache"))
    cache.begin()
    calls = []

    def double(array, factor=2, workers=1):
        calls.append(1)
        return factor * array

    double.calls = calls
    return double


def count(double, *args, **options):
    found = keep("double", double, *args, **options)
    return found.tolist(), len(double.calls)


def test_only_what_matters_makes_another_result(double):
    assert count(double, np.arange(3)) == ([0, 2, 4], 1)
    assert count(double, np.arange(3), workers=8) == ([0, 2, 4], 1)
    assert count(double, np.arange(3), factor=3) == ([0, 3, 6], 2)
    assert count(double, np.arange(3.0)) == ([0, 2, 4], 3)


def test_fresh_computes_everything_once(double, tmp_path):
    count(double, np.arange(3))
    cache.begin((tmp_path / "cache").stat().st_mtime + 1e9)
    assert count(double, np.arange(3))[1] == 2


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: path.write_bytes(path.read_bytes()[:-9]), "computed anew: damaged"),
        (lambda path: path.write_bytes(b""), "computed anew: damaged"),
        (lambda path: None, "made by another version"),
    ],
)
def test_a_damaged_or_old_result_is_computed_anew_and_said(
    double, tmp_path, monkeypatch, spoil, message
):
    count(double, np.arange(300))
    (path,) = (tmp_path / "cache").rglob("*.joblib")
    spoil(path)
    if "version" in message:
        monkeypatch.setattr(cache, "PHYSICS", -1)
    with pytest.warns(UserWarning, match=message):
        assert count(double, np.arange(300))[1] == 2
    assert count(double, np.arange(300))[1] == 2


def test_a_full_disk_loses_no_result_and_an_interrupted_one_leaves_nothing(
    double, tmp_path, monkeypatch
):
    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch, pytest.warns(UserWarning, match="No space left"):
        patch.setattr(cache.joblib, "dump", fail)
        assert count(double, np.arange(3)) == ([0, 2, 4], 1)

    def stop(array):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        keep("double", stop, np.arange(3))
    assert not [*(tmp_path / "cache").rglob("[!.]*.joblib*")]


def test_where_nothing_can_be_written_results_are_computed_and_that_is_said(double, tmp_path):
    (tmp_path / "cache").write_text("no folder")
    for calls in (1, 2):
        with pytest.warns(UserWarning, match="a double could not be cached: Not a directory"):
            assert count(double, np.arange(3)) == ([0, 2, 4], calls)


def test_a_fit_that_is_recalled_is_the_fit(double):
    rng = np.random.default_rng(0)
    tensors = rng.random((4, 3, 30))
    options = {"n_components": 2, "n_lags": 4, "max_iter": 3, "warn": False, "random_state": 0}
    first, second = (CachedNMF(**options, n_jobs=n).fit(tensors) for n in (1, 2))
    assert [one["source"] for one in cache._used] == ["computed", "cache"]
    np.testing.assert_array_equal(first.activations_, second.activations_)
    # so what is made of a fit has one key
    keys = {joblib.hash(vars(one) | {"n_jobs": None}) for one in (first, second)}
    assert len(keys) == 1
    np.testing.assert_array_equal(*(one.transform(tensors) for one in (first, second)))


def test_a_run_lists_what_was_computed_and_what_was_not(double, tmp_path):
    def show(context, section):
        keep("double", double, np.arange(3))
        keep("double", double, np.arange(4))

    count(double, np.arange(3))
    stage = Stage(name="antenna", title="t", make=show)
    made, again = (run_stage(stage, Context(out=tmp_path / "out")) for _ in range(2))
    found = list_sources([made])
    assert found["source"].tolist() == ["computed", "cache", "computed"]
    assert found["result"].tolist() == ["section", "double", "double"]
    again.kept = ""
    assert list_sources([again])["source"].tolist() == ["cache"]
