"""``feeler spikes``: touches in; page, numbers and NWB out; and what is refused."""

import json

import numpy as np
import pytest

import feeler
from feeler.spikes import Firing, draw_spikes, find_gain, place_sensilla
from tests.cli._command import run
from tests.spikes._touches import make_bent


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verb")
    feeler.save(make_bent(3), folder / "set.nc")
    return folder


@pytest.mark.long
def test_the_verb_says_and_writes_what_the_library_draws(folder):
    asked = (
        "--touches",
        "set.nc",
        "--rate",
        "200",
        "--order",
        "2",
        "--seed",
        "3",
        "--show",
        "1",
    )
    session = ("--session-start", "2026-01-31T10:00:00+01:00", "--identifier", "made-1")
    done = run("spikes", *asked, *session, "--out", "one", "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    touches = make_bent(3)
    places = place_sensilla(touches["position"].values, 30.0)
    population = find_gain(touches, places, 200.0)
    drawn = draw_spikes(population.encode(touches), Firing(order=2), seed=3)
    assert said["spikes_per_touch"] == np.isfinite(drawn["spike_time"].values).sum() / 3
    assert said["gain"] == pytest.approx(population.gain[0], rel=1e-9)
    assert said["greatest_rate"] == pytest.approx(200, rel=1e-6) and said["units"] == 10
    for name in ("spikes.nc", "spikes.nwb"):
        back = feeler.load(folder / "one" / name)["spike_time"]
        np.testing.assert_allclose(back, drawn["spike_time"], atol=1e-6)
    page = (folder / "one" / "spikes.html").read_text()
    assert "data:image/" in page and "Szczecinski" in page
    kept = json.loads((folder / "one" / "spikes.json").read_text())
    np.testing.assert_allclose(kept["rate"], drawn["rate"][1])


@pytest.mark.further
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--show", "3"), "--show is below 3, the number of touches"),
        (("--identifier", "x"), "needs both --session-start and --identifier"),
        (("--gain", "5000"), "too coarse for how fast these sensilla adapt"),
        (("--gain", "-1"), "gain must be finite and > 0"),
        (("--order", "0"), "--order must be ≥ 1"),
    ],
)
def test_what_cannot_be_drawn_is_said(folder, options, words):
    done = run("spikes", "--touches", "set.nc", *options, "--out", "wrong", cwd=folder)
    assert done.returncode == 2 and words in done.stderr


@pytest.mark.long
def test_nothing_is_written_over(folder):
    asked = ("spikes", "--touches", "set.nc", "--sensors", "4", "--out", "twice")
    assert run(*asked, cwd=folder).returncode == 0
    first = (folder / "twice" / "spikes.nc").read_bytes()
    again = run(*asked, "--seed", "1", cwd=folder)
    assert again.returncode == 2 and "exists already" in again.stderr
    assert (folder / "twice" / "spikes.nc").read_bytes() == first
