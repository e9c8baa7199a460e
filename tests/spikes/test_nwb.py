"""Trains in files: NWB Units as pynwb and others read them, NetCDF and Zarr by feeler."""

import json
from datetime import UTC, datetime

import neo
import numpy as np
import pynapple
import pytest

import feeler
from feeler.spikes import Firing, attach_trains, draw_spikes, find_gain, place_sensilla
from feeler.tensors.schema import validate
from tests.cli._command import run
from tests.spikes._touches import POSITION, make_bent

pynwb = pytest.importorskip("pynwb")
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


def test_pynapple_reads_the_units(file):
    units = pynapple.load_file(str(file))["units"]
    assert len(units) == 2 * POSITION.size


def test_neo_reads_the_units(file):
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
