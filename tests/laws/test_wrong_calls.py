"""Wrong calls of everything public: fewer than one in two hundred end in an error that is not of
feeler's, whichever arguments are wrong.
"""

import inspect
import os

import numpy as np
import pytest

import feeler

from . import _calls
from .test_arguments import PUBLIC

MOST = 0.005  # raw errors among all calls
N_LONG = 1000
SEEDS = {"long": 5, "slow": 6}
THINGS = {
    name: thing
    for name, thing in PUBLIC.items()
    if not (
        inspect.isclass(thing) and (issubclass(thing, Exception) or inspect.isabstract(thing))
    )
}


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder with files of noise; what compiles does so before anything is hurried."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty.toml").touch()
    for name in ("noise.toml", "noise.nc", "noise.csv"):
        (tmp_path / name).write_bytes(np.random.default_rng(0).bytes(300))
    antenna = feeler.presets.cockroach()
    trial = feeler.Trial(feature=feeler.Ball(radius=1.0), location=0.5, speed=0.3)
    for engine in ("chain", "chain-consistent", "rod", "mujoco"):
        feeler.touch(antenna, [trial], engine=engine)
    for code in ("ridge", "sparse"):
        _calls.make_encoder().transform(np.ones((2, 3, 12)), code=code)
    feeler.active.Observer(feeler.active.TouchTask())


def run_calls(n, seed):
    rng, wrong, log = np.random.default_rng(seed), _calls.list_wrong(), _calls.Calls()
    for _ in range(n):
        name = sorted(THINGS)[rng.integers(len(THINGS))]
        _calls.call(log, name, THINGS[name], rng, wrong)
    return log


def test_a_raw_error_is_counted_and_one_of_ours_is_not():
    def fails(n: int) -> None:
        raise ValueError if n else feeler.errors.InvalidInput("n must be > 0, got 0.")

    log, rng = _calls.Calls(), np.random.default_rng(0)
    for value in (0, 3):
        _calls.call(log, "fails", fails, rng, [value])
    assert (log.ends["refused"], log.ends["raw"], log.share) == (1, 1, 0.5)


def print_calls(capfd, kind, n):
    """The calls of a kind of run, which say on the screen what came of them."""
    log = run_calls(n, SEEDS[kind])
    with capfd.disabled():
        print(f"\nseed {SEEDS[kind]}, {os.cpu_count()} threads: {log}")
    return log


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_nearly_no_wrong_call_gives_a_foreign_error(desk, capfd):
    log = print_calls(capfd, "long", N_LONG)
    assert log.share < MOST, log.raw


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_nearly_none_of_many_wrong_calls_gives_a_foreign_error(desk, request, capfd):
    assert print_calls(capfd, "slow", request.config.getoption("--inputs")).share < MOST
