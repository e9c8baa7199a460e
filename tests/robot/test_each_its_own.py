"""Of several robots, touches, recordings and channels each keeps what is its own; and what is said
of them has their numbers, in their order. Nothing is simulated.
"""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from awkward_touches import make_antenna

from feeler.decoding.transfer import AFTER, find_direction
from feeler.errors import InvalidInput
from feeler.objects import Box, Outline
from feeler.physics.contact import get_contact
from feeler.robot import (
    Gap,
    Recording,
    align_recordings,
    fit_sensors,
    load_recording,
    load_robot,
    make_dataset,
    make_robot,
    make_surrogate,
    make_touches,
    make_training,
    reality,
    repair,
    save_recording,
    touches,
    write_robot,
)
from feeler.robot import classify as lessons
from feeler.robot import fit as factors
from feeler.robot.classify import TrainingSet, _judge_touch, judge_recording
from feeler.robot.description import Flexures, RobotFile
from feeler.robot.reality import Touches
from feeler.robot.recordings import ROBOT_FILES, _read
from feeler.robot.stream import Link, _parse_sample, read_samples

CLASSES = [("ball", 0.5, 0.1), ("box", 0.6, 0.2), ("ball", 0.9, 0.3)]


def make_reader(probability=(0.2, 0.5, 0.3), strangeness=0.4, seen=None):
    """Of three classes, so that no probability is all the rest."""
    seen = [] if seen is None else seen

    def predict(tensors, until=None):
        seen.append((tensors, until))
        felt = np.isfinite(tensors).any()
        return np.array([probability]) if felt else np.full((1, 3), np.nan)

    return SimpleNamespace(
        classes_=CLASSES,
        predict_proba=predict,
        measure_strangeness=lambda tensors, until: np.array([strangeness]),
    )


def test_an_answer_says_each_number_beside_its_own_touch():
    answer = _judge_touch(make_reader(), np.zeros((2, 3)), {"feature": "box", "speed": 0.3})
    first, verdict = str(answer).split("\n")
    assert first == (
        "box at 0.6 of the length, 0.2 m/s (50%); then ball at 0.9 of the length, 0.3 m/s (30%)"
    )
    assert verdict == (
        "  the notes say feature box, speed 0.3: WRONG: speed (no such class was trained)"
    )
    plain = answer.to_plain()
    assert plain["label"] == {"feature": "box", "location": 0.6, "speed": 0.2}
    assert plain["runner_up"] == {"feature": "ball", "location": 0.9, "speed": 0.3}
    numbers = ("probability", "runner_up_probability", "strangeness", "unlike_all", "known")
    assert [plain[name] for name in numbers] == [0.5, 0.3, 0.4, False, False]
    assert (plain["truth"], plain["right"]) == (
        {"feature": "box", "speed": 0.3},
        {"feature": True, "speed": False},
    )
    right = _judge_touch(make_reader(), np.zeros((2, 3)), {"location": 0.6})
    assert right.known and str(right).endswith("the notes say location 0.6: right")
    other = _judge_touch(make_reader(strangeness=1.7), np.zeros((2, 3)), {})
    assert str(other) == (
        "unlike any touch I know (1.7 × the limit); nearest box at 0.6 of the length, 0.2 m/s"
    )
    assert other.to_plain()["unlike_all"] is True


@pytest.mark.parametrize("late", [-1, 0, 1])
def test_a_recording_is_whole_with_its_last_sample_and_short_of_it_says_by_how_much(late):
    seen, robot, peak = [], make_robot(), 300
    n = peak + 1 + AFTER + late
    tip = np.exp(-(((np.arange(n) - peak) / 40.0) ** 2))
    values = 0.01 * np.ones((8, 1)) * tip
    recording = Recording(time=np.arange(float(n)), values=values)
    answer, tensor = judge_recording(make_reader(seen=seen), recording, robot, before=250)
    (_, until), *_ = seen
    held = AFTER + late
    assert until == (None if late >= 0 else float(250 + held))
    words = f"{AFTER} ms after the first peak are needed; here {held}"
    assert answer.missing == ("" if late >= 0 else words)
    assert tensor.shape == (8, 250 + AFTER)


@pytest.mark.parametrize("share", [0.0, 0.4, 0.95])
def test_a_recording_of_the_other_side_is_judged_by_its_mirror_image(share):
    """Whatever the antenna swings back by afterwards; and the answer says so."""
    robot, n = make_robot(), 900
    time = np.arange(float(n))
    tip = np.exp(-(((time - 300) / 40.0) ** 2)) - share * np.exp(-(((time - 420) / 40.0) ** 2))
    values = np.linspace(0.5, 1.5, 8)[:, None] * 0.01 * tip
    seen: list = []
    judged = [
        judge_recording(
            make_reader(seen=seen), Recording(time=time, values=one), robot, before=250
        )
        for one in (values, -values)
    ]
    (answer, tensor), (other, mirrored) = judged
    np.testing.assert_array_equal(mirrored, tensor)
    assert (answer.mirrored, other.mirrored) == (False, True)
    assert replace(other, mirrored=False) == answer
    assert "judged by its mirror image" in str(other) and other.to_plain()["mirrored"]
    assert "mirror" not in str(answer)


@pytest.mark.parametrize("values", [np.zeros(5), np.full(5, np.nan), np.zeros(0)])
def test_a_tip_that_stays_goes_nowhere(values):
    assert find_direction(values) == 0


def test_a_training_set_of_the_other_side_is_its_mirror_image():
    trials = make_touches(locations=(0.8,), speeds=(0.27,))
    left, right = (
        make_training(trials=[trial.replace(side=side) for trial in trials])
        for side in ("left", "right")
    )
    assert right.labels == left.labels and len(left.labels) == 2
    np.testing.assert_allclose(right.values, left.values, atol=1e-9)
    np.testing.assert_array_equal(
        align_recordings(
            [Recording(time=np.arange(float(m.shape[1])), values=m) for m in right.motions],
            before=right.before,
        ),
        right.values,
    )


def test_without_contact_nothing_is_missing_and_nothing_is_probable():
    answer = _judge_touch(make_reader(), np.full((2, 3), np.nan), {}, 5.0, "words")
    plain = answer.to_plain()
    assert (str(answer), answer.missing, answer.strangeness) == ("no contact", "", 0.0)
    assert [plain[name] for name in ("probability", "runner_up", "runner_up_probability")] == [
        None
    ] * 3


def make_trials():
    """Three touches that differ in everything."""
    first, second = make_touches(locations=(0.6, 0.9), speeds=(0.2,))[::3]
    return [first, second, replace(first, location=0.7, speed=0.31)]


def test_a_surrogate_writes_its_first_sample_and_its_last_and_what_the_touch_was():
    gap = Gap().scaled(0.0).replace(dropped=0.4)
    for seed in range(6):
        robot = make_surrogate(np.random.default_rng(seed), gap=gap)
        trial = make_trials()[2]
        recording = robot.record(np.zeros((8, 37)), trial)
        assert (recording.time[0], recording.time[-1]) == (0.0, 36.0)
        assert 10 < recording.time.size < 36
    labels = {"feature": trial.name, "size": 4.0, "location": 0.7, "speed": 0.31}
    assert recording.labels == labels
    assert (recording.source, recording.robot, recording.unit) == (
        "surrogate",
        "surrogate",
        "pF",
    )
    assert robot.record(np.zeros((8, 9))).labels == {}


def test_touches_are_as_long_as_each_of_them_lasts_and_simulated_with_what_was_asked(
    monkeypatch,
):
    calls = []

    def simulate(scenes, clock, *, engine, workers, executor):
        calls.append((scenes, clock.duration, clock.timestep, engine, workers))
        length = round(clock.duration)
        return [SimpleNamespace(angle=np.full((length, 8), s.antenna)) for s in scenes]

    def make_scene(antenna, trial):
        return SimpleNamespace(antenna=antenna, contact=get_contact())

    monkeypatch.setattr("feeler.physics.run.simulate", simulate)
    monkeypatch.setattr("feeler.physics.run.expect_motions", lambda results: results)
    monkeypatch.setattr("feeler.physics.scene.make_scene", make_scene)
    trials = [replace(make_trials()[0], speed=speed) for speed in (0.3, 0.05, 0.27, 0.06)]
    pairs = [*zip((10.0, 11.0, 12.0, 13.0), trials, strict=True)]
    how = {"engine": "chain", "timestep": 0.01, "workers": 3, "reach": 1.3}
    motions = touches.simulate_pairs.__wrapped__(pairs, **how)
    lasts = [touches._choose_duration(trial, 1.3) for trial in trials]
    assert [motion.shape for motion in motions] == [(8, round(t)) for t in lasts]
    assert [motion[0, 0] for motion in motions] == [10.0, 11.0, 12.0, 13.0]
    touched = [[scene.antenna for scene in call[0]] for call in calls]
    assert touched == [[10.0, 12.0], [13.0, 11.0]]
    assert [call[1] for call in calls] == [max(lasts[0], lasts[2]), max(lasts[1], lasts[3])]
    assert all(call[2:] == (0.01, "chain", 3) for call in calls)


def make_touches_of(robot, n, felt=()):
    """Touches of one robot: numbers that say which robot and which touch, some without contact."""
    values = 100.0 * robot + np.arange(n)[:, None, None] + np.zeros((n, 2, AFTER + 1))
    values[[k for k in range(n) if k in felt]] = np.nan
    labels = tuple((f"f{robot}", 0.1 * k, 0.2) for k in range(n))
    motions = tuple(np.full((2, 3 + k), 100.0 * robot + k) for k in range(n))
    return Touches(values=values, labels=labels, antenna=make_robot(), motions=motions)


def test_lessons_name_each_touch_s_robot_however_many_touches_it_has():
    known = [make_touches_of(0, 2), make_touches_of(1, 4, felt=(1,)), make_touches_of(2, 1)]
    strangers = [make_touches_of(7, 3, felt=(0,))]
    values, labels, robots, (others, kinds) = TrainingSet(
        known=known, strangers=strangers
    ).gather()
    assert robots.tolist() == [0, 0, 1, 1, 1, 2]
    assert values[:, 0, 0].tolist() == [0, 1, 100, 102, 103, 200]
    assert [label[0] for label in labels] == ["f0", "f0", "f1", "f1", "f1", "f2"]
    assert others[:, 0, 0].tolist() == [701, 702]
    assert kinds == pytest.approx(np.array([(0.1, 0.2), (0.2, 0.2)]))
    watched = []
    decoder = SimpleNamespace(watch=lambda *given: watched.append(given))
    TrainingSet(known=known, strangers=strangers).watch(decoder)
    ((motions, names, numbers, (odd, _)),) = watched
    assert [m[0, 0] for m in motions] == [0, 1, 100, 101, 102, 103, 200]
    assert [*numbers] == [0, 0, 1, 1, 1, 1, 2] and len(names) == 7
    assert [m.shape[1] for m in odd] == [3, 4, 5]


@pytest.mark.parametrize("robots", [1, 4, 5])
def test_half_as_many_robots_meet_strangers_of_the_sizes_that_are_said(monkeypatch, robots):
    met = []

    def touch_robots(several, *, trials, antenna, **how):
        assert how == {"engine": "chain"} and antenna is robot
        met.append((len(several), trials))
        return [(one.name, k) for k, one in enumerate(several)]

    monkeypatch.setattr(lessons, "touch_robots", touch_robots)
    robot, trials = make_robot(), make_trials()
    found = lessons.draw_training_set(robot, trials, robots=robots, seed=3, engine="chain")
    assert (len(found.known), len(found.strangers)) == (robots, (robots + 1) // 2)
    of_known = [given for n, given in met if given == trials]
    strange = [given for _, given in met if given != trials]
    assert sum(n for n, given in met if given == trials) == robots and of_known
    assert len(strange) == (robots + 1) // 2
    for given in strange:
        assert [trial.location for trial in given] == [trial.location for trial in trials]


def test_a_stranger_is_as_large_as_its_share_of_the_object_in_whose_place_it_is_met():
    from feeler.objects import Ball

    rng, spans, kinds = np.random.default_rng(2), [], set()
    for _ in range(300):
        one = lessons._draw_stranger(Ball(radius=2.0), rng)
        kinds.add(type(one))
        if isinstance(one, Outline):
            corners = np.asarray(one.vertices)
            spans.append(np.ptp(corners, axis=0) / 2 / np.cos(np.pi / 16))
        else:
            spans.append([one.half_width + one.rounding, one.half_height + one.rounding])
    spans = np.array(spans)
    assert kinds == {Box, Outline}
    assert 0.4 * 0.99 < spans.min() < 0.5 and 10.0 < spans.max() < 12.0 * 1.01


def make_angles(samples=12, interval=1.0, **more):
    values = 0.01 * np.arange(8.0)[:, None] + 1e-3 * np.arange(samples)
    return Recording(time=interval * np.arange(samples), values=values, **more)


def test_a_short_recording_is_held_at_its_last_sample_and_a_long_one_keeps_its_own():
    """Whichever comes first."""
    short, long = make_angles(5), make_angles(12)
    for pair in ([short, long], [long, short]):
        held = make_dataset(pair, lengths="hold")["angle"].values
        for found, one in zip(held, pair, strict=True):
            n = one.time.size
            np.testing.assert_array_equal(found[:, :n], one.values)
            np.testing.assert_array_equal(
                found[:, n:], one.values[:, -1:].repeat(12 - n, axis=1)
            )


def test_intervals_that_differ_by_less_than_a_millisecond_are_no_one_set():
    with pytest.raises(InvalidInput, match=r"recordings every 1, 1\.3 ms cannot be one set"):
        make_dataset([make_angles(), make_angles(interval=1.3)])
    dataset = make_dataset([make_angles(interval=2.5)])
    assert dataset["time"].values[:3].tolist() == [0.0, 2.5, 5.0]
    assert dataset.attrs["timestep"] == 2.5
    for k, bad in enumerate(([make_angles()], [make_angles()] * 2)):
        odd = make_angles(quantity="voltage", unit="mV")
        with pytest.raises(InvalidInput, match=f"recording {k + 1} holds voltage"):
            make_dataset([*bad, odd])


def test_what_is_left_out_of_a_recording_is_counted_and_named(tmp_path):
    others = [f"temperature{k}x" for k in range(14)]
    head = ",".join(["time_ms", *others, *(f"hinge{n}_deg" for n in range(1, 9))])
    row = ",".join(["{}", *["20"] * 14, *["1"] * 8])
    (tmp_path / "a.csv").write_text("\n".join([head, row.format(0), row.format(1)]))
    recording = load_recording(tmp_path / "a.csv")
    (line,) = [words for words in recording.history if words.startswith("left out")]
    assert line == f"left out, being no channels: {', '.join(others[:12])}, … (14 in all)"
    np.testing.assert_allclose(recording.values, np.deg2rad(1.0))


def test_a_saved_recording_keeps_its_labels_its_robot_and_as_many_digits_as_asked_for(tmp_path):
    labels = {"feature": "box", "size": 2.5, "location": 0.7, "speed": 0.31}
    values = np.array([[1 / 3, 2 / 3, 1.0], [-1 / 3, 0.0, 7.0]])
    one = Recording(
        time=np.array([0.0, 1.5, 2.0]), values=values, quantity="voltage", unit="mV", robot="r",
        source="simulation", labels=labels,
    )  # fmt: skip
    for digits, off in ((3, 1e-3), (17, 0.0)):
        save_recording(one, tmp_path / "a.csv", digits=digits)
        again = load_recording(tmp_path / "a.csv", n_channels=2)
        assert (again.labels, again.robot, again.source, again.unit) == (
            labels,
            "r",
            "simulation",
            "mV",
        )
        away = np.abs(again.values - values).max()
        assert away <= off and (off == 0.0 or away > 1e-5)
    with pytest.raises(InvalidInput, match="digits must be 1 to 17, got 18"):
        save_recording(one, tmp_path / "a.csv", digits=18)
    with pytest.raises(InvalidInput, match="unit of voltage is mV, got 'pF'"):
        one.replace(unit="pF")


def test_a_moulded_robot_is_as_thick_as_its_diameter_says_and_as_long(tmp_path):
    write_robot(tmp_path / "m.toml", 5, moulded=True)
    robot = load_robot(tmp_path / "m.toml")
    theory = robot.theory
    assert theory.length == pytest.approx(40.0) and theory.n_segments == 5
    place = (np.arange(5) + 0.5) / 5
    np.testing.assert_allclose(theory.radius, (4 - 2 * place) / 2, rtol=0.02)
    np.testing.assert_array_equal(theory.damping, theory.stiffness)
    np.testing.assert_allclose(robot.antenna.damping, 2.0 * theory.stiffness)
    assert theory.stiffness[0] > 3 * theory.stiffness[-1]
    with pytest.raises(InvalidInput, match=r"m\.toml exists already"):
        write_robot(tmp_path / "m.toml", 5)
    with pytest.raises(InvalidInput, match="at most 256 hinges, got 257"):
        write_robot(tmp_path / "n.toml", 257)


def test_a_robot_s_hinges_and_links_stand_each_in_their_own_place(tmp_path):
    write_robot(tmp_path / "r.toml", 3)
    text = (tmp_path / "r.toml").read_text()
    for name, values in (("length", [9.0, 8.0, 7.0]), ("mass", [0.05, 0.04, 0.02])):
        text = re.sub(rf"(?m)^{name} = \[.*?\]", f"{name} = {values}", text)
    text = text.replace("stiffness = 1.0", "stiffness = 1.3").replace(
        "damping = 2.0", "damping = 0.7"
    )
    text = re.sub(r"(?m)^hinges = \[.*?\]", "hinges = [1, 3]", text).replace(
        '# calibration = "calibration.json"', 'calibration = "c.json"'
    )
    (tmp_path / "r.toml").write_text(text)
    robot = load_robot(tmp_path / "r.toml")
    assert robot.antenna.segment_length.tolist() == [9.0, 8.0, 7.0]
    assert robot.antenna.segment_mass.tolist() == [0.05, 0.04, 0.02]
    k_th = 2500 * np.array([12.0, 8.0, 4.0]) * 0.05**3 / (12 * 0.5)
    np.testing.assert_allclose(robot.theory.stiffness, k_th)
    np.testing.assert_allclose(robot.antenna.stiffness, 1.3 * k_th)
    np.testing.assert_allclose(robot.antenna.damping, 0.7 * k_th)
    assert robot.calibration == tmp_path / "c.json"
    lines = ROBOT_FILES["robot"].tell(robot)
    assert lines[1] == "hinges      3, 24 mm"
    said = [f"{x:g}" for x in (1.3 * k_th[0], 1.3 * k_th[-1], 0.7 * k_th[0], 0.7 * k_th[-1])]
    assert lines[2] == f"stiffness   {said[0]} (base) … {said[1]} (tip) N·mm/rad"
    assert lines[3] == f"damping     {said[2]} (base) … {said[3]} (tip) N·mm·ms/rad"


def test_lists_of_unlike_lengths_are_told(tmp_path):
    hinges = Flexures(width=np.array([3.0, 2.0]), thickness=0.05, length=0.5, modulus=2500.0)
    with pytest.raises(InvalidInput, match="give one or the other"):
        RobotFile(name="r", folder=tmp_path, hinges=hinges)


def test_a_release_lasts_from_its_first_sample_to_its_last_whenever_it_began():
    values = 0.1 * np.exp(-np.arange(40.0) / 5)[None] * np.ones((8, 1))
    for begin in (0.0, 250.0):
        recording = Recording(time=begin + 1.5 * np.arange(40), values=values)
        start, lasts = factors._find_release(recording)
        np.testing.assert_allclose(start, values[:, 0] - values[:, -10:].mean(axis=1))
        assert lasts == pytest.approx(39 * 1.5 + 1.0)


def test_repair_counts_gaps_and_missing_values_of_each_channel():
    time = np.delete(np.arange(100.0), [*range(20, 41), *range(60, 75)])
    values = np.sin(time / 7) * np.arange(1.0, 4.0)[:, None]
    values[2, :3] = np.nan
    recording = Recording(time=time, values=values)
    with pytest.raises(
        InvalidInput, match=r"hinge 1 has 2 gaps longer than 10 ms, the longest 22"
    ):
        repair(recording)
    bridged = repair(recording, gaps="bridge")
    assert bridged.history[0] == (
        "recorded every 1 ms (jitter sd 0 ms), 36 samples dropped; time base evened"
    )
    assert bridged.history[1:3] == (
        "hinge 1: 2 gaps over 10 ms, bridged",
        "hinge 2: 2 gaps over 10 ms, bridged",
    )
    assert bridged.history[-1] == "hinge 3: 3 missing values"
    kept = repair(recording, gaps="keep", max_gap=18.0)
    assert [*np.isnan(kept.values).sum(axis=1)] == [21, 21, 21]
    assert kept.history[1] == "hinge 1: 1 gaps over 18 ms, kept"
    coarse = repair(recording, gaps="bridge", interval=2.5)
    assert coarse.time[-1] == 97.5 and "resampled to 2.5 ms" in coarse.history[0]
    np.testing.assert_allclose(coarse.values[1], np.interp(coarse.time, time, values[1]))


def test_bad_channels_are_those_and_no_others():
    values = np.random.default_rng(0).normal(size=(3, 60))
    values[1] = 0.25
    recording = Recording(time=np.arange(60.0), values=values)
    with pytest.raises(InvalidInput, match=r"hinge 2 is dead \(always 0\.25\)\. Record again"):
        repair(recording)
    mended = repair(recording, bad_channels="missing")
    assert np.isnan(mended.values).all(axis=1).tolist() == [False, True, False]
    twice = np.arange(60.0) - (np.arange(60) >= 4)
    with pytest.raises(InvalidInput, match=r"1 samples share their time .* the first at 3 ms"):
        repair(recording.replace(time=twice), bad_channels="missing")


def test_readings_out_of_range_are_told_of_the_hinge_that_has_most_of_them():
    hinge, level = np.repeat([1, 2], 5), np.tile(np.linspace(-0.4, 0.4, 5), 2)
    table = fit_sensors(hinge, level, 5.0 + 2.0 * level + hinge, robot="a")
    readings = np.array([[6.0, 9.9, 6.0, 6.1], [7.0, 3.1, 2.2, 7.3]])
    words = r"3 readings .*, most in hinge 2: 2\.2 to 3\.1 pF, calibrated 6\.2 to 7\.8"
    with pytest.raises(InvalidInput, match=words):
        table.apply(readings)
    clipped = table.apply(readings, outside="clip")
    assert clipped[1, 1:3] == pytest.approx([-0.4, -0.4]) and clipped[0, 1] == pytest.approx(
        0.4
    )
    missing = table.apply(readings, outside="missing")
    assert np.isnan(missing).tolist() == [
        [False, True, False, False],
        [False, True, True, False],
    ]
    with pytest.raises(InvalidInput, match="belongs to robot 'a', the recording to 'b'"):
        table.apply(readings, robot="b")


def test_a_header_is_passed_over_once_and_a_time_is_told_from_a_reading():
    lines, link = ["time,a,b", "# note", "", "1.5;2;nan", "2.5,,3e0", "again,b"], Link(2)
    found = [(time, values.tolist()) for time, values in read_samples(lines, 2, link)]
    assert found == [(1.5, [2.0, pytest.approx(np.nan, nan_ok=True)]), (2.5, found[1][1])]
    assert np.isnan(found[1][1][0]) and found[1][1][1] == 3.0 and link.broken == 1
    assert [time for time, _ in read_samples(["3e0 4", "5 6"], 2)] == [None, None]
    with pytest.raises(
        InvalidInput, match=r"a sample is 2 numbers, or a time and 2 .* got 4 in '1"
    ):
        _parse_sample("1 2 3 4", 2)


def test_what_info_says_of_a_recording_is_what_it_holds(tmp_path):
    recording = Recording(
        time=np.array([5.0, 6.5, 9.0]), values=np.arange(9.0).reshape(3, 3), quantity="voltage",
        unit="mV", labels={"feature": "box", "speed": 0.3},
    )  # fmt: skip
    save_recording(recording, path := tmp_path / "a.csv")
    lines = _read(path, None, False)
    assert lines[:5] == [
        "channels    3, voltage [mV]",
        "samples     3 over 4 ms",
        "source      robot",
        "robot       not said",
        "labels      feature box, speed 0.3",
    ]
    assert lines[-1] == (
        "next        feeler robot check a.csv --antenna robot.toml --calibration calibration.json"
    )


def test_robots_of_a_size_and_seed_are_named_by_them_and_are_no_others():
    few, more = reality.draw_robots(0.5, 2, 7), reality.draw_robots(0.5, 3, 7)
    assert [one.name for one in more] == [f"surrogate-0.5-{k}" for k in range(3)]
    for one, same in zip(few, more, strict=False):
        np.testing.assert_array_equal(one.antenna.stiffness, same.antenna.stiffness)
    other = reality.draw_robots(0.5, 1, 8)[0]
    assert not np.array_equal(other.antenna.stiffness, few[0].antenna.stiffness)
    assert {one.gap.noise for one in more} == {0.5 * Gap().noise}


def test_touches_together_go_back_each_to_its_own_robot(monkeypatch):
    """Two robots, three touches, twice; and how they are simulated."""
    told = []

    def make(number):
        return SimpleNamespace(
            carry_out=lambda trials: [(number, trial) for trial in trials],
            record=lambda motion, trial: (number, motion, trial),
        )

    def simulate(pairs, **how):
        told.append(how)
        return [number for number, _ in pairs]

    monkeypatch.setattr(reality, "simulate_pairs", simulate)
    monkeypatch.setattr(reality, "_read", lambda robot, trials, raw, antenna: raw)
    trials, antenna = make_trials(), make_antenna()
    read = reality.touch_robots.__wrapped__(
        [make(1), make(2)], 2, trials=trials, antenna=antenna, engine="chain"
    )
    assert read == [[(k, k, trial) for trial in trials * 2] for k in (1, 2)]
    assert told == [{"reach": antenna.length / make_robot().length, "engine": "chain"}]


def test_variants_keep_their_labels_and_touches_without_contact_are_left_out(monkeypatch):
    trials, antenna = make_trials(), make_robot()

    def simulate(given, asked, n_variants, gap, rng, how):
        assert (given, asked, gap, how) == (antenna, trials, "gap", {"engine": "chain"})
        return [np.full((8, 5), float(k)) for k in range(3 * (1 + n_variants))]

    def align(given, motions, before):
        values = np.array([np.full((8, before + AFTER), m[0, 0]) for m in motions])
        values[4] = np.nan
        return values

    monkeypatch.setattr(reality, "_simulate", simulate)
    monkeypatch.setattr(reality, "_align", align)
    training = reality.make_training.__wrapped__(
        antenna, trials, n_variants=2, gap="gap", engine="chain"
    )
    kept = [0, 1, 2, 3, 5, 6, 7, 8]
    assert training.values[:, 0, 0].tolist() == kept
    assert [motion[0, 0] for motion in training.motions] == kept
    wanted = [touches.get_label(trials[k % 3]) for k in kept]
    assert [*training.labels] == wanted
    assert training.before == reality.choose_before(antenna, trials)


def test_of_a_robot_s_own_touches_the_first_are_shown_and_the_last_are_the_test(monkeypatch):
    """Two rounds of six are shown at most; of the shown ones, those with contact join."""
    scored, fitted = [], []

    class Classifier:
        def fit(self, values, labels):
            fitted.append((values[:, 0, 0].tolist(), [*labels]))
            return self

    monkeypatch.setattr(reality, "TransferClassifier", Classifier)
    monkeypatch.setattr(reality, "score_transfer", lambda one, *given: scored.append(given))
    training, own = make_touches_of(9, 3), make_touches_of(1, 18, felt=(1, 13))
    for k in (0, 1, 2):
        reality._score_shots(training, own, k, 2)
    trained = [900.0, 901.0, 902.0]
    shown = [100.0 + n for n in range(12) if n != 1]
    assert [values for values, _ in fitted] == [trained, trained + shown[:5], trained + shown]
    for values, labels in scored:
        assert values[[0, 2], 0, 0].tolist() == [112.0, 114.0] and len(labels) == 6


def test_a_pool_of_scores_counts_and_lists_all_of_them():
    parts = [
        SimpleNamespace(
            correct={"feature": 3, "speed": 1}, total=4, predicted=["a"], true=["b"]
        ),
        SimpleNamespace(
            correct={"feature": 2, "speed": 5}, total=7, predicted=["c"], true=["d"]
        ),
    ]
    pooled = reality._pool(parts)
    assert (pooled.correct, pooled.total) == ({"feature": 5, "speed": 6}, 11)
    assert (pooled.predicted, pooled.true) == (["a", "c"], ["b", "d"])


def test_a_robot_file_s_plain_answer_is_json(tmp_path):
    answer = _judge_touch(make_reader(), np.zeros((2, 3)), {"feature": "ball"})
    assert json.loads(json.dumps(answer.to_plain()))["right"] == {"feature": False}
