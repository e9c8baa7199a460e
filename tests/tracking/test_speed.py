"""Known motions give their known speeds; filter, gaps and wraps follow their laws."""

from dataclasses import replace

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.tracking import (
    Tracks,
    compute_antenna_angle,
    find_sweeps,
    make_synthetic_tracks,
    measure_exploration,
)
from feeler.tracking.kinematics import _bridge_gaps, _differentiate, smooth

DEGREES = np.deg2rad(1.0) * 1e-3  # °/s in rad/ms


def test_lateral_speed_is_angular_speed_times_length():
    tracks = make_synthetic_tracks(np.random.default_rng(3), noise=0.0)
    result = measure_exploration([tracks, tracks], length=42.0)
    assert result.lateral_speed == pytest.approx(
        0.0635, abs=2e-4
    )  # 86.67 °/s × 42 mm, the paper's 6 cm/s


def test_short_gaps_are_bridged_and_counted_long_ones_kept():
    angle = 0.1 * np.arange(60.0)
    angle[[10, 11]] = np.nan
    angle[30:40] = np.nan
    filled, bridged = _bridge_gaps(angle, max_gap=5)
    assert bridged == 2
    np.testing.assert_allclose(filled[:30], 0.1 * np.arange(30.0))
    assert np.isnan(filled[30:40]).all()
    sweeps = find_sweeps(angle, 10.0, max_gap=5)
    assert sweeps.bridged == 2
    assert sweeps.missing == 10
    np.testing.assert_array_equal(np.isnan(sweeps.speed), np.isnan(filled))


@pytest.mark.parametrize(("lost", "bridged"), [(4, 4), (5, 5), (6, 0)])
def test_a_gap_of_exactly_the_longest_is_bridged(lost, bridged):
    angle = 0.1 * np.arange(40.0)
    angle[12 : 12 + lost] = np.nan
    filled, count = _bridge_gaps(angle, max_gap=5)
    assert count == bridged
    np.testing.assert_allclose(
        filled[12 : 12 + lost], 0.1 * np.arange(12, 12 + lost) if bridged else np.nan
    )


def test_no_speed_is_invented_across_a_long_gap():
    time = np.arange(400) * 10.0
    angle = np.where(time < 2000, 0.0, 1.0)  # stands still, is lost, and stands elsewhere
    angle[190:210] = np.nan
    assert find_sweeps(angle, 10.0).peak_speed.size == 0


def test_a_turn_through_the_back_is_unwrapped_even_across_a_gap():
    swing = np.linspace(0, 4 * np.pi, 200)
    tip = np.stack([np.sin(swing), np.cos(swing)], axis=1)
    still = np.zeros_like(tip)
    tracks = Tracks(
        position=np.stack([tip, tip, still, still - [0, 1]], axis=1),
        landmarks=("left_tip", "right_tip", "head", "abdomen"),
        interval=10.0,
    )
    left, right = compute_antenna_angle(tracks)
    np.testing.assert_allclose(np.diff(right), np.diff(swing), atol=1e-9)
    np.testing.assert_allclose(left, -right, atol=1e-9)
    right[49:51] = np.nan
    right[51:] -= 2 * np.pi
    filled, _ = _bridge_gaps(right, 5)
    np.testing.assert_allclose(np.diff(filled), np.diff(swing), atol=1e-9)
    right[51:] += 6 * np.pi  # two turns on instead of one back
    np.testing.assert_allclose(np.diff(_bridge_gaps(right, 5)[0]), np.diff(swing), atol=1e-9)


@pytest.mark.parametrize("n_frames", [3, 4, 5, 12])
def test_derivative_of_a_parabola_is_exact_up_to_both_ends(n_frames):
    time = 0.2 * np.arange(n_frames)
    np.testing.assert_allclose(_differentiate(3 * time**2 - time, 0.2), 6 * time - 1, atol=1e-9)


@pytest.mark.parametrize("octave", [0.5, 2.0])
def test_filter_is_a_butterworth_of_second_order_run_twice(octave):
    """Gain 1 / (1 + (f / f_c)⁴), which is |H|² (Butterworth 1930)."""
    time = np.arange(6000) * 1.0
    angle = np.sin(2 * np.pi * octave * 5e-3 * time)
    middle = slice(2000, 4000)
    smoothed = smooth(angle, 1.0, cutoff=5e-3)
    gain = smoothed[middle] @ angle[middle] / (angle[middle] @ angle[middle])
    assert gain == pytest.approx(1 / (1 + octave**4), rel=2e-3)


@pytest.mark.parametrize(("n_frames", "kept"), [(9, 0), (10, 10)])
def test_stretches_too_short_to_filter_are_left_out(n_frames, kept):
    angle = np.full(40, np.nan)
    angle[5 : 5 + n_frames] = np.linspace(0, 1, n_frames)
    assert np.isfinite(smooth(angle, 10.0, cutoff=6e-3)).sum() == kept


@pytest.mark.parametrize("phase", [0.0, 0.4, 1.1])
def test_peaks_lie_between_frames_at_their_times_and_heights(phase):
    """θ = A sin(ω t + φ): |θ'| = A ω at every ω t + φ = k π."""
    interval, omega = 10.0, 2 * np.pi * 0.5e-3
    time = interval * np.arange(1000)
    found = find_sweeps(0.7 * np.sin(omega * time + phase), interval, cutoff=20e-3)
    inner = (found.peak_time > 500) & (found.peak_time < 9500)
    turns = (omega * found.peak_time[inner] + phase) / np.pi
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-4)
    assert inner.sum() == 9 and np.all(np.diff(np.round(turns)) == 1)
    np.testing.assert_allclose(found.peak_speed[inner], 0.7 * omega, rtol=1e-5)
    assert found.missing == found.bridged == 0


def test_a_peak_is_when_it_is_whatever_was_lost_before_it():
    """A second without a place, in the middle: peaks away from it keep their times and heights."""
    time = 10.0 * np.arange(1000)
    angle = 0.7 * np.sin(2 * np.pi * 0.5e-3 * time + 0.4)
    whole, lost = find_sweeps(angle, 10.0), np.where(np.abs(time - 4000) < 500, np.nan, angle)
    found = find_sweeps(lost, 10.0)
    away = [np.abs(one.peak_time - 5000) < 4500 for one in (whole, found)]
    away = [
        mask & (np.abs(one.peak_time - 4000) > 1000)
        for mask, one in zip(away, (whole, found), strict=True)
    ]
    assert away[0].sum() == 7
    np.testing.assert_allclose(found.peak_time[away[1]], whole.peak_time[away[0]], atol=2.0)
    np.testing.assert_allclose(found.peak_speed[away[1]], whole.peak_speed[away[0]], rtol=0.01)


def test_peaks_below_the_prominence_are_no_sweeps():
    """Swings of 3 and of 0.5 mrad/ms: a threshold between them keeps the great ones, one above them
    none.
    """
    time = 10.0 * np.arange(2000)
    swing = (
        np.where((time // 2000) % 2 == 0, 3e-3, 0.5e-3) * np.sin(2 * np.pi * time / 1000) ** 2
    )
    angle = np.cumsum(swing) * 10.0
    counts = [
        find_sweeps(angle, 10.0, min_prominence=least).peak_speed.size
        for least in (1e-4, 1e-3, 4e-3)
    ]
    assert counts == [40, 20, 0]


def test_the_noise_of_a_speed_is_that_of_white_noise_through_filter_and_derivative():
    rng = np.random.default_rng(0)
    found = [find_sweeps(rng.normal(0.0, 0.01, 4000), 10.0, cutoff=6e-3) for _ in range(8)]
    spread = np.mean([one.speed[50:-50].std() for one in found])
    assert np.mean([one.noise for one in found]) == pytest.approx(spread, rel=0.03)


def test_the_error_is_of_the_mean_and_holds_the_noise():
    clean = make_synthetic_tracks(np.random.default_rng(8), noise=0.5)
    for side in measure_exploration([clean]).sweeps[0]:
        n, mean = side.peak_speed.size, side.peak_speed.mean()
        scatter = np.sqrt(((side.peak_speed - mean) ** 2).sum() / (n - 1) / n)
        assert side.error == pytest.approx(np.sqrt(scatter**2 + side.noise**2), rel=1e-12)
        assert side.mean_peak == pytest.approx(mean)
    one = replace(side, peak_speed=side.peak_speed[:1])
    assert np.isnan(one.error) and one.mean_peak == side.peak_speed[0]
    none = replace(side, peak_speed=side.peak_speed[:0])
    assert np.isnan(none.error) and np.isnan(none.mean_peak)


def test_the_mean_is_over_all_sides_that_swept():
    both = make_synthetic_tracks(
        np.random.default_rng(3), noise=0.0, peak_speed=(90 * DEGREES, 60 * DEGREES)
    )
    still = make_synthetic_tracks(
        np.random.default_rng(3), noise=0.0, peak_speed=(30 * DEGREES, 0.0)
    )
    found = measure_exploration([both, replace(still, source="tracked")])
    assert np.isnan(found.mean_peak[1, 1]) and found.n_peaks[1, 1] == 0
    assert found.mean == pytest.approx(60 * DEGREES, rel=1e-3)
    assert found.error.shape == (2, 2) and found.source == "synthetic"
    assert found.length is None and np.isnan(found.lateral_speed)
    assert measure_exploration([replace(both, source="tracked")]).source == "tracked"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cutoff": 20e-3}, "half the frame rate, 15 Hz; got 20 Hz"),
        ({"cutoff": 0.0}, "cutoff must lie between"),
        ({"max_gap": -1}, "max_gap must be ≥ 0"),
        ({"min_prominence": float("nan")}, "min_prominence must be finite and ≥ 0"),
        ({"min_prominence": 1.0}, "no sweep in 1 trials"),
        ({"length": -1.0}, "length must be > 0 mm"),
    ],
)
def test_bad_options(options, message):
    tracks = make_synthetic_tracks(np.random.default_rng(0))
    with pytest.raises(InvalidInput, match=message):
        measure_exploration([tracks], **options)


def test_no_trials_and_no_common_frames():
    with pytest.raises(InvalidInput, match="at least one trial"):
        measure_exploration([])
    tracks = make_synthetic_tracks(np.random.default_rng(0))
    lost = Tracks(
        position=np.full_like(tracks.position, np.nan),
        landmarks=tracks.landmarks,
        interval=tracks.interval,
    )
    with pytest.raises(InvalidInput, match="no angle to measure"):
        measure_exploration([lost])
