"""Trains against what is known of renewal processes; rasters, thinning, recorded trains."""

import json
import os
import subprocess
import sys
from datetime import UTC, datetime

import numpy as np
import pytest
from scipy import stats

import feeler
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.spikes import (
    Firing,
    attach_trains,
    count_spikes,
    draw_spikes,
    find_gain,
    place_sensilla,
    thin_spikes,
)
from feeler.tensors.schema import validate
from tests.cli._command import run
from tests.spikes._touches import POSITION, make_bent


def make_rates(hertz, steps=400, n=1, units=4):
    """Touches whose units all fire at this rate [Hz], a number or (time,)."""
    touches = make_bent(n, steps)
    rates = np.broadcast_to(hertz, (n, units, steps)).astype(float)
    return touches.assign(rate=(("trial", "unit", "time"), rates, {"units": "Hz"}))


def list_intervals(spikes):
    times = spikes["spike_time"].values
    return np.diff(times, axis=2)[np.isfinite(np.diff(times, axis=2))]


@pytest.mark.parametrize("order", [1, 4])
@pytest.mark.parametrize("seed", [0, 1])
def test_any_window_holds_the_expected_number_of_spikes(order, seed):
    rate = 60 + 50 * np.sin(np.arange(90) / 9)
    drawn = draw_spikes(make_rates(rate, 90, n=40, units=50), Firing(order=order), seed=seed)
    counts = count_spikes(drawn).values.reshape(2000, 90)
    for window in (slice(0, 4), slice(20, 50), slice(0, 90)):
        own, expected = counts[:, window].sum(axis=1), rate[window].sum() * 1e-3
        error = own.std() / np.sqrt(own.size)
        assert abs(own.mean() - expected) < 4 * error
    long = counts.sum(axis=1)
    assert long.var() / long.mean() == pytest.approx({1: 1.0, 4: 0.31}[order], rel=0.12)


def test_poisson_counts_follow_the_poisson_distribution():
    counts = count_spikes(draw_spikes(make_rates(80, 60, n=50, units=60), seed=4)).sum("time")
    seen = np.bincount(counts.values.ravel(), minlength=14)[:14]
    expected = stats.poisson(4.8).pmf(np.arange(14)) * counts.size
    enough = expected > 20
    assert (
        stats.chisquare(
            np.append(seen[enough], counts.size - seen[enough].sum()),
            np.append(expected[enough], counts.size - expected[enough].sum()),
        ).pvalue
        > 1e-3
    )


@pytest.mark.parametrize("order", [1, 3])
def test_intervals_are_the_refractory_period_and_a_gamma(order):
    drawn = draw_spikes(
        make_rates(200, 4000, units=6), Firing(order=order, refractory=2.0), seed=2
    )
    intervals = list_intervals(drawn)
    law = stats.gamma(order, loc=2.0, scale=5.0 / order)
    assert stats.kstest(intervals, law.cdf).pvalue > 1e-3
    assert intervals.min() >= 2.0 and intervals.mean() == pytest.approx(7.0, rel=0.05)


def test_latency_moves_all_spikes_and_its_spread_each():
    rates = make_rates(100, 300, units=8)
    plain, late = (
        draw_spikes(rates, Firing(latency=x), seed=3)["spike_time"] for x in (0, 7.5)
    )
    first, moved = (x.values[np.isfinite(x.values)] for x in (plain, late))
    np.testing.assert_allclose(
        np.sort(first + 7.5)[: moved.size // 2], np.sort(moved)[: moved.size // 2]
    )
    spread = draw_spikes(
        make_rates(20, 4000, units=30), Firing(spread=1.5, latency=9.0), seed=3
    )
    times = spread["spike_time"].values
    assert np.all(np.diff(times, axis=2)[np.isfinite(np.diff(times, axis=2))] >= 0)
    assert list_intervals(spread).mean() == pytest.approx(50, rel=0.1)


def test_a_trial_has_the_same_spikes_alone_or_among_others():
    rates = make_rates(150, 50, n=4)
    whole, alone = (
        draw_spikes(part, seed=5)["spike_time"] for part in (rates, rates.isel(trial=[2]))
    )
    own = whole.values[2][np.isfinite(whole.values[2])]
    np.testing.assert_array_equal(own, alone.values[np.isfinite(alone.values)])
    assert not np.array_equal(own, whole.values[1][np.isfinite(whole.values[1])])


@pytest.mark.long
def test_the_same_numbers_come_without_compiled_code():
    code = (
        "from tests.spikes._touches import make_bent, POSITION\n"
        "from feeler.spikes import *\n"
        "firing = Firing(order=2, refractory=1.5, spread=0.2)\n"
        "rates = place_sensilla(POSITION, 25.0).encode(make_bent(1, 60))\n"
        "times = draw_spikes(rates, firing, seed=8)['spike_time'].values\n"
        "print(repr(float(rates['rate'].sum())), times[times == times].tolist())"
    )
    said = [
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "NUMBA_DISABLE_JIT": off},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for off in ("0", "1")
    ]
    (first, *one), (second, *two) = (
        [float(x.strip("[],")) for x in text.split()] for text in said
    )
    assert len(one) == len(two) > 5 and first == pytest.approx(second, rel=1e-12)
    np.testing.assert_allclose(one, two, rtol=1e-12)


def test_a_spike_belongs_to_the_first_sample_at_or_after_it():
    touches = make_bent(2, steps=5)
    trains = [[[0.0, 0.3, 1.0], []], [[], [3.2]]]
    raster = count_spikes(attach_trains(touches, trains, ["a", "b"]))
    assert raster.values[0].tolist() == [[1, 2, 0, 0, 0], [0] * 5]
    assert raster.values[1].tolist() == [[0] * 5, [0, 0, 0, 0, 1]]
    assert raster["unit"].values.tolist() == ["a", "b"] and "lead" in raster.coords


@pytest.mark.parametrize(
    ("trains", "units", "words"),
    [
        ([[[1.0], [2.0]]], ["a", "a"], "two trains of unit 'a'"),
        ([[[1.0]]], ["a", "b"], "trial 0 has 1 trains for 2 units"),
        ([[[1.0]], [[1.0]]], ["a"], "1 trials but trains of 2"),
        (
            [[[2.0, 1.0]]],
            ["a"],
            "train of unit 'a' in trial 0 must rise within the record, 0 to 4",
        ),
        ([[[7.0]]], ["a"], "must rise within the record"),
    ],
)
def test_recorded_trains_that_cannot_be_are_refused(trains, units, words):
    with pytest.raises(InvalidInput, match=words):
        attach_trains(make_bent(1, steps=5), trains, units)


def test_thinned_trains_keep_the_share_asked_for_and_nothing_is_made_up():
    counts = np.random.default_rng(0).poisson(0.2, (300, 8, 40))
    thin = thin_spikes(counts, 20.0, seed=1)
    per_trial = thin.sum(axis=(1, 2))
    assert np.all(thin <= counts) and per_trial.mean() == pytest.approx(20, rel=0.03)
    assert per_trial.var() == pytest.approx(20, rel=0.35)  # thinned Poisson is Poisson
    np.testing.assert_array_equal(thin_spikes(counts, 1e6), counts)


def test_silence_is_said():
    with pytest.warns(ModelValidityWarning, match="no unit fired in any trial"):
        drawn = draw_spikes(make_rates(0, 20))
    assert count_spikes(drawn).sum() == 0
    with pytest.warns(
        ModelValidityWarning, match="every train that was given is empty"
    ) as told:
        attach_trains(make_bent(1), [[[], []]], ["a", "b"])
    assert told[0].filename == __file__


def test_negative_rates_are_refused():
    with pytest.raises(InvalidInput, match="rates must be ≥ 0 Hz"):
        draw_spikes(make_rates(-1, 20))
    with pytest.raises(InvalidInput, match=r"population.encode\(touches\) gives them"):
        draw_spikes(make_bent())


START = datetime(2026, 11, 23, 10, tzinfo=UTC)


@pytest.fixture(scope="module")
def drawn():
    return draw_spikes(place_sensilla(POSITION, 25.0).encode(make_bent(3)), seed=4)


@pytest.fixture(scope="module")
def file(drawn, tmp_path_factory):
    path = tmp_path_factory.mktemp("spikes") / "set.nwb"
    feeler.save(drawn, path, session_start=START, identifier="spikes-1")
    return path


@pytest.mark.long
def test_pynwb_reads_each_unit_on_the_session_s_clock(file, drawn):
    pynwb = pytest.importorskip("pynwb")
    with pynwb.NWBHDF5IO(str(file), "r") as io:
        read = io.read()
        units, trials = read.units, read.trials
        assert len(units) == drawn.sizes["unit"]
        for number in range(len(units)):
            times = units["spike_times"][number]
            assert np.all(np.diff(times) >= 0)
            for trial in range(3):
                start, stop = trials["start_time"][trial], trials["stop_time"][trial]
                own = times[(times > start - 0.1) & (times < stop + 0.1)] - start
                train = drawn["spike_time"].values[trial, number]
                np.testing.assert_allclose(own * 1e3, train[np.isfinite(train)], atol=1e-9)
            whole = [[trials["start_time"][0], trials["stop_time"][2]]]
            np.testing.assert_allclose(units["obs_intervals"][number], whole)
        np.testing.assert_allclose(units["unit_position"][:], drawn["unit_position"])
        assert units["unit_name"][0] == "1"


@pytest.mark.parametrize("ending", ["nwb", "nc", "zarr"])
def test_trains_come_back_as_they_were(drawn, file, tmp_path, ending):
    path = file if ending == "nwb" else tmp_path / f"set.{ending}"
    if ending != "nwb":
        feeler.save(drawn, path)
    back = validate(feeler.load(path))
    assert back["spike_time"].dims == ("trial", "unit", "event")
    np.testing.assert_allclose(back["spike_time"], drawn["spike_time"], atol=1e-9)
    np.testing.assert_array_equal(back["rate"], drawn["rate"])
    assert back["spike_time"].attrs["units"] == "ms"
    np.testing.assert_array_equal(back["unit_side"], drawn["unit_side"])


def test_units_that_never_fire_and_trials_of_seconds_keep_their_places(tmp_path):
    touches = make_bent(2, steps=1500, step=2.0)
    trains = [[[], [0.0, 2998.0]], [[], [1.0]]]
    made = attach_trains(touches, trains, ["silent", "loud"])
    feeler.save(made, tmp_path / "set.nwb", session_start=START, identifier="spikes-2")
    back = feeler.load(tmp_path / "set.nwb")["spike_time"]
    np.testing.assert_allclose(back, made["spike_time"], atol=1e-6)


@pytest.mark.long
def test_pynapple_reads_the_units(file):
    pynapple = pytest.importorskip("pynapple")
    units = pynapple.load_file(str(file))["units"]
    assert len(units) == 2 * POSITION.size


def test_neo_reads_the_units(file):
    neo = pytest.importorskip("neo")
    trains = neo.io.NWBIO(str(file), "r").read_all_blocks()[0].segments[0].spiketrains
    assert sum(len(train) for train in trains) > 0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verb")
    feeler.save(make_bent(3), folder / "set.nc")
    return folder


@pytest.mark.long
def test_the_verb_says_and_writes_what_the_library_draws(folder):
    asked = (
        "--touches",
        "set.nc",
        "--rate",
        "200",
        "--order",
        "2",
        "--seed",
        "3",
        "--show",
        "1",
    )
    session = ("--session-start", "2026-01-31T10:00:00+01:00", "--identifier", "made-1")
    done = run("spikes", *asked, *session, "--out", "one", "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    touches = make_bent(3)
    places = place_sensilla(touches["position"].values, 30.0)
    population = find_gain(touches, places, 200.0)
    drawn = draw_spikes(population.encode(touches), Firing(order=2), seed=3)
    assert said["spikes_per_touch"] == np.isfinite(drawn["spike_time"].values).sum() / 3
    assert said["gain"] == pytest.approx(population.gain[0], rel=1e-9)
    assert said["greatest_rate"] == pytest.approx(200, rel=1e-6) and said["units"] == 10
    for name in ("spikes.nc", "spikes.nwb"):
        back = feeler.load(folder / "one" / name)["spike_time"]
        np.testing.assert_allclose(back, drawn["spike_time"], atol=1e-6)
    page = (folder / "one" / "spikes.html").read_text()
    assert "data:image/" in page and "Szczecinski" in page
    kept = json.loads((folder / "one" / "spikes.json").read_text())
    np.testing.assert_allclose(kept["rate"], drawn["rate"][1])


@pytest.mark.further
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--show", "3"), "--show is below 3, the number of touches"),
        (("--identifier", "x"), "needs both --session-start and --identifier"),
        (("--gain", "5000"), "too coarse for how fast these sensilla adapt"),
        (("--gain", "-1"), "gain must be finite and > 0"),
        (("--order", "0"), "--order must be ≥ 1"),
    ],
)
def test_what_cannot_be_drawn_is_said(folder, options, words):
    done = run("spikes", "--touches", "set.nc", *options, "--out", "wrong", cwd=folder)
    assert done.returncode == 2 and words in done.stderr


@pytest.mark.long
def test_nothing_is_written_over(folder):
    asked = ("spikes", "--touches", "set.nc", "--sensors", "4", "--out", "twice")
    assert run(*asked, cwd=folder).returncode == 0
    first = (folder / "twice" / "spikes.nc").read_bytes()
    again = run(*asked, "--seed", "1", cwd=folder)
    assert again.returncode == 2 and "exists already" in again.stderr
    assert (folder / "twice" / "spikes.nc").read_bytes() == first
