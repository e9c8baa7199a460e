"""A board's lines: whatever happens on the way, samples come in order, and what went wrong is
counted.
"""

import inspect
import os
import pty
import re
import threading
import time
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feeler.robot.link import CLOCK, WRAP, Link, frame_sample, unwrap_clock
from feeler.robot.samples import open_serial, read_samples


def send(count, first=0):
    return [
        frame_sample(first + k, 2.0 * k, np.array([k, -k / 8, np.nan])) for k in range(count)
    ]


def test_a_line_is_its_layout_and_the_sum_that_of_nmea():
    line = frame_sample(12, 1034.25, np.array([4.73, 4.71, np.nan]))
    assert line == "$12,1034.250,4.73,4.71,nan*7F"
    body = line[1:-3]
    assert int(line[-2:], 16) == int(
        np.bitwise_xor.reduce(np.frombuffer(body.encode(), np.uint8))
    )


@given(
    st.lists(
        st.sampled_from(["lose", "double", "break", "swap", "pass"]), min_size=40, max_size=40
    ),
    st.booleans(),
)
def test_lost_late_doubled_and_broken_lines_leave_an_even_row_of_samples(fates, wrap):
    first = WRAP - 20 if wrap else 0
    lines, arriving = send(41, first), []
    for fate, line in zip(fates, lines[1:], strict=True):
        if fate == "swap" and arriving:
            arriving.insert(-1, line)
        elif fate != "lose":
            arriving += {"double": [line, line], "break": [line.replace(",", ";", 1)]}.get(
                fate, [line]
            )
    link = Link(3)
    samples = list(read_samples([lines[0], *arriving], 3, link))
    times = [at for at, _ in samples]
    assert times == pytest.approx(
        [2.0 * k for k in range(len(times))]
    )  # every sample has its place, seen or not
    seen = [k for k, (_, values) in enumerate(samples) if not np.isnan(values[0])]
    assert all(samples[k][1][0] == k for k in seen) and len(samples) - len(seen) == link.lost
    assert link.broken == fates.count("break")
    assert len(seen) + link.late + link.broken == 1 + len(arriving)


@given(st.integers(1, 30), st.sampled_from("0123456789"))
def test_any_one_other_character_breaks_a_line(place, other):
    line = frame_sample(12, 1034.25, np.array([4.73, 4.71, 0.125, -3.5, 0.0625]))
    link, changed = Link(5), line[:place] + other + line[place + 1 :]
    assert (len(link.take(changed)), link.broken) == ((1, 0) if changed == line else (0, 1))


def test_a_sound_line_of_other_sensors_is_broken():
    link = Link(2)
    assert [link.take(line) for line in send(3)] == [[], [], []] and link.broken == 3


def test_a_board_that_begins_anew_is_followed():
    link = Link(3)
    samples = [sample for line in [*send(5, 30000), *send(5)] for sample in link.take(line)]
    assert len(samples) == 10 and link.describe() == ""


def test_a_clock_that_begins_anew_goes_on_for_hours():
    link, true = Link(3), np.arange(0.0, 3.5 * CLOCK, CLOCK / 7)
    assert [link.follow(time % CLOCK) for time in true] == pytest.approx(list(true))


def test_a_recorded_clock_that_begins_anew_is_unwrapped_and_a_small_step_back_stays():
    true = np.arange(0.0, 2.5 * CLOCK, CLOCK / 7)
    np.testing.assert_allclose(unwrap_clock(true % CLOCK), true, rtol=1e-12)
    jitter = np.array([0.0, 4.0, 3.0, 8.0])
    np.testing.assert_array_equal(unwrap_clock(jitter), jitter)


def test_a_serial_line_that_drops_and_repeats_is_read_as_it_comes():
    """Over a pseudo-terminal: what the kernel hands on is what a USB board's would."""
    ours, theirs = pty.openpty()
    lines = send(60)
    kept = [line for k, line in enumerate(lines) if k not in (7, 8, 30)]
    kept.insert(20, kept[19])
    kept[40] = kept[40].replace("*", "!")

    def write():
        time.sleep(0.3)  # opening a port throws away what came before
        for line in kept:
            os.write(ours, (line + "\r\n").encode())
            time.sleep(0.001)

    writer = threading.Thread(target=write)
    link = Link(3)
    arriving = open_serial(os.ttyname(theirs), timeout=0.5)
    writer.start()
    samples = list(read_samples(arriving, 3, link))
    writer.join()
    os.close(ours)
    os.close(theirs)
    assert [at for at, _ in samples] == pytest.approx([2.0 * k for k in range(60)])
    assert (link.lost, link.late, link.broken) == (4, 1, 1)
    assert link.describe() == "4 lost, 1 late or doubled, 1 broken"


def test_the_sketch_the_library_and_the_studio_speak_at_one_rate():
    """A board is heard only by who asks at the rate at which it sends."""
    sketch = files("feeler.robot").joinpath("board.ino").read_text(encoding="utf-8")
    (rate,) = re.findall(r"BAUD = (\d+)", sketch)
    assert inspect.signature(open_serial).parameters["baudrate"].default == int(rate)
