"""Formats: what is saved comes back identical, other programs can open it, and hostile files do no
harm.
"""

import json
import os
from datetime import UTC, datetime

import h5netcdf
import h5py
import numpy as np
import pytest
import scipy.io
import xarray as xr

from feeler import sandbox
from feeler.errors import InvalidInput
from feeler.sandbox import Limits
from feeler.tensors.formats import (
    FORMATS,
    Format,
    Model,
    _find_writer,
    describe_file,
    detect,
    find_problems,
    load,
    load_model,
    save,
    save_model,
)
from feeler.tensors.writers import complete, save_netcdf

from ._sets import judge, make_set, make_trial

pytestmark = pytest.mark.filterwarnings(
    "ignore:The data type"
)  # Zarr's own note on texts that xarray writes
NWB = {"session_start": datetime(2026, 1, 2, tzinfo=UTC), "identifier": "test"}
OPTIONS = {".nwb": NWB}


@pytest.fixture(scope="module")
def whole():
    return make_set()


@pytest.mark.guarded
@pytest.mark.parametrize("suffix", [".zarr", ".nc", ".mat", ".nwb", ".parquet"])
def test_a_set_comes_back_identical(tmp_path, whole, suffix):
    path = tmp_path / f"set{suffix}"
    save(whole, path, **OPTIONS.get(suffix, {}))
    expected = whole if suffix == ".zarr" else complete(whole)
    got = load(path)
    xr.testing.assert_identical(got, expected)
    assert {name: v.dtype for name, v in got.variables.items()} == {
        name: v.dtype for name, v in expected.variables.items()
    }


def test_units_in_netcdf_are_characters_for_octave(tmp_path, whole):
    """Its netcdf package reads no texts of variable length; others read the same as before."""
    whole = whole.assign(angle=whole["angle"].assign_attrs(units="1"))
    save_netcdf(whole, tmp_path / "set.nc")
    with h5py.File(tmp_path / "set.nc") as file, xr.open_dataset(tmp_path / "set.nc") as plain:
        for name in complete(whole).data_vars:
            unit = file[name].attrs.get_id("units").dtype
            assert h5py.check_string_dtype(unit).length is not None
            assert plain[name].attrs["units"] == complete(whole)[name].attrs["units"]


def test_a_tensor_as_text_is_for_other_programs(tmp_path, whole):
    save(whole, tmp_path / "one.csv", variable="curvature", trial=3)
    with pytest.raises(InvalidInput, match=r"one\.csv is one tensor as text.*NetCDF"):
        load(tmp_path / "one.csv")


def test_a_text_keeps_gaps_and_each_label_in_a_line_of_its_own(tmp_path, whole):
    gaps = whole.assign_coords(feature=("trial", ["two\nlines"] * 8))
    gaps = gaps.assign(angle=gaps.angle.where(gaps.time != 3.0))
    save(gaps, tmp_path / "one.csv", trial=2)
    lines = (tmp_path / "one.csv").read_text().split("\n")
    assert "# feature: two\\nlines" in lines
    heading = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    assert lines[heading + 4] == "3.0,nan,nan,nan,nan,nan"


def test_a_mat_file_that_matlab_saved_again_is_read(tmp_path, whole):
    save(whole, tmp_path / "set.mat")
    content = {
        k: v
        for k, v in scipy.io.loadmat(tmp_path / "set.mat").items()
        if not k.startswith("__")
    }
    content |= {"extra": {"a": [1.0, 2.0]}, "cells": np.array([1, "x"], dtype=object)}
    scipy.io.savemat(
        tmp_path / "again.mat", content, do_compression=True, long_field_names=True
    )
    xr.testing.assert_identical(load(tmp_path / "again.mat"), complete(whole))


def test_foreign_netcdf_and_zarr_of_the_contract_are_read(tmp_path, whole):
    whole.to_netcdf(tmp_path / "x.nc", engine="h5netcdf")
    whole.to_zarr(tmp_path / "x.zarr", zarr_format=3, consolidated=False)
    for path in (tmp_path / "x.nc", tmp_path / "x.zarr"):
        got = load(path)
        assert set(got.coords) == set(whole.coords)
        for name in whole.variables:
            assert got[name].dims == whole[name].dims
            np.testing.assert_array_equal(
                got[name].values.astype(whole[name].dtype), whole[name].values
            )


def test_pynwb_validates_the_file(tmp_path, whole):
    from pynwb import validate

    save(whole, tmp_path / "set.nwb", **NWB)
    assert validate(path=str(tmp_path / "set.nwb")) == []


@pytest.mark.parametrize(
    "subject",
    [{}, {"subject": "c1", "species": "Periplaneta americana", "sex": "F", "age": "P90D"}],
)
def test_nwbinspector_finds_nothing_critical_and_no_violation(tmp_path, whole, subject):
    save(
        whole,
        tmp_path / "set.nwb",
        **NWB,
        **subject,
        experimenter="Doe, Jane",
        institution="Home",
    )
    assert judge(tmp_path / "set.nwb") == []


def test_the_table_of_trials_cuts_the_series_on_one_clock(tmp_path, whole):
    """By pynapple, which knows nothing of feeler; samples every 0.3 ms from 12.5 ms on, so that
    neither the rate nor the start is a round number.
    """
    nap = pytest.importorskip("pynapple")
    time = 12.5 + 0.3 * np.arange(whole.sizes["time"])
    odd = whole.assign_coords(time=("time", time, whole["time"].attrs))
    save(odd, tmp_path / "set.nwb", **NWB)
    data = nap.load_file(str(tmp_path / "set.nwb"))
    trials, angle = data["trials"], data["angle"]
    assert len(data.keys()) <= 12
    assert np.all(trials.start[1:] > trials.end[:-1])
    assert trials.start[0] == pytest.approx(12.5e-3)
    for k in range(len(trials)):
        own = angle.restrict(nap.IntervalSet(trials.start[k] - 1e-6, trials.end[k] + 1e-6))
        np.testing.assert_allclose(own.t - trials.start[k], 1e-3 * (time - time[0]), atol=1e-9)
        np.testing.assert_allclose(own.values, whole.angle.values[k].T)
    np.testing.assert_allclose(load(tmp_path / "set.nwb")["time"], time, rtol=1e-12)


@pytest.mark.parametrize(("n_trials", "n_times"), [(1, 2), (2, 2)])
def test_a_set_of_fewer_samples_than_channels_is_clean_too(tmp_path, whole, n_trials, n_times):
    few = whole.isel(trial=slice(n_trials), time=slice(n_times))
    assert n_trials * n_times < few.sizes["sensor"]
    save(few, tmp_path / "set.nwb", **NWB)
    xr.testing.assert_identical(load(tmp_path / "set.nwb"), complete(few))
    assert judge(tmp_path / "set.nwb") == []


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("set.xyz", {}, r"unknown ending '\.xyz'.*valid: \.zarr, \.nc, \.nwb, \.mat, \.csv"),
        ("set.csv", {"variable": "tip"}, "no tensor 'tip'.*valid: angle, curvature"),
        ("set.csv", {"trial": 8}, r"trial must lie in 0 … 7, got 8"),
        (
            "set.nwb",
            {**NWB, "session_start": datetime(2026, 1, 2)},
            r"need session_start=, a time with its zone",
        ),
    ],
)
def test_what_cannot_be_saved_is_refused(tmp_path, whole, name, options, words):
    with pytest.raises(InvalidInput, match=words):
        save(whole, tmp_path / name, **options)


CONTENT = {
    "pickle": (b"\x80\x04\x95", "Python pickle.*never read"),
    "zip": (b"PK\x03\x04aaaa", "ZIP archive"),
    "netcdf3": (b"CDF\x01aaaaaaa", "NetCDF-3"),
    "mat73": (b"MATLAB 7.3 MAT-file", "-v7"),
    "empty": (b"", "is empty"),
    "noise": (bytes(range(256)), "a kind that feeler does not know"),
}


@pytest.mark.parametrize("name", CONTENT)
def test_other_files_are_named(tmp_path, name):
    raw, words = CONTENT[name]
    (tmp_path / name).write_bytes(raw)
    with pytest.raises(InvalidInput, match=words):
        load(tmp_path / name)


def test_absent_files_pipes_and_folders_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name, words in {
        "absent": "no such file",
        "pipe": "not a regular file",
        "folder": "is a folder, no store of touches: name a file .nothing",
        "a\0": "must be .*a path that a file can have",
    }.items():
        with pytest.raises(InvalidInput, match=words):
            load(tmp_path / name)


def bomb_zarr(path, changes):
    make_set(2).to_zarr(path, zarr_format=3, consolidated=False)
    metadata = json.loads((path / "angle" / "zarr.json").read_text())
    (path / "angle" / "zarr.json").write_text(json.dumps({**metadata, **changes}))


@pytest.mark.guarded
@pytest.mark.further
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"shape": [1 << 20, 1 << 20, 1]}, "asks for 8192 GiB, over the limit of 4 GiB"),
        ({"shape": [-1, 5, 40]}, "x.zarr: .*"),
        ({"data_type": "object"}, "damaged or of another kind"),
        ({"codecs": [{"name": "bytes"}, {"name": "pickle"}]}, "damaged or of another kind"),
        ({"codecs": 3}, "damaged or of another kind"),
        (
            {"chunk_key_encoding": {"name": "default", "configuration": {"separator": "/../"}}},
            "damaged or of another",
        ),
        ({"dimension_names": ["../../x", "sensor", "time"]}, "dims|conflicting"),
    ],
)
def test_hostile_zarr_metadata_are_refused_before_memory_is_taken(tmp_path, changes, words):
    bomb_zarr(tmp_path / "x.zarr", changes)
    with pytest.raises(InvalidInput, match=words):
        load(tmp_path / "x.zarr")


@pytest.mark.long
@pytest.mark.guarded
def test_hostile_hdf5_is_refused(tmp_path):
    with h5netcdf.File(tmp_path / "huge.nc", "w") as file:
        file.dimensions = {"a": 1 << 20, "b": 1 << 20}
        file.create_variable("angle", ("a", "b"), "f8", chunks=(1, 1024))
    (tmp_path / "secret").write_bytes(bytes(64))
    with h5py.File(tmp_path / "external.nc", "w") as file:
        file.create_dataset(
            "angle", shape=(8,), dtype="f8", external=[(str(tmp_path / "secret"), 0, 64)]
        )
    with h5py.File(tmp_path / "link.nc", "w") as file:
        file["angle"] = h5py.ExternalLink(str(tmp_path / "huge.nc"), "/angle")
    with h5py.File(tmp_path / "virtual.nc", "w") as file:
        layout = h5py.VirtualLayout(shape=(8,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "huge.nc"), "angle", shape=(8,))
        file.create_virtual_dataset("angle", layout)
    with h5py.File(tmp_path / "compound.nc", "w") as file:
        file["angle"] = np.zeros(3, [("a", "f8"), ("b", "i4")])
    words = {
        "huge": "over the limit",
        "external": "in another file",
        "link": "is a link",
        "virtual": "in another file",
    }
    for name, expected in {
        **words,
        "compound": "neither tensors|readable are numbers",
    }.items():
        with pytest.raises(InvalidInput, match=expected):
            load(tmp_path / f"{name}.nc")


@pytest.mark.parametrize("kind", ["|b1", "<i2", ">f4", "<f8", "<f2"])
def test_an_array_is_counted_by_the_size_of_its_type(kind):
    n_bytes = 6 * np.dtype(kind).itemsize
    sandbox._check_bytes(Limits(max_bytes=n_bytes), [("a", kind, [2, 3])], "it")
    with pytest.raises(InvalidInput, match="over the limit"):
        sandbox._check_bytes(Limits(max_bytes=n_bytes - 1), [("a", kind, [2, 3])], "it")


@pytest.mark.parametrize("kind", ["<U12", "<c16", "<m8[ns]", "|O", "|S8", "8"])
def test_what_is_no_plain_number_is_refused_on_both_sides_of_the_guard(kind):
    with pytest.raises(InvalidInput, match="readable are numbers and texts"):
        sandbox._check_bytes(Limits(), [("a", kind, [2, 3])], "it")


@pytest.mark.guarded
def test_limits_come_from_the_environment(tmp_path, whole, monkeypatch):
    save(whole, tmp_path / "set.mat")
    monkeypatch.setenv("FEELER_MAX_GIB", "1e-6")
    with pytest.raises(InvalidInput, match=r"over the limit of 9\.993e-07 GiB"):
        load(tmp_path / "set.mat")
    monkeypatch.setenv("FEELER_MAX_GIB", "much")
    with pytest.raises(InvalidInput, match="FEELER_MAX_GIB must be a number"):
        load(tmp_path / "set.mat")


MODEL = Model(
    kind="lda",
    version=2,
    arrays={
        "scale": np.array(3.5),
        "means": np.arange(6.0).reshape(2, 3),
        "mask": np.array([True]),
        "n": np.array([2**62]),
    },
    settings={"classes": ["ball", "box"], "shrinkage": 1 / 3},
)


def test_a_model_comes_back_identical_and_opens_as_safetensors(tmp_path):
    save_model(MODEL, tmp_path / "m.safetensors")
    got = load_model(tmp_path / "m.safetensors", kind="lda", version=2)
    assert got.settings == MODEL.settings
    for name, values in MODEL.arrays.items():
        assert got.arrays[name].dtype == values.dtype
        np.testing.assert_array_equal(got.arrays[name], values)
    assert detect(tmp_path / "m.safetensors") == "model"


def test_safetensors_reads_the_same(tmp_path):
    import safetensors.numpy as numpy

    save_model(MODEL, tmp_path / "m.safetensors")
    got = numpy.load_file(tmp_path / "m.safetensors")
    np.testing.assert_array_equal(got["means"], MODEL.arrays["means"])
    numpy.save_file({"a": np.ones(3)}, tmp_path / "theirs.safetensors", {"format": "pt"})
    with pytest.raises(InvalidInput, match="no model of feeler"):
        load_model(tmp_path / "theirs.safetensors", kind="lda", version=2)


@pytest.mark.parametrize(
    ("kind", "version", "words"),
    [
        ("cnmf", 2, "holds a model of kind 'lda', not 'cnmf'"),
        ("lda", 1, "holds version 2 of 'lda'; this feeler reads 1. Update feeler"),
        ("lda", 3, "holds version 2 of 'lda'; this feeler reads 3. Fit it again"),
    ],
)
def test_another_kind_or_version_says_so(tmp_path, kind, version, words):
    save_model(MODEL, tmp_path / "m.safetensors")
    with pytest.raises(InvalidInput, match=words):
        load_model(tmp_path / "m.safetensors", kind=kind, version=version)


@pytest.mark.parametrize("cut", [0, 4, 8, 40, -1])
def test_a_cut_model_file_is_refused(tmp_path, cut):
    save_model(MODEL, tmp_path / "m.safetensors")
    raw = (tmp_path / "m.safetensors").read_bytes()
    (tmp_path / "m.safetensors").write_bytes(raw[:cut])
    with pytest.raises(InvalidInput, match=r"damaged|no model of feeler"):
        load_model(tmp_path / "m.safetensors", kind="lda", version=2)


@pytest.mark.long
def test_one_trial_of_one_sample_survives_every_format(tmp_path):
    tiny = make_trial(0, 1)
    for suffix in (".zarr", ".nc", ".mat", ".nwb"):
        save(tiny, tmp_path / f"tiny{suffix}", **OPTIONS.get(suffix, {}))
        expected = tiny if suffix == ".zarr" else complete(tiny)
        xr.testing.assert_identical(load(tmp_path / f"tiny{suffix}").load(), expected)


@pytest.mark.guarded
@pytest.mark.parametrize(
    "kind", ["(2,", "f8,(3", "O", "V8", "<f16", "{'a': 1}", 8, None, ["a"]]
)
def test_a_type_is_one_of_few_words_and_never_parsed(tmp_path, whole, kind):
    from feeler.tensors.writers import describe, restore

    content = json.loads(describe(whole))
    content["variables"]["angle"]["type"] = kind
    with pytest.raises(InvalidInput, match=r"variable 'angle' has the type"):
        restore(content, {name: item.values for name, item in whole.variables.items()}, "file")


@pytest.fixture
def plain_json():
    """A format of somebody else."""

    def write(dataset, path, *, indent):
        path.write_text("plain " + json.dumps(dataset.to_dict(), indent=indent, default=str))

    def read(path, limits, trusted):
        return xr.Dataset.from_dict(json.loads(path.read_text()[6:]))

    form = Format(
        words="plain JSON",
        suffix=".json",
        detect=lambda path, start: start.startswith(b"plain "),
        load=read,
        save=write,
    )
    FORMATS.register("json", form)
    yield
    FORMATS.unregister("json")


def test_a_format_from_outside_goes_from_save_to_load_to_info(tmp_path, plain_json, whole):
    with pytest.raises(InvalidInput, match=r"cannot write \.json.*it takes indent="):
        save(whole, tmp_path / "set.json")
    save(whole, tmp_path / "set.json", indent=1)
    got = load(tmp_path / "set.json")
    np.testing.assert_array_equal(got.angle, whole.angle)
    assert detect(tmp_path / "set.json") == "json"
    assert "plain JSON" in describe_file(tmp_path / "set.json")[0]
    assert find_problems(tmp_path / "set.json") == []
    assert "json" in FORMATS and _find_writer(".json")


def test_options_that_a_format_needs_are_named(tmp_path, whole):
    with pytest.raises(
        InvalidInput, match=r"cannot write \.nwb.*it takes session_start=, identifier="
    ):
        save(whole, tmp_path / "set.nwb", began="today")
    with pytest.raises(InvalidInput, match=r"cannot write \.nc.*it takes no options"):
        save(whole, tmp_path / "set.nc", trial=3)


@pytest.mark.guarded
@pytest.mark.parametrize("suffix", [".nc", ".mat"])
def test_a_file_of_ones_own_may_skip_the_guard(tmp_path, whole, suffix, monkeypatch):
    save(whole, tmp_path / f"set{suffix}")
    monkeypatch.setattr("feeler.sandbox._ask", lambda *_: pytest.fail("asked the guard"))
    xr.testing.assert_identical(load(tmp_path / f"set{suffix}", trusted=True), complete(whole))


def test_what_is_read_must_keep_the_contract(tmp_path, whole):
    save_netcdf(whole.assign(angle=whole.angle * np.nan), tmp_path / "set.nc")
    with pytest.raises(InvalidInput, match="'angle' has values that are not finite"):
        load(tmp_path / "set.nc")


@pytest.mark.long
def test_simulated_touches_become_nwb_without_more_words(tmp_path):
    """A recording must say when it was; a simulation has no such time."""
    pytest.importorskip("pynwb")
    made = make_set()
    save(made, tmp_path / "a.nwb")
    save(made, tmp_path / "b.nwb", session_start="2026-01-01T00:00:00+00:00", identifier="b")
    for name in ("a.nwb", "b.nwb"):
        np.testing.assert_allclose(load(tmp_path / name)["angle"], made["angle"], rtol=1e-6)
    recorded = made.assign_coords(source=("trial", ["robot"] * made.sizes["trial"]))
    with pytest.raises(InvalidInput, match="recordings need session_start="):
        save(recorded, tmp_path / "c.nwb")
    with pytest.raises(InvalidInput, match="must be a time such as"):
        save(made, tmp_path / "d.nwb", session_start="yesterday")
