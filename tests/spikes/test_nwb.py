"""Trains in files: NWB Units as pynwb and others read them, NetCDF and Zarr by feeler."""

from datetime import UTC, datetime

import neo
import numpy as np
import pynapple
import pytest

import feeler
from feeler.spikes import attach_trains, draw_spikes, place_sensilla
from feeler.tensors.schema import validate
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
