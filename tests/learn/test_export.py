"""What other tools read: every number of the store, with its labels, and a description that fits
it.
"""

import json
import shutil

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.learn import export as module
from feeler.learn import export_parquet, write_crate
from feeler.objects.trials import trials as list_ninety

from .conftest import SAMPLES, SENSORS, make_touches

pq = pytest.importorskip("pyarrow.parquet", reason="needs the extra `parquet`")


@pytest.fixture
def exported(store, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "EPISODES", 250)  # three files
    return export_parquet(store, tmp_path / "set", task="feature")


def test_parquet_holds_every_sample_once(exported):
    tensors, info = make_touches(), json.loads((exported / "meta/info.json").read_text())
    files = sorted((exported / "data").rglob("*.parquet"))
    assert len(files) == 3 and str(files[1].relative_to(exported)) == info["data_path"].format(
        chunk_index=0, file_index=1
    )
    table = pq.read_table(exported / "data").to_pandas().sort_values("index")
    assert table["index"].tolist() == [*range(600 * SAMPLES)] and info["total_frames"] == len(
        table
    )
    state = np.stack(table["observation.state"]).reshape(600, SAMPLES, SENSORS)
    np.testing.assert_array_equal(state.transpose(0, 2, 1), tensors["angle"].values)
    np.testing.assert_allclose(table["timestamp"][:SAMPLES], tensors["time"] / 1000, rtol=1e-6)
    tasks = (
        pq.read_table(exported / "meta/tasks.parquet")
        .to_pandas()
        .set_index("task_index")["task"]
    )
    assert (
        tasks[table["task_index"]].tolist()
        == np.repeat(tensors["feature"].values, SAMPLES).tolist()
    )
    assert info["fps"] == 1000.0 and info["features"]["observation.state"]["shape"] == [SENSORS]


def test_episodes_carry_all_labels(exported):
    tensors = make_touches()
    episodes = (
        pq.read_table(exported / "meta/episodes").to_pandas().sort_values("episode_index")
    )
    for name in ("feature", "size", "location", "antenna", "seed"):
        assert episodes[f"label/{name}"].tolist() == tensors[name].values.tolist()
    first = episodes.iloc[7]
    assert (first.dataset_from_index, first.dataset_to_index, first.length) == (
        7 * SAMPLES,
        8 * SAMPLES,
        SAMPLES,
    )


@pytest.mark.parametrize("order", [1, -1], ids=["rising", "falling"])
def test_sums_are_those_of_all_samples(tmp_path, monkeypatch, order):
    """Of several blocks, whichever of them holds the least and the greatest."""
    monkeypatch.setattr(module, "_BLOCK", 100)
    touches = make_touches().isel(trial=slice(None, None, order))
    folder = export_parquet(touches, tmp_path / "set")
    stats = json.loads((folder / "meta/stats.json").read_text())["observation.state"]
    values = touches["angle"].values.transpose(0, 2, 1).reshape(-1, SENSORS).astype(float)
    assert stats["count"] == [len(values)]
    for name in ("min", "max", "mean", "std"):
        np.testing.assert_allclose(stats[name], getattr(np, name)(values, axis=0), rtol=1e-6)


def test_the_card_begins_as_hugging_face_wants_it(exported):
    yaml = pytest.importorskip("yaml")
    card = (exported / "README.md").read_text()
    head = yaml.safe_load(card.split("---")[1])
    assert (
        head["size_categories"] == ["n<1K"]
        and head["configs"][0]["data_files"] == "data/*/*.parquet"
    )
    assert "| location | 0.4" in card and "600 touches" in card


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"task": "taste"}, "task='taste' is no coordinate"),
        ({"variable": "tip"}, "no variable 'tip'"),
    ],
)
def test_what_cannot_be_exported_is_refused(store, tmp_path, options, words):
    with pytest.raises(InvalidInput, match=words):
        export_parquet(store, tmp_path / "set", **options)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    with pytest.raises(InvalidInput, match="holds something"):
        export_parquet(store, tmp_path / "full")


ANTENNA = feeler.presets.cockroach()
TOUCHES = feeler.sample_trials(6, seed=1)
QUICK = {"duration": 9.0, "sample_interval": 0.3, "save": ("angle",), "timestep": 0.1}


def simulate(kind, path):
    """Sets as users make them: labels are empty, mixed or equal."""
    antennas = [ANTENNA]
    trials = TOUCHES
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
    made = antennas if kind == "many antennas" else ANTENNA
    return feeler.touch(made, trials, store=path, load=False, **QUICK)


KINDS = ("one antenna", "many antennas", "a base that moves", "the paper's grid")


@pytest.mark.further
@pytest.mark.parametrize("kind", KINDS)
def test_sets_that_touch_makes_are_exported_whole(kind, tmp_path):
    simulate(kind, tmp_path / "set.zarr")
    tensors = feeler.load(tmp_path / "set.zarr")
    folder = export_parquet(tmp_path / "set.zarr", tmp_path / "pq")
    table = pq.read_table(folder / "data").to_pandas().sort_values("index")
    n, n_sensors, n_samples = tensors["angle"].shape
    state = np.stack(table["observation.state"]).reshape(n, n_samples, n_sensors)
    expected = tensors["angle"].values.astype(np.float32).transpose(0, 2, 1)
    np.testing.assert_array_equal(state, expected)
    time = table["timestamp"].to_numpy().reshape(n, n_samples)
    np.testing.assert_allclose(time, np.tile(0.3e-3 * np.arange(n_samples), (n, 1)), rtol=1e-6)
    info = json.loads((folder / "meta/info.json").read_text())
    assert info["fps"] == pytest.approx(1 / 0.3e-3)
    # the name is the hinge's: of 140 hinges, 56 are sensors
    names = info["features"]["observation.state"]["names"]
    segments = tensors["segment"].values
    assert names == [f"angle_{segment}" for segment in segments]
    assert names != [f"angle_{number}" for number in tensors["sensor"].values]
    episodes = pq.read_table(folder / "meta/episodes").to_pandas().sort_values("episode_index")
    labels = [k for k, v in tensors.coords.items() if v.dims == ("trial",) and k != "trial"]
    for name in labels:
        np.testing.assert_array_equal(episodes[f"label/{name}"], tensors[name].values, name)
    card = (folder / "README.md").read_text()
    assert all(f"| {name} |" in card for name in labels)
    assert [entry.name for entry in tmp_path.iterdir() if entry.name.startswith(".")] == []


def test_what_fails_halfway_leaves_nothing_behind(store, tmp_path, monkeypatch):
    def fail(*_):
        raise OSError("the disk is full")

    (tmp_path / "set").mkdir()
    monkeypatch.setattr(module, "EPISODES", 250)
    monkeypatch.setattr(module, "_make_episodes", fail)
    with pytest.raises(OSError, match="the disk is full"):
        export_parquet(store, tmp_path / "set")
    assert [*tmp_path.rglob("*")] == [tmp_path / "set"]
    monkeypatch.undo()
    assert (export_parquet(store, tmp_path / "set") / "README.md").is_file()


def test_what_the_description_lacks_is_said_before_anything_is_written(tmp_path):
    tensors = make_touches()
    del tensors["time"].attrs["units"]
    with pytest.raises(InvalidInput, match="'time' says no unit"):
        export_parquet(tensors, tmp_path / "set")
    assert not any(tmp_path.iterdir())


def test_a_crate_names_the_store_its_variables_and_its_licence(store, tmp_path):
    shutil.copytree(store, tmp_path / "set.zarr")
    place = write_crate(tmp_path / "set.zarr", name="Touches", author="A. Author")
    graph = {item["@id"]: item for item in json.loads(place.read_text())["@graph"]}
    assert graph["./"]["hasPart"] == [{"@id": "set.zarr/"}]
    assert graph["#angle"]["unitText"] == "rad" and graph["#size"]["unitText"] == "mm"
    linked = {
        value["@id"]
        for item in graph.values()
        for value in item.values()
        if isinstance(value, dict) and "@id" in value
    }
    assert linked - graph.keys() == {"https://w3id.org/ro/crate/1.1"}
    assert write_crate(tmp_path / "set.zarr") == place  # once more
    place.write_text("{}")
    with pytest.raises(InvalidInput, match="describes something else"):
        write_crate(tmp_path / "set.zarr")
