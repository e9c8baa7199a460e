"""The closed loop: with the true distance its limit is the closed form's, and an antenna only takes
away from it.
"""

from dataclasses import replace

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.presets import cockroach
from feeler.wall import calibrate
from studies.active import wall_loop as loop

map_stability, measure_wall_response = loop.map_stability, loop.measure_wall_response


def test_the_limit_of_the_delayed_loop_is_a_root_of_its_equation():
    """s² + (2ω s + ω²) e^(−sτ) = 0 has a root on the imaginary axis at ωτ = LIMIT."""
    r = np.sqrt(2 + np.sqrt(5))
    s, tau = 1j * r, loop.LIMIT
    assert abs(s**2 + (2 * s + 1) * np.exp(-s * tau)) < 1e-12


def test_a_body_that_is_told_the_distance_is_stable_below_the_limit_and_not_above():
    """Low-pass and period add some 7 ms to the delay."""
    frequency, more = 0.03, 7.0
    assert frequency * (10.0 + more) < loop.LIMIT < frequency * 40.0
    found = map_stability(cockroach(), [10.0, 40.0], [frequency], oracle=True)
    assert found.stable.tolist() == [[True], [False]]


def test_a_delayed_and_weakened_swing_has_its_gain_and_phase():
    time = np.arange(0.0, 400.0)
    omega = 2 * np.pi * 0.01
    ratio = loop._compare_swings(
        omega, time, 3 + np.sin(omega * time), 5 + 0.5 * np.sin(omega * (time - 10))
    )
    assert abs(ratio) == pytest.approx(0.5, rel=1e-3)
    assert np.angle(ratio) == pytest.approx(-0.1 * 2 * np.pi, rel=1e-3)


@pytest.mark.parametrize("lost", [0, 399])
def test_a_swing_that_was_not_felt_all_the_time_has_no_gain(lost):
    time = np.arange(0.0, 400.0)
    assert np.isnan(
        loop._compare_swings(
            0.06, time, np.sin(0.06 * time), np.where(time == lost, np.nan, np.sin(time))
        )
    )


@pytest.mark.long
def test_slow_weaving_is_felt_at_its_distance_and_ahead_by_its_heading():
    """What is felt is g d + c · heading, and the heading is the distance's rate over the speed: g +
    iωc/v, g the map's slope.
    """
    antenna = cockroach()
    slow, fast = measure_wall_response(antenna, calibrate(antenna), [1.0, 2.0], cycles=2)
    assert 0.8 < slow.real < 1.3
    assert fast.real == pytest.approx(slow.real, rel=0.03)
    assert fast.imag == pytest.approx(2 * slow.imag, rel=0.05) and slow.imag > 0


@pytest.mark.long
@pytest.mark.parametrize(("hertz", "amplitude"), [(4.0, 1.0), (8.0, 0.5)])
def test_the_body_weaves_as_far_and_as_often_as_it_was_asked_to(monkeypatch, hertz, amplitude):
    """A heading of ωA/v · sin ωt at a speed v takes the body to A (1 − cos ωt) from where it began,
    12 mm from the wall.
    """
    seen = []
    monkeypatch.setattr(loop, "_compare_swings", lambda *given: seen.append(given) or 0j)
    antenna = cockroach()
    measure_wall_response(antenna, calibrate(antenna), [hertz], amplitude=amplitude, cycles=2)
    ((omega, time, true, _),) = seen
    assert omega == pytest.approx(2e-3 * np.pi * hertz)
    assert (time[0], time[-1]) == pytest.approx(
        (1000 / hertz, 2000 / hertz), abs=2.1
    )  # the second cycle
    swing = amplitude * (1 - np.cos(omega * time))
    away = np.sign((true - 12.0)[time.size // 2 - 9]) * swing
    np.testing.assert_allclose(true, 12.0 + away, atol=0.05 * amplitude)


@pytest.mark.long
def test_without_a_map_no_gain_is_stable_and_with_one_a_small_gain_is():
    antenna = cockroach()
    known = calibrate(antenna)
    assert map_stability(antenna, [10.0], [0.01], known=known).stable.tolist() == [[True]]
    lost = map_stability(
        antenna, [10.0], [0.01], known=replace(known, undefined="nothing was felt")
    )
    assert lost.stable.tolist() == [[False]] and np.isnan(lost.spread).all()


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"delays": [-1.0], "frequencies": [0.1], "oracle": True}, "delays must be ≥ 0"),
        (
            {"delays": [0.0], "frequencies": [0.1], "oracle": True, "speed": 0.0},
            "speed > 0 mm/ms",
        ),
        ({"delays": [5.0, -1.0], "frequencies": [0.1], "oracle": True}, "delays must be ≥ 0"),
        ({"delays": [0.0], "frequencies": [0.0], "oracle": True}, "frequencies > 0 rad/ms"),
        ({"delays": [], "frequencies": [0.1], "oracle": True}, "at least one of each"),
        ({"delays": [0.0], "frequencies": [], "oracle": True}, "at least one of each"),
        ({"delays": [0.0], "frequencies": [0.1]}, "give known="),
    ],
)
def test_a_loop_that_cannot_be_closed_is_named(fields, said):
    with pytest.raises(InvalidInput, match=said):
        map_stability(cockroach(), **fields)
