"""A real antenna: a board that sends while it feels, and recordings. A pseudo-terminal stands in
for the board.
"""

import json
import os
import re
from threading import Event

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.presets import make_preset
from feeler.robot import (
    SensorCalibration,
    load_calibration_table,
    load_recording,
    save_calibration,
)
from feeler.robot.description import get_example
from feeler.studio import Boards
from feeler.studio.live import _LEAST_STEP, _WINDOW, Judge, listen
from feeler.studio.study import ANSWERS

from .test_session import Page

ROBOT = make_preset("robot")
HALF = np.array(
    [0.5, 0.25, 0.125, 0.0, -0.125, -0.25, -0.5, 1.0]
)  # rad; exact in a few digits and as float32


def write_lines(rows, times=None):
    texts = (",".join(f"{number:.6g}" for number in row) for row in rows)
    lines = (
        texts
        if times is None
        else (f"{time:.3f},{text}" for time, text in zip(times, texts, strict=True))
    )
    return [b"0.1,0.2\n", *(line.encode() + b"\n" for line in lines)]  # the first began before


def hear(lines, antenna=ROBOT, calibration=None, find=lambda antenna: None):
    """All that a page hears of a board, and the error with which that ended."""
    heard = []
    with pytest.raises(InvalidInput) as error:
        listen(
            iter(lines),
            antenna,
            calibration,
            find,
            lambda header, **arrays: heard.append((header, arrays)),
            Event(),
        )
    return heard, str(error.value)


def join(heard, name="angle"):
    return np.concatenate(
        [arrays[name] for header, arrays in heard if header["part"] == "piece"]
    )


@pytest.mark.parametrize("interval", [None, 0.5, 1.0, 10.0])
def test_what_the_board_sends_is_shown(interval):
    rows = HALF * np.linspace(0, 1, 41)[:, None]
    times = None if interval is None else 7.0 + interval * np.arange(41)
    heard, error = hear(write_lines(rows, times))
    assert "fell silent" in error
    assert heard[0][0]["interval"] == pytest.approx(interval or 1.0)
    assert join(heard) == pytest.approx(rows, abs=1e-6)
    assert heard[-1][0]["missing"] == heard[-1][0]["damaged"] == 0


def test_what_is_missing_is_held_and_counted():
    rows, times = HALF * np.linspace(0, 1, 40)[:, None], np.arange(40.0)
    rows[5, 2] = np.nan
    kept = np.delete(np.arange(40), [20, 21, 22])
    lines = write_lines(rows[kept], times[kept])
    lines[31:31] = [b"\xff\x00,,3\n", b"# a note\n", b"\n"]
    heard, _ = hear(lines)
    expected = rows.copy()
    expected[5, 2], expected[20:23] = rows[4, 2], rows[19]
    assert join(heard) == pytest.approx(expected, abs=1e-6)
    assert heard[-1][0]["missing"] == 3
    assert heard[-1][0]["damaged"] == 1


def make_lines(n):
    ones = np.ones(n)
    return SensorCalibration(
        slope=0.5 * ones,
        offset=-ones,
        **{
            name: ones
            for name in (
                "low",
                "high",
                "residual",
                "cross_validated",
                "resolution",
                "drift",
                "r_squared",
            )
        },
    )


def test_capacitance_becomes_angle_by_the_calibration():
    rows = 2 + 2 * HALF * np.linspace(0, 1, 20)[:, None]
    heard, _ = hear(write_lines(rows), calibration=make_lines(8))
    assert join(heard) == pytest.approx(0.5 * rows - 1, abs=1e-5)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], "is silent"),
        ([b"\n"] * 40, "11 lines without a number"),
        ([b" ,;\n"] * 40, "11 lines without a number"),
        (write_lines(np.zeros((20, 5))), "sends 5 numbers a line; .* has 56 sensors .*robot 8"),
        (
            write_lines(np.zeros((20, 7)), _LEAST_STEP * 2 * np.arange(20)),
            "sends 8 numbers a line, the first of them a time",
        ),
        (write_lines(4 + np.zeros((20, 8))), "4 is no angle"),
        ([*write_lines(np.zeros((20, 8))), *[b"noise\n"] * 60], "a sample is 8 numbers"),
    ],
)
def test_what_is_wrong_with_a_board_is_said(lines, words):
    _, error = hear(lines, antenna=make_preset("exponential"))
    assert re.search(words, error), error


@pytest.mark.long
def test_touches_are_judged_one_after_the_other_as_each_alone(studied):
    first, second = studied.tensors[0].T, studied.tensors[25].T
    rest = np.zeros((300, 8))
    judge, said, noticed = Judge(studied, 1.0), [], []
    for k, row in enumerate(np.concatenate([rest, first, rest, rest, second])):
        belief, contact = judge.update(row, float(k))
        said.append(belief)
        noticed += [k] * contact
    assert len(noticed) == 2
    for begin, touch in ((300, first), (300 + len(first) + 600, second)):
        alone = studied.decoder.decode(np.concatenate([np.zeros((200, 8)), touch]).T)[0][-1]
        assert ANSWERS[int(alone.argmax())] != "outside"
        np.testing.assert_allclose(said[begin + len(first) - 1], alone, atol=1e-6)


def find_contact(studied, rows, interval=1.0):
    """The sample with which a decoder of its own notices contact, and what it says in the end."""
    judge = Judge(studied, interval)
    beliefs, noticed = zip(
        *(judge.update(r, k * interval) for k, r in enumerate(rows)), strict=True
    )
    return noticed.index(True), beliefs[-1]


def test_a_fast_board_is_judged_at_the_pace_of_what_was_learned(studied):
    """Two samples a millisecond: each second one counts."""
    touch = np.concatenate([np.zeros((60, 8)), studied.tensors[25].T])
    slow = find_contact(studied, touch)
    fast = find_contact(studied, np.repeat(touch, 2, axis=0), 0.5)
    assert fast[0] == 2 * slow[0] + 1
    np.testing.assert_allclose(fast[1], slow[1], atol=1e-9)


def test_the_verdict_comes_once_there_is_a_study(studied):
    rows = np.concatenate([np.zeros((60, 8)), studied.tensors[25].T])
    heard, _ = hear(
        write_lines(rows, np.arange(float(len(rows)))), find=lambda antenna: studied
    )
    last, arrays = heard[-1]
    assert last["contact"] == find_contact(studied, rows)[0] >= 60
    np.testing.assert_allclose(
        arrays["posterior"][-1], studied.decoder.decode(rows.T)[0][-1], atol=1e-4
    )


@pytest.fixture
def terminal():
    """Port of a pseudo-terminal, and the end on which the board writes."""
    pty, tty = pytest.importorskip("pty"), pytest.importorskip("tty")
    pytest.importorskip("serial")
    board, port = pty.openpty()
    tty.setraw(port)
    yield os.ttyname(port), board
    os.close(port)


def test_an_unplugged_board_is_said_and_no_other_file_is_opened(terminal):
    port, board = terminal
    page = Page(boards=Boards(port))
    page.ask({"type": "ports"}).wait()
    assert port in page.find("ports")[0][0]["ports"]
    page.ask({"type": "listen", "port": "/etc/passwd", "antenna": {}}).wait()
    assert "no board at '/etc/passwd'" in page.find("error")[-1][0]["message"]
    page.ask({"type": "listen", "port": port, "antenna": {}})
    while not page.find("touch", "piece"):
        os.write(board, b"".join(write_lines(np.tile(HALF, (20, 1)))))
    os.close(board)
    page.wait(10.0)
    assert page.find("touch", "begin")[0][0]["robot"]
    assert f"the board at {port} is gone" in page.find("error")[-1][0]["message"]


def test_a_recording_of_capacitance_is_played_back_once_its_calibration_is_open(
    tmp_path, studied
):
    table = load_calibration_table(get_example("calibration"))
    recording = get_example("recording")
    save_calibration(table, tmp_path / "calibration.json")
    page = Page()
    message = {
        "type": "open",
        "name": "touch.csv",
        "text": recording.read_text(),
        "speed": 0.3,
    }
    page.ask(message).wait()
    assert "Open the sensors' calibration first" in page.find("error")[-1][0]["message"]
    page.ask(
        {"type": "open", "name": "c.json", "text": (tmp_path / "calibration.json").read_text()}
    ).wait()
    assert page.find("opened")[-1][0]["hinges"] == 8
    page.ask(message).wait()
    header, arrays = page.find("opened")[-1]
    expected = load_recording(recording).to_angles(table, outside="extend").values
    assert np.abs(arrays["angle"].max(axis=0) - expected.max(axis=1)) == pytest.approx(
        0, abs=0.02
    )
    assert header["robot"] and header["total"] == len(arrays["angle"]) <= _WINDOW * 4
    assert arrays["posterior"].shape == (header["total"], len(ANSWERS))
    page.ask({"type": "open", "name": "c.json", "text": json.dumps({"format": "other"})}).wait()
    assert "no sensor calibration" in page.find("error")[-1][0]["message"]
