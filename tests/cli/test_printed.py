"""What the verbs print is what the library computes, in the unit that stands beside it."""

import json
import re
from importlib.resources import files

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.robot import fit_factors, load_recording, repair
from feeler.robot.description import get_example
from feeler.tensors.formats import load
from feeler.tracking import load_tracks, measure_exploration

NUMBER = r"(-?[\d.]+(?:e-?\d+)?)"


def run(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.output


def read(pattern, text):
    return [float(number) for number in re.search(pattern.replace("#", NUMBER), text).groups()]


def test_touch_prints_peaks_of_the_tensor_it_wrote_the_same_from_both_sides(tmp_path):
    """Re-derived from the file, with its own units; on the page too."""
    asked = ("touch", "--duration", 30, "--timestep", 0.05, "--no-movie", "--location", 0.7)
    told = {}
    for side in ("left", "right"):
        out = tmp_path / side
        found = json.loads(run(*asked, "--side", side, "--out", out, "--json"))
        tensors = load(out / "tensor.nc")
        assert [tensors[name].attrs["units"] for name in ("angle", "curvature", "force")] == [
            "rad",
            "1/mm",
            "N",
        ]
        expected = {
            "peak_hinge_angle": 180 / np.pi * np.abs(tensors["angle"].values).max(),
            "peak_curvature": np.abs(tensors["curvature"].values).max(),
            "peak_force": 1e3 * np.linalg.norm(tensors["force"], axis=-1).max(),
        }
        assert found["units"] == {
            "peak_hinge_angle": "deg",
            "peak_curvature": "1/mm",
            "peak_force": "mN",
            "penetration_depth": "smaller radius",
            "contact_time_constant": "ms",
            "timestep": "ms",
            "error": "1",
        }
        told[side] = [found[name] for name in expected]
        assert told[side] == pytest.approx(list(expected.values()), rel=1e-12)
        page = re.sub("<[^>]+>", " ", (out / "touch.html").read_text(encoding="utf-8"))
        facts = (
            r"angle \[°\]\s+#\s+peak curvature \[1/mm\]\s+#\s+peak force \[mN\]\s+#\s+"
            r"penetration depth \[smaller radius\]\s+#\s+contact time constant \[ms\]\s+#\s+"
            r"timestep \[ms\]\s+#\s+its error, over the peak\s+#"
        )
        depth, error = (float(tensors[name].max()) for name in ("sink", "error"))
        shown = [*told[side], depth, 0.2, 0.05, error]
        assert read(facts, page) == pytest.approx(shown, rel=1e-3)
    assert told["right"] == pytest.approx(told["left"], rel=1e-6)
    said = run(*asked, "--side", "right", "--out", tmp_path / "right")
    printed = read(r"peak hinge angle #°, peak curvature # /mm", said)
    assert printed == pytest.approx(told["left"][:2], rel=5e-3)


@pytest.mark.parametrize("side", ["left", "right"])
def test_spikes_prints_what_the_file_that_it_wrote_holds(tmp_path, side):
    asked = ("spikes", "--rate", 200, "--side", side, "--location", 0.6, "--speed", 0.6)
    found = json.loads(run(*asked, "--out", tmp_path, "--json"))
    drawn = load(tmp_path / "spikes.nc")
    times = drawn["spike_time"].transpose("trial", "unit", "event").values
    silent = np.isnan(times)
    assert drawn["spike_time"].attrs["units"] == "ms" and drawn["rate"].attrs["units"] == "Hz"
    assert found["unit"] == {"greatest_rate": "Hz", "gain": "1/rad", "units_that_fire": "1"}
    assert found["units"] == times.shape[1] and found["touches"] == len(times)
    assert found["units_that_fire"] == pytest.approx(1 - silent.all(axis=2).mean())
    assert found["spikes_per_touch"] == pytest.approx((~silent).sum() / len(times))
    rates = drawn["rate"].transpose("trial", "unit", "time").values
    assert found["greatest_rate"] == pytest.approx(np.median(rates.max(axis=(1, 2))))
    assert found["greatest_rate"] == pytest.approx(200, rel=1e-6)
    assert drawn["side"].item() == side
    # the units of the side to which the object bends the antenna fire most
    own = drawn["unit_side"].values == (1 if side == "left" else -1)
    counts = (~silent).sum(axis=2)[0]
    assert counts[own].sum() > 2 * counts[~own].sum()


def test_tracks_prints_degrees_per_second_and_centimetres_per_second():
    path = files("feeler.tracking") / "data" / "synthetic_tracks_xypts.csv"
    found = measure_exploration([load_tracks(path, frame_rate=30)])
    said = run("tracks", path, "--frame-rate", 30, "--length", 50)
    mean, length, lateral = read(
        r"angular speed is # °/s; with an antenna of # mm that is # cm/s", said
    )
    assert mean == pytest.approx(1e3 * 180 / np.pi * found.mean, abs=0.006)  # rad/ms
    assert length == 50
    assert lateral == pytest.approx(mean * np.pi / 180 * 50 / 10, rel=1e-3)  # rad/s × mm
    left, n_left, right, n_right = read(rf"{path.name} +# \( *#\) +# \( *#\)", said)
    assert (left, right) == pytest.approx(1e3 * 180 / np.pi * found.mean_peak[0], abs=0.006)
    assert (n_left, n_right) == tuple(found.n_peaks[0])
    errors = read(r"standard error: left #, right # °/s", said)
    assert errors == pytest.approx(1e3 * 180 / np.pi * found.error[0], rel=0.06)


def test_robot_fit_prints_hertz():
    path = get_example("release")
    found = fit_factors(repair(load_recording(path)))
    said = run("robot", "fit", path)
    for name, ringing in (("recording", found.target), ("model", found.reached)):
        frequency, ratio, share = read(
            rf"{name} +# Hz damped, damping ratio #, a damped cosine explains #%", said
        )
        assert share == pytest.approx(100 * ringing.r_squared, abs=0.06)
        assert frequency == pytest.approx(1e3 * ringing.frequency, abs=6e-4)  # kHz
        assert ratio == pytest.approx(ringing.damping_ratio, abs=6e-5)
    p1, p2, error, count = read("p1 = #, p2 = # ms, error #, # evaluations", said)
    assert (p1, p2) == pytest.approx((found.stiffness_factor, found.damping_factor), abs=6e-5)
    assert (error, count) == (pytest.approx(found.error, rel=0.05), found.n_evaluations)
