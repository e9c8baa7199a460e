"""Known motions give their known speeds; filter, gaps and wraps follow their laws."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.tracking import Tracks, compute_antenna_angle, find_sweeps, make_synthetic_tracks, measure_exploration
from feeler.tracking.speed import bridge_gaps, differentiate, smooth

DEGREES = np.deg2rad(1.0) * 1e-3  # °/s in rad/ms


@pytest.mark.parametrize("peak", [75.0, 86.67, 300.0])
@pytest.mark.parametrize("frame_rate", [30.0, 60.0])
def test_planted_peak_speed_is_recovered(peak, frame_rate):
    rng = np.random.default_rng(3)
    tracks = make_synthetic_tracks(
        rng, peak_speed=(peak * DEGREES, 0.5 * peak * DEGREES), noise=0.0, frame_rate=frame_rate
    )
    result = measure_exploration([tracks])
    # the gain of the zero-phase filter at 0.5 Hz, cutoff 6 Hz, is 1/(1 + (1/12)^4) = 0.99995
    np.testing.assert_allclose(result.mean_peak[0] / DEGREES, [peak, 0.5 * peak], rtol=3e-4)
    assert np.all(result.n_peaks >= 18)  # 20 s of 0.5 Hz, two peaks per cycle
    assert result.source == "synthetic"


def test_lateral_speed_is_angular_speed_times_length():
    tracks = make_synthetic_tracks(np.random.default_rng(3), noise=0.0)
    result = measure_exploration([tracks, tracks], length=42.0)
    assert result.lateral_speed == pytest.approx(0.0635, abs=2e-4)  # 86.67 °/s × 42 mm, the paper's 6 cm/s


def test_filter_gain_at_the_cutoff_is_one_half():
    time = np.arange(4000) * 10.0
    angle = np.sin(2 * np.pi * 5e-3 * time)
    smoothed = smooth(angle, 10.0, cutoff=5e-3)
    middle = slice(1000, 3000)
    gain = smoothed[middle] @ angle[middle] / (angle[middle] @ angle[middle])
    assert gain == pytest.approx(0.5, abs=1e-3)


def test_filter_does_not_delay():
    time = np.arange(1001.0)
    bump = np.exp(-(((time - 500) / 60) ** 2))
    assert np.argmax(smooth(bump, 1.0, cutoff=0.01)) == 500


def test_derivative_of_a_cubic_is_exact_inside():
    time = np.linspace(-3, 5, 41)
    speed = differentiate(time**3 - 2 * time, 0.2)
    np.testing.assert_allclose(speed[2:-2], 3 * time[2:-2] ** 2 - 2, atol=1e-9)


def test_short_gaps_are_bridged_and_counted_long_ones_kept():
    angle = 0.1 * np.arange(60.0)
    angle[[10, 11]] = np.nan
    angle[30:40] = np.nan
    filled, bridged = bridge_gaps(angle, max_gap=5)
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
    filled, count = bridge_gaps(angle, max_gap=5)
    assert count == bridged
    np.testing.assert_allclose(filled[12 : 12 + lost], 0.1 * np.arange(12, 12 + lost) if bridged else np.nan)


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
    filled, _ = bridge_gaps(right, 5)
    np.testing.assert_allclose(np.diff(filled), np.diff(swing), atol=1e-9)


def test_lost_frames_change_the_answer_little():
    clean = make_synthetic_tracks(np.random.default_rng(8), noise=0.2)
    gappy = make_synthetic_tracks(np.random.default_rng(8), noise=0.2, gap_share=0.1)
    assert np.isnan(gappy.position).any()
    a, b = measure_exploration([clean]).mean, measure_exploration([gappy], max_gap=5).mean
    assert b == pytest.approx(a, rel=0.02)


def test_tracking_noise_biases_peaks_upwards():
    quiet = measure_exploration([make_synthetic_tracks(np.random.default_rng(8), noise=0.0)]).mean
    noisy = measure_exploration([make_synthetic_tracks(np.random.default_rng(8), noise=0.5)]).mean
    assert 1.01 * quiet < noisy < 1.06 * quiet


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cutoff": 20e-3}, "half the frame rate, 15 Hz; got 20 Hz"),
        ({"cutoff": 0.0}, "cutoff must lie between"),
        ({"max_gap": -1}, "max_gap must be ≥ 0"),
        ({"min_prominence": float("nan")}, "min_prominence must be ≥ 0"),
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
    lost = Tracks(position=np.full_like(tracks.position, np.nan), landmarks=tracks.landmarks, interval=tracks.interval)
    with pytest.raises(InvalidInput, match="no angle to measure"):
        measure_exploration([lost])
