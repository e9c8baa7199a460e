"""The clock: how many samples and steps a duration has."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.physics.clock import Clock


@pytest.mark.parametrize("tenths", [1, 3, 7, 11, 23, 57, 110, 1001])
def test_durations_that_are_not_exact_in_binary_have_the_samples_they_say(tenths):
    """1.1 / 0.1 is 11.000000000000002 in binary."""
    clock = Clock(duration=tenths / 10, sample_interval=0.1, timestep=0.02)
    assert (clock.n_samples, clock.steps_per_sample) == (tenths, 5)
    assert clock.time[-1] == pytest.approx(tenths / 10 - 0.1)


@pytest.mark.parametrize(("duration", "samples"), [(1.0, 1), (1.001, 2), (1.999, 2), (2.0, 2), (0.3, 1)])
def test_samples_lie_in_the_half_open_duration(duration, samples):
    clock = Clock(duration=duration, timestep=0.02)
    assert np.array_equal(clock.time, np.arange(samples))
    assert clock.time[-1] < duration


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"duration": 0.0}, "duration must be finite and > 0 ms"),
        ({"duration": np.nan}, "duration must be finite and > 0 ms"),
        ({"timestep": -0.02}, "timestep must be finite and > 0 ms"),
        ({"timestep": 0.03}, r"whole number of timesteps.*timestep=0\.0303"),
        ({"timestep": 3.0}, "whole number of timesteps"),
        ({"duration": 1e9}, "samples; allowed are 1 to"),
    ],
)
def test_bad_clocks_are_named(fields, message):
    with pytest.raises(InvalidInput, match=message):
        Clock(**{"duration": 2.0, "timestep": 0.02} | fields)
