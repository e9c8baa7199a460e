"""The page says what was measured: bits, per cent, best speeds and costs, each in its place and
unit.
"""

import re

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import feeler
from feeler.plotting.style import style
from feeler.report import Section
from feeler.tradeoff import (
    _plot_tradeoff,
    fill_section,
    find_best,
    load_declared,
    write_tradeoff,
)

SPEEDS = (0.06, 0.6, 1.2)


@pytest.fixture(scope="module")
def declared():
    return load_declared(sets=3, speeds=SPEEDS)


@pytest.fixture(scope="module")
def measured(declared):
    """Random numbers in the shape of a measurement, no two alike."""
    windows, rng = declared.list_windows(), np.random.default_rng(0)
    levels = [f"{kind} {size:g}" for kind, sizes in declared.levels.items() for size in sizes]
    shape, dims = (
        (3, len(SPEEDS), len(levels), len(windows)),
        ("set", "speed", "level", "window"),
    )
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
def test_tables_hold_means_over_the_sets_and_the_best_speed(declared, measured, tmp_path):
    section = Section(name="tradeoff", title="", folder=tmp_path, vector=False)
    fill_section(section, {"toy": measured}, declared)
    *tables, costs = [block for block in section.blocks if block["kind"] == "table"]
    for table, (kind, size) in zip(tables, declared.headline.items(), strict=True):
        assert table["header"] == ["window", "0.06 m/s", "0.6 m/s", "1.2 m/s", "best"]
        assert (
            f"toy, noise {kind} {size:g} {'rad' if kind == 'common' else 'of peak'}: bits"
            in table["caption"]
        )
        assert "accuracy in %. Best speed by accuracy [m/s]" in table["caption"]
        here, best = (
            measured.sel(level=f"{kind} {size:g}").mean("set"),
            find_best(measured, f"{kind} {size:g}"),
        )
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
        assert said[name] == pytest.approx(measured[field].values.mean(axis=0), rel=1e-3)


def test_the_picture_is_in_per_cent_bits_microjoules_and_millinewtons(declared, measured):
    levels = {kind: f"{kind} {size:g}" for kind, size in declared.headline.items()}
    _plot_tradeoff({"toy": measured}, levels, figure := Figure())
    time, distance, best, common, relative, work, force = figure.axes
    assert (time.get_xlabel(), time.get_ylabel()) == (
        "time since contact [ms]",
        "ideal accuracy [%]",
    )
    assert distance.get_xlabel() == "distance since contact [mm]"
    assert (best.get_xlabel(), best.get_ylabel()) == (
        "deadline [ms since contact]",
        "best speed [m/s]",
    )
    assert (work.get_ylabel(), force.get_ylabel()) == (
        "work of a\ntouch [µJ]",
        "peak force\n[mN]",
    )
    for ax, level, unit in (
        (common, levels["common"], "rad"),
        (relative, levels["relative"], "of peak"),
    ):
        assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_title()) == (
            "speed [m/s]",
            "bits",
            f"noise {level} {unit}",
        )
        matched = measured["window"].values[measured["kind"].values == "distance and samples"][
            0
        ]
        whole, dashed = (bars.lines[0].get_xydata() for bars in ax.containers)
        for line, window in ((whole, "whole touch"), (dashed, matched)):
            expected = measured["bits"].sel(level=level, window=window).mean("set")
            np.testing.assert_allclose(line, np.column_stack([SPEEDS, expected]))
    for bars, level in zip(best.containers, levels.values(), strict=True):
        found = find_best(measured, level)
        found = found.isel(window=np.flatnonzero(found["kind"].values == "time"))
        np.testing.assert_allclose(
            bars.lines[0].get_xydata(), np.column_stack([found["value"], found["best"]])
        )
        (span,) = bars.lines[2]
        ends = np.array([segment[:, 1] for segment in span.get_segments()])
        np.testing.assert_allclose(ends, np.column_stack([found["least"], found["most"]]))
    for ax, kind in ((time, "time"), (distance, "distance")):
        chosen = (
            measured["accuracy"]
            .sel(level=levels["common"])
            .mean("set")
            .isel(window=measured["kind"].values == kind)
        )
        for line, speed in zip(ax.lines, SPEEDS, strict=True):
            np.testing.assert_allclose(line.get_ydata(), 100 * chosen.sel(speed=speed))


@pytest.mark.further
@pytest.mark.parametrize(
    "names", [["exponential"], ["exponential", "linear", "uniform", "matched"]]
)
def test_the_legend_fits_into_the_figure(declared, measured, names):
    with style():
        figure = Figure(figsize=(7.2, 4.6), layout="constrained")
        levels = {kind: f"{kind} {size:g}" for kind, size in declared.headline.items()}
        shown = measured.assign_attrs(antenna=names[0])
        _plot_tradeoff(dict.fromkeys(names, shown), levels, figure)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    speeds, antennas = figure.legends
    for legend in (speeds, antennas):
        box, page = legend.get_window_extent(canvas.get_renderer()), figure.bbox
        assert (
            page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1
        )
    assert all(text.get_text().endswith(" m/s") for text in speeds.get_texts())
    said = [text.get_text() for text in antennas.get_texts()]
    assert said[: len(names)] == names and len(said) == len(names) + 2


@pytest.mark.long
@pytest.mark.parametrize(("sets", "spread"), [(3, "95 % over sets"), (1, "One set of touches")])
def test_the_page_counts_its_own_touches_and_has_no_interval_of_one_set(
    measured, tmp_path, sets, spread
):
    """Two objects at five places are ten touches: 3.32 bits."""
    objects = [feeler.Ball(radius=1.0), feeler.Box(half_width=2.0, half_height=1.0)]
    study = load_declared(sets=sets, speeds=SPEEDS, objects=objects)
    path = write_tradeoff({"toy": measured.isel(set=slice(0, sets))}, study, tmp_path)
    page = path.read_text(encoding="utf-8")
    assert "discriminates 10 touches" in page and "All 10 discriminated are 3.32 bits." in page
    assert spread in page and ("best by accuracy" in page, "(0.06…" in page)[1] == (sets > 1)
