"""A touch from the right is the mirror image of one from the left; what is touched on both sides
loses neither.
"""

import warnings

import numpy as np
import pytest
import xarray as xr

import feeler
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.objects import Ball, Triangle
from feeler.tensors import fold_signs, measure_peak, mirror_to_left, rectify
from feeler.tensors.transforms import get_bending
from tests.tensors._touches import antenna

SIDES = ("left", "right", "left", "right")


@pytest.fixture(scope="module")
def touches():
    """Two touches, each from both sides."""
    trials = [
        feeler.Trial(
            feature=feature, location=0.6, speed=0.4, approach=approach, side=side, lead=2.0
        )
        for feature, approach in ((Triangle(half_width=1.5), 70.0), (Ball(radius=1.0), 110.0))
        for side in ("left", "right")
    ]
    return feeler.touch(antenna, trials, duration=40.0, timestep=0.02)


def make_space(n=8, x=0.02, z=0.02):
    """A straight antenna in space, as stiff towards z as towards x where ``x`` is ``z``."""
    return feeler.Antenna(
        segment_length=np.full(n, 1.5),
        segment_mass=1e-5,
        radius=0.15,
        stiffness=np.outer([x, z, 0.05], 0.8 ** np.arange(n)),
        damping=np.outer([0.3 * x, 0.3 * z, 0.02], 0.8 ** np.arange(n)),
        rest_angle=np.zeros((3, n)),
        name="straight",
    )


def make_random(planes=False, seed=0, sides=SIDES, dtype=float):
    """Numbers with sides and azimuths."""
    rng = np.random.default_rng(seed)
    shape = (len(sides), *([3] if planes else []), 5, 7)
    dims = ("trial", *(["plane"] if planes else []), "sensor", "time")
    coords = {
        "side": ("trial", list(sides)),
        "azimuth": ("trial", np.arange(len(sides)) * 40.0),
    }
    coords |= {"plane": ["x", "z", "torsion"]} if planes else {}
    return xr.DataArray(
        rng.normal(size=shape).astype(dtype), coords, dims, "angle", {"units": "rad"}
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("x", "z", "azimuth", "share"),
    [(0.02, 0.05, 0.0, 1e-9), (0.02, 0.05, 90.0, 1e-9), (0.02, 0.02, 40.0, 0.03)],
)
def test_in_space_the_mirror_stands_across_the_approach(x, z, azimuth, share):
    """To rounding where a plane of bending is mirrored onto itself; between them up to the second
    order of the angles, as a hinge bends towards x first and towards z then.
    """
    trials = [
        feeler.Trial(
            feature=Ball(radius=1.0),
            location=0.7,
            speed=0.2,
            azimuth=azimuth,
            side=side,
            lead=1.0,
        )
        for side in ("left", "right")
    ]
    found = feeler.touch(make_space(x=x, z=z), trials, duration=15.0)["angle"]
    assert measure_peak(found) > 0.01
    left, right = mirror_to_left(found).values
    np.testing.assert_allclose(right, left, atol=share * measure_peak(found))
    round_about = trials[0].replace(azimuth=azimuth + 180.0)
    turned = feeler.touch(make_space(x=x, z=z), round_about, duration=15.0)["angle"]
    assert measure_peak(turned) == pytest.approx(measure_peak(found[0]), rel=1e-6)


@pytest.mark.parametrize("planes", [False, True])
@pytest.mark.parametrize("dtype", [float, np.float32])
def test_a_mirror_image_s_own_is_the_original_and_left_stays_to_the_bit(planes, dtype):
    given = make_random(planes, dtype=dtype)
    found = mirror_to_left(given)
    assert found.dtype == dtype and found.dims == given.dims
    np.testing.assert_array_equal(found[::2], given[::2])
    assert not np.allclose(found[1::2], given[1::2])
    xr.testing.assert_identical(mirror_to_left(found), found)
    back = mirror_to_left(found.assign_coords(side=given["side"]))
    np.testing.assert_allclose(back, given, rtol=1e-5)
    np.testing.assert_allclose(  # no mirror changes a length
        get_bending(given) if planes else abs(given),
        get_bending(found) if planes else abs(found),
        rtol=1e-5,
    )
    for k in range(len(SIDES)):  # one alone as among others
        np.testing.assert_array_equal(mirror_to_left(given[k]), found[k])
        np.testing.assert_array_equal(mirror_to_left(given[[k]]), found[[k]])
    order = [3, 0, 2, 1]
    np.testing.assert_array_equal(mirror_to_left(given[order]), found[order])


@pytest.mark.parametrize("labels", [None, [""] * 4, ["left"] * 4])
def test_what_does_not_say_that_it_came_from_the_right_stays(labels):
    given = make_random().drop_vars("side")
    given = given if labels is None else given.assign_coords(side=("trial", labels))
    np.testing.assert_array_equal(mirror_to_left(given), given)
    with pytest.raises(InvalidInput, match=r"side is 'left', 'right', or empty .* got 'Right'"):
        mirror_to_left(given.assign_coords(side=("trial", ["left", "Right"] * 2)))


@pytest.mark.parametrize("azimuth", [0.0, 33.0, 90.0, 200.0])
def test_at_each_azimuth_what_bends_away_is_turned_round(azimuth):
    """Bending away from the object changes its sign, across it does not, torsion does."""
    given = make_random(planes=True).assign_coords(azimuth=("trial", [azimuth] * 4))
    found, turn = mirror_to_left(given), np.radians(azimuth)
    for sign, (c, s) in (
        (-1, (np.cos(turn), np.sin(turn))),
        (1, (-np.sin(turn), np.cos(turn))),
    ):
        along = [c * one[1::2, 0] + s * one[1::2, 1] for one in (given, found)]
        np.testing.assert_allclose(along[1], sign * along[0], atol=1e-12)
    np.testing.assert_array_equal(found[1::2, 2], -given[1::2, 2])


def test_a_peak_has_no_sign_and_no_direction():
    assert measure_peak(np.array([0.3, -2.7])) == measure_peak(np.array([-0.3, 2.7])) == 2.7
    assert measure_peak(np.array([1.0, np.nan]), np.array([[-3.0]])) == 3.0
    assert measure_peak(np.zeros((2, 0))) == 0.0
    plane = xr.DataArray(
        [[[[3.0]], [[-4.0]], [[9.0]]]], dims=("trial", "plane", "sensor", "time")
    )
    assert measure_peak(plane) == 5.0  # torsion bends nothing
    with pytest.raises(InvalidInput, match="measure_peak needs at least one tensor"):
        measure_peak()


def test_rectify_says_what_it_takes_of_touches_from_the_right(touches):
    details = []
    for tensors in (touches["angle"], -np.ones((2, 3, 4)), -1e-300 * np.ones((3, 4))):
        with pytest.warns(ModelValidityWarning, match="mirror_to_left first") as warned:
            rectify(tensors)
        details.append(warned[0].message.details)
    for words, said in zip(
        ("2 of 4 trials more than 40%", "Up to 100%", "1 of 1"), details, strict=True
    ):
        assert words in said
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = rectify(mirror_to_left(touches["angle"]))
        rectify(np.zeros((2, 3, 4)))
        rectify(np.array([[[1.0, np.nan, -0.1]]]))
        rectify(np.full((1, 2, 3), 1e300))
    np.testing.assert_allclose(found[1::2], found[::2], atol=1e-12)


@pytest.mark.parametrize("planes", [False, True])
def test_folded_signs_lose_nothing(planes):
    given = make_random(planes)
    found = fold_signs(given)
    n = found.sizes["sensor"] // 2
    assert n == (15 if planes else 5) and float(found.min()) >= 0
    first, second = found.values[:, :n], found.values[:, n:]
    np.testing.assert_array_equal((first - second).reshape(given.shape), given)
    assert not (first * second).any()
    assert found["side"].values.tolist() == [*SIDES]
    if not planes:
        np.testing.assert_array_equal(fold_signs(given.values), found.values)
