"""What a command prints, and what stands on its page, is what it says in JSON, in the unit beside
it. What the JSON says is held against files in tests/relations, and against planted truths.
"""

import json
import re
from functools import reduce
from importlib.resources import files

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.cli.choose import change_antenna
from feeler.presets import cockroach
from feeler.robot.description import get_example
from feeler.robot.sensors import fit_sensors

NUMBER = r"(-?[\d.]+(?:e-?\d+)?)"
TRACKS = files("feeler.tracking") / "data" / "synthetic_tracks_xypts.csv"
KHZ, CM_S = 1e3, 1e2

SAID = [
    (
        "touch --duration 30 --no-movie --location 0.7 --side right --out o",
        {r"peak hinge angle #°, peak curvature # /mm": ["peak_hinge_angle", "peak_curvature"]},
        {
            r"angle \[°\] # peak curvature \[1/mm\] # peak force \[mN\] # penetration": [
                *("peak_hinge_angle", "peak_curvature", "peak_force"),
            ]
        },
    ),
    (
        f"tracks {TRACKS} --frame-rate 30 --length 50 --out o",
        {
            r"angular speed is # °/s; with an antenna of # mm that is # cm/s": [
                *("mean", "length", ("lateral_speed", CM_S)),
            ],
            r"_xypts.csv +# \( *#\) +# \( *#\)": [
                *("trials.0.mean_peak.0", "trials.0.n_peaks.0"),
                *("trials.0.mean_peak.1", "trials.0.n_peaks.1"),
            ],
            r"standard error: left #, right # °/s": ["trials.0.error.0", "trials.0.error.1"],
        },
        {r"\.csv # ± # \(#\)": ["trials.0.mean_peak.0", "trials.0.error.0", "trials.0.n_peaks.0"]},
    ),
    (
        "wall linear --near 5 --far 11 --steps 4 --angle 40 --friction 0 --no-movie --out o",
        {
            r"linear +\d+ +\d+ +\d+ +# +# +# +# +yes +# to #": [
                *(f"linear.{name}" for name in ("r2", "slope", "intercept", "error")),
                *("linear.told_apart.0", "linear.told_apart.1"),
            ]
        },
        {},
    ),
    pytest.param(
        "follow --turn -20 --speed 0.9 --target 10 --friction 0.2",
        {
            r"after # ms; tracking error # mm, nearest # mm, estimate off by # mm \(map R² #\)": [
                *("duration", "error", "nearest", "estimate_error", "r2"),
            ]
        },
        {},
        marks=pytest.mark.long,
    ),
    (
        f"robot fit {get_example('release')} --out o",
        {
            r"recording +# Hz damped, damping ratio #, a damped cosine explains #%": [
                *(("recording.frequency", KHZ), "recording.damping_ratio"),
                ("recording.r_squared", 100),
            ],
            r"p1 = #, p2 = # ms, error #": ["stiffness_factor", "damping_factor", "error"],
        },
        {r"p1 = #, p2 = # ms": ["stiffness_factor", "damping_factor"]},
    ),
]  # fmt: skip
"""Words, and what is printed and stands on the page, with where it is in JSON and a factor."""


def run(words):
    result = CliRunner().invoke(app, words.split())
    assert result.exit_code == 0, result.output
    return result.stdout


def take(known, path):
    """A number of JSON by where it is, times a factor where one is given."""
    name, factor = path if isinstance(path, tuple) else (path, 1)
    keys = [int(key) if key.isdigit() else key for key in name.split(".")]
    return factor * reduce(lambda item, key: item[key], keys, known)


@pytest.mark.parametrize(("words", "printed", "paged"), SAID, ids=lambda w: str(w)[:6])
def test_a_command_prints_what_it_says_in_json(words, printed, paged, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    known = json.loads(run(f"{words.removesuffix(' --out o')} --json"))
    texts = [(run(words), printed)]
    for page in tmp_path.glob("o/*.html"):
        shown = re.sub("<[^>]+>", " ", page.read_text(encoding="utf-8"))
        texts.append((" ".join(shown.split()), paged))
    assert len(texts) == 2 or not paged
    for text, patterns in texts:
        for pattern, paths in patterns.items():
            found = re.search(pattern.replace("#", NUMBER), text)
            assert found, pattern
            wanted = [take(known, path) for path in paths]
            for number, value in zip(found.groups(), wanted, strict=True):
                digits = len(re.sub(r"e.*|^-?0\.0*|\D", "", number))
                assert float(number) == pytest.approx(value, rel=0.6 * 10.0 ** (1 - digits))


def test_a_sensor_report_is_in_degrees_and_degrees_a_minute():
    rng = np.random.default_rng(3)
    hinge, level = np.repeat([1, 2], 15), np.tile(np.repeat([-0.35, -0.1, 0.0, 0.2, 0.4], 3), 2)
    readings = 5 + 3 * level * hinge + 0.1 * rng.standard_normal(30)
    fit = fit_sensors(hinge, level, readings, time=rng.permutation(30) * 7e3)
    head, *rows = fit.report().splitlines()
    assert "°/pF" in head and "resolution °" in head and "drift °/min   angles °" in head
    for k, row in enumerate(rows):
        _, slope, r2, *errors, drift, least, most = map(float, row.replace(" to ", " ").split())
        assert least < np.rad2deg(-0.3) and np.rad2deg(0.35) < most < 30
        assert (slope, r2) == pytest.approx(
            (np.rad2deg(fit.slope[k]), fit.r_squared[k]), rel=6e-3
        )
        own = (fit.residual[k], fit.cross_validated[k], fit.resolution[k])
        assert errors == pytest.approx(np.rad2deg(own).tolist(), abs=6e-4)
        assert drift == pytest.approx(np.rad2deg(fit.drift[k]) * 60_000, rel=6e-3)


def test_info_prints_an_antenna_in_millimetres_milligrams_and_newton_millimetres(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    run("antenna a.toml")
    said, antenna = run("info a.toml"), cockroach()
    patterns = {
        "segments +#, # mm, # mg": [140, antenna.length, 1e3 * antenna.segment_mass.sum()],
        r"stiffness +# \(base\) … # \(tip\) N·mm/rad": antenna.stiffness[[0, -1]],
        r"damping +# \(base\) … # \(tip\) N·mm·ms/rad": antenna.damping[[0, -1]],
    }
    for pattern, wanted in patterns.items():
        found = re.search(pattern.replace("#", NUMBER), said).groups()
        assert [float(number) for number in found] == pytest.approx([*wanted], rel=1e-5)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ("stiffness=2", "stiffness"),
        ("damping=2", "damping"),
        ("cockroach.mass=2", "segment_mass"),
        ("length=2", "segment_length"),
        ("radius=2", "radius"),
    ],
)
def test_set_scales_one_quantity_alone(change, field):
    antenna = cockroach()
    changed = change_antenna(antenna, [change])
    for name in ("stiffness", "damping", "segment_mass", "segment_length", "radius"):
        factor = 2.0 if name == field else 1.0
        np.testing.assert_allclose(getattr(changed, name), getattr(antenna, name) * factor)
