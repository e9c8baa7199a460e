"""Spikes of one's own: the same trains from every format, and planted rates, delays and gains."""

from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.spikes import (
    CAMPANIFORM,
    Population,
    attach_trains,
    compare_trains,
    compute_psth,
    count_spikes,
    cut_trains,
    draw_spikes,
    fit_sensillum,
    measure_trains,
    read_onsets,
    read_trains,
)
from feeler.spikes.recordings import measure_van_rossum

ONSETS = np.array([500.0, 1400.0, 2250.0])  # ms
TRAINS = {
    "3": np.sort(np.concatenate([ONSETS + late for late in (7.0, 17.0, 27.0, 41.0)])),
    "5": np.array([120.0, 512.0, 1422.0, 2258.0, 2600.0]),
}


def write_csv(folder):
    rows = [(name, time / 1e3) for name, train in TRAINS.items() for time in train]
    pd.DataFrame(rows, columns=["unit", "time_s"]).sample(frac=1, random_state=2).to_csv(
        folder / "own.csv", index=False
    )
    return folder / "own.csv"


def write_words(folder):
    rows = [(f"n{name}", time) for name, train in TRAINS.items() for time in train]
    path = folder / "words.csv"
    pd.DataFrame(rows, columns=["neuron", "Spike time (ms)"]).to_csv(path, index=False, sep=";")
    return path


def write_phy(folder):
    path = folder / "phy"
    path.mkdir()
    time, owner = np.concatenate([*TRAINS.values(), [99.0]]), [*"3" * 12, *"5" * 5, "9"]
    order = np.argsort(time)
    np.save(path / "spike_times.npy", np.round(time * 30)[order].astype(np.uint64)[:, None])
    np.save(path / "spike_clusters.npy", np.array(owner, dtype=np.int32)[order])
    (path / "params.py").write_text("dat_path = 'a.dat'\nsample_rate = 30000.\n")
    (path / "cluster_group.tsv").write_text("cluster_id\tgroup\n3\tgood\n5\tmua\n9\tnoise\n")
    return path


def write_nwb(folder):
    pynwb = pytest.importorskip("pynwb")
    file = pynwb.NWBFile("x", "y", datetime(2026, 5, 1, tzinfo=UTC))
    for name, train in TRAINS.items():
        file.add_unit(spike_times=train / 1e3, id=int(name))
    for start in ONSETS:
        file.add_trial(start_time=start / 1e3, stop_time=start / 1e3 + 0.4)
    with pynwb.NWBHDF5IO(folder / "own.nwb", "w") as io:
        io.write(file)
    return folder / "own.nwb"


@pytest.mark.long
@pytest.mark.parametrize("write", [write_csv, write_words, write_phy, write_nwb])
def test_every_format_holds_the_same_trains(tmp_path, write):
    found = read_trains(write(tmp_path))
    assert sorted(name.lstrip("n") for name in found) == ["3", "5"]
    for name, train in found.items():
        np.testing.assert_allclose(train, TRAINS[name.lstrip("n")], atol=1e-6)


@pytest.mark.long
def test_the_trials_of_an_nwb_file_and_a_table_of_onsets_are_the_same(tmp_path):
    np.testing.assert_allclose(read_onsets(write_nwb(tmp_path)), ONSETS)
    path = tmp_path / "on.csv"
    path.write_text("onset_s\n" + "\n".join(f"{one / 1e3}" for one in ONSETS))
    np.testing.assert_allclose(read_onsets(path), ONSETS)


def test_units_keep_long_names_and_spikes_are_not_their_onsets(tmp_path):
    trains = {"20240101": TRAINS["3"], "20240102": TRAINS["5"]}
    rows = [(name, 5.0, time / 1e3) for name, train in trains.items() for time in train]
    table = pd.DataFrame(rows, columns=["unit", "onset_s", "spike_time_s"])
    table.to_csv(tmp_path / "s.csv", index=False)
    found = read_trains(tmp_path / "s.csv")
    assert [*found] == [*trains]
    for name, train in trains.items():
        np.testing.assert_allclose(found[name], train)
    table.rename(columns={"onset_s": "time_s"}).to_csv(tmp_path / "two.csv", index=False)
    with pytest.raises(InvalidInput, match="which of time_s, spike_time_s is the time"):
        read_trains(tmp_path / "two.csv")


def test_rows_that_differ_and_intervals_that_no_cell_has_are_told(tmp_path):
    times = np.cumsum(np.random.default_rng(0).exponential(20.0, 100) + 2)
    twice = pd.DataFrame({"unit": 1, "time_ms": np.repeat(times, 2)})
    twice.to_csv(tmp_path / "twice.csv", index=False)
    with pytest.warns(ModelValidityWarning, match="several cells, or rows twice"):
        read_trains(tmp_path / "twice.csv")
    events = pd.DataFrame({"time_ms": ONSETS, "event": ["contact", "let go", "contact"]})
    events.to_csv(tmp_path / "events.csv", index=False)
    with pytest.warns(ModelValidityWarning, match="though they differ in event"):
        assert read_onsets(tmp_path / "events.csv").size == 3
    numbers = pd.DataFrame({"time_ms": ONSETS, "state": [1, 0, 1], "trial": [0, 1, 2]})
    numbers.to_csv(tmp_path / "numbers.csv", index=False)
    with pytest.warns(ModelValidityWarning, match="though they differ in state") as warned:
        assert read_onsets(tmp_path / "numbers.csv").size == 3
    assert len(warned) == 1
    owned = pd.DataFrame({"unit": [1, 2, 1, 2], "time_s": [0.1, 0.2, 0.3, 0.4]})
    owned.assign(electrode=owned["unit"] + 4).to_csv(tmp_path / "owned.csv", index=False)
    assert len(read_trains(tmp_path / "owned.csv")) == 2


@pytest.mark.parametrize(
    ("head", "factor", "words"),
    [
        ("time", 1e-3, "does not say whether its times are s or ms"),
        ("time_ms", 1e-3, "Are its times s"),
        ("time_s", 1.0, "Are its times ms"),
        ("when", 1.0, "no column of times, but unit, when"),
    ],
)
def test_a_wrong_unit_of_time_is_questioned(tmp_path, head, factor, words):
    times = factor * np.cumsum(np.random.default_rng(0).exponential(20.0, 300))
    pd.DataFrame({"unit": 1, head: times}).to_csv(tmp_path / "s.csv", index=False)
    with pytest.raises(InvalidInput, match=words):
        read_trains(tmp_path / "s.csv")
    if head == "time":
        assert read_trains(tmp_path / "s.csv", unit="s")["1"][-1] == pytest.approx(
            times[-1] * 1e3
        )


@pytest.mark.parametrize("head", ["unit,time_s", "id;spike time (s)", "unit,time\n,s"])
def test_units_are_told_by_any_heading_and_ids_are_whole(tmp_path, head):
    rows = [(1, 0.1), (2, 0.15), (1, 0.32), (1, 0.4)]
    text = "\n".join(f"{unit}.0,{time}" for unit, time in rows)
    (tmp_path / "s.csv").write_text(
        (head + "\n" + text).replace(",", ";" if ";" in head else ",")
    )
    trains = read_trains(tmp_path / "s.csv")
    assert {name: train.tolist() for name, train in trains.items()} == {
        "1": pytest.approx([100, 320, 400]),
        "2": pytest.approx([150]),
    }


def test_the_clock_of_a_recording_is_no_train(tmp_path):
    (tmp_path / "r.csv").write_text(
        "time_ms,hinge1_deg\n" + "".join(f"{k},1\n" for k in range(50))
    )
    with pytest.raises(InvalidInput, match="1 ms apart, all of them"):
        read_trains(tmp_path / "r.csv")


def test_a_folder_that_is_not_phy_s_and_onsets_in_seconds_are_named(tmp_path):
    with pytest.raises(InvalidInput, match=r"lacks spike_times\.npy"):
        read_trains(tmp_path)
    long = {"1": np.arange(100.0, 300_000.0, 40.0)}
    for apart in (0.7, 2.0, 20.0):  # s between trials, as they are in ms if named so
        with pytest.raises(InvalidInput, match="are the onsets in s"):
            cut_trains(long, 0.5 + apart * np.arange(3))
        assert cut_trains(long, 500.0 + 1e3 * apart * np.arange(3)).sizes["trial"] == 3
    with pytest.warns(ModelValidityWarning, match="after the last spike count as silent"):
        cut_trains(long, [5000.0, 310_000.0])
    with pytest.raises(InvalidInput, match="onsets must rise"):
        cut_trains(long, [5.0, 4.0])


def test_rates_intervals_and_latency_are_those_of_the_trains():
    drawn = cut_trains(TRAINS, ONSETS, before=100.0, after=300.0)
    assert drawn.sizes["trial"] == 3 and int(count_spikes(drawn).sum()) == 15
    found = measure_trains(drawn).set_index("unit")
    assert found.loc["3", "latency_ms"] == 7.0 and found.loc["3", "answered"] == 1.0
    assert found.loc["5", "latency_ms"] == 12.0  # of 12, 22 and 8
    assert found.loc["3", "rate_hz"] == pytest.approx(4 / 0.4)
    assert found.loc["3", "rate_contact_hz"] == pytest.approx(4 / 0.3)
    steps = np.array([10.0, 10.0, 14.0] * 3)
    assert found.loc["3", "isi_ms"] == pytest.approx(steps.mean())
    assert found.loc["3", "isi_cv"] == pytest.approx(steps.std(ddof=1) / steps.mean())
    psth = compute_psth(drawn, 10.0)
    assert float(psth.sel(unit="3", time=5.0)) == pytest.approx(100.0)  # every trial, in 10 ms
    assert float(psth.sel(unit="3").sum() * 10e-3) == pytest.approx(4.0)


def test_a_touch_s_lead_is_where_contact_is(tmp_path):
    touches = xr.Dataset(
        coords={
            "time": ("time", np.arange(0.0, 301.0), {"units": "ms"}),
            "trial": [0, 1, 2],
            "lead": ("trial", [20.0] * 3),
        }
    )
    drawn = cut_trains(TRAINS, ONSETS, touches=touches)
    assert measure_trains(drawn).set_index("unit").loc["3", "latency_ms"] == 7.0
    assert float(drawn["spike_time"][0, 0, 0]) == 27.0
    with pytest.raises(InvalidInput, match="2 onsets for 3 touches"):
        cut_trains(TRAINS, ONSETS[:2], touches=touches)


def test_van_rossum_s_distance_is_the_norm_of_the_filtered_difference():
    one, other, tau, step = [10.0, 33.0, 34.0], [12.0, 60.0], 8.0, 0.01
    time = np.arange(0.0, 400.0, step)
    filtered = [
        sum(np.where(time >= t, np.exp(-(time - t) / tau), 0.0) for t in train)
        for train in (one, other)
    ]
    norm = np.sqrt(np.sum((filtered[0] - filtered[1]) ** 2) * step / (tau / 2))
    assert measure_van_rossum(one, other, tau) == pytest.approx(norm, rel=1e-3)
    assert measure_van_rossum(one, one) == 0.0 and measure_van_rossum([], [5.0]) == 1.0


def test_a_model_that_is_the_recording_has_no_distance_and_another_has():
    drawn = cut_trains(TRAINS, ONSETS, before=100.0, after=300.0)
    same = compare_trains(drawn, drawn).set_index("unit")
    assert (same["distance"] == 0).all() and same["correlation"].tolist() == [1.0, 1.0]
    assert same.loc["3", "distance_among"] == 0.0 < same.loc["5", "distance_among"]
    crossed = compare_trains(drawn, drawn, pairs={"3": "5", "5": "3"})
    assert (crossed["distance"] > 1).all()
    with pytest.raises(InvalidInput, match="pairs names no unit"):
        compare_trains(drawn, drawn, pairs={"3": "8"})


def make_touches(angle):
    trials, samples = angle.shape
    return xr.Dataset(
        {
            "angle": (
                ("trial", "sensor", "time"),
                np.repeat(angle[:, None], 2, axis=1),
                {"units": "rad"},
            )
        },
        coords={
            "time": ("time", np.arange(samples) * 1.0, {"units": "ms"}),
            "position": ("sensor", [0.2, 0.8]),
            "trial": np.arange(trials),
        },
    )


@pytest.mark.long
def test_planted_gain_and_threshold_lie_within_their_intervals():
    """Ramps and holds of many sizes, drawn from the model itself; several seeds."""
    time = np.arange(400.0)
    sizes = np.linspace(0.01, 0.06, 12)[:, None]
    angle = sizes * np.clip((time - 40.0) / np.linspace(30.0, 200.0, 12)[:, None], 0, 1)
    touches, inside = make_touches(angle), 0
    planted = CAMPANIFORM.replace(d=-70.0)
    population = Population(
        position=np.array([0.5]), side=np.array([1]), gain=90.0, sensilla=(planted,)
    )
    rates = population.encode(touches)
    for seed in range(4):
        drawn = draw_spikes(rates, seed=seed)
        found = fit_sensillum(angle, drawn, "1")
        low, high = found.gain_interval
        inside += low < 90.0 < high
        inside += found.threshold_interval[0] < 70.0 < found.threshold_interval[1]
        assert found.gain == pytest.approx(90.0, rel=0.2)
        assert found.threshold == pytest.approx(70.0, abs=25.0)
        assert found.explained > 0.05
    assert inside >= 6  # of 8 intervals of 95 %
    np.testing.assert_allclose(
        fit_sensillum(angle / 2, drawn, "1").gain, 2 * found.gain, rtol=1e-2
    )


def test_a_fit_without_spikes_or_stimulus_is_refused():
    angle = np.full((1, 50), 0.1)
    drawn = attach_trains(make_touches(angle), [[[3.0, 9.0]]], ["a"])
    with pytest.raises(InvalidInput, match="needs ten or more"):
        fit_sensillum(angle, drawn, "a")
    with pytest.raises(InvalidInput, match="no unit 'b'"):
        fit_sensillum(angle, drawn, "b")
    with pytest.raises(InvalidInput, match="on the recording's clock"):
        fit_sensillum(angle[:, 1:], drawn, "a")
    many = attach_trains(make_touches(angle), [[np.arange(12.0)]], ["a"])
    with pytest.raises(InvalidInput, match="mind its sign"):
        fit_sensillum(-angle, many, "a")


def test_the_command_reads_one_s_own_units_and_writes_tables(tmp_path):
    own, on = write_csv(tmp_path), tmp_path / "on.csv"
    on.write_text("onset_ms\n" + "\n".join(map(str, ONSETS)))
    out = tmp_path / "o"
    words = ["spikes", "--recorded", str(own), "--onsets", str(on), "--out", str(out)]
    said = CliRunner().invoke(app, words)
    assert said.exit_code == 0, said.output + str(said.exception)
    table = pd.read_csv(out / "recorded.csv", dtype={"unit": str}).set_index("unit")
    assert table.loc["3", "latency_ms"] == 7.0 and "3 trial(s)" in said.output
    assert (out / "recorded.png").exists() and (out / "psth.csv").exists()


@pytest.mark.parametrize("write", [write_csv, write_words, write_phy, write_nwb])
def test_info_names_the_command_that_reads_spikes(tmp_path, write):
    said = CliRunner().invoke(app, ["info", str(write(tmp_path))])
    assert "trains of spikes" in said.output and "17, 5 to 12 of a unit" in said.output
    assert "feeler spikes --recorded" in said.output
