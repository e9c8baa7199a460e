"""Own data: planted mechanics come back from noisy traces, within the stated interval; bad files
say why.
"""

import numpy as np
import pytest
from scipy.stats import t as student

from feeler.calibration import Protocol, Traces, fit_traces, load_traces, make_synthetic_traces
from feeler.calibration.traces import measure_trace
from feeler.errors import InvalidInput

from .small_antenna import make_small

PLANTED = (1.25, 0.7)
QUICK = Protocol(timestep=0.05)


@pytest.fixture(scope="module")
def traces():
    return make_synthetic_traces(
        make_small(),
        np.random.default_rng(11),
        n_animals=4,
        spread=0.04,
        noise=0.005,
        planted=PLANTED,
        protocol=QUICK,
    )


@pytest.mark.long
def test_planted_factors_lie_in_an_interval_no_narrower_than_student_s(traces):
    result = fit_traces(traces, make_small(), protocol=QUICK)
    assert result.names == ("stiffness", "damping") and result.each.shape == (4, 2)
    assert max(result.residual.values()) < 0.02
    assert np.all(result.low < PLANTED) and np.all(result.high > PLANTED)
    assert np.all(result.high / result.low < 1.6)
    logs = np.log(result.each)
    half = student.ppf(0.975, 3) * logs.std(axis=0, ddof=1) / 2
    np.testing.assert_allclose(np.log(result.p), logs.mean(axis=0))
    assert np.all(np.log(result.high / result.p) >= half * (1 - 1e-9))
    np.testing.assert_allclose(result.low * result.high, result.p**2)
    np.testing.assert_array_equal(result.directions.p, result.each[0])


@pytest.mark.long
def test_one_animal_has_an_interval_from_its_residuals():
    one = make_synthetic_traces(
        make_small(),
        np.random.default_rng(2),
        n_animals=1,
        spread=0.0,
        planted=PLANTED,
        protocol=QUICK,
    )
    result = fit_traces(one, make_small(), protocol=QUICK)
    assert (
        "from the residuals" in result.interval
        and result.residual["synthetic1: release"] < 0.02
    )
    assert np.all(result.low < PLANTED) and np.all(result.high > PLANTED)


def test_a_trace_is_no_clock_and_times_come_before_frames(tmp_path):
    time = np.arange(90.0)
    moved = 8 * np.exp(-time / 25) * np.cos(2 * np.pi * time / 22)
    rows = "".join(f"{k:g},{k / 1e3:g},{y:.6f}\n" for k, y in zip(time, moved, strict=True))
    (tmp_path / "t.csv").write_text("frame,Time (s),a\n" + rows)
    found = load_traces(tmp_path / "t.csv")
    assert found.names == ("a",) and found.time[-1] == pytest.approx(89.0)
    with pytest.raises(InvalidInput, match="holds times"):
        load_traces(tmp_path / "t.csv", frame_rate=500)


@pytest.mark.parametrize("counted", ["Frame", "index", "No."])
def test_numbers_of_rows_are_no_animal(counted, tmp_path):
    plain = "time_ms,a1\n" + "".join(f"{2 * k},{20 / (k + 1):.3f}\n" for k in range(9))
    (tmp_path / "plain.csv").write_text(plain)
    head, *rows = plain.split()
    lines = [f"{counted},{head}", *(f"{k},{row}" for k, row in enumerate(rows, 1))]
    (tmp_path / "numbered.csv").write_text("\n".join(lines))
    plain, numbered = (load_traces(tmp_path / f"{name}.csv") for name in ("plain", "numbered"))
    assert numbered.names == plain.names == ("a1",)
    np.testing.assert_array_equal(numbered.displacement, plain.displacement)
    (tmp_path / "numbers.csv").write_text(
        "\n".join(["time_ms,index", *map("{0},{0}".format, range(9))])
    )
    with pytest.raises(InvalidInput, match="no column of an animal beside its time"):
        load_traces(tmp_path / "numbers.csv")


def test_synthetic_traces_are_scattered_and_noisy_as_they_say():
    made = make_synthetic_traces(
        make_small(),
        np.random.default_rng(2),
        n_animals=3,
        spread=0.0,
        noise=0.02,
        planted=PLANTED,
        protocol=QUICK,
    )
    clean = make_synthetic_traces(
        make_small(*PLANTED),
        np.random.default_rng(2),
        n_animals=1,
        spread=0.0,
        noise=0.0,
        protocol=QUICK,
    )
    noise = made.displacement - clean.displacement
    assert noise.std() / clean.displacement[0, 0] == pytest.approx(0.02, rel=0.15)
    np.testing.assert_array_equal(made.time, np.arange(90.0))
    usual = make_synthetic_traces(make_small(), np.random.default_rng(2), protocol=QUICK)
    assert len(usual.animals) == 5  # as many as were recorded (paper, Fig. 1)
    assert np.abs(np.corrcoef(noise) - np.eye(3)).max() < 0.4


def test_synthetic_animals_are_log_normal_about_what_was_planted():
    quiet = {"noise": 0.0, "protocol": QUICK}
    drawn = np.random.default_rng(3).standard_normal((2, 2))
    options = {"n_animals": 2, "spread": 0.1, "planted": PLANTED}
    made = make_synthetic_traces(make_small(), np.random.default_rng(3), **options, **quiet)
    for row, share in zip(made.displacement, np.exp(0.1 * drawn), strict=True):
        one = make_small(*(np.array(PLANTED) * share))
        alone = make_synthetic_traces(
            one, np.random.default_rng(0), n_animals=1, spread=0.0, **quiet
        )
        np.testing.assert_allclose(row, alone.displacement[0], atol=1e-9)


def test_the_example_is_named_synthetic():
    example = load_traces("synthetic_step")
    assert example.source == "synthetic" and example.displacement.shape[0] == 5
    assert all("synthetic" in name for name in example.names)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("t,a\n0,1\n", "needs a column time_ms or time_s or frame"),
        ("time_ms\n0\n", "one named column per animal"),
        ("", "no header row"),
        ("time_ms,a\n0,1\n1,x\n", "line 3, column 'a': 'x' is no finite number"),
        ("time_ms,a\n0,1e200\n", "line 2, column 'a': '1e200' is larger than"),
        ("time_ms,a\n0,1\n1\n", "line 3: 1 cells"),
        (
            "time_ms,a\n"
            + "\n".join(f"{k},{'' if 5 <= k < 12 else 20 - k}" for k in range(20)),
            r"a is missing from sample 5 to 11.*max_gap=7",
        ),
        ("time_ms,a\n" + "\n".join(f"{-k},{20 - k}" for k in range(20)), "time must rise"),
    ],
)
def test_bad_tables_say_where(tmp_path, text, match):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    with pytest.raises(InvalidInput, match=match):
        load_traces(file)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    file = tmp_path / "bad.csv"
    file.write_bytes(b"time_ms,a\n0,\xf0\n")
    with pytest.raises(InvalidInput, match=r"is not UTF-8 text \(byte 12\)"):
        load_traces(file)


def test_a_short_trace_names_its_animal():
    time = np.arange(0.0, 200.0)
    short = Traces(time=time[:20], displacement=np.exp(-time / 20)[None, :20], names=("stub",))
    with pytest.raises(InvalidInput, match=r"'stub'.*too short to hold one cycle"):
        fit_traces(short, make_small())


def test_white_noise_moves_frequency_and_damping_little():
    time = np.arange(0.0, 120.0)
    rate, omega = 2 * np.pi * 0.0175 * 0.3 / np.sqrt(1 - 0.09), 2 * np.pi * 0.0175
    clean = np.exp(-rate * time) * (np.cos(omega * time) + rate / omega * np.sin(omega * time))
    rng = np.random.default_rng(3)
    found = [
        measure_trace(time, clean + 0.005 * rng.standard_normal(time.size)) for _ in range(20)
    ]
    assert np.mean([free.frequency for free in found]) == pytest.approx(0.0175, rel=0.02)
    assert np.std([free.frequency for free in found]) < 0.04 * 0.0175
    assert np.mean([free.damping_ratio for free in found]) == pytest.approx(0.3, rel=0.05)


@pytest.mark.parametrize(
    ("time", "frequency", "match"),
    [
        (np.arange(0.0, 120.0), 0.45, "faster than its sampling rate"),
        (1000.0 * np.arange(0.0, 120.0), 0.0175e-3, "Name the column time_ms"),
    ],
)
def test_frequencies_beyond_sampling_and_beyond_antennae_are_refused(time, frequency, match):
    trace = np.exp(-0.1 * frequency * time) * np.cos(2 * np.pi * frequency * time)
    with pytest.raises(InvalidInput, match=match):
        measure_trace(time, trace, "fast")


def test_seconds_taken_for_milliseconds_are_noticed():
    time = np.arange(0.0, 0.12, 0.001)
    trace = np.exp(-30 * time) * np.cos(2 * np.pi * 17.5 * time)
    with pytest.raises(InvalidInput, match="Name the column time_s"):
        measure_trace(time, trace)


def test_the_noise_of_a_trace_is_told_as_a_share_of_its_first_deflection():
    """White noise of sd σ has second differences of sd √6 σ."""
    time = np.arange(0.0, 4000.0)
    trace = np.cos(0.002 * time) + 0.3 * np.random.default_rng(2).standard_normal(time.size)
    trace[0] = 1.0
    with pytest.raises(
        InvalidInput,
        match=r"jumps from sample to sample by (29|30|31)% of its first deflection",
    ):
        measure_trace(time, trace)


def test_a_table_that_is_not_there():
    with pytest.raises(InvalidInput, match="no such file"):
        load_traces("nowhere.csv")


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"names": ("a", "b")}, "got 2 names, 50 samples"),
        ({"time": np.arange(49.0)}, "got 1 names, 49 samples"),
        ({"displacement": np.zeros(50)}, r"displacement must be an array \(trace, sample\)"),
        ({"time": None}, "time must be an array of numbers, got None"),
    ],
)
def test_traces_that_do_not_fit_together_are_refused(changes, match):
    fields = {
        "time": np.arange(50.0),
        "displacement": np.exp(-np.arange(50.0) / 9)[None],
        "names": ("a",),
    }
    with pytest.raises(InvalidInput, match=match):
        Traces(**fields | changes)
