"""A decoder in a file: what it answers after loading, without a sensor, for another robot, and as a
C header.
"""

import json
import os
import pty
import re
import runpy
import shutil
import subprocess
import threading
import time
import tty
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.robot import (
    RobotDecoder,
    draw_robots,
    make_robot,
    make_touches,
    save_calibration,
    save_recording,
    touch_robots,
    train_decoder,
)
from feeler.robot.decoder import _LiveTouch, make_board_decoder
from feeler.robot.sensors import fit_sensors
from feeler.robot.stream import Link, _Buffer, open_serial, read_lines, read_samples

NODE = Path(__file__).parents[2] / "examples" / "ros2" / "antenna_node.py"
TRIALS = make_touches(locations=(0.5, 0.9), speeds=(0.27,))


@pytest.fixture(scope="module")
def decoder():
    return train_decoder(trials=TRIALS, robots=8, noise=0.003, name="mine")


@pytest.fixture(scope="module")
def touched():
    """Touches of a robot that is in no training set, whose name nobody noted."""
    touches = touch_robots(draw_robots(1.0, 1, 5), trials=TRIALS)[0]
    return [recording.replace(robot="") for recording in touches.recordings], touches.labels


@pytest.fixture(scope="module")
def file(decoder, tmp_path_factory):
    path = tmp_path_factory.mktemp("decoder") / "my.decoder"
    lines = fit_sensors(
        np.repeat(np.arange(1, 9), 5),
        np.tile(np.linspace(-1, 1, 5), 8),
        np.tile(np.arange(5.0), 8),
    )
    replace(decoder, calibration=lines, joints=("antenna_*",)).save(path)
    return path


def test_a_loaded_decoder_answers_as_the_trained_one(decoder, file, touched):
    loaded = RobotDecoder.load(file)
    assert loaded.recipe == json.loads(json.dumps(decoder.recipe))
    assert (loaded.accuracy, loaded.tolerance) == (decoder.accuracy, decoder.tolerance)
    assert loaded.joints == ("antenna_*",) and loaded.calibration.n_hinges == 8
    right = 0
    for recording, label in zip(*touched, strict=True):
        found, expected = loaded.classify(recording), decoder.classify(recording)
        assert (found.label, found.missing) == (expected.label, expected.missing)
        assert found.probability == pytest.approx(expected.probability, abs=1e-5)
        right += found.label == label
        truncated = recording.replace(
            time=recording.time[:-150], values=recording.values[:, :-150]
        )  # its classifier is fitted when it is asked for
        short, own = loaded.classify(truncated), decoder.classify(truncated)
        assert short.label == own.label and "are needed" in short.missing
        assert short.probability == pytest.approx(own.probability, abs=1e-3)
    assert right >= 3


def test_a_stream_of_a_loaded_decoder_gives_the_trained_one_s_states(decoder, file, touched):
    lives = [one.start(missing=(3,)) for one in (RobotDecoder.load(file), decoder)]
    recording = touched[0][1]
    for at, values in zip(recording.time, recording.values.T, strict=True):
        states = [live.update(values, at) for live in lives]
        assert states[0].state == states[1].state and states[0].label == states[1].label
        np.testing.assert_allclose(states[0].posterior, states[1].posterior, atol=1e-3)
    assert lives[0].answer is not None and lives[0].answer.without == (3,)


def test_a_missing_sensor_is_said_and_costs_little(decoder, touched):
    """The classifier without it is the one that never had it."""
    right = 0
    for number, (recording, label) in enumerate(zip(*touched, strict=True)):
        values = recording.values.copy()
        values[number] = np.nan if number % 2 else values[number, 0]  # torn off, or stuck
        answer = decoder.classify(recording.replace(values=values))
        assert answer.without == (number + 1,)
        right += answer.label == label
        with pytest.raises(InvalidInput, match=rf"hinge {number + 1} is (dead|empty)"):
            decoder.classify(recording.replace(values=values), bad_channels="refuse")
    assert right >= 3
    assert decoder.tolerance["1"] > decoder.accuracy - 0.2
    means, y, groups, others = decoder.classifier._training
    without = decoder.classifier._without[tuple([1, 2, 3, 4, 5, 6, 7, -means.shape[2]])]
    fresh = type(without)()._learn(means[:, 1:], y, groups, (others[0][:, 1:], others[1]))
    np.testing.assert_array_equal(fresh.confusion_, without.confusion_)


def test_held_out_touches_are_counted_once_each(decoder):
    confusion = decoder.classifier.confusion_
    assert confusion.shape == (4, 4) and confusion.sum() <= 8 * len(TRIALS)
    assert decoder.accuracy == np.trace(confusion) / confusion.sum()
    assert decoder.recipe["noise"] == 0.003 and decoder.recipe["friction"] == [1.0]


def test_another_robot_is_refused_by_name(decoder, touched):
    with pytest.raises(InvalidInput, match="belongs to robot 'mine', the recording to 'yours'"):
        decoder.classify(touched[0][0].replace(robot="yours"))
    longer = make_robot(mass=0.6)
    with pytest.raises(InvalidInput, match=r"robot 'mine', not for 'long'.*other numbers"):
        decoder.check_antenna(longer, "long")
    decoder.check_antenna(make_robot(name="the same"), "the same")
    for missing in ((0,), (9,), range(1, 9)):
        with pytest.raises(InvalidInput, match="numbers of sensors from 1 to 8, not all"):
            decoder.start(missing=missing)
    with pytest.raises(InvalidInput, match="noise must be > 0 rad, got -1"):
        train_decoder(noise=-1.0)


@pytest.mark.parametrize("share", [0.2, 0.9])
def test_a_file_that_was_cut_or_is_another_is_refused(file, tmp_path, share):
    cut = tmp_path / "cut.decoder"
    cut.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    with pytest.raises(InvalidInput, match=r"cut\.decoder"):
        RobotDecoder.load(cut)
    with pytest.raises(InvalidInput, match="no such file"):
        RobotDecoder.load(tmp_path / "none.decoder")


def run(*words):
    return CliRunner().invoke(app, ["robot", *map(str, words)])


def test_the_commands_take_a_decoder_and_refuse_what_is_not_its(file, touched, tmp_path):
    path = tmp_path / "touch.csv"
    save_recording(touched[0][0], path)
    done = run("classify", path, "--decoder", file, "--json")
    assert done.exit_code == 0, done.exception
    found = json.loads(done.stdout)[0]
    assert tuple(found["label"].values()) == touched[1][0]
    streamed = run("stream", path, "--decoder", file, "--json", "--missing", "2")
    assert streamed.exit_code == 0, streamed.exception
    last = json.loads(streamed.stdout.splitlines()[-1])
    assert last["whole"]["without"] == [2] and last["samples"] == touched[0][0].time.size
    assert last["rate_hz"] == pytest.approx(990, rel=0.02)  # of 1000, one in a hundred is lost
    both = run("classify", path, "--decoder", file, "--speeds", "0.1,0.2")
    assert both.exit_code != 0 and "--speeds belongs to the training" in str(both.exception)
    other = run("stream", path, "--decoder", file, "--antenna", "cockroach")
    assert other.exit_code != 0 and "robot 'mine', not for 'cockroach'" in str(other.exception)
    lines = fit_sensors(np.repeat(np.arange(1, 9), 3), *np.tile([[0, 1, 2], [5, 6, 7]], 8))
    save_calibration(lines.replace(robot="theirs"), tmp_path / "lines.json")
    foreign = run("classify", path, "--decoder", file, "--calibration", tmp_path / "lines.json")
    assert foreign.exit_code != 0 and "lines.json to 'theirs'" in str(foreign.exception)
    save_recording(touched[0][0].replace(robot="yours"), path)
    theirs = run("classify", path, "--decoder", file)
    assert theirs.exit_code != 0 and "touch.csv to 'yours'" in str(theirs.exception)


@pytest.mark.long
def test_without_a_file_a_decoder_is_kept_for_the_next_time(touched, tmp_path, monkeypatch):
    monkeypatch.setenv("FEELER_CACHE", str(tmp_path / "cache"))
    save_recording(touched[0][0], tmp_path / "touch.csv")
    words = "classify", tmp_path / "touch.csv", "--speeds", 0.27, "--locations", "0.5,0.9"
    first, second = (run(*words, "--robots", 4) for _ in range(2))
    assert first.exit_code == 0, first.exception
    assert "training: 4 touches by 4 surrogate" in first.output
    assert "trained before with these settings" in second.output
    assert first.stdout.splitlines()[-2:] == second.stdout.splitlines()[-2:]
    (kept,) = (tmp_path / "cache").glob("*.decoder")
    kept.write_bytes(kept.read_bytes()[:1000])  # it is made anew
    assert "training" in run(*words, "--robots", 4).output
    other = run(*words, "--robots", 5)
    assert "training" in other.output and len(list((tmp_path / "cache").iterdir())) == 2


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("side", [1, -1])
def test_the_board_s_header_answers_as_python_does(decoder, touched, tmp_path, side):
    header, _, window = make_board_decoder(decoder)
    names, bias, *rows = (
        re.findall(r'"[^"]+"' if "names" in line else r"[-\d.e+]+(?=f)", line)
        for line in header.splitlines()
        if re.match(r"static const .*feeler_(names|bias)|\{", line)
    )
    weights = np.array(rows, dtype=float)
    (tmp_path / "decoder.h").write_text(header)
    program = """
#include <stdio.h>
#include "decoder.h"
int main(void) {
  feeler_touch touch; float angle[FEELER_SENSORS]; int n, which, last = -1, answers = 0;
  feeler_reset(&touch);
  for (;;) {
    for (n = 0; n < FEELER_SENSORS; n++) if (scanf("%f", &angle[n]) != 1) {
      printf("%d %d\\n", last, answers);
      for (n = 0; n < FEELER_BINS * FEELER_SENSORS; n++) printf("%.7g ", touch.mean[n]);
      return 0;
    }
    which = feeler_push(&touch, angle);
    if (which != -1) { last = which; answers++; }
  }
}"""
    (tmp_path / "main.c").write_text(program)
    build = ["cc", "-Wall", "-Wextra", "-Werror", "-o", "b", "main.c", "-lm"]
    subprocess.run(build, cwd=tmp_path, check=True)
    watch, right = decoder.stream, 0
    for recording, label in zip(*touched, strict=True):
        values = side * recording.values
        text = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in values.T)
        how = {"capture_output": True, "text": True, "check": True}
        done = subprocess.run([tmp_path / "b"], input=text, **how)
        head, body = done.stdout.splitlines()
        which, answers = map(int, head.split())
        assert answers == 1
        cut = watch._cut(values)[:, watch.max_lag : watch.max_lag + window]
        means = cut.reshape(8, -1, 20).mean(axis=2).T.ravel()
        found = side * np.array(body.split(), dtype=float)
        np.testing.assert_allclose(found, means, atol=2e-5)
        assert which == np.argmax(weights @ means + np.array(bias, dtype=float))
        felt = int(np.argmax(np.abs(values).sum(axis=0)))
        for at, expected in ((0, which), (felt, -2)):  # a NaN at rest, and in the touch
            rows = text.splitlines()
            rows[at] = "nan " + rows[at].partition(" ")[2]
            done = subprocess.run([tmp_path / "b"], input="\n".join(rows), **how)
            assert done.stdout.split()[:2] == [str(expected), "1"]
        degrees = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in np.rad2deg(values).T)
        done = subprocess.run([tmp_path / "b"], input=degrees, **how)
        assert done.stdout.split()[:2] == ["-2", "1"]
        right += names[which] == json.dumps("{} {:g} {:g}".format(*label))
    assert right >= 3 and re.search(rf"FEELER_CLASSES {len(names)}\b", header)


def test_the_ros_node_s_own_part_answers_by_names(file, touched):
    """Joints come shuffled, beside a wheel; the answers are those of the stream."""
    node = runpy.run_path(str(NODE))["Feeler"](str(file))
    live, names = RobotDecoder.load(file).start(), [f"antenna_{k}" for k in range(1, 9)]
    recording = touched[0][2]
    order, said = np.random.default_rng(0).permutation(8), []
    for at, values in zip(recording.time, recording.values.T, strict=True):
        state = live.update(values, at)
        assert node.take(["wheel", "arm"], [9.0, 0.1], 5e8 + at) is None  # another publisher
        found = node.take(
            ["wheel", *(names[k] for k in order)], [9.0, *values[order]], 5e8 + at
        )
        if found:
            said.append(found)
            expected = (state.state, state.label, state.strange)
            assert tuple(found[key] for key in ("state", "touch", "unlike_all")) == expected
    assert said[0]["state"] == "waiting" and said[-1]["touch"] is not None
    assert len(said) < 40  # only what is new
    json.dumps(said, allow_nan=False)


def send(lines, pause=0.0):
    """The name of a pseudo-terminal, and its other end, to which a thread writes once the port is
    open (pyserial drops what came before).
    """
    ours, theirs = pty.openpty()
    tty.setraw(theirs)

    def write():
        time.sleep(0.3)
        for line in lines:
            os.write(ours, line)
            time.sleep(pause)

    threading.Thread(target=write, daemon=True).start()
    return ours, theirs, os.ttyname(theirs)


def list_lines(recording):
    rows = zip(recording.time, recording.values.T, strict=True)
    return [f"{at:.3f},{','.join(f'{x:.5f}' for x in row)}\n".encode() for at, row in rows]


def test_a_port_is_listened_to_at_its_rate_and_its_samples_are_counted(file, touched):
    ours, theirs, port = send(list_lines(touched[0][0]))
    done = run(
        "stream",
        port,
        "--serial",
        "--baud",
        921_600,
        "--unit",
        "rad",
        "--timeout",
        1,
        "--decoder",
        file,
    )
    os.close(ours)
    os.close(theirs)
    assert done.exit_code == 0, done.exception
    assert f"listening at {port}, 921600 baud: 8 numbers a line, in rad (--unit)" in done.output
    assert re.search(rf"{touched[0][0].time.size} samples at 1000 per second", done.output)
    assert "as a whole: " in done.output


def test_a_silent_port_ends_with_one_line(file):
    ours, theirs, port = send([])
    done = run("stream", port, "--serial", "--timeout", 0.2, "--decoder", file)
    os.close(ours)
    os.close(theirs)
    assert isinstance(done.exception, InvalidInput)
    assert re.search(rf"no sample came from {port} in 0\.2 s", str(done.exception))


@pytest.mark.long
def test_a_board_that_was_unplugged_is_waited_for(tmp_path):
    """Lines before and after; one that is gone for longer than the timeout is said."""
    link, port = tmp_path / "port", "port"
    ours, theirs, name = send([b"1,0.5\n", b"2,0.5\n", b"3,0.6\n"])
    link.symlink_to(name)
    port = str(link)
    lines = open_serial(port, timeout=3.0, reconnect=True)
    found = [next(lines) for _ in range(3)]
    link.unlink()
    os.close(ours)
    os.close(theirs)
    again, other, name = send([b"1,0.7\n", b"2,0.8\n"])
    link.symlink_to(name)
    found += [next(lines) for _ in range(3)]
    assert found == [b"1,0.5\n", b"2,0.5\n", b"3,0.6\n", None, b"1,0.7\n", b"2,0.8\n"]
    counted = Link(1)
    samples = list(read_samples(found, 1, counted))
    assert [at for at, _ in samples] == [1, 2, 3, 1, 2] and counted.restarts == 1
    link.unlink()
    os.close(again)
    os.close(other)
    with pytest.raises(InvalidInput, match=r"the board at .*port is gone"):
        list(lines)


def test_control_c_gives_the_summary(file, touched, monkeypatch, tmp_path):
    """After 600 samples of a touch; what was felt is judged, and the exit code is the shell's."""
    save_recording(touched[0][0], tmp_path / "touch.csv")
    update, count = _LiveTouch.update, iter(range(10**6))

    def stop(self, *words):
        if next(count) == 600:
            raise KeyboardInterrupt
        return update(self, *words)

    monkeypatch.setattr(_LiveTouch, "update", stop)
    done = run("stream", tmp_path / "touch.csv", "--decoder", file)
    assert done.exit_code == 130
    assert "as a whole: " in done.output and re.search(r"60\d samples at 1000", done.output)


def test_a_sample_costs_a_fraction_of_a_millisecond(decoder, touched):
    """Processor time of a touch at 1 kHz, judgements of the whole included; its lines are read in
    pieces, not byte by byte.
    """
    live, recording = decoder.start(), touched[0][0]
    began = time.thread_time()
    for at, values in zip(recording.time, recording.values.T, strict=True):
        live.update(values, at)
    assert time.thread_time() - began < 5e-4 * recording.time.size

    class Port:
        reads, rest, in_waiting = 0, b"".join(list_lines(recording)), 4096

        def read(self, size):
            Port.reads += 1
            found, Port.rest = Port.rest[:size], Port.rest[size:]
            return found

    size, lines = len(Port.rest), list(read_lines(_Buffer(Port())))
    assert lines == list_lines(recording) and Port.reads <= size / 4096 + 2
