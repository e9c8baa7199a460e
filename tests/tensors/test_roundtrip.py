"""What can be saved loads back equal, in every format that is read; everything else is refused
before anything is written.
"""

import os

import hypothesis.strategies as st
import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, example, given, settings

from feeler.errors import FeelerError, InvalidInput
from feeler.tensors.formats import FORMATS, load, save
from feeler.tensors.schema import find_errors
from feeler.tensors.writers import complete

from ._sets import make_set

WRITTEN = [form.suffix for form in FORMATS.values() if form.save and form.suffix != ".csv"]
NWB = {"session_start": "2026-01-02T00:00:00+00:00", "identifier": "test"}

TEXTS = st.text(max_size=6) | st.sampled_from(["", " a ", "a\0b", "\ud800", "日本", "x" * 5000])
VALUES = (
    st.none()
    | st.booleans()
    | st.floats()
    | st.integers(-(2**70), 2**70)
    | TEXTS
    | st.lists(st.integers(0, 3) | st.floats(), max_size=3)
    | st.just({"a": [1.5, "b"]})
)
LABELS = st.one_of(
    st.lists(st.floats(), min_size=4, max_size=4).map(np.array),
    st.lists(st.integers(0, 2**64 - 1), min_size=4, max_size=4).map(
        lambda numbers: np.array(numbers, "u8")
    ),
    st.lists(TEXTS, min_size=4, max_size=4).map(lambda texts: np.array(texts, str)),
    st.sampled_from(["i1", "f2", "g", "c16", "S3", "M8[ns]", "m8[ns]", ">f4", "?"]).map(
        lambda kind: np.arange(4).astype(kind)
    ),
    st.just(np.array(["a", 1, None, 2.5], object)),
)
PARTS = st.fixed_dictionaries(
    {
        "trial": st.sampled_from([slice(None), slice(0), [2], 0, [3, 1]]),
        "sensor": st.sampled_from([slice(None), slice(None, None, -1), [1], slice(0)]),
        "time": st.sampled_from([slice(None), slice(None, None, -1), [5], slice(0)]),
    }
)
CHANGES = {
    "as it is": lambda data: data,
    "32 bits": lambda data: data.assign(angle=data.angle.astype("f4")),
    "other end": lambda data: data.assign(angle=data.angle.astype(">f8")),
    "NaN": lambda data: data.assign(angle=data.angle * np.nan),
    "infinite": lambda data: data.assign(tip=data.tip + np.inf),
    "whole numbers": lambda data: data.assign(angle=(9 * data.angle).astype(int)),
    "transposed": lambda data: data.transpose("time", ...),
    "same times": lambda data: data.assign_coords(time=data.time * 0),
    "one label twice": lambda data: (
        data.assign_coords(trial=("trial", np.ones(data.sizes.get("trial", 0), int)))
        if "trial" in data.dims
        else data
    ),
    "a number beside": lambda data: data.assign(total=3.5, count=2**62),
    "lazily": lambda data: data.chunk(),
}
NAMES = ["note", "units", "finished", "id", "start_time", "label", "é", "trial", "feature"]


@pytest.mark.long
@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@example(
    part={"trial": slice(0), "sensor": slice(None), "time": slice(None)},
    change="lazily",
    label=("note", np.array(["a", 1, None, 2.5], object)),
    attribute=None,
    suffix=".nc",
)
@given(
    part=PARTS,
    change=st.sampled_from([*CHANGES]),
    label=st.tuples(st.sampled_from(NAMES), LABELS) | st.none(),
    attribute=st.tuples(
        st.sampled_from(["note", "größe", "coordinates", "feeler_store", "units", 3]), VALUES
    )
    | st.none(),
    suffix=st.sampled_from(WRITTEN),
)
def test_what_can_be_saved_loads_back_equal(
    tmp_path_factory, part, change, label, attribute, suffix
):
    data = make_set(4)
    if label is not None:
        data = data.assign_coords({label[0]: ("trial", label[1])})
    data = CHANGES[change](data.isel(part))
    if attribute is not None:
        data = data.assign_attrs({attribute[0]: attribute[1]})
        data["tip"].attrs["note"] = attribute[1]
    path = tmp_path_factory.mktemp("any") / f"set{suffix}"
    try:
        save(data, path, **(NWB if suffix == ".nwb" else {}))
    except FeelerError:
        assert not os.listdir(path.parent)
        return
    expected = (data if suffix == ".zarr" else complete(data)).load()
    loaded = load(path).load()
    xr.testing.assert_identical(loaded, expected)
    for name, item in expected.variables.items():
        if item.dtype.kind not in "OU":
            kinds = {one.dtype.newbyteorder("=") for one in (loaded.variables[name], item)}
            assert len(kinds) == 1


@pytest.mark.parametrize("suffix", WRITTEN)
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda data: data.isel(sensor=slice(None, None, -1)), "from base to tip"),
        (lambda data: data.isel(trial=0), r"'angle' must have dims \('trial'"),
        (lambda data: data.assign(angle=data.angle.astype("f2")), "has the type float16"),
        (lambda data: data.assign_attrs(x=np.nan), "attribute 'x' that files cannot hold"),
        (lambda data: data.set_index(trial=["feature", "seed"]), "holds .*texts"),
    ],
)
def test_what_load_would_refuse_is_refused_before_it_is_written(tmp_path, suffix, spoil, words):
    spoiled = spoil(make_set(4))
    with pytest.raises(InvalidInput, match=words):
        save(spoiled, tmp_path / f"set{suffix}", **(NWB if suffix == ".nwb" else {}))
    assert not os.listdir(tmp_path)


def test_spikes_keep_their_trials_and_places_in_nwb(tmp_path):
    """All trials share one clock there: what lies far outside a trial would be another's."""
    spikes = np.full((4, 2, 3), np.nan)
    spikes[:, 0, 0], spikes[2, 1, :2] = 1.0, (0.125, 430.0)
    unit = {"units": "ms"}
    data = make_set(4).assign(spike_time=(("trial", "unit", "event"), spikes, unit))
    save(data, tmp_path / "set.nwb", **NWB)
    np.testing.assert_allclose(load(tmp_path / "set.nwb")["spike_time"], spikes, atol=1e-9)
    spikes[2, 1, 1] = 540.0
    with pytest.raises(InvalidInput, match=r"1 spikes lie more than 500 ms outside.*trial 2"):
        save(
            data.assign(spike_time=(("trial", "unit", "event"), spikes, unit)),
            tmp_path / "b.nwb",
            **NWB,
        )


@pytest.mark.parametrize("suffix", [".zarr", ".nc", ".mat", ".nwb", ".parquet", ".csv"])
def test_a_folder_that_cannot_be_written_is_named(tmp_path, suffix):
    (tmp_path / "file").write_text("")
    with pytest.raises(FeelerError, match=r"cannot write|cannot make"):
        save(
            make_set(2), tmp_path / "file" / f"set{suffix}", **(NWB if suffix == ".nwb" else {})
        )


def test_a_newline_in_a_name_and_a_second_writer_do_no_harm(tmp_path):
    first, second = make_set(2), make_set(3)
    assert not find_errors(first)
    for suffix in WRITTEN:
        options = NWB if suffix == ".nwb" else {}
        path = tmp_path / f"two\nlines{suffix}"
        save(first, path, **options)
        np.testing.assert_array_equal(load(path)["angle"], first["angle"])
        if suffix == ".zarr":
            with pytest.raises(FeelerError, match="already holds something"):
                save(second, path, **options)
        else:
            save(second, path, **options)
            np.testing.assert_array_equal(load(path)["angle"], second["angle"])


@pytest.mark.parametrize("suffix", [".zarr", ".nc", ".parquet"])
def test_a_save_that_is_interrupted_leaves_nothing(tmp_path, suffix, monkeypatch):
    """A part of a set would be read as a set of fewer trials."""
    data, counted = make_set(8), []

    def interrupt(*_):
        counted.append(1)
        if len(counted) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", interrupt)
    monkeypatch.setattr("pathlib.Path.replace", lambda *_: interrupt() or interrupt())
    with pytest.raises(KeyboardInterrupt):
        save(data, tmp_path / f"set{suffix}")
    assert not os.listdir(tmp_path)
