"""Anyone's robot: any number of hinges and sensors, objects of one's own, answers that say how sure
they are.
"""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.decoding.transfer import find_first_peak
from feeler.errors import InvalidInput
from feeler.objects import load_objects
from feeler.robot import (
    compute_tip,
    draw_robots,
    fit_factors,
    load_robot,
    make_classifier,
    make_robot,
    make_surrogate,
    make_touches,
    save_calibration,
    save_recording,
    simulate_release,
    touch_robots,
    write_robot,
)
from feeler.robot.classify import judge_recording
from feeler.robot.fit import make_posture
from feeler.robot.recordings import Recording

OBJECTS = """
[[object]]
name = "bolt"
shape = "ball"
radius = 3.0
[[object]]
name = "wedge"
shape = "outline"
vertices = [[0, -3], [0, 3], [-5, 0]]
"""


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=True)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A folder with a robot of twelve hinges, two objects, and recordings of touches with known
    truth.
    """
    folder = tmp_path_factory.mktemp("lab")
    write_robot(folder / "robot.toml", 12)
    text = (
        (folder / "robot.toml")
        .read_text()
        .replace('# calibration = "calibration.json"', 'calibration = "c.json"')
    )
    (folder / "robot.toml").write_text(text)
    (folder / "objects.toml").write_text(OBJECTS)
    antenna = load_robot(folder / "robot.toml").antenna
    robot = make_surrogate(np.random.default_rng(3), nominal=antenna, name="my robot")
    save_calibration(robot.calibration, folder / "c.json")
    touches = make_touches(
        features=load_objects(folder / "objects.toml"), locations=(0.9,), speeds=(0.3,)
    )
    for touch, recording in zip(
        touches, robot.touch(touches, reach=antenna.length / make_robot().length), strict=True
    ):
        save_recording(recording, folder / f"{touch.name}.csv")
    return folder


def test_a_new_robot_file_is_the_beam_formula_and_every_verb_takes_it(tmp_path):
    assert run("robot", "new", tmp_path / "r.toml", "--hinges", 5).exit_code == 0
    robot = load_robot(tmp_path / "r.toml")
    width = np.linspace(12, 4, 5)
    np.testing.assert_allclose(robot.theory.stiffness, 2500 * width * 0.05**3 / (12 * 0.5))
    np.testing.assert_allclose(robot.antenna.damping, 2.0 * robot.theory.stiffness)
    for words in ("w [mm]", "t [mm]", "ℓ [mm]", "p2 [ms]"):
        assert words in (tmp_path / "r.toml").read_text()
    plain = [
        line
        for line in (tmp_path / "r.toml").read_text().splitlines()
        if not line.startswith("hinges")
    ]
    (tmp_path / "plain.toml").write_text("\n".join(plain))
    for name in ("r.toml", "plain.toml"):  # every hinge is sensed unless another list is given
        np.testing.assert_array_equal(
            load_robot(tmp_path / name).antenna.sensors, [1, 2, 3, 4, 5]
        )
    assert run("export", tmp_path / "s.xml", "--antenna", tmp_path / "r.toml").exit_code == 0
    with pytest.raises(InvalidInput, match="exists already"):
        write_robot(tmp_path / "r.toml", 5)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('"feeler.robot/1"', '"feeler.robot/2"', "schema must be 'feeler.robot/1'"),
        ("thickness", "thicknes", "has no 'thicknes'; valid: width, thickness"),
        ("modulus = 2500", "", "needs modulus"),
        (
            "modulus = 2500",
            'modulus = "stiff"',
            "modulus must be an array of numbers, got 'stiff'",
        ),
        ("radius = 1.0", "radius = [1, 2, 3]", "one number per hinge; their lengths are"),
        ("stiffness = 1.0", "stiffness = -1.0", r"\[factors\] stiffness must be > 0, got -1"),
        ("stiffness = 1.0", "stiffness = 0.0", r"\[factors\] stiffness must be > 0, got 0"),
        ("name =", "nmae =", "has no 'nmae'; valid: name, "),
        ("[hinges]", "[hinges", "robot.toml"),
    ],
)
def test_a_wrong_robot_file_is_refused_by_name(tmp_path, old, new, match):
    write_robot(tmp_path / "robot.toml", 4)
    (tmp_path / "robot.toml").write_text(
        (tmp_path / "robot.toml").read_text().replace(old, new)
    )
    with pytest.raises(InvalidInput, match=match):
        load_robot(tmp_path / "robot.toml")


def test_the_tip_of_sensed_hinges_is_the_whole_tip_where_the_others_are_straight():
    robot = make_robot().replace(sensors=[1, 3, 6])
    angle = np.zeros((8, 5))
    angle[robot.sensors - 1] = np.random.default_rng(0).normal(0, 0.1, (3, 5))
    np.testing.assert_allclose(
        compute_tip(robot, angle[robot.sensors - 1]), compute_tip(robot, angle)
    )
    with pytest.raises(InvalidInput, match="the 8 hinges of the antenna, or its 3 sensors"):
        compute_tip(robot, np.zeros((7, 5)))


@pytest.mark.long
def test_classify_names_objects_of_ones_own_with_probability_and_truth(lab):
    said = run(
        "robot",
        "classify",
        lab / "bolt.csv",
        lab / "wedge.csv",
        "--antenna",
        lab / "robot.toml",
        "--objects",
        lab / "objects.toml",
        "--speeds",
        "0.3",
        "--locations",
        "0.6,0.9",
        "--json",
    )
    assert said.exit_code == 0, said.output
    for answer in json.loads(said.stdout):
        assert (
            0.25 < answer["probability"] <= 1
            and answer["runner_up_probability"] <= answer["probability"]
        )
        assert answer["label"]["feature"] in ("bolt", "wedge")
        assert answer["truth"] == {
            "feature": answer["file"][:-4],
            "location": 0.9,
            "speed": 0.3,
        }
        assert answer["right"]["location"] and answer["known"]


@pytest.mark.parametrize("verb", ["classify", "check", "stream", "fit"])
def test_a_recording_with_other_channels_is_refused(lab, verb):
    said = run("robot", verb, lab / "bolt.csv", "--calibration", lab / "c.json")
    assert isinstance(said.exception, InvalidInput)
    words = "the calibration is for 12 hinges, the antenna has 8 sensors"
    assert words in str(said.exception)


@pytest.fixture(scope="module")
def classifier():
    """The paper's robot and four touches, learned from six surrogates."""
    trials = make_touches(locations=(0.6, 0.9), speeds=(0.27,))
    return make_classifier(trials=trials, robots=6), make_robot(), trials


@pytest.mark.parametrize("share", [1.0, 0.6])
def test_a_recording_that_ends_early_is_judged_on_what_it_holds(classifier, share):
    classifier, robot, trials = classifier
    for one in touch_robots(draw_robots(0.3, 1, 6), trials=trials)[0].recordings:
        count = int(share * one.time.size)
        cut = one.replace(time=one.time[:count], values=one.values[:, :count])
        answer, _ = judge_recording(classifier, cut, robot)
        assert answer.label[0] in ("ball", "box") and 0 < answer.probability <= 1
        peak = find_first_peak(compute_tip(robot, cut.values))
        left = count - 1 - peak
        said = {
            "no peak: the largest deflection stands for it": peak < 0,
            f"400 ms after the first peak are needed; here {left}": peak >= 0 and left < 400,
        }
        assert {words: words in str(answer) for words in said} == said


def test_a_second_touch_and_too_small_a_motion_are_said(classifier):
    classifier, robot, trials = classifier
    one = touch_robots(draw_robots(0.3, 1, 6), trials=trials[:1])[0].recordings[0]
    rest = np.zeros((8, 600))
    for parts, said in (
        ([one.values, rest], ""),
        ([one.values, rest, one.values], "not judged"),
    ):
        values = np.hstack(parts)
        long = one.replace(time=np.arange(values.shape[1]), values=values)
        answer, _ = judge_recording(classifier, long, robot)
        assert said in answer.missing and bool(answer.missing) == bool(said)
    faint, _ = judge_recording(classifier, one.replace(values=0.01 * one.values), robot)
    assert "the tip moves by 0." in str(faint) and "less than 1 mm" in str(faint)


def test_noise_drift_and_taps_beside_are_unlike_any_touch(classifier):
    classifier, robot, _ = classifier
    rng = np.random.default_rng(2)
    strange = []
    for _ in range(40):
        noise = 0.02 * rng.standard_normal((8, 1500))
        walk = rng.normal(0, 0.004, (8, 1500)).cumsum(axis=1)
        for values in (noise, walk):
            one = Recording(time=np.arange(1500.0), values=values)
            answer = judge_recording(classifier, one, robot)[0]
            strange.append(answer.strange or answer.label[0] == "no contact")
    beside = make_touches(locations=(0.2, 0.3), speeds=(0.27,))
    for touches in touch_robots(draw_robots(1.0, 4, 8), trials=beside):
        for one in touches.recordings:
            answer = judge_recording(classifier, one, robot)[0]
            strange.append(answer.strange)
            assert "unlike any touch I know" in str(answer)
    assert np.mean(strange) >= 0.95


def test_a_sketch_has_the_asked_channels_and_rate(tmp_path):
    assert (
        run("robot", "board", tmp_path / "b.ino", "--channels", 12, "--rate", 100).exit_code
        == 0
    )
    text = (tmp_path / "b.ino").read_text()
    assert "CHANNELS = 12;" in text and "RATE = 100;" in text
    assert "exists already" in str(run("robot", "board", tmp_path / "b.ino").exception)


@pytest.mark.parametrize("robots", [1, 2])
def test_too_few_robots_to_learn_from_are_refused_in_words(robots):
    """With one held out nothing is left that differs."""
    trials = make_touches(locations=(0.6, 0.9), speeds=(0.27,))
    with pytest.raises(InvalidInput, match=r"3 or more|two groups"):
        make_classifier(trials=trials, robots=robots)


def test_a_recording_may_number_its_channels_as_the_robot_file_does(tmp_path):
    """Sensors on hinges 2, 5 and 12: channels are those numbers, or 1 to 3."""
    write_robot(tmp_path / "few.toml", 12)
    text = (tmp_path / "few.toml").read_text()
    (tmp_path / "few.toml").write_text(
        re.sub(r"(\[sensors\]\nhinges = )\[.*?\]", r"\1[2, 5, 12]", text)
    )
    for numbers in ((2, 5, 12), (1, 2, 3)):
        names = ",".join(f"hinge{number}_deg" for number in numbers)
        rows = [f"{time},{time + 1},{time + 2},{time + 3}" for time in range(9)]
        (tmp_path / "r.csv").write_text("\n".join([f"time_ms,{names}", *rows]) + "\n")
        done = run("robot", "check", tmp_path / "r.csv", "--antenna", tmp_path / "few.toml")
        assert done.exit_code == 0 and "r.csv: 3 channels, 8 ms" in done.output, done.output


def test_damping_is_p2_times_the_theoretical_stiffness_whatever_p1_is(tmp_path):
    write_robot(tmp_path / "r.toml", 3)
    text = (tmp_path / "r.toml").read_text()
    text = text.replace("stiffness = 1.0", "stiffness = 1.19").replace(
        "damping = 2.0", "damping = 2.06"
    )
    (tmp_path / "r.toml").write_text(text)
    k_th = 2500 * np.array([12.0, 8.0, 4.0]) * 0.05**3 / (12 * 0.5)
    robot = load_robot(tmp_path / "r.toml")
    np.testing.assert_allclose(robot.antenna.stiffness, 1.19 * k_th)
    np.testing.assert_allclose(robot.antenna.damping, 2.06 * k_th)
    np.testing.assert_allclose(robot.theory.stiffness, k_th)


def test_factors_of_any_antenna_come_back_from_its_release(tmp_path):
    write_robot(tmp_path / "r.toml", 5)
    theory = load_robot(tmp_path / "r.toml").theory
    planted = theory.replace(stiffness=1.3 * theory.stiffness, damping=2.4 * theory.stiffness)
    motion = simulate_release(planted, make_posture(planted, 4.0), 600.0)
    found = fit_factors(
        Recording(time=np.arange(motion.shape[1]) * 1.0, values=motion), theory=theory
    )
    assert (found.stiffness_factor, found.damping_factor) == pytest.approx((1.3, 2.4), rel=0.01)
