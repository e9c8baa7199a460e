"""The sketch is compiled by a C++ compiler and read as it writes; a clock of 32 bits goes on where
it begins anew.
"""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.robot import load_recording
from feeler.robot.stream import CLOCK, Link, read_samples, unwrap_clock
from tests.robot._board import frame_sample

COMPILER = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
VALUES = np.random.default_rng(0).integers(0, 1024, (60, 3))


@pytest.fixture(scope="module")
def board(tmp_path_factory):
    """The sketch of three channels as a program: bytes of its converter in, lines out."""
    if COMPILER is None:
        pytest.skip("no C++ compiler here")
    folder = tmp_path_factory.mktemp("board")
    words = ["robot", "board", folder / "board.ino", "--channels", 3, "--rate", 500]
    assert CliRunner().invoke(app, [str(word) for word in words]).exit_code == 0
    flags = [
        "-std=c++17",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-include",
        Path(__file__).with_name("Arduino.h"),
    ]
    made = subprocess.run(
        [COMPILER, *flags, "-x", "c++", folder / "board.ino", "-o", folder / "board"],
        capture_output=True,
    )
    assert made.returncode == 0, made.stderr.decode()

    def run(values, clock=0):
        words = {
            "input": values.astype("<u2").tobytes(),
            "env": {**os.environ, "CLOCK": str(clock)},
        }
        return subprocess.run(
            [folder / "board"], stdout=subprocess.PIPE, check=True, **words
        ).stdout.splitlines()

    return run


@pytest.mark.parametrize("clock", [5_000, 2**32 - 40_000])
def test_what_the_sketch_sends_is_what_its_converter_read_every_two_milliseconds(board, clock):
    link = Link(3)
    samples = list(read_samples(board(VALUES, clock), 3, link))
    np.testing.assert_array_equal([values for _, values in samples], VALUES)
    np.testing.assert_allclose(
        np.diff([at for at, _ in samples]), 2.0, atol=0.101
    )  # it looks each 0.1 ms
    assert samples[0][0] == pytest.approx(1e-3 * (clock + 200)) and link.describe() == ""


def test_its_numbers_wrap_and_a_broken_line_is_known(board):
    lines = board(np.tile(VALUES, (1100, 1)))[65_500:65_560]
    lines[7] = lines[7].replace(b",", b";", 1)
    link = Link(3)
    assert (
        len(list(read_samples(lines, 3, link))) == 60 and link.describe() == "1 lost, 1 broken"
    )
    assert lines[35].startswith(b"$65535,") and lines[36].startswith(b"$0,")


def test_holes_across_the_clocks_end_have_their_times():
    at = CLOCK - 9 + 2.0 * np.arange(10)
    lines = [
        frame_sample(k, t % CLOCK, np.array([k])) for k, t in enumerate(at) if k not in (4, 5)
    ]
    assert [t for t, _ in read_samples(lines, 1, Link(1))] == pytest.approx(at)
    plain = [f"{t % CLOCK:.3f},{k}" for k, t in enumerate(at)]
    assert [t for t, _ in read_samples(plain, 1, Link(1))] == pytest.approx(at)


def test_plain_lines_after_the_clock_went_round_come_at_once_and_doubles_go():
    link, at = Link(1), CLOCK - 5 + np.arange(20.0)
    came = [link.add(float(t % CLOCK), np.array([k])) for k, t in enumerate(at) for _ in "ab"]
    assert [len(some) for some in came[2:]] == [2, 0] + [1, 0] * 18
    np.testing.assert_allclose([t for some in came for t, _ in some], at)


def test_a_board_that_begins_anew_has_not_gone_round():
    lines = [frame_sample(30_000 + k, 0.9 * CLOCK + k, np.zeros(1)) for k in range(3)]
    lines += [frame_sample(k, 5.0 + k, np.zeros(1)) for k in range(3)]
    assert [t for t, _ in read_samples(lines, 1, Link(1))][3:] == [5.0, 6.0, 7.0]


def test_a_board_that_begins_anew_after_its_clock_went_round_begins_at_its_own_time():
    at = 0.9 * CLOCK + np.linspace(0, 0.2 * CLOCK, 5)
    lines = [frame_sample(30_000 + k, t % CLOCK, np.zeros(1)) for k, t in enumerate(at)]
    lines += [frame_sample(k, 5.0 + k, np.zeros(1)) for k in range(3)]
    link = Link(1)
    found = [t for t, _ in read_samples(lines, 1, link)]
    assert found == pytest.approx([*at, 5.0, 6.0, 7.0]) and link.restarts == 1


def test_a_clock_goes_round_more_than_once_and_a_jump_back_is_none():
    time = np.arange(0, 3 * CLOCK, 1000.0)
    np.testing.assert_allclose(unwrap_clock(time % CLOCK), time)
    for back in ([500.0, 100.0], [0.0, 4.0, 3.0, 8.0]):
        np.testing.assert_array_equal(unwrap_clock(np.array(back)), back)


def test_a_recording_across_the_clocks_end_is_read_and_says_so_and_one_that_runs_back_is_refused(
    tmp_path,
):
    at = (2**32 - 5000 + 2000 * np.arange(6)) % 2**32
    path = tmp_path / "touch.csv"
    path.write_text("time_us,hinge1_deg\n" + "".join(f"{t},{k}\n" for k, t in enumerate(at)))
    read = load_recording(path, n_channels=1)
    np.testing.assert_allclose(read.time, CLOCK - 5 + 2.0 * np.arange(6))
    assert "the board's clock of 32 bits began anew" in read.history[-1]
    path.write_text("time_ms,hinge1_deg\n0,1\n900,2\n400,3\n")
    with pytest.raises(InvalidInput, match="line 4: time runs backwards, from 900 to 400 ms"):
        load_recording(path, n_channels=1)
