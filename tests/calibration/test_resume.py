"""A search that is stopped, by whatever, goes on where it was and ends with the same numbers."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from feeler.calibration import (
    METHODS,
    Problem,
    Protocol,
    fit,
    make_hinges,
    make_starts,
    make_targets,
    search,
)
from feeler.errors import InvalidInput
from feeler.provenance import Journal

from .small_antenna import make_small


def make_problem(**protocol):
    targets = make_targets(frequency=0.022, damping_ratio=0.25)
    return Problem(
        hinges=make_hinges("scale", make_small()),
        targets=targets,
        protocol=Protocol(**({"timestep": 0.05} | protocol)),
    )


def make_two_starts(problem):
    return make_starts(problem.hinges, 2, np.random.default_rng(0), spread=0.3)


def count(file: Path) -> int:
    return len(file.read_bytes().splitlines()) - 1 if file.exists() else 0


SLOW_FIT = """
import sys, time
from tests.calibration.test_resume import fit, make_problem, make_two_starts
problem = make_problem()
problem.watch = lambda evaluations, best: time.sleep(0.05)
fit(problem, make_two_starts(problem), method="powell", checkpoint=sys.argv[1], max_evaluations=40)
"""


@pytest.mark.long
def test_a_killed_fit_loses_nothing_it_had_finished(tmp_path):
    file = tmp_path / "fit.jsonl"
    root = Path(__file__).parents[2]
    process = subprocess.Popen([sys.executable, "-c", SLOW_FIT, str(file)], cwd=root)
    deadline = time.monotonic() + 120
    while count(file) < 12 and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL  # it was killed in the middle, not finished
    kept = count(file)
    assert kept >= 12

    resumed, whole = make_problem(), make_problem()
    options = {"method": "powell", "max_evaluations": 40}
    found = fit(resumed, make_two_starts(resumed), checkpoint=file, **options)
    expected = fit(whole, make_two_starts(whole), **options)
    assert [m.p for m in found.minima] == [m.p for m in expected.minima]
    assert [m.evaluations for m in found.minima] == [m.evaluations for m in expected.minima]
    assert kept < found.minima[0].evaluations  # it was within its first start
    assert count(file) - kept <= whole.evaluations - kept  # nothing was simulated twice
    assert found.error == expected.error


@pytest.mark.further
@pytest.mark.parametrize("method", METHODS)
def test_a_replay_simulates_nothing(tmp_path, method, monkeypatch):
    file = tmp_path / "fit.jsonl"
    first = fit(make_problem(), method=method, checkpoint=file, max_evaluations=40)
    monkeypatch.setattr(Protocol, "measure_many", lambda *_: pytest.fail("simulated again"))
    problem = make_problem()
    with Journal(file, json.loads(file.read_bytes().splitlines()[0])["key"]) as problem.journal:
        again = search(problem, problem.hinges.start, method, max_evaluations=40)
    assert again == first.minima[0]


def test_methods_and_starts_share_a_checkpoint(tmp_path):
    file = tmp_path / "fit.jsonl"
    for method in METHODS:
        fit(make_problem(), method=method, checkpoint=file, max_evaluations=15)
    vectors = [
        tuple(json.loads(line)["name"][0]) for line in file.read_bytes().splitlines()[1:]
    ]
    assert len(set(vectors)) == len(vectors) > 15


def test_a_foreign_file_is_refused_and_left_alone(tmp_path):
    file = tmp_path / "fit.jsonl"
    fit(make_problem(), checkpoint=file, max_evaluations=10)
    before = file.read_bytes()
    with pytest.raises(InvalidInput, match="belongs to another fit"):
        fit(make_problem(deflection=0.5), checkpoint=file, max_evaluations=10)
    assert file.read_bytes() == before
    file.write_bytes(b"my precious notes, no newline")
    with pytest.raises(InvalidInput, match="no journal of a fit"):
        fit(make_problem(), checkpoint=file)
    assert file.read_bytes() == b"my precious notes, no newline"


def test_whoever_watches_sees_every_group_of_antennas():
    problem, seen = make_problem(), []
    problem.watch = lambda evaluations, best: seen.append((evaluations, best))
    found = search(problem, np.ones(2), "nelder-mead", 30)
    assert [n for n, _ in seen] == list(range(1, found.evaluations + 1))
    assert seen[-1][1] == found.error == min(best for _, best in seen)
