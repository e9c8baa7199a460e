"""Recordings enter through the same door as simulations."""

import numpy as np
import pytest

from feeler import touch
from feeler.errors import InvalidInput
from feeler.robot import Recording, make_dataset, make_robot, make_touches
from feeler.tensors import find_errors


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
    held = make_dataset(pair, lengths="hold")
    np.testing.assert_array_equal(
        held["angle"][1, :, 30:], np.tile(pair[1].values[:, -1:], (1, 20))
    )


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
