"""Random touches: within their ranges, the same whatever is drawn beside them, and all of them
fit.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import feeler
from feeler.antenna import sample_antennas
from feeler.draw import LogRange, draw_shares, spread_out
from feeler.errors import InvalidInput
from feeler.objects import place, sample_trials

ANTENNA = feeler.presets.cockroach()


@given(few=st.integers(1, 40), many=st.integers(41, 3000), seed=st.integers(0, 2**40))
@settings(max_examples=15, deadline=None)
def test_the_kth_touch_is_the_same_whatever_n(few, many, seed):
    short, long = sample_trials(few, seed=seed), sample_trials(many, seed=seed)
    assert [*short] == [*long[:few]]
    assert [*sample_antennas(few, seed=seed)] == sample_antennas(many, seed=seed)[:few]


def test_another_range_leaves_the_other_parameters_as_they_were():
    one, other = sample_trials(500), sample_trials(500, speeds=0.3)
    for name in ("size", "location", "approach", "friction", "feature", "right"):
        np.testing.assert_array_equal(one.columns[name], other.columns[name])
    assert {*other.columns["speed"]} == {0.3}


@pytest.mark.parametrize(
    ("spread", "law"),
    [
        ((2.0, 3.0), stats.uniform(2, 1)),
        (LogRange(0.06, 0.6), stats.loguniform(0.06, 0.6)),
        (stats.norm(1.0, 0.1), stats.norm(1.0, 0.1)),
    ],
)
def test_draws_follow_their_distribution(spread, law):
    values = spread_out(spread, "x", draw_shares(5, "x", 20_000))
    assert stats.kstest(values, law.cdf).pvalue > 1e-3


def test_streams_of_different_names_and_seeds_are_independent():
    streams = np.stack(
        [draw_shares(seed, name, 20_000) for seed in (0, 1) for name in ("size", "speed")]
    )
    assert np.abs(np.corrcoef(streams) - np.eye(4)).max() < 0.03


def test_what_is_said_to_fit_without_looking_does_fit():
    drawn = sample_trials(
        300, sizes=(0.2, 20.9), locations=(0.02, 1.0), approach=(5.0, 175.0), seed=4
    )
    assert (
        np.isfinite([place(ANTENNA, trial).origin for trial in drawn]).all()
        and len(drawn) == 300
    )


def test_what_does_not_fit_is_drawn_again():
    wide = sample_trials(300, sizes=[2.0, 30.0])
    assert {*wide.columns["size"]} == {2.0}
    once = sample_trials(300, sizes=2.0)
    fitted = sample_trials(
        300,
        sizes=[2.0, 30.0],
        antenna=ANTENNA.replace(segment_length=2 * ANTENNA.segment_length),
    )
    kept = fitted.columns["size"] == 2.0
    assert 100 < kept.sum() < 200
    np.testing.assert_array_equal(wide.columns["speed"][kept], once.columns["speed"][kept])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"sizes": 30.0},
            r"50 of 50 touches cannot be placed.*bigger than the antenna.*Narrow",
        ),
        ({"sizes": (-1.0, 1.0)}, "sizes must be > 0"),
        ({"speeds": (0.0, -1.0)}, "speed must be a finite number, a range"),
        ({"speeds": (-1.0, 1.0)}, r"Trial\.speed must be > 0"),
        ({"locations": (0.5, 1.5)}, r"Trial\.location must be > 0 and ≤ 1 \(a fraction"),
        ({"features": ["wall"]}, "no size to be drawn"),
        ({"features": []}, "features must be a list"),
        ({"features": ["cone"]}, "unknown shape 'cone'"),
        ({"sides": ["up"]}, "sides must be left, right or both"),
        ({"base": {"z": 1.0}}, "base has spreads of x, y, turn"),
        ({"speeds": "fast"}, "speed must be a finite number"),
        ({"seed": -1}, "seed must be"),
    ],
)
def test_ranges_that_no_touch_can_have_are_refused(options, words):
    with pytest.raises(InvalidInput, match=words):
        sample_trials(50, **options)


@pytest.mark.parametrize(
    ("options", "words"), [({"stiffness": (0.0, 0.0)}, "factor > 0"), ({"n": 0}, "n must be")]
)
def test_antennas_that_cannot_be_are_refused(options, words):
    with pytest.raises(InvalidInput, match=words):
        sample_antennas(**{"n": 3, **options})


@pytest.mark.long
def test_sampled_touches_of_sampled_antennas_carry_every_parameter(tmp_path):
    small = feeler.Antenna(
        segment_length=np.full(8, 2.0),
        segment_mass=1e-4,
        radius=0.2,
        stiffness=0.5,
        damping=0.3,
        name="small",
    )
    antennas = sample_antennas(3, small)
    trials = sample_trials(20, antenna=small, sizes=(0.5, 1.0))
    tensors = feeler.touch(antennas, trials, duration=8.0, timestep=0.05)
    for name in ("size", "location", "speed", "approach", "friction", "lead"):
        np.testing.assert_array_equal(tensors[name], trials.columns[name])
    np.testing.assert_allclose(
        tensors.antenna_stiffness, antennas.columns["stiffness"][np.arange(20) % 3]
    )
    assert tensors.antenna.values.tolist() == [f"small {k % 3}" for k in range(20)]
    alone = feeler.touch(antennas[1], [trials[k] for k in (1, 4)], duration=8.0, timestep=0.05)
    np.testing.assert_array_equal(alone.angle, tensors.angle[[1, 4]])
    options = {"duration": 8.0, "timestep": 0.05, "store": tmp_path / "a.zarr"}
    feeler.touch(antennas, sample_trials(12, antenna=small, sizes=(0.5, 1.0)), **options)
    grown = feeler.touch(antennas, trials, **options)
    np.testing.assert_array_equal(grown.angle, tensors.angle)
    with pytest.raises(feeler.errors.StoreError, match=r"trials\.size\[1\]: 1\.0 → 0\.9"):
        feeler.touch(antennas, sample_trials(20, antenna=small, sizes=(0.5, 0.9)), **options)


def test_a_touch_has_the_numbers_of_its_row():
    drawn = sample_trials(40, base={"x": (-0.1, 0.1), "y": 0.05, "turn": (0.0, 0.01)}, seed=2)
    for k in (0, 13, 39):
        row, trial = {name: values[k] for name, values in drawn.columns.items()}, drawn[k]
        assert trial.feature.kind == drawn.features[
            row["feature"]
        ].kind and trial.feature.size == pytest.approx(row["size"])
        for name in ("location", "speed", "approach", "friction", "lead"):
            assert getattr(trial, name) == row[name]
        assert trial.side == ("right" if row["right"] else "left")
        assert (
            trial.base.velocity == (row["x"], row["y"]) == (row["x"], 0.05)
            and trial.base.turn == row["turn"]
        )
    assert {trial.side for trial in drawn} == {"left", "right"}
    assert {trial.side for trial in sample_trials(20, sides=("left",))} == {"left"}
