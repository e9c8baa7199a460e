"""The table of results: written, read, looked up, compared, and what is read from it."""

import itertools

import numpy as np
import pytest
import xarray as xr

from feeler.errors import InvalidInput
from feeler.presets import cockroach
from feeler.report import Section
from feeler.tensors.schema import label_units
from paper import front
from paper.kept import SHIPPED
from paper.statements import judge, load_statements
from paper.table import COLUMNS, KEPT, PLACE, Results, compare, read_declared, split_key

VALUES = {
    "dispersion.380 ms window.nmi.slow": {"value": 0.58, "low": 0.5, "high": 0.6, "n": 30},
    "gradient.fastest.common.-0.0827": {"value": 4.86, "low": 4.8, "high": 4.9, "n": 8},
    "wall.defined": 122,
    "complete.peak.exponential": 0.0790123456789,
    "wall.near.uniform": {"undefined": "no contact"},
}


@pytest.mark.parametrize(
    ("key", "parts"),
    [
        ("dispersion.380 ms window.nmi.slow", ("dispersion.nmi", "380 ms window", "slow")),
        ("gradient.common.-0.0827", ("gradient", "common", "-0.0827")),
        ("axes.place.every 14", ("axes.place", "", "every 14")),
        ("robot.gap.0.25.all", ("robot.gap.all", "", "0.25")),
        ("encoding.entropy.mean of rows.M4", ("encoding.entropy", "mean of rows", "M4")),
    ],
)
def test_a_name_has_a_quantity_a_reading_and_a_group(key, parts):
    assert split_key(key) == parts


def test_a_table_is_what_was_written(tmp_path):
    made = Results.make(VALUES)
    made.write(tmp_path / "results.csv")
    read = Results.read(tmp_path / "results.csv")
    assert tuple(read.table.columns) == COLUMNS
    assert compare(made.table, read.table, 1e-8).empty
    assert read.get("dispersion.380 ms window.nmi.slow") == (0.58, 0.5, 0.6, 30)
    assert read.get("wall.defined") == (122, 122, 122, 1)
    assert np.isnan(read.get("wall.near.uniform").value)
    assert read.get("wall.near.linear") is None


def test_no_two_numbers_of_the_cached_run_share_a_row():
    """And its table is that of its sections."""
    values = {}
    for path in sorted(SHIPPED.glob("*/section.json")):
        values |= Section.load(path.parent).values
    made, kept = Results.make(values), Results.read(KEPT)
    rows = made.table[["quantity", "reading", "group"]]
    assert not rows.duplicated().any() and len(rows) > 1000
    assert compare(made.table, kept.table, 1e-8).empty


def test_the_cached_run_computed_what_statements_ask_for():
    """So that a misspelt name fails."""
    kept = Results.read(KEPT)
    lacking = {
        one.id: missing
        for one in load_statements()
        if (missing := {key for key in one.list_keys() if kept.get(key) is None})
    }
    assert not lacking


def test_words_on_the_page_are_filled_with_the_run_s_numbers():
    declared, kept = read_declared("statements.toml"), Results.read(KEPT)
    said = (one.get("words", "") for one in (*declared["answer"], *declared["figure"]))
    for words in (*itertools.chain(*declared["front"]["rows"]), *said):
        filled, empty = kept.fill(words), Results.make({}).fill(words)
        assert "{" not in filled + empty
        plain = PLACE.sub(lambda place: "0 to 0" if place[2] == "ci" else "0", words)
        assert len(filled.split()) == len(plain.split())


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"a.slow": 0.5, "b.slow": 3}, "Half: 50%. Of 3 all."),
        ({"a.slow": 0.5}, "Half: 50%."),
        ({"b.slow": {"undefined": "none"}}, ""),
    ],
)
def test_a_sentence_says_the_values_or_is_left_out(values, words):
    assert Results.make(values).fill("Half: {a.slow:.0%}. Of {b.slow:d} all.") == words


def test_two_tables_are_compared_row_by_row():
    first, second = VALUES, {**VALUES, "wall.defined": 121, "wall.set_ups": 324}
    del second["complete.peak.exponential"]
    second["gradient.fastest.common.-0.0827"] = {"value": 5.2, "low": 5.1, "high": 5.3, "n": 8}
    found = compare(Results.make(first).table, Results.make(second).table, 1e-6)
    rows = found.set_index("quantity")
    assert {*rows.index} == {"wall.defined", "wall.set_ups", "complete.peak", "gradient"}
    assert rows.loc["gradient", "apart"] and rows.loc["wall.defined", "apart"]
    assert np.isnan(rows.loc["complete.peak", "second"])
    assert compare(Results.make(first).table, Results.make(first).table, 0.0).empty


def test_a_file_that_is_no_table_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="there is no table"):
        Results.read(tmp_path / "none.csv")
    (path := tmp_path / "x.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InvalidInput, match="lacks the columns figure, group, high"):
        Results.read(path)


def test_another_antenna_is_compared_with_the_exponential_one():
    mine = Results.make({"complete.peak.this antenna": 0.08, "wall.defined": 122})
    theirs = Results.make({"complete.peak.exponential": 0.079, "wall.defined": 122})
    found = compare(theirs.table, mine.table, 1e-6)
    assert found[["quantity", "group", "first", "second"]].values.tolist() == [
        ["complete.peak", "exponential", 0.079, 0.08]
    ]


ASKED = {
    "sets": 4,
    "train": 4,
    "copies": 2,
    "draws": 20,
    "seed": 3,
    "absolute": [0.03],
    "relative": [0.3],
    "shapes": ("ball", "box"),
    "locations": (0.5, 0.9),
}
NAMES = ("exponential", "uniform")


def make_touch(size):
    """Touches whose tensor says by one sensor each which class they are; ``size`` by antenna."""

    def touch(antenna, trials, *, duration, save, **options):
        angle = np.zeros((len(trials), 10, 30))
        for tensor, trial in zip(angle, trials, strict=True):
            kind = 2 * (trial.feature.kind == "box") + (trial.feature.size > 2.2)
            tensor[kind] = tensor[4 + (trial.location > 0.7)] = 1.0
        angle *= size[antenna.name]
        return label_units(
            xr.Dataset(
                {"angle": (("trial", "sensor", "time"), angle)},
                coords={"time": np.arange(30.0)},
            )
        )

    return touch


def find_values(monkeypatch, size):
    monkeypatch.setattr(front, "touch", make_touch(size))
    antennas = {name: cockroach(name) for name in NAMES}
    found = front.measure(antennas, {"slow": 0.06}, ASKED)
    fast = front.measure({NAMES[0]: antennas[NAMES[0]]}, {"fast": 0.6}, ASKED)
    assert found.dims == ("antenna", "speed", "set", "level", "case") and found.shape[2] == 4
    return found, front.list_values(found) | front.list_values(fast)


def judge_front(values):
    results = Results.make(values)
    return {
        one.id: judge(one, results, "paper")
        for one in load_statements()
        if one.section == "front"
    }


def test_a_larger_signal_is_classified_better_in_absolute_noise_only(monkeypatch):
    found, values = find_values(monkeypatch, {"exponential": 1.0, "uniform": 0.005})
    mean = found.mean("set").isel(speed=0)
    assert (mean.sel(antenna="exponential") > 0.9).all()
    assert (mean.sel(antenna="uniform", level="absolute 0.03") < 0.8).all()
    assert (mean.sel(antenna="uniform", level="relative 0.3") > 0.9).all()
    gradient = judge_front(values)["front-gradient"]
    held = dict(zip(gradient.statement.readings, gradient.findings[0].agrees, strict=True))
    assert all(held[name] for name in held if "absolute" in name and "ideal" not in name)
    assert not any(held[name] for name in held if "relative" in name)
    assert gradient.word == "holds under some conditions only"


@pytest.mark.further
@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_equal_antennas_and_speeds_bear_out_nothing(monkeypatch, size):
    _, values = find_values(monkeypatch, dict.fromkeys(NAMES, size))
    judged = judge_front(values)
    assert len(judged) == 2
    assert not any(agree for one in judged.values() for agree in one.findings[0].agrees)
