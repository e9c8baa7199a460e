"""The whole run at smoke scale: the same bytes from every run, whole numbers after a kill, only
what changed made anew.
"""

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from paper.reproduce import _COCKROACH_ONLY
from paper.table import Results
from tests.paper_run import start


def read_numbers(out: Path) -> dict[str, bytes]:
    """Every numbers file of a run."""
    tables = [out / "results.csv", out / "verdicts.json"]
    files = [*tables, *sorted((out / "figures").glob("*.json"))]
    return {file.name: file.read_bytes() for file in files}


@pytest.mark.slow
def test_two_workers_leave_the_same_bytes_as_one(whole, tmp_path):
    process = start(tmp_path / "out", "--workers", "2")
    assert process.wait(600) == 0, process.stderr.read().decode()
    assert read_numbers(tmp_path / "out") == read_numbers(whole)


@pytest.mark.slow
def test_killed_at_random_and_run_again_ends_with_the_same_numbers(whole, tmp_path):
    rng = np.random.default_rng(0)
    for seconds in rng.uniform(3, 25, 6):
        process = start(tmp_path / "out")
        time.sleep(seconds)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait(30)
    process = start(tmp_path / "out")
    assert process.wait(600) == 0, process.stderr.read().decode()
    assert read_numbers(tmp_path / "out") == read_numbers(whole)


@pytest.mark.slow
def test_another_antenna_leaves_out_what_makes_no_sense_and_says_so(tmp_path):
    process = start(tmp_path / "out", "--antenna", "linear", "--set", "stiffness=1.5")
    assert process.wait(600) == 0, process.stderr.read().decode()
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("Left out: this section compares") == len(_COCKROACH_ONLY)
    assert "none is judged here" in page
    assert Results.read(tmp_path / "out" / "results.csv").get("tensors.count")
