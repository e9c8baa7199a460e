"""Strain on the sides of an antenna, against geometry and closed forms."""

import numpy as np
import pytest
import xarray as xr

import feeler
from feeler.analysis import compute_strain
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.tensors.transforms import project_planes

FIELDS = {"segment_mass": 1e-3, "radius": 0.1, "stiffness": 1.0, "damping": 0.1}
RADIUS = np.array([0.2, 0.11, 0.17, 0.05])


def make_arc(bend: float, towards: float) -> tuple[xr.Dataset, Antenna]:
    """An antenna bent to curvature ``bend`` [1/mm] towards a side [degrees], as a Dataset."""
    length = np.array([0.5, 0.7, 0.4, 0.9])
    both = np.array([np.cos(np.radians(towards)), np.sin(np.radians(towards))])
    angle = bend * both[:, None] * length
    antenna = Antenna(
        segment_length=length,
        segment_mass=1e-3,
        radius=RADIUS,
        stiffness=np.ones((2, 4)),
        damping=0.1,
        sensors=[2, 3, 4],
    )
    curvature = (angle / length)[None, :, 1:, None]
    touches = xr.Dataset(
        {"curvature": (("trial", "plane", "sensor", "time"), curvature, {"units": "1/mm"})},
        {"segment": ("sensor", [2, 3, 4])},
    )
    return touches, antenna


@pytest.mark.parametrize("towards", [0.0, 37.0, 201.0])
def test_fibres_of_an_arc_are_as_long_as_geometry_says(towards):
    """Of an arc of radius R the fibre at a distance r towards its centre has (R − r)/R of it."""
    touches, antenna = make_arc(0.13, towards)
    sides = [towards, towards + 180.0, towards + 90.0, towards - 60.0]
    found = compute_strain(touches, antenna, sides)
    assert found.dims == ("trial", "side", "sensor", "time")
    assert found.attrs["units"] == "1" and found["around"].attrs["units"] == "deg"
    distance = RADIUS[1:] * np.cos(np.radians([[0.0], [180.0], [90.0], [-60.0]]))
    arc = 1 / 0.13
    np.testing.assert_allclose(found[0, :, :, 0], (arc - distance) / arc - 1, atol=1e-15)


def test_a_turn_sets_each_sensor_farther_around_than_the_last():
    touches, antenna = make_arc(0.1, 20.0)
    found = compute_strain(touches, antenna, 5.0, turn=50.0)
    each = [compute_strain(touches, antenna, 5.0 + 50.0 * k)[0, 0, k, 0] for k in range(3)]
    np.testing.assert_allclose(found[0, 0, :, 0], each)


def test_in_the_plane_sides_towards_z_are_neither_stretched_nor_compressed():
    antenna = feeler.presets.cockroach()
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.3)
    touches = feeler.touch(antenna, trial, duration=12)
    found = compute_strain(touches, antenna, [0.0, 90.0, 180.0])
    assert np.abs(found[:, 0]).max() > 1e-4
    np.testing.assert_allclose(found[:, 1], 0, atol=1e-18)
    np.testing.assert_allclose(found[:, 2], -found[:, 0], atol=1e-18)
    wanted = -0.225 * touches["curvature"].values
    np.testing.assert_allclose(found[:, 0], wanted)


def test_torsion_bends_nothing():
    touches, _ = make_arc(0.1, 20.0)
    twisted = xr.concat([touches["curvature"], 9.0 + touches["curvature"][:, :1]], "plane")
    found = project_planes(twisted, 33.0)
    np.testing.assert_array_equal(found, project_planes(touches["curvature"], 33.0))


def test_what_is_wrong_is_said():
    touches, antenna = make_arc(0.1, 20.0)
    with pytest.raises(InvalidInput, match="sensor on segment 4, but 'custom' has 3"):
        compute_strain(touches, feeler.Antenna.from_profile(3, length=2.0, **FIELDS))
    with pytest.raises(InvalidInput, match=r"finite.*\[degrees\]"):
        compute_strain(touches, antenna, np.nan)
