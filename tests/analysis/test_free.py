"""Laws of free-response measures on signals whose answer is known in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feeler.analysis import check_trace, measure_deflection_ratios, measure_free_response
from feeler.analysis.response import _find_extrema, fit_damped_cosine
from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.experiments.mechanics import bend


def swing(time, frequency=0.0175, ratio=0.35):
    """Free response of one oscillator released at rest from 1: the textbook's."""
    damped = 2 * np.pi * frequency
    decay = damped * ratio / np.sqrt(1 - ratio**2)
    return np.exp(-decay * time) * (
        np.cos(damped * time) + decay / damped * np.sin(damped * time)
    )


@settings(max_examples=25, deadline=None)
@given(
    frequency=st.floats(0.005, 0.05),
    ratio=st.floats(0.05, 0.7),
    step=st.floats(-20, 20).filter(lambda a: abs(a) > 0.1),
)
def test_one_oscillator_gives_back_its_frequency_and_damping(frequency, ratio, step):
    time = np.arange(0, 3 / frequency, 0.01 / frequency)
    trace = step * swing(time, frequency, ratio)
    free = measure_free_response(time, trace, floor=1e-5)
    assert free.frequency == pytest.approx(frequency, rel=2e-3)
    assert free.damping_ratio == pytest.approx(ratio, rel=5e-3)
    fitted = fit_damped_cosine(time, trace, free.frequency, free.damping_ratio)
    assert fitted.frequency == pytest.approx(frequency, rel=1e-4)
    assert fitted.damping_ratio == pytest.approx(ratio, rel=1e-4)


def test_settling_and_rejection_of_a_known_decay():
    time = np.arange(0, 300, 0.05)
    signal = swing(time, 0.0175, 0.2)
    free = measure_free_response(time, signal)
    for level, settle in ((0.10, free.settle_10), (0.05, free.settle_5)):
        assert np.abs(signal[time > settle + 0.05]).max() <= level
        assert np.abs(np.interp(settle, time, signal)) == pytest.approx(level, rel=1e-3)
    after = np.abs(signal[time >= 1 / 0.0175]).max()
    assert free.rejected == pytest.approx(1 - after, rel=1e-3)


def test_rest_and_release_are_taken_from_where_they_are_said_to_be():
    time = np.arange(0, 200, 0.5)
    held = np.concatenate((np.full(40, 7.0), 3.0 + 4.0 * swing(time)))
    late = np.arange(held.size) * 0.5
    free = measure_free_response(late, held, rest=3.0, release=20.0)
    assert free.frequency == pytest.approx(0.0175, rel=1e-3)


@pytest.mark.parametrize("ratio", [1.0, 1.5, 4.0])
def test_an_overdamped_response_is_said_to_be_one(ratio):
    time, omega = np.arange(0, 600, 0.5), 2 * np.pi * 0.0175
    if ratio == 1.0:
        signal = (1 + omega * time) * np.exp(-omega * time)
    else:
        slow = omega * (ratio - np.sqrt(ratio**2 - 1))
        fast = omega * (ratio + np.sqrt(ratio**2 - 1))
        signal = (fast * np.exp(-slow * time) - slow * np.exp(-fast * time)) / (fast - slow)
    free = measure_free_response(time, signal)
    assert free.overdamped
    assert (free.frequency, free.damping_ratio, free.rejected) == (None,) * 3
    assert free.settle_10 < free.settle_5


TIME = np.arange(0.0, 200.0, 1.0)


def _uneven(values):
    values = values.copy()
    values[50] += 0.3
    return values


@pytest.mark.parametrize(
    ("time", "signal", "match"),
    [
        (
            TIME,
            np.where(TIME == 40, np.nan, swing(TIME)),
            "1 missing samples of 200, the first at 40 ms",
        ),
        (TIME[::-1], swing(TIME), "must rise, but 199 is followed by 198"),
        (np.where(TIME == 50, 49, TIME), swing(TIME), "must rise, but 49 is followed by 49"),
        (_uneven(TIME), swing(TIME), "not evenly sampled"),
        (np.where(TIME == 3, np.nan, TIME), swing(TIME), "time has 1 missing"),
        (TIME, np.full(200, 2.0), "constant at 2"),
        (TIME[:5], swing(TIME[:5]), "too short: 5 samples"),
        (TIME[:12], swing(TIME[:12]), "too short to hold one cycle"),
        (TIME[:36], swing(TIME[:36]), "before the trough"),
        (TIME, swing(TIME[:-1]), "one length"),
        (TIME, swing(TIME, 0.45, 0.02), "beyond the sampling rate"),
        (TIME, swing(TIME, 0.3, 0.02), "beyond the sampling rate"),
        (TIME, swing(TIME, 0.5 / 2.3, 0.05), "there are not 2.5 samples of 1 ms"),
        (TIME / 4, swing(TIME, 0.5 / 2.3, 0.05), "there are not 2.5 samples of 0.25 ms"),
        (
            TIME,
            np.where(TIME < 50, 0.0, swing(np.maximum(TIME - 50, 0))),
            "starts at its rest position",
        ),
    ],
)
def test_unusable_traces_say_why(time, signal, match):
    with pytest.raises(InvalidInput, match=match):
        measure_free_response(time, signal)


@pytest.mark.parametrize("half", [2.6, 3.2])
def test_two_and_a_half_samples_of_half_a_cycle_are_enough(half):
    found = measure_free_response(TIME, swing(TIME, 0.5 / half, 0.1))
    assert found.frequency == pytest.approx(0.5 / half, rel=0.02)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_a_release_is_a_twentieth_of_the_largest_deflection_in_any_unit(unit):
    """A trace that grows to 1 after it began at 4 % is none; at 6 % it is one, and too short to
    turn twice.
    """
    for begin, match in (
        (0.04, "starts at its rest position"),
        (0.06, "without having turned"),
    ):
        with pytest.raises(InvalidInput, match=match):
            measure_free_response(TIME, unit * (begin + (1 - begin) * TIME / 199))


def test_of_several_turns_on_one_side_the_farthest_counts():
    """Two opposite turns, −0.3 at 20 ms and −0.5 at 40, before the trough 0.25 at 70; the next
    swings do not matter.
    """
    places = [0.0, 20.0, 30.0, 40.0, 70.0, 100.0, 130.0, 160.0, 199.0]
    signal = np.interp(TIME, places, [1.0, -0.3, -0.1, -0.5, 0.25, -0.1, 0.05, -0.02, 0.0])
    free = measure_free_response(TIME, signal)
    assert (free.peak, free.trough) == pytest.approx((-0.5, 0.25), abs=0.01)
    assert free.peak_time == pytest.approx(40.0, abs=0.5)
    assert free.frequency == pytest.approx(0.5 / 30, rel=0.03)


def test_the_cosine_says_how_badly_it_fits():
    two = swing(TIME) + 0.5 * swing(TIME, 0.06, 0.05)
    assert fit_damped_cosine(TIME, swing(TIME), 0.017).residual < 1e-6
    assert fit_damped_cosine(TIME, two, 0.017).residual > 0.1


@pytest.mark.parametrize("begin", [0.0, 20.0])
@pytest.mark.parametrize("ratio", [0.1, 0.35])
def test_turns_are_those_of_the_textbook_s_oscillator(begin, ratio):
    """x(k T / 2) = (−1)^k exp(−k π ζ / √(1 − ζ²)), counted from the release."""
    time = begin + np.arange(0, 400, 0.1)
    free = measure_free_response(time, -3 * swing(time - begin, ratio=ratio))
    fall = np.exp(-np.pi * ratio / np.sqrt(1 - ratio**2))
    assert (free.peak, free.trough) == pytest.approx((-fall, fall**2), rel=1e-4)
    assert free.peak_time == pytest.approx(0.5 / 0.0175, rel=1e-5)
    assert not free.overdamped
    assert free.rejected == pytest.approx(
        1 - fall**2, abs=2e-4
    )  # what is left after one whole cycle


@given(st.lists(st.integers(-9, 9), min_size=5, max_size=30))
def test_extrema_of_any_trace_are_vertices_through_the_sample_farthest_out(values):
    signal = np.array(values, dtype=float)
    size = np.abs(signal)
    tops = [k for k in range(1, size.size - 1) if size[k - 1] < size[k] >= size[k + 1]]
    fits = [np.polyfit([-1.0, 0.0, 1.0], signal[k - 1 : k + 2], 2) for k in tops]
    times, heights = _find_extrema(0.5 * np.arange(size.size), signal)
    np.testing.assert_allclose(
        times, [0.5 * (k - b / (2 * a)) for k, (a, b, _) in zip(tops, fits, strict=True)]
    )
    np.testing.assert_allclose(
        heights, [np.polyval(fit, -fit[1] / (2 * fit[0])) for fit in fits], atol=1e-9
    )


def test_a_trace_that_touches_zero_is_no_opposite_peak():
    """Two bumps on one side with a sample at rest between them: nothing swings through."""
    time = np.arange(0.0, 60.0)
    signal = np.clip(1 - time / 20, 0, None) + 0.3 * np.exp(-(((time - 35) / 4) ** 2))
    free = measure_free_response(time, signal)
    assert free.overdamped and free.peak is None


def test_settling_is_counted_from_the_release_and_is_between_samples():
    """A straight line from 1 at 10 ms to 0 at 30 ms passes 10 % at 28 ms and 5 % at 29 ms; it never
    crosses.
    """
    time = np.arange(0.0, 60.0, 1.5)
    signal = np.clip((30.0 - time) / 20.0, 0.0, 1.0)
    free = measure_free_response(time, signal, release=10.5)
    start, end = signal[7], 30.0
    assert free.overdamped and free.peak_time is None
    assert free.settle_10 == pytest.approx(end - 20 * 0.10 * start - 10.5)
    assert free.settle_5 == pytest.approx(end - 20 * 0.05 * start - 10.5)


def test_one_turn_without_a_trough_is_overdamped_and_keeps_its_peak():
    """Below the floor there is no trough, only the opposite peak with its place and height."""
    time = np.arange(0.0, 200.0, 0.1)
    free = measure_free_response(50 + time, swing(time, ratio=0.8), floor=0.01)
    fall = np.exp(-np.pi * 0.8 / 0.6)
    assert free.overdamped and free.trough is None and free.frequency is None
    assert (free.peak, free.peak_time) == (
        pytest.approx(-fall, rel=1e-3),
        pytest.approx(0.5 / 0.0175, rel=1e-4),
    )


@pytest.mark.parametrize("interval", [0.1, 1.0, 8.0])
def test_time_may_be_uneven_by_a_thousandth(interval):
    time = np.arange(100.0)
    late = (time >= 50).astype(float)  # one interval is longer
    assert check_trace(interval * (time + 0.8e-3 * late), swing(time))[0][-1] == pytest.approx(
        interval * 99.0008
    )
    with pytest.raises(InvalidInput, match="not evenly sampled"):
        check_trace(interval * (time + 1.2e-3 * late), swing(time))


def test_what_came_within_10_percent_but_not_5_has_one_settling_time():
    """exp(−t / 50), cut at 130 ms, where 7 % are left: it passed 10 % at 50 ln 10 ms."""
    time = np.arange(0.0, 130.0, 0.5)
    free = measure_free_response(time, np.exp(-time / 50))
    assert free.overdamped and free.settle_5 is None
    assert free.settle_10 == pytest.approx(50 * np.log(10), abs=0.01)


def test_eight_samples_are_enough_and_seven_are_not():
    assert check_trace(TIME[:8], TIME[:8])[0].size == 8
    with pytest.raises(InvalidInput, match="too short: 7 samples; at least 8"):
        check_trace(TIME[:7], TIME[:7])


TIME_MEASURES = np.arange(0.0, 50.0, 1.0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("curve", [0.0, 0.02, -0.05])
def test_points_are_read_on_parabolas_of_their_own(curve, sign):
    """A point that itself turns, sampled every 2 ms: its value at the tip's vertex, 20.9 ms, is
    that of its parabola.
    """
    time = 2.0 * np.arange(20)
    tip, point = 10 - 0.01 * (time - 20.9) ** 2, 3.0 + 0.1 * time + curve * (time - 17.0) ** 2
    expected = (3.0 + 2.09 + curve * 3.9**2) / 10
    found = measure_deflection_ratios(time, sign * np.array([point, 0.4 * tip]), sign * tip)
    np.testing.assert_allclose(found, [expected, 0.4], rtol=1e-12)


def test_a_tip_that_never_turns_is_refused():
    for tip, word in ((TIME_MEASURES, "last"), (TIME_MEASURES[::-1], "first")):
        with pytest.raises(InvalidInput, match=f"farthest out at the {word} sample"):
            measure_deflection_ratios(TIME_MEASURES, TIME_MEASURES, tip)


@pytest.mark.parametrize("peak", [1.1, 47.9])
def test_a_tip_may_turn_beside_the_ends_of_the_trace(peak):
    tip = 10 - 0.001 * (TIME_MEASURES - peak) ** 2
    assert measure_deflection_ratios(TIME_MEASURES, 0.3 * TIME_MEASURES, tip)[
        0
    ] == pytest.approx(0.3 * peak / 10)


def test_a_tip_that_rests_at_its_farthest_but_for_a_bit_is_read_there():
    tip = np.clip(TIME_MEASURES / 20, 0.0, 1.0) * np.clip((49 - TIME_MEASURES) / 20, 0.0, 1.0)
    tip[20] = np.nextafter(1.0, 0.0)
    assert np.argmax(tip) == 21 and measure_deflection_ratios(
        TIME_MEASURES, 0.3 * TIME_MEASURES, tip
    )[0] == pytest.approx(0.3 * 21)


def test_gaps_and_shapes_of_points_are_refused():
    tip = 10 - 0.1 * (TIME_MEASURES - 20.4) ** 2
    with pytest.raises(InvalidInput, match="missing samples"):
        measure_deflection_ratios(TIME_MEASURES, np.where(TIME_MEASURES == 9, np.nan, tip), tip)
    with pytest.raises(InvalidInput, match="with 50 samples"):
        measure_deflection_ratios(TIME_MEASURES, tip[:-1], tip)


def test_a_uniform_cantilever_gives_back_its_rigidity():
    """n hinges of stiffness k, each half a segment from the clamp's side, approach EI = k ℓ."""
    n, rigidity = 200, 0.5
    length = 40.0 / n
    antenna = Antenna(
        segment_length=np.full(n, length),
        segment_mass=1e-5,
        radius=0.1,
        stiffness=rigidity / length,
        damping=1.0,
    )
    force = 1e-6
    tip = float(bend(antenna, force)["tip"].values[0, 0])
    assert force * antenna.length**3 / (3 * tip) == pytest.approx(rigidity, rel=0.01)
