"""Speed against accuracy: the task is one for all speeds, windows hold what they say, and best is
best.
"""

import json
import re

import numpy as np
import pytest
import xarray as xr
from scipy.special import stdtrit
from typer.testing import CliRunner

import feeler
from feeler.analysis import compute_information, scale_peaks
from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.report import Section
from feeler.tradeoff import (
    average_sets,
    fill_section,
    find_best,
    load_declared,
    write_tradeoff,
)

BALLS = [feeler.Ball(radius=1.5), feeler.Ball(radius=3.0)]


CHOSEN = {"levels": {"relative": (1.0,), "common": (0.03,)}, "objects": BALLS}


@pytest.fixture(scope="module")
def study():
    return load_declared(sets=2, speeds=(0.6, 1.2), **CHOSEN)


@pytest.fixture(scope="module")
def measured(study):
    found = study.run({"cockroach": feeler.presets.cockroach()})
    return found.sel(antenna="cockroach", classifier="ideal")


def test_a_window_is_the_samples_that_it_names(study, measured):
    """20 ms at 0.6 m/s and 12 mm are not in the table of one kind only: what is the same window
    tells the same.
    """
    trials, _ = study.task.draw(None, "test", set=1, speed=0.6)
    angle = feeler.touch(feeler.presets.cockroach(), trials, duration=60.0)["angle"].values
    found = measured.isel(set=1).sel(speed=0.6)
    common = compute_information(angle[:, :, 6:26], 0.03, n_draws=study.draws, random_state=1)
    assert float(found["bits"].sel(level="common 0.03", window="20 ms")) == pytest.approx(
        common.bits, abs=1e-3
    )
    every = compute_information(angle[:, :, 7:46:2], 0.03, n_draws=study.draws, random_state=1)
    assert float(
        found["bits"].sel(level="common 0.03", window="24 mm, 20 samples")
    ) == pytest.approx(every.bits, abs=1e-3)


def test_more_samples_tell_more(measured):
    for kind in ("time", "distance"):
        mean = (
            measured["bits"]
            .mean("set")
            .isel(window=np.flatnonzero(measured["kind"].values == kind))
        )
        assert np.all(np.diff(mean.values, axis=-1) > -0.02)  # the drawn noise differs a little
    assert np.all(
        measured["bits"].sel(window="800 ms") == measured["bits"].sel(window="whole touch")
    )


def test_relative_noise_is_of_the_whole_touchs_peak(study, measured):
    trials, _ = study.task.draw(None, "test", speed=1.2)
    length = feeler.presets.cockroach().length
    angle = feeler.touch(
        feeler.presets.cockroach(), trials, duration=np.ceil(105 + length / 1.2)
    )["angle"].values
    known = compute_information(
        scale_peaks(angle)[:, :, 6:], 1.0, n_draws=study.draws, random_state=0
    )
    found = (
        measured["accuracy"]
        .isel(set=0)
        .sel(speed=1.2, level="relative 1", window="whole touch")
    )
    assert float(found) == pytest.approx(known.accuracy, abs=1e-3)


def test_faster_costs_more(measured):
    assert np.all(measured["work"].sel(speed=1.2) > measured["work"].sel(speed=0.6))
    assert np.all(measured["force"].sel(speed=1.2) > measured["force"].sel(speed=0.6))


def test_best_and_what_is_not_told_from_it():
    values = np.array(
        [[[0.5, 0.9], [0.6, 0.2]], [[0.5, 0.8], [0.9, 0.1]], [[0.5, 0.7], [0.45, 0.3]]]
    )  # set, speed, window
    data = xr.Dataset(
        {"accuracy": (("set", "speed", "level", "window"), values[:, :, None])},
        {
            "speed": [0.1, 0.2],
            "level": ["a"],
            "window": ["x", "y"],
            "kind": ("window", ["time"] * 2),
            "value": ("window", [1.0, 2.0]),
        },
    )
    found = find_best(data, "a")
    assert found["best"].values.tolist() == [0.2, 0.1]
    assert found["least"].values.tolist() == [
        0.1,
        0.1,
    ]  # 0.2 is best at x, but three sets do not tell it from 0.1
    assert found["most"].values.tolist() == [0.2, 0.1]
    assert found["gain"].values == pytest.approx([0.15, 0.6])
    paired = np.array(
        [[0.1, 0.4, -0.05], [0.7, 0.7, 0.4]]
    )  # of the best over the second, by set
    half = stdtrit(2, 0.975) * paired.std(axis=1, ddof=1) / np.sqrt(3)
    assert found["gain_half"].values == pytest.approx(half)


def test_the_interval_is_students():
    rng = np.random.default_rng(0)
    draws = xr.DataArray(rng.standard_normal((5, 4000)), dims=("set", "case"))
    found = average_sets(draws)
    assert float((abs(found["mean"]) < found["half"]).mean()) == pytest.approx(0.95, abs=0.015)
    assert np.isnan(average_sets(draws[:1])["half"]).all()


def test_every_speed_has_its_matched_samples_on_the_grid():
    """At all declared speeds the matched samples lie on whole samples, so that nothing is
    rounded.
    """
    study = load_declared()
    far, n = study.windows["matched_distance"], study.windows["matched_samples"]
    for speed in study.task.speeds:
        at = far * np.arange(1, n + 1) / n / speed / study.sample_interval
        assert at == pytest.approx(np.round(at), abs=1e-9)
    names = [name for _, _, name in study.list_windows()]
    assert len({*names}) == len(names)


@pytest.mark.long
def test_a_classifier_that_learns_tells_less_than_one_that_knows():
    study = load_declared(
        sets=1,
        speeds=(0.6,),
        classifiers=("ideal", "lda"),
        locations=(0.6, 0.9),
        draws=8,
        windows={**load_declared().windows, "deadlines": (20, 100), "distances": ()},
        **CHOSEN,
    )
    found = study.run({"a": feeler.presets.cockroach()}).isel(antenna=0, set=0, speed=0)
    assert found["bits"].dims == ("classifier", "level", "window")
    whole = found["accuracy"].sel(window="whole touch", level="common 0.03")
    assert (
        0.25 < float(whole.sel(classifier="lda")) <= float(whole.sel(classifier="ideal")) + 0.1
    )
    assert float(found["bits"].sel(classifier="lda").max()) <= 2.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sets": 0}, "Study.sets must be ≥ 1, got 0"),
        ({"classifiers": ("oracle",)}, "must be one of lda, svm, .*'oracle'"),
        (
            {"levels": {"pink": (1.0,)}},
            "Study.levels must be one of relative, common, mixed, got 'pink'",
        ),
        ({"objects": ()}, "a task needs an object"),
        ({"objects": [BALLS[0]] * 2}, "two objects are called"),
        ({"speeds": ()}, "Task.speeds must be 1 or more numbers > 0"),
    ],
)
def test_a_study_that_cannot_be_made_is_refused(changes, words):
    with pytest.raises(InvalidInput, match=words):
        load_declared(**changes)


@pytest.mark.long
def test_the_verb_writes_page_picture_and_numbers(tmp_path):
    arguments = [
        "tradeoff",
        "--out",
        str(tmp_path),
        "--sets",
        "1",
        "--speed",
        "0.6",
        "--speed",
        "1.2",
    ]
    done = CliRunner().invoke(
        app, [*arguments, "--objects", "ball:radius=1.5", "--antenna", "uniform", "--json"]
    )
    assert done.exit_code == 0, done.output
    assert {p.name for p in tmp_path.iterdir()} >= {
        f"tradeoff.{end}" for end in ("html", "png", "csv", "json")
    }
    kept = json.loads((tmp_path / "tradeoff.json").read_text())
    assert "uniform" in kept and json.loads(done.stdout)["antennas"] == kept
    lines = (tmp_path / "tradeoff.csv").read_text().splitlines()
    assert lines[0].startswith("antenna,speed,level,window,accuracy")
    assert len(lines) == 1 + 2 * 6 * len(load_declared().list_windows())


def test_an_interrupted_study_goes_on_and_another_is_refused(tmp_path):
    study = load_declared(sets=2, speeds=(1.2,), draws=2, **CHOSEN)
    antennas, path = {"a": feeler.presets.cockroach()}, tmp_path / "kept.jsonl"
    done = []

    def stop(n, total):
        done.append((n, total))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study.run(antennas, journal=path, workers=1, progress=stop)
    again = study.run(antennas, journal=path, workers=1, progress=lambda *n: done.append(n))
    assert done == [(1, 2), (2, 2)]
    xr.testing.assert_identical(again, study.run(antennas))
    before = path.read_bytes()
    with pytest.raises(InvalidInput, match="another study"):
        study.replace(draws=3).run(antennas, journal=path)
    assert path.read_bytes() == before


SPEEDS = (0.06, 0.6, 1.2)


@pytest.fixture(scope="module")
def declared():
    return load_declared(sets=3, speeds=SPEEDS)


@pytest.fixture(scope="module")
def measured_tradeoff_page(declared):
    """Random numbers in the shape of a measurement, no two alike."""
    windows, rng = declared.list_windows(), np.random.default_rng(0)
    levels = [f"{kind} {size:g}" for kind, sizes in declared.levels.items() for size in sizes]
    shape = (3, len(SPEEDS), len(levels), len(windows))
    dims = ("set", "speed", "level", "window")
    fields = {"accuracy": (dims, rng.random(shape)), "bits": (dims, 5 * rng.random(shape))}
    costs = {
        name: (dims[:2], scale * rng.random(shape[:2]))
        for name, scale in (("work", 90), ("force", 4), ("release", 300))
    }
    coords = {
        "speed": list(SPEEDS),
        "level": levels,
        "window": [name for _, _, name in windows],
    }
    kinds = {
        "kind": ("window", [kind for kind, _, _ in windows]),
        "value": ("window", [value for _, value, _ in windows]),
    }
    return xr.Dataset(fields | costs, coords | kinds, {"antenna": "toy"})


@pytest.mark.long
def test_tables_hold_means_over_the_sets_and_the_best_speed(
    declared, measured_tradeoff_page, tmp_path
):
    section = Section(name="tradeoff", title="", folder=tmp_path, vector=False)
    fill_section(section, {"toy": measured_tradeoff_page}, declared)
    *tables, costs = [block for block in section.blocks if block["kind"] == "table"]
    for table, (kind, size) in zip(tables, declared.headline.items(), strict=True):
        assert table["header"] == ["window", "0.06 m/s", "0.6 m/s", "1.2 m/s", "best"]
        assert (
            f"toy, noise {kind} {size:g} {'rad' if kind == 'common' else 'of peak'}: bits"
            in table["caption"]
        )
        assert "accuracy in %. Best speed by accuracy [m/s]" in table["caption"]
        here = measured_tradeoff_page.sel(level=f"{kind} {size:g}").mean("set")
        best = find_best(measured_tradeoff_page, f"{kind} {size:g}")
        for window, *cells, last in table["rows"]:
            for cell, speed in zip(cells, SPEEDS, strict=True):
                one = here.sel(speed=speed, window=window)
                assert cell == f"{float(one['bits']):.2f} ({100 * float(one['accuracy']):.0f})"
            ends = [float(best[name].sel(window=window)) for name in ("best", "least", "most")]
            assert [float(x) for x in re.split(r" \(|…|\)", last)[:3]] == pytest.approx(ends)
        assert [row[0] for row in table["rows"][:2]] == [
            f"{t:g} ms" for t in declared.windows["matched_times"][:2]
        ]
    assert costs["header"] == ["antenna", "of a whole touch", "0.06 m/s", "0.6 m/s", "1.2 m/s"]
    said = {row[1]: [float(cell) for cell in row[2:]] for row in costs["rows"]}
    for name, field in (
        ("work [µJ]", "work"),
        ("peak force [mN]", "force"),
        ("last contact [ms]", "release"),
    ):
        assert said[name] == pytest.approx(
            measured_tradeoff_page[field].values.mean(axis=0), rel=1e-3
        )


@pytest.mark.long
@pytest.mark.parametrize(("sets", "spread"), [(3, "95 % over sets"), (1, "One set of touches")])
def test_the_page_counts_its_own_touches_and_has_no_interval_of_one_set(
    measured_tradeoff_page, tmp_path, sets, spread
):
    """Two objects at five places are ten touches: 3.32 bits."""
    objects = [feeler.Ball(radius=1.0), feeler.Box(half_width=2.0, half_height=1.0)]
    study = load_declared(sets=sets, speeds=SPEEDS, objects=objects)
    path = write_tradeoff(
        {"toy": measured_tradeoff_page.isel(set=slice(0, sets))}, study, tmp_path
    )
    page = path.read_text(encoding="utf-8")
    assert "discriminates 10 touches" in page and "All 10 discriminated are 3.32 bits." in page
    assert spread in page and ("best by accuracy" in page, "(0.06…" in page)[1] == (sets > 1)
