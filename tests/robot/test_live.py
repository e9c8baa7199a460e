"""A touch while it happens: units, readings that are not possible, and one answer from its first
line to its last.
"""

import json
import os
import pty
import re
import threading
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli import robot_live
from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.robot import (
    Recording,
    draw_robots,
    draw_training_set,
    make_classifier,
    make_decoder,
    make_robot,
    make_touches,
    touch_robots,
    train_decoder,
)
from feeler.robot.classify import choose_before, judge_recording
from feeler.robot.decoder import Readings, _LiveTouch
from feeler.robot.sensors import fit_sensors
from feeler.robot.stream import Link

TRIALS = make_touches(locations=(0.5, 0.9), speeds=(0.27,))


def calibrate(unit="mV", scale=1.0):
    """Three hinges whose readings are 1000 to 3000 mV, or these in another unit."""
    angle = np.tile(np.linspace(-0.7, 0.7, 9), 3)
    hinge = np.repeat([1, 2, 3], 9)
    reading = scale * (2000 + (1400 + 10 * hinge) * angle)
    return fit_sensors(hinge, angle, reading, unit=unit)


@pytest.mark.parametrize(("unit", "factor"), [("V", 1e-3), ("mV", 1.0)])
def test_readings_in_another_unit_are_the_same_angles(unit, factor):
    lines, sample = calibrate(), np.array([1500.0, np.nan, 2900.0])
    expected = lines.slope * sample + lines.offset
    np.testing.assert_allclose(
        Readings(lines, unit).convert(factor * sample), expected, rtol=1e-12
    )
    assert Readings(lines).unit == "mV" and Readings(None).unit == "rad"
    degrees = Readings(lines, "deg").convert(np.array([10.0, -90.0, 179.0]))
    np.testing.assert_allclose(degrees, np.deg2rad([10, -90, 179]))


@pytest.mark.parametrize("outside", ["refuse", "clip", "missing", "extend"])
def test_volts_for_millivolts_are_refused_and_a_glitch_alone_is_left_out(outside):
    lines = calibrate()
    volts, good = np.array([1.5, 2.0, 2.5]), np.array([1500.0, 2000.0, 2500.0])
    readings = Readings(lines, outside=outside)
    for k in range(200):  # now and then one reading of three
        values = good.copy()
        values[1] = 9e4 if k % 10 == 0 else values[1]
        angle = readings.convert(values)
        expected = lines.apply(
            values[:, None], outside="missing" if outside == "refuse" else outside
        )
        np.testing.assert_array_equal(angle, expected[:, 0])
    assert readings.outside == 20 and readings.fate.startswith("outside the calibrated range")
    readings = Readings(lines, outside=outside)
    if outside != "refuse":
        for _ in range(50):
            readings.convert(volts)
        assert readings.outside == 50
        return
    with pytest.raises(InvalidInput, match=r"20 samples in a row .* calibrated .* unit right"):
        for _ in range(20):
            assert np.isnan(readings.convert(volts)).all()


@pytest.mark.parametrize("rail", [0.0, 4095.0])
def test_one_wire_at_a_rail_is_left_out_live_and_in_a_recording_and_does_not_stop_the_others(
    rail,
):
    """The same angles as without that sensor; a curve is prepared once, not for each sample."""
    angle = np.linspace(-0.7, 0.7, 15)
    hinge, reading = np.repeat([1, 2, 3], 15), 2000 + 1300 * np.sin(np.tile(angle, 3))
    lines = fit_sensors(hinge, np.tile(angle, 3), reading, unit="mV", curve="cubic")
    values = 2000 + 400 * np.sin(np.arange(120) / [[9], [7], [5]])
    values[1] = rail
    other = values.copy()
    other[1] = np.nan
    expected = lines.apply(other)
    live, told = Readings(lines), Readings(lines, missing=(2,))
    found = np.array([live.convert(sample) for sample in values.T]).T
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(found[:, 0], told.convert(values[:, 0]))
    assert (live.outside, told.outside) == (120, 0)
    assert lines._curves is lines._curves
    recording = Recording(time=np.arange(120.0), values=values, quantity="voltage")
    kept = recording.to_angles(lines, bad_channels="missing")
    np.testing.assert_array_equal(kept.values, expected)
    assert kept.history[-1].endswith("never in its range, made missing: 2")
    with pytest.raises(InvalidInput, match="most in hinge 2"):
        recording.to_angles(lines)
    values[0] = rail  # two of three: not a wire, but a unit
    with pytest.raises(InvalidInput, match="outside the calibrated range"):
        Recording(time=np.arange(120.0), values=values, quantity="voltage").to_angles(
            lines, bad_channels="missing"
        )
    with pytest.raises(InvalidInput, match="20 samples in a row"):
        for sample in values.T:
            live.convert(sample)


def test_degrees_for_radians_and_other_units_than_the_calibration_s_are_refused():
    readings = Readings()
    with pytest.raises(InvalidInput, match="turns by 40 rad, more than half a turn"):
        for _ in range(20):
            readings.convert(np.array([0.1, -40.0, np.nan]))
    assert readings.outside == 20
    with pytest.raises(InvalidInput, match="readings in mV, the readings are in pF"):
        Readings(calibrate(), "nF")
    with pytest.raises(InvalidInput, match="readings in mV need a calibration"):
        Readings(None, "V")
    with pytest.raises(InvalidInput, match=r"is 'volt'; valid: rad, "):
        Readings(calibrate(), "volt")
    with pytest.raises(InvalidInput, match="unknown outside='perhaps'"):
        Readings(calibrate(), outside="perhaps")


@pytest.fixture(scope="module")
def trained():
    """A decoder and a classifier of one training set, and touches of robots outside it."""
    training = draw_training_set(trials=TRIALS, robots=8)
    decoder = training.watch(make_decoder(trials=TRIALS))
    classifier = make_classifier(training=training)
    return decoder, classifier, touch_robots(draw_robots(1.0, 2, 5), trials=TRIALS)


def play(trained, recording, step=1.0, jitter=0.0, begin=123e3, side=1):
    """The live touch of a recording that is sent every ``step`` ms, and its states."""
    rng, count = np.random.default_rng(2), recording.time.size
    at = np.arange(0.0, count - 1, step)
    at[1:] += np.clip(rng.normal(0, jitter, at.size - 1), -0.4 * step, 0.4 * step)
    at = np.minimum(at, count - 1.0)
    sent = np.array([np.interp(at, np.arange(count), row) for row in recording.values])
    decoder, classifier, _ = trained
    live = _LiveTouch(decoder, classifier, make_robot(), choose_before(make_robot(), TRIALS))
    return live, [live.update(side * sent[:, k], begin + at[k]) for k in range(at.size)]


@pytest.mark.parametrize(("step", "jitter"), [(1.0, 0.0), (2.0, 0.0), (2.4, 0.2)])
def test_what_is_said_last_is_what_classify_says_however_fast_the_sender(trained, step, jitter):
    felt = [one for touches in trained[2] for one in touches.recordings]
    for recording in felt if step == 1.0 else felt[::3]:
        live, states = play(trained, recording, step, jitter)
        end = live.end()
        whole, _ = judge_recording(
            trained[1], recording, make_robot(), choose_before(make_robot(), TRIALS)
        )
        assert (end.label, end.strange) == (live.answer.label, live.answer.strange)
        assert end.probability == live.answer.probability
        if step == 1.0:  # the same samples, but for the last
            assert end.label == whole.label and end.strange == whole.strange
            assert end.probability == pytest.approx(whole.probability, abs=0.05)
        assert live.stream.missed == 0
        assert states[-1].since_contact == end.since_contact
        np.testing.assert_allclose(end.posterior.sum(), 1)
        assert live.kept[-1][2] is end


def test_a_board_that_begins_anew_begins_a_new_touch(trained):
    recording = trained[2][0].recordings[0]
    live, states = play(trained, recording)
    first = live.end()
    live.begin()
    assert live.answer is None and live.end() is None
    again = [
        live.update(recording.values[:, k], float(k)) for k in range(recording.time.size - 1)
    ]
    assert [one.since_contact for one in again] == [one.since_contact for one in states]
    assert live.end().probability == pytest.approx(first.probability)


def test_a_long_wait_before_the_touch_costs_nothing_and_changes_no_answer(trained):
    """A judgement of the whole once read all samples since the stream began: 50 ms each."""
    recording = trained[2][0].recordings[1]
    resting = np.repeat(recording.values[:, :1], 6000, axis=1)
    resting += np.random.default_rng(3).normal(0, 1e-3, resting.shape)
    waited = recording.replace(
        time=np.arange(6000.0 + recording.time.size),
        values=np.concatenate([resting, recording.values], axis=1),
    )
    (live, states), (prompt, own) = (play(trained, one) for one in (waited, recording))
    assert len(live.kept) <= 2100 + states[-1].since_contact
    assert live.end().label == prompt.end().label == own[-1].label
    assert live.answer.probability == pytest.approx(prompt.answer.probability, abs=0.1)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The command with a decoder of few touches."""
    path = tmp_path_factory.mktemp("live") / "my.decoder"
    train_decoder(trials=TRIALS, robots=6, noise=0.003).save(path)

    def run(lines, *options):
        words = ["robot", "stream", "-", "--decoder", str(path), *options]
        return CliRunner().invoke(app, words, input=lines)

    return run


def write(recording, factor=1.0):
    return [
        f"{7e4 + at:.3f}," + ",".join(f"{factor * value:.8g}" for value in values)
        for at, values in zip(recording.time, recording.values.T, strict=True)
    ]


@pytest.mark.long
def test_the_command_skips_what_is_no_sample_and_says_so_while_it_listens(run, trained):
    lines = write(trained[2][0].recordings[1])
    sound = run("\n".join(lines), "--json")
    *states, end = map(json.loads, sound.stdout.splitlines())
    torn = [line[: 9 + k % 30] if k % 50 == 20 else line for k, line in enumerate(lines)]
    torn[5:5] = ["ets Jun  8 2016 00:22:57", "rst:0x1", "\x00\x01\x7f", "1,2,3"]
    damaged = run("\n".join(torn), "--json")
    assert damaged.exit_code == 0, damaged.exception
    *found, last = map(json.loads, damaged.stdout.splitlines())
    count = last["broken"]
    assert count == 4 + len([k for k in range(len(lines)) if k % 50 == 20])
    assert 4 <= found[0]["broken"] <= found[-1]["broken"] <= count
    assert last["whole"]["label"] == end["whole"]["label"] and last["unit"] == "rad"
    assert found[-1]["label"] == last["whole"]["label"] == states[-1]["label"]
    assert found[-1]["unlike_all"] == last["whole"]["unlike_all"]
    said = run("\n".join(torn)).output
    assert "listening: 8 numbers a line, in rad (--unit), times in ms (--time-unit)" in said
    assert "1 broken lines so far" in said and f"of the lines that came: {count} broken" in said


def test_the_command_takes_a_unit_and_refuses_what_none_of_its_lines_can_be(run, trained):
    recording = trained[2][0].recordings[1]
    plain = json.loads(run("\n".join(write(recording)), "--json").stdout.splitlines()[-1])
    degrees = "\n".join(write(recording, 180 / np.pi))
    same = json.loads(run(degrees, "--json", "--unit", "deg").stdout.splitlines()[-1])
    assert same["whole"]["probability"] == pytest.approx(plain["whole"]["probability"], 1e-3)
    assert same["unit"] == "deg"
    with pytest.raises(InvalidInput, match="more than half a turn"):
        raise run("\n".join(write(recording, 1e3))).exception
    with pytest.raises(
        InvalidInput, match=r"3 of 3 lines are no samples; of the latest: .* got 2"
    ):
        raise run("header a\n1,2\n1,2\n1,2\n").exception
    with pytest.raises(
        InvalidInput, match=re.escape("time_unit='hours' is unknown; valid: ms")
    ):
        raise run("", "--time-unit", "hours").exception
    seconds = "\n".join(
        f"{float(line.split(',')[0]) / 1e3:.6f},{line.split(',', 1)[1]}"
        for line in write(recording)
    )
    timed = json.loads(run(seconds, "--json", "--time-unit", "s").stdout.splitlines()[-1])
    assert timed["whole"]["probability"] == pytest.approx(plain["whole"]["probability"], 1e-3)


@pytest.mark.long
def test_what_a_board_sends_during_training_waits(monkeypatch):
    ours, theirs = pty.openpty()
    link = Link(3)
    samples = robot_live._listen(os.ttyname(theirs), True, 115_200, 2.0, link, 3, None)
    lines = [f"{k},{k},{k + 1},{k + 2}\n".encode() for k in range(400)]
    for line in lines:
        os.write(ours, line)
    time.sleep(0.2)  # training
    threading.Timer(0.1, os.write, (ours, b"400,1,2,3\n")).start()
    found = [at for at, _ in samples]
    os.close(ours)
    os.close(theirs)
    assert found == list(range(401)) and link.describe() == ""
