"""A board's lines: whatever happens on the way, samples come in order, and what went wrong is
counted.
"""

import io
import os
import pty
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feeler.robot.stream import (
    CLOCK,
    WRAP,
    Link,
    open_serial,
    read_lines,
    read_samples,
)
from tests.robot._board import frame_sample


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


@settings(max_examples=40)
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


def damage(line, rng):
    """Cut at an end, a byte changed or lost, joined to itself, or noise."""
    k, how = int(rng.integers(1, len(line))), rng.integers(6)
    other = bytes(rng.integers(33, 256, 1, dtype=np.uint8))
    noise = bytes(rng.integers(33, 256, k, dtype=np.uint8))
    ways = line[:k], line[k:], line[:k] + other + line[k + 1 :], line[: k - 1] + line[k:]
    return (*ways, line + line[:k], noise)[how]


@pytest.mark.further
@pytest.mark.parametrize("between", ["$", ",", "; ", "\t", " "])
@pytest.mark.parametrize("timed", [True, False])
def test_two_thousand_broken_lines_cost_no_sound_one(between, timed):
    """Board's lines are never misread. In plain ones a digit more or less cannot be noticed: less
    than a sixth of the broken are taken, each in its own place.
    """
    rng, arriving, sound = np.random.default_rng(5), [], []
    for k in range(6000):
        values = k + np.arange(10) / 16
        cells = [f"{k:.3f}"] * timed + [f"{x:.5f}" for x in values]
        plain = between.join(cells)
        line = (frame_sample(k, k, values) if between == "$" else plain).encode()
        whole = k < 5 or k % 3 > 0
        sound += [k] * whole
        arriving.append(line if whole else damage(line, rng))
    link = Link(10)
    found = list(read_samples(arriving, 10, link))
    read = [(at, values) for at, values in found if not np.isnan(values).all()]
    right = [
        round(values[0])
        for at, values in read
        if np.abs(values - values[0] - np.arange(10) / 16).max() < 0.02
        and at in (None, round(values[0]))
    ]
    assert right == sorted(right) and {*sound} <= {*right}
    assert len(read) - len(right) <= (0 if between == "$" else 2000 / 6)
    assert link.broken + link.late + len(read) > 6000 - 20  # the others look like notes


def test_lines_whose_times_are_in_us_are_broken_and_the_reason_is_named():
    link = Link(2)
    found = list(read_samples([f"{2500 * k},1,2" for k in range(300)], 2, link))
    assert len(found) <= 1 and link.broken >= 299 and "2500 ms after it" in link.fault


@given(st.integers(1, 30), st.sampled_from("0123456789"))
def test_any_one_other_character_breaks_a_line(place, other):
    line = frame_sample(12, 1034.25, np.array([4.73, 4.71, 0.125, -3.5, 0.0625]))
    link, changed = Link(5), line[:place] + other + line[place + 1 :]
    assert (len(link.take(changed)), link.broken) == ((1, 0) if changed == line else (0, 1))


def test_a_sound_line_of_other_sensors_is_broken():
    link = Link(2)
    assert [link.take(line) for line in send(3)] == [[], [], []] and link.broken == 3


def test_a_clock_that_begins_anew_goes_on_for_hours():
    link, true = Link(3), np.arange(0.0, 3.5 * CLOCK, CLOCK / 7)
    assert [link.follow(time % CLOCK) for time in true] == pytest.approx(list(true))


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


BANNER = [b"ets Jun  8 2016 00:22:57\n", b"rst:0x1 (POWERON_RESET),boot:0x13\n", b"entry 0x4\n"]
HOSTILE = [
    b"\n", b"\0\0\0\n", b",,,\n", b",\n", b"$\n", b"$*00\n", b"*7F\n", b"nan\n", b"\xff\xfe\n",
    b"1e999,1,2,3\n", b"5,1e16,2,3\n", b"5,inf,2,3\n", b"nan,1,2,3\n", b"5,1_0,2,3\n",
    "٥,١,٢,٣\n".encode(), "５,１,２,３\n".encode(), b"5,0x1,2,3\n", b"5,1,2\n", b"5,1,2,3,4\n",
    b"5,--1,2,3\n", b"5,1.2.3,2,3\n", b"5,1e,2,3\n", b"5,.,2,3\n", b"5,\x1b[2J,2,3\n",
    b"1e15,1,2,3\n", b"-1e15,1,2,3\n", b"7" * 9000 + b",1,2,3\n", *BANNER,
]  # fmt: skip


def write_plain(count):
    """Lines with a time of seven digits and three readings, each of which says its own number."""
    values = [(k % 90 + 10) / 100 for k in range(count)]
    return [
        b"%.3f,%.2f,%.2f,%.2f\n" % (7e4 + 2.4 * k, v, v + 1, v + 2)
        for k, v in enumerate(values)
    ]


def spoil(line, after, rng):
    """A line cut, joined to the next, with a byte gone wrong, or something else altogether."""
    match rng.integers(5):
        case 0:
            return line[: rng.integers(1, 10)] + b"\n"
        case 1:
            return line[rng.integers(12, 20) :]
        case 2:
            return line[:-1] + after
        case 3:
            k = rng.integers(len(line) - 1)
            return line[:k] + bytes([rng.choice([0, 7, 27, 33, 127, 128, 255])]) + line[k + 1 :]
    return HOSTILE[rng.integers(len(HOSTILE))]


@pytest.mark.parametrize("framed", [False, True])
def test_thousands_of_broken_lines_end_no_stream_and_none_becomes_a_sample(framed):
    rng, link = np.random.default_rng(5), Link(3)
    plain = write_plain(4000)
    lines = plain
    if framed:
        rows = [list(map(float, line.split(b","))) for line in plain]
        lines = [
            frame_sample(k, row[0], np.array(row[1:])).encode() + b"\n"
            for k, row in enumerate(rows)
        ]
    bad = set(rng.choice(np.arange(1, 3999), 2000, replace=False).tolist())
    sent = b"".join(
        spoil(line, lines[k + 1], rng) if k in bad else line
        for k, line in enumerate(lines[:-1])
    )
    found = list(read_samples(read_lines(io.BytesIO(sent)), 3, link))
    times = np.array([at for at, _ in found])
    assert (np.diff(times) > 0).all() and link.restarts == 0
    for at, values in found:
        k = round((at - 7e4) / 2.4)
        assert np.isnan(values).all() or values == pytest.approx(
            np.array(plain[k].split(b",")[1:], dtype=float)
        )
    seen = {round((at - 7e4) / 2.4) for at, values in found if np.isfinite(values).all()}
    assert seen >= set(range(3999)) - bad  # every whole line is a sample
    assert link.broken + link.late > 1500 and link.fault


def test_an_empty_cell_is_a_missing_channel_and_moves_no_other():
    for row in (b"%d,,2,3\n", b"%d,nan,2,3\n"):
        for at, values in read_samples([row % k for k in range(5, 9)], 3):
            assert at in range(5, 9) and np.isnan(values[0])
            assert values[1:].tolist() == [2, 3]


@pytest.mark.parametrize("framed", [False, True])
def test_a_board_that_is_reset_is_heard_again_and_a_late_line_is_not(framed):
    def send_all(times, first=0):
        if framed:
            return [frame_sample(first + k, t, np.full(1, t)) for k, t in enumerate(times)]
        return [f"{t},{t}" for t in times]

    before, after = np.arange(5e4, 5.1e4, 10.0), np.arange(100.0, 1600.0, 10.0)
    link = Link(1)
    lines = [*send_all(before), "ets Jun  8 2016 00:22:57", *send_all(after)]
    found = [time for time, _ in read_samples(lines, 1, link)]
    assert link.restarts == 1 and link.broken == 1
    assert found[:100] == before.tolist() and found[100:] == after[-len(found) + 100 :].tolist()
    assert len(found) > 200
    link, times = Link(1), [*np.arange(0.0, 50.0), 47.0, *np.arange(50.0, 60.0)]
    numbered = [frame_sample(int(t), t, np.full(1, t)) for t in times]
    sent = numbered if framed else send_all(times)
    assert [time for time, _ in read_samples(sent, 1, link)] == np.arange(60.0).tolist()
    assert (link.late, link.broken, link.restarts) == (1, 0, 0)
