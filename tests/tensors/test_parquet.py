"""Parquet: one labelled touch a row, which feeler restores and pandas reads without feeler."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import feeler
from feeler.errors import InvalidInput
from feeler.objects.trials import trials as list_ninety
from feeler.sandbox import Limits
from feeler.tensors.formats import find_problems, load, save
from feeler.tensors.writers import complete

from ._sets import make_set

pa = pytest.importorskip("pyarrow", reason="needs the extra `parquet`")
pq = pytest.importorskip("pyarrow.parquet")


@pytest.fixture(scope="module")
def whole():
    touches = make_set()
    split = np.where(np.arange(touches.sizes["trial"]) % 3, "train", "test")
    return touches.assign_coords(split=("trial", split))


@pytest.fixture
def saved(whole, tmp_path):
    save(whole, tmp_path / "set.parquet")
    return tmp_path / "set.parquet"


def test_pandas_reads_each_touch_with_its_labels(whole, saved):
    table = pd.read_parquet(saved)
    assert len(table) == whole.sizes["trial"]
    angle = np.stack([np.stack(touch) for touch in table["angle"]])
    np.testing.assert_array_equal(angle, whole["angle"].values)
    for name in (name for name, item in whole.coords.items() if item.dims == ("trial",)):
        np.testing.assert_array_equal(table[name], whole[name].values, name)
    test = table[table["split"] == "test"]
    assert test["seed"].tolist() == whole["seed"].values[::3].tolist()


def test_rows_that_pandas_chose_and_wrote_again_come_back(whole, saved, tmp_path):
    order = np.argsort(whole["seed"].values)[::-2]
    pd.read_parquet(saved).iloc[order].to_parquet(tmp_path / "again.parquet")
    expected = complete(whole.isel(trial=order))
    xr.testing.assert_identical(load(tmp_path / "again.parquet"), expected)


def test_objects_are_numbered_for_datasets_of_hugging_face(whole, saved, tmp_path):
    """As that library writes a ``ClassLabel``: int64, and its names in the schema."""
    schema = pq.read_schema(saved)
    said = json.loads(schema.metadata[b"huggingface"])["info"]["features"]["label"]
    assert said["_type"] == "ClassLabel" and schema.field("label").type == pa.int64()
    numbers = pd.read_parquet(saved, columns=["label"])["label"]
    assert [said["names"][k] for k in numbers] == whole["feature"].values.tolist()
    own = whole.assign_coords(label=("trial", whole["seed"].values * 2.5))
    save(own, tmp_path / "own.parquet")
    xr.testing.assert_identical(load(tmp_path / "own.parquet"), complete(own))
    datasets = pytest.importorskip("datasets", reason="Hugging Face's reader")
    words = {"data_files": str(saved), "filters": [("split", "==", "test")]}
    read = datasets.load_dataset("parquet", cache_dir=str(tmp_path), split="train", **words)
    assert (
        read.features["label"].int2str(read["label"]) == whole["feature"].values[::3].tolist()
    )


@pytest.mark.parametrize("count", [1, 256, 257, 600])
def test_sets_of_any_size_come_back_in_order(whole, tmp_path, count):
    touches = whole.isel(trial=np.arange(count) % whole.sizes["trial"])
    touches["angle"] = touches["angle"] + np.arange(count)[:, None, None]
    save(touches, tmp_path / "set.parquet")
    xr.testing.assert_identical(load(tmp_path / "set.parquet"), complete(touches))


def test_the_other_order_of_bytes_and_missing_numbers_come_back(whole, tmp_path):
    touches = whole.assign_coords(
        size=("trial", np.full(whole.sizes["trial"], np.nan), {"units": "mm"})
    )
    touches["angle"] = touches["angle"].astype(">f8")
    save(touches, tmp_path / "set.parquet")
    xr.testing.assert_identical(load(tmp_path / "set.parquet"), complete(touches))


ANTENNA = feeler.presets.cockroach()
QUICK = {"duration": 9.0, "sample_interval": 0.3, "save": ("angle",), "timestep": 0.1}


def simulate(kind, path):
    """Sets as users make them: labels are empty, mixed or equal."""
    antennas, trials = ANTENNA, feeler.sample_trials(6, seed=1)
    if kind == "many antennas":
        antennas = feeler.sample_antennas(6, seed=2)
    if kind == "a base that moves":
        moving = feeler.BaseMotion(velocity=(0.1, 0.0), turn=0.002)
        ball = feeler.Ball(radius=1.5)
        trials = [
            feeler.Trial(feature=ball, location=0.5 + 0.1 * k, speed=0.3, lead=1.0, base=base)
            for k, base in enumerate((None, moving))
        ]
    if kind == "the paper's grid":
        trials = list_ninety(speeds=[0.6])
    return feeler.touch(antennas, trials, store=path, load=False, **QUICK)


KINDS = ("one antenna", "many antennas", "a base that moves", "the paper's grid")


@pytest.mark.further
@pytest.mark.parametrize("kind", KINDS)
def test_stores_that_touch_makes_are_written_whole(kind, tmp_path):
    simulate(kind, tmp_path / "set.zarr")
    tensors = feeler.load(tmp_path / "set.zarr")
    feeler.save(tensors, tmp_path / "set.parquet")
    xr.testing.assert_identical(feeler.load(tmp_path / "set.parquet"), complete(tensors))
    assert find_problems(tmp_path / "set.parquet") == []


def test_what_has_no_trials_is_refused(whole, tmp_path):
    one = whole[["axis"]].assign(bend=("joint", [0.1, 0.2]))
    with pytest.raises(InvalidInput, match="one touch a row; this Dataset has no dim trial"):
        save(one, tmp_path / "set.parquet")
    assert not any(tmp_path.iterdir())


def change(saved, make):
    table = pq.read_table(saved)
    pq.write_table(make(table), saved)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda t: t.replace_schema_metadata({}), r"its columns \(.*angle.*\) mean is unknown"),
        (lambda t: t.drop_columns(["angle"]), "the column 'angle' is missing"),
        (lambda t: t.replace_schema_metadata({"feeler_description": "{"}), "is damaged"),
        (lambda t: t.replace_schema_metadata({"feeler_description": "[]"}), "is damaged"),
        (
            lambda t: t.set_column(
                t.schema.get_field_index("angle"), "angle", pa.array([1.0] * len(t))
            ),
            "'angle' has .* values for the shape",
        ),
        (
            lambda t: t.set_column(
                t.schema.get_field_index("split"),
                "split",
                pa.array([None] * len(t), pa.string()),
            ),
            "column 'split' has empty cells",
        ),
    ],
    ids=["somebody else's", "a column missing", "no JSON", "other JSON", "shape", "empty"],
)
def test_a_changed_file_is_refused_in_one_line(saved, make, words):
    change(saved, make)
    with pytest.raises(InvalidInput, match=words) as caught:
        load(saved)
    assert "\n" not in str(caught.value)


def test_a_file_that_was_cut_is_refused(saved):
    raw = saved.read_bytes()
    for size in (4, 60, len(raw) // 2, len(raw) - 1):
        saved.write_bytes(raw[:size])
        with pytest.raises(InvalidInput, match="is damaged"):
            load(saved)


def test_more_numbers_than_the_limit_are_refused(saved):
    with pytest.raises(InvalidInput, match=r"asks for .* GiB, over the limit"):
        load(saved, Limits(max_bytes=1000))
