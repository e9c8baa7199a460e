"""Sensilla around an antenna in space: what is bent in one plane is the planar touch."""

import json

import numpy as np
import pytest
import xarray as xr

import feeler
from feeler.analysis import compute_strain
from feeler.errors import InvalidInput
from feeler.spikes import Population, draw_spikes, find_gain, place_sensilla
from feeler.spikes.sensilla import Sensillum
from tests.cli._command import run
from tests.spikes._touches import POSITION, make_bent

pytestmark = pytest.mark.long


def turn_touches(flat: xr.Dataset, azimuth: float, twist: float | None = None) -> xr.Dataset:
    """The planar touches bent towards ``azimuth`` [degrees], perhaps twisted by some [rad]."""
    at, found = np.radians(azimuth), {}
    for name in ("angle", "curvature"):
        rows = [flat[name] * np.cos(at), flat[name] * np.sin(at)]
        if twist is not None:
            rows.append(flat[name] * 0 + twist)
        bent = xr.concat(rows, "plane").transpose("trial", "plane", "sensor", "time")
        found[name] = bent.assign_attrs(flat[name].attrs)
    return flat.assign(found)


@pytest.mark.parametrize("twist", [None, 0.4])
def test_what_bends_in_the_first_plane_only_has_the_spikes_of_the_planar_touch(twist):
    """To the last digit, gains too; the sides towards z feel nothing, and torsion bends none."""
    flat = make_bent()
    space = turn_touches(flat, 0.0, twist)
    pair = find_gain(flat, place_sensilla(POSITION, 30.0), 200.0)
    four = find_gain(space, place_sensilla(POSITION, 30.0, around=(0.0, 90.0)), 200.0)
    np.testing.assert_array_equal(four.gain[:10], pair.gain)
    planar, spatial = (draw_spikes(one.encode(x)) for one, x in ((pair, flat), (pair, space)))
    np.testing.assert_array_equal(spatial["spike_time"], planar["spike_time"])
    rates = four.encode(space)["rate"].values
    np.testing.assert_array_equal(rates[:, :10], planar["rate"])
    assert rates[:, :10].max() > 100 and not rates[:, 10:].any()


@pytest.mark.parametrize("azimuth", [0.0, 37.0, 90.0, 180.0, -60.0])
def test_a_side_feels_what_bends_towards_it_wherever_it_sits(azimuth):
    flat = make_bent()
    expected = place_sensilla(POSITION, 20.0).encode(flat)["rate"]
    found = place_sensilla(POSITION, 20.0, around=azimuth).encode(turn_touches(flat, azimuth))
    np.testing.assert_allclose(found["rate"], expected, rtol=1e-9, atol=1e-9)
    assert found["unit_around"].values.tolist() == [azimuth] * 10
    assert found["unit_around"].attrs["units"] == "deg"


def test_opposite_sides_are_each_other_by_either_name():
    touches = turn_touches(make_bent(), 70.0)
    fields = {"position": POSITION, "gain": 20.0}
    opposite = Population(side=np.full(5, -1), around=20.0, **fields).encode(touches)["rate"]
    turned = Population(side=np.full(5, 1), around=200.0, **fields).encode(touches)["rate"]
    np.testing.assert_allclose(opposite, turned, rtol=1e-9)
    assert turned.max() > 10


def test_sensilla_answer_to_the_compression_of_their_side():
    """Tonic units fire as −strain of their side says, in a real touch from between the planes."""
    whisker = feeler.presets.make_preset("rat-whisker")
    trial = feeler.Trial(feature=feeler.Peg(radius=1.0), location=0.7, speed=0.1, azimuth=40.0)
    touches = feeler.touch(whisker, trial, duration=60)
    tonic = Sensillum(a=0.0, c=1.0, d=0.0, ceiling=1e9)
    radius = whisker.radius[touches["segment"].values - 1]
    population = place_sensilla(
        touches["position"].values,
        1e6 * radius,
        sensillum=tonic,
        quantity="curvature",
        around=(0.0, 90.0),
    )
    rates = population.encode(touches)["rate"].values
    strain = compute_strain(touches, whisker, [0.0, 180.0, 90.0, 270.0]).values
    squeezed = np.maximum(-1e6 * strain, 0).reshape(rates.shape)
    assert all(side.max() > 1 for side in np.split(squeezed[0], 4)[::2])
    np.testing.assert_allclose(rates, squeezed, rtol=1e-9, atol=1e-6)


def test_an_angle_around_that_is_none_is_refused():
    with pytest.raises(InvalidInput, match=r"around must be .*360.*got"):
        Population(position=[0.5], side=[1], gain=1.0, around=400.0)


def test_the_verb_places_four_sides_around_an_antenna_in_space(tmp_path):
    touches = turn_touches(make_bent(), 50.0)
    feeler.save(touches, tmp_path / "set.nc")
    asked = ("--touches", "set.nc", "--rate", "200", "--out", "one", "--json")
    done = run("spikes", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    four = find_gain(touches, place_sensilla(POSITION, 30.0, around=(0.0, 90.0)), 200.0)
    drawn = draw_spikes(four.encode(touches))
    back = feeler.load(tmp_path / "one" / "spikes.nc")
    np.testing.assert_array_equal(back["spike_time"], drawn["spike_time"])
    np.testing.assert_array_equal(back["unit_around"], np.repeat([0.0, 90.0], 10))
    assert said["units"] == 20 and said["gain"] == pytest.approx(four.gain[0], rel=1e-9)
