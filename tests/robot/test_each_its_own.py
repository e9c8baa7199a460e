"""Of several robots, touches, recordings and channels each keeps what is its own; and what is said
of them has their numbers, in their order. Nothing is simulated.
"""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from feeler import touch
from feeler.decoding.transfer import AFTER
from feeler.errors import InvalidInput
from feeler.robot import (
    Recording,
    align_recordings,
    load_robot,
    make_dataset,
    make_robot,
    make_touches,
    make_training,
    write_robot,
)
from feeler.robot.classify import judge_recording
from feeler.robot.recordings import ROBOT_FILES
from feeler.tensors import find_errors

CLASSES = [("ball", 0.5, 0.1), ("box", 0.6, 0.2), ("ball", 0.9, 0.3)]


def make_classifier(probability=(0.2, 0.5, 0.3), strangeness=0.4, seen=None):
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


@pytest.mark.parametrize("late", [-1, 0, 1])
def test_a_recording_is_whole_with_its_last_sample_and_short_of_it_says_by_how_much(late):
    seen, robot, peak = [], make_robot(), 300
    n = peak + 1 + AFTER + late
    tip = np.exp(-(((np.arange(n) - peak) / 40.0) ** 2))
    values = 0.01 * np.ones((8, 1)) * tip
    recording = Recording(time=np.arange(float(n)), values=values)
    answer, tensor = judge_recording(make_classifier(seen=seen), recording, robot, before=250)
    (_, until), *_ = seen
    held = AFTER + late
    assert until == (None if late >= 0 else float(250 + held))
    words = f"{AFTER} ms after the first peak are needed; here {held}"
    assert answer.missing == ("" if late >= 0 else words)
    assert tensor.shape == (8, 250 + AFTER)


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


def _recording(samples=50, **fields):
    values = np.random.default_rng(0).normal(0, 0.1, (8, samples))
    return Recording(**{"time": np.arange(float(samples)), "values": values, **fields})


def test_recordings_keep_the_contract():
    labels = {"feature": "ball", "size": 4.0, "location": 0.9, "speed": 0.027}
    recordings = [_recording(labels=labels, robot="A"), _recording(source="surrogate")]
    dataset = make_dataset(recordings)
    assert find_errors(dataset) == []
    assert dataset["angle"].dims == ("trial", "sensor", "time")
    np.testing.assert_array_equal(dataset["angle"][0], recordings[0].values)
    assert dataset["source"].values.tolist() == ["robot", "surrogate"]
    assert dataset["antenna"].values.tolist() == ["A", "robot"]
    assert float(dataset["speed"][0]) == 0.027 and np.isnan(float(dataset["speed"][1]))
    shape = make_robot().shape(recordings[0].values.T)
    np.testing.assert_allclose(dataset["tip"][0], shape[:, -1])
    np.testing.assert_allclose(dataset["curvature"][0, 0], dataset["angle"][0, 0] / 7.85)
    assert dataset["seed"].values.tolist() == [-1, -1]


def test_sensors_stand_where_those_of_a_simulated_touch_stand():
    robot = make_robot()
    dataset = make_dataset([_recording()])
    simulated = touch(robot, make_touches()[0], duration=5.0)
    start = np.concatenate([[0.0], np.cumsum(robot.segment_length)])
    np.testing.assert_allclose(dataset["position"], start[:-1] / start[-1])
    for name in ("position", "segment", "segment_length"):
        np.testing.assert_allclose(dataset[name], simulated[name])


def test_different_durations_are_never_mended_in_silence():
    pair = [_recording(50), _recording(30)]
    with pytest.raises(InvalidInput, match="30 to 50 samples"):
        make_dataset(pair)
    assert make_dataset(pair, lengths="crop").sizes["time"] == 30


@pytest.mark.parametrize(
    ("recordings", "options", "message"),
    [
        ([], {}, "at least one recording"),
        ([_recording(quantity="capacitance")], {}, "recording 0 holds capacitance"),
        (
            [Recording(time=np.arange(9.0), values=np.zeros((7, 9)))],
            {},
            "7 channels, the antenna 8",
        ),
        ([_recording(time=np.arange(50.0) ** 1.1)], {}, "uneven time base"),
        ([_recording(time=np.arange(50.0) + 5)], {}, "does not start at 0"),
        ([_recording(), _recording(time=np.arange(50.0) * 2)], {}, "recordings every 1, 2 ms"),
        ([_recording(values=np.full((8, 50), np.nan))], {}, "recording 0 has missing values"),
        ([_recording()], {"lengths": "stretch"}, "lengths must be one of refuse, crop, hold"),
    ],
)
def test_bad_sets(recordings, options, message):
    with pytest.raises(InvalidInput, match=message):
        make_dataset(recordings, **options)
