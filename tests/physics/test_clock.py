"""The clock: how many samples and steps a duration has."""

from decimal import Decimal

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.physics.scene import Clock


@pytest.mark.parametrize("tenths", [1, 3, 7, 11, 23, 57, 110, 1001])
@pytest.mark.parametrize(("interval", "steps"), [(0.1, 5), (0.3, 15), (0.7, 35)])
def test_durations_that_are_not_exact_in_binary_have_the_samples_they_say(
    tenths, interval, steps
):
    """2.1 / 0.3 is 7.000000000000001 in binary, 0.3 / 0.1 is 2.9999999999999996."""
    duration = float(Decimal(str(interval)) * tenths)
    clock = Clock(duration=duration, sample_interval=interval, timestep=0.02)
    assert (clock.n_samples, clock.steps_per_sample) == (tenths, steps)
    assert clock.time[-1] == pytest.approx(duration - interval)


@pytest.mark.parametrize(
    ("duration", "samples"), [(1.0, 1), (1.001, 2), (1.999, 2), (2.0, 2), (0.3, 1)]
)
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
