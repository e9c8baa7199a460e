"""Every export of what ``feeler.touch`` makes, opened by its foreign reader and compared number by
number.
"""

import csv
import json
import re
import tomllib
from datetime import UTC, datetime, timedelta, timezone

import mujoco
import numpy as np
import pytest
import xarray as xr
from awkward_touches import INTERVAL, N_SAMPLES, SENSORS, list_trials, make_antenna, make_set

import feeler
from feeler.errors import InvalidInput
from feeler.physics.spec import write_mjcf
from feeler.tensors.formats import load, save

TIME = INTERVAL * np.arange(N_SAMPLES)
TENSORS = ("angle", "curvature", "tip", "force", "base_force", "base_moment", "base_pose")
LABELS = (
    "feature",
    "size",
    "location",
    "speed",
    "lead",
    "friction",
    "approach",
    "side",
    "seed",
)


@pytest.fixture(scope="module")
def tensors():
    made = make_set()
    assert (made["segment"].values == SENSORS).all()
    assert np.abs(made["angle"].values).max(axis=(1, 2)).min() > 0.01
    return made


def test_hdf5_holds_every_variable_of_a_netcdf_file(tensors, tmp_path):
    h5py = pytest.importorskip("h5py")
    save(tensors, tmp_path / "a.nc")
    with h5py.File(tmp_path / "a.nc") as file:
        for name in (*TENSORS, "contact_place", "sink", "time", "position", "segment"):
            np.testing.assert_array_equal(file[name][()], tensors[name].values, name)
            assert _decode(file[name].attrs.get("units", "")) == tensors[name].attrs.get(
                "units", ""
            )
        for name in LABELS:
            assert [*map(_decode, file[name][()])] == tensors[name].values.tolist()


def test_what_netcdf_cannot_hold_is_json_in_it(tensors, tmp_path):
    h5py = pytest.importorskip("h5py")
    told = {"posture": [1.5, None, True], "name": "µ"}
    save(tensors.assign_attrs(told=told), tmp_path / "a.nc")
    with h5py.File(tmp_path / "a.nc") as file:
        assert json.loads(file.attrs["told"]) == told


def test_what_xarray_cut_turned_or_converted_is_not_read_by_the_old_description(
    tensors, tmp_path
):
    save(tensors, tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as opened:
        own = opened.load()
    cut = own.isel(time=slice(0, N_SAMPLES // 2), trial=[1])
    turned, seconds = own.transpose(), own.assign_coords(time=own["time"] / 1e3)
    seconds["time"].attrs["units"] = "s"
    for name, one in (("cut", cut), ("turned", turned), ("seconds", seconds)):
        one.to_netcdf(tmp_path / f"{name}.nc", engine="h5netcdf")
    found = load(tmp_path / "cut.nc")
    np.testing.assert_array_equal(found["angle"].values, cut["angle"].values)
    assert found.attrs["engine"] == tensors.attrs["engine"]
    with pytest.raises(InvalidInput, match="'angle' must have dims"):
        load(tmp_path / "turned.nc")
    with pytest.raises(InvalidInput, match="'time' must be in ms, says 's'"):
        load(tmp_path / "seconds.nc")


def test_labels_that_xarray_put_in_another_order_or_changed_are_those_of_the_file(
    tensors, tmp_path
):
    save(tensors, tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as opened:
        own = opened.load()
    own.isel(trial=[2, 0, 1]).to_netcdf(tmp_path / "turned.nc", engine="h5netcdf")
    turned = load(tmp_path / "turned.nc")
    assert turned["feature"].values.tolist() == ["box", "triangle", "ball"]
    np.testing.assert_array_equal(turned["angle"].values, own["angle"].values[[2, 0, 1]])
    own["feature"][:] = "peg"
    own.to_netcdf(tmp_path / "renamed.nc", engine="h5netcdf")
    assert set(load(tmp_path / "renamed.nc")["feature"].values) == {"peg"}
    own["feature"] = ("trial", np.array([b"peg", b"ball", b"box"]))
    own.to_netcdf(tmp_path / "bytes.nc", engine="h5netcdf")
    assert load(tmp_path / "bytes.nc")["feature"].values.tolist() == ["peg", "ball", "box"]


def test_numbers_packed_as_whole_ones_are_what_they_stand_for(tensors, tmp_path):
    save(tensors, tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as opened:
        own = opened.load()
    how = {"angle": {"dtype": "int32", "scale_factor": 1e-8, "_FillValue": -(2**31)}}
    own.to_netcdf(tmp_path / "packed.nc", engine="h5netcdf", encoding=how)
    found = load(tmp_path / "packed.nc")["angle"]
    np.testing.assert_allclose(found.values, own["angle"].values, atol=1e-8)
    assert "scale_factor" not in found.attrs


def test_labels_that_matlab_put_in_another_order_are_those_of_the_file(tensors, tmp_path):
    from scipy.io import loadmat, savemat

    save(tensors, tmp_path / "a.mat")
    own = {k: v for k, v in loadmat(tmp_path / "a.mat").items() if not k.startswith("_")}
    order = [2, 0, 1]
    for name in [name for name in tensors.variables if "trial" in tensors[name].dims]:
        row = own[name].shape[0] == 1
        own[name] = own[name][:, order] if row else own[name][order]
    savemat(tmp_path / "turned.mat", own, long_field_names=True)
    turned = load(tmp_path / "turned.mat")
    np.testing.assert_array_equal(turned["angle"].values, tensors["angle"].values[order])
    assert turned["feature"].values.tolist() == tensors["feature"].values[order].tolist()


def _decode(value):
    return value.decode() if isinstance(value, bytes) else value


def test_scipy_holds_every_variable_of_a_matlab_file(tensors, tmp_path):
    from scipy.io import loadmat

    save(tensors, tmp_path / "a.mat")
    found = loadmat(tmp_path / "a.mat")
    for name in (*TENSORS, "contact_place"):
        np.testing.assert_array_equal(found[name], tensors[name].values, name)
    np.testing.assert_allclose(found["time"], TIME[None], rtol=1e-14)
    np.testing.assert_array_equal(found["segment"], [SENSORS])
    np.testing.assert_array_equal(found["speed"], [[0.37, 0.61, 0.23]])
    assert [text.strip() for text in found["feature"]] == ["triangle", "ball", "box"]
    save(tensors.isel(trial=[1]), tmp_path / "one.mat")
    one = loadmat(tmp_path / "one.mat")["angle"]
    np.testing.assert_array_equal(one, tensors["angle"].values[1:2])
    units = json.loads(found["feeler_description"][0])["variables"]
    assert units["curvature"]["attributes"]["units"] == "1/mm"


@pytest.mark.parametrize("way", ["saved", "stored"])
def test_zarr_holds_every_variable(tensors, tmp_path, way):
    zarr = pytest.importorskip("zarr")
    options = {"duration": INTERVAL * N_SAMPLES, "sample_interval": INTERVAL, "seed": 5}
    if way == "saved":
        save(tensors, tmp_path / "a.zarr")
    else:
        feeler.touch(make_antenna(), list_trials(), store=tmp_path / "a.zarr", **options)
    group = zarr.open_group(tmp_path / "a.zarr", mode="r")
    names = TENSORS if way == "saved" else [n for n in TENSORS if n != "curvature"]
    for name in (*names, "time", "segment", "position"):
        np.testing.assert_array_equal(group[name][:], tensors[name].values, name)
        assert group[name].attrs.get("units", "") == tensors[name].attrs.get("units", "")
    for name in LABELS:
        assert group[name][:].tolist() == tensors[name].values.tolist()


def test_pynwb_finds_each_touch_at_its_time_with_its_labels(tensors, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    pytest.importorskip("ndx_pose")
    start, late = datetime(2026, 3, 4, 5, 6, tzinfo=UTC), 5.7  # ms, at which recording began
    time = ("time", TIME + late, tensors["time"].attrs)
    made = tensors.assign_coords(time=time)
    save(made, tmp_path / "a.nwb", session_start=start, identifier="a")
    with pynwb.NWBHDF5IO(str(tmp_path / "a.nwb"), "r") as io:
        file = io.read()
        for k in range(3):
            begun = late * 1e-3 + k * (1 + TIME[-1] * 1e-3)
            part = slice(k * len(TIME), (k + 1) * len(TIME))
            for name in TENSORS:
                series = file.acquisition[name]
                np.testing.assert_array_equal(series.data[part], _pick(tensors, name, k))
                assert series.unit == tensors[name].attrs.get("units", "unknown")
                np.testing.assert_allclose(series.timestamps[part], begun + 1e-3 * TIME)
            row = file.trials.to_dataframe().iloc[k]
            assert [row[name] for name in LABELS] == [tensors[n].values[k] for n in LABELS]
            assert row["start_time"] == pytest.approx(begun, rel=1e-12)
            length = row["stop_time"] - row["start_time"]
            assert length == pytest.approx(TIME[-1] * 1e-3, rel=1e-9)


def _pick(tensors, name, k):
    """One touch's numbers, time first."""
    return tensors[name].isel(trial=k).transpose("time", ...).values


@pytest.mark.parametrize(("variable", "unit"), [("angle", "rad"), ("curvature", "per_mm")])
def test_a_spreadsheet_finds_one_touch_in_a_csv(tensors, tmp_path, variable, unit):
    save(tensors, tmp_path / "a.csv", variable=variable, trial=1)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    header, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    assert header == ["time_ms", *(f"sensor{n}_{unit}" for n in range(1, 6))]
    table = np.array(rows, dtype=float)
    np.testing.assert_array_equal(table[:, 0], tensors["time"].values)
    np.testing.assert_array_equal(table[:, 1:].T, tensors[variable].values[1])
    notes = dict(line[2:].split(": ", 1) for line in lines if re.match(r"# \w+: ", line))
    assert notes["feature"] == "ball" and float(notes["speed"]) == 0.61
    assert notes["unit"] == tensors[variable].attrs["units"]


MOVING = list_trials()[:2]


@pytest.mark.parametrize("trial", MOVING, ids=lambda trial: trial.name)
def test_mujoco_plays_an_exported_scene_as_the_chain_does(tmp_path, trial):
    """From the keyframe, by MuJoCo's own step and nothing of ours, though MuJoCo's angle is the
    hinge's and its clock in seconds is our milliseconds."""
    antenna, timestep = make_antenna(), 0.01
    write_mjcf(antenna, trial, tmp_path / "scene.xml", timestep)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    rows = []
    for _ in range(N_SAMPLES):
        rows.append(data.qpos[:11].copy())
        for _ in range(round(INTERVAL / timestep)):
            mujoco.mj_step(model, data)
    options = {
        "duration": INTERVAL * N_SAMPLES,
        "sample_interval": INTERVAL,
        "timestep": timestep,
    }
    found = feeler.touch(antenna, trial, engine="chain", all_hinges=True, **options)
    expected = found["angle"].values[0].T
    peak = np.abs(expected - expected[0]).max()
    assert peak > 0.01
    assert np.abs(np.array(rows) - expected).max() < 1e-3 * peak


def test_an_antenna_file_is_read_by_any_toml_reader(tmp_path):
    antenna = make_antenna()
    feeler.save_antenna(antenna, tmp_path / "a.toml")
    found = tomllib.loads((tmp_path / "a.toml").read_text())
    units = {
        "segment_length": "mm",
        "segment_mass": "g",
        "radius": "mm",
        "stiffness": "N·mm/rad",
        "damping": "N·mm·ms/rad",
        "rest_angle": "rad",
    }
    for name, unit in units.items():
        written = found[name]
        assert written["unit"] == unit
        ends = [written[key] for key in ("base", "tip") if key in written]
        values = written.get("values", np.linspace(*ends, 11) if ends else None)
        np.testing.assert_allclose(values, getattr(antenna, name), rtol=1e-15, atol=1e-18)
    assert found["sensors"]["hinges"] == [*SENSORS] and found["name"] == "awkward"


def test_a_session_starts_at_the_moment_that_was_given_whatever_its_zone(tensors, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    start = datetime(2026, 5, 1, 0, 30, tzinfo=timezone(timedelta(hours=5, minutes=30)))
    words = {"session_start": start.isoformat(), "identifier": "one"}
    save(tensors, tmp_path / "a.nwb", **words)
    with pynwb.NWBHDF5IO(str(tmp_path / "a.nwb"), "r") as io:
        assert io.read().session_start_time == start
