"""Touches compared whole: as long as the slowest lasts, with the samples of the paper's window."""

import numpy as np
import pytest

import feeler
from feeler import comparison as compare
from feeler.errors import ModelValidityWarning
from feeler.experiments.tactile import DURATION
from paper.window import complete_tensors

BALL = feeler.Ball(radius=1.5)


@pytest.mark.parametrize(("name", "speed"), [("exponential", 0.3), ("uniform", 0.6)])
def test_they_are_what_the_paper_calls_complete(name, speed):
    antenna = feeler.presets.cockroach(name)
    trials = [feeler.Trial(feature=BALL, location=at, speed=speed) for at in (0.55, 0.8)]
    found, end = compare.touch_whole(antenna, trials, seed=3)
    longer = feeler.touch(antenna, trials, duration=1.7 * 48.0 / speed, seed=3)
    expected = complete_tensors(longer)
    assert found.sizes["time"] == round(DURATION) == expected.sizes["time"]
    held = (longer["force"] != 0).any(("trial", "axis")).values
    assert end == pytest.approx(float(longer["time"].values[held][-1]) + 1.0)
    np.testing.assert_allclose(found["angle"], expected["angle"], atol=1e-9)


def test_a_touch_that_does_not_end_is_cut_and_said(monkeypatch):
    monkeypatch.setattr(compare, "_FACTORS", (1,))
    monkeypatch.setattr(compare, "_DISTANCE", 4.0)
    trial = feeler.Trial(feature=BALL, location=0.5, speed=0.3)
    with pytest.warns(ModelValidityWarning, match="still touched when the recording ends"):
        _, end = compare.touch_whole(feeler.presets.cockroach(), [trial])
    assert end == pytest.approx(round(4.0 / 0.3), abs=1.0)
