"""Quantities are one open set: units that others can read, and a new one from outside goes all the
way.
"""

from types import SimpleNamespace

import numpy as np
import pint
import pytest

import feeler
from feeler.analysis import compute_dispersion
from feeler.errors import InvalidInput
from feeler.tensors import QUANTITIES, Quantity, find_errors, make_tensors
from feeler.tensors.formats import load
from feeler.tensors.schema import _find_contact
from tensors._touches import antenna, options, trials


@pytest.mark.parametrize("name", list(QUANTITIES))
def test_units_are_read_by_pint_and_dims_begin_with_the_trial(name):
    quantity = QUANTITIES[name]
    pint.Unit(quantity.unit or "1")
    assert quantity.coordinate or quantity.dims[0] == "trial"


@pytest.fixture
def labour():
    """A quantity of somebody else: twice the first hinge's angle, in words of their own."""
    quantity = Quantity(
        unit="mJ",
        meaning="a made-up work",
        dims=("trial", "time"),
        make=lambda antenna, motion: 2 * motion.angle[:, 0],
    )
    QUANTITIES.register("labour", quantity)
    yield
    QUANTITIES.unregister("labour")


def test_a_quantity_from_outside_goes_from_touch_to_store_to_dispersion(labour, tmp_path):
    tensors = feeler.touch(antenna, trials[:3], store=tmp_path / "set.zarr", **options)
    for dataset in (tensors, load(tmp_path / "set.zarr")):
        assert find_errors(dataset) == []
        assert (
            dataset.labour.attrs["units"] == "mJ"
            and "made-up" in dataset.labour.attrs["long_name"]
        )
        np.testing.assert_array_equal(dataset.labour, 2 * dataset.angle.isel(sensor=0))
    found = compute_dispersion(
        load(tmp_path / "set.zarr").labour.values[:, None], indices=("mse",)
    )
    assert found.values("mse", found.groups[0]).min() > 0


def test_every_parameter_of_a_trial_is_a_coordinate():
    trial = feeler.Trial(
        feature=feeler.Box(half_width=1.0, half_height=1.0, name="crumb"),
        location=0.7,
        speed=0.3,
        approach=80.0,
        side="right",
        lead=7.0,
        friction=0.4,
    )
    tensors = feeler.touch(antenna, trial, **options)
    expected = {
        "kind": "box",
        "feature": "crumb",
        "size": 1.0,
        "location": 0.7,
        "speed": 0.3,
        "approach": 80.0,
    }
    expected |= {"side": "right", "lead": 7.0, "friction": 0.4}
    assert {name: tensors[name].item() for name in expected} == expected


def _sensors(n):
    labels = {
        "feature": ["x"],
        "size": [1.0],
        "location": [0.5],
        "speed": [1.0],
        "antenna": ["a"],
        "seed": [0],
    }
    return {
        "time": np.arange(4.0),
        "segment": np.arange(1, n + 1),
        "position": np.linspace(0, 0.9, n),
        "segment_length": np.full(n, 0.5),
        "trials": labels | {"source": ["robot"]},
    }


def test_curvature_follows_from_angle_in_the_type_asked_for():
    tensors = make_tensors(angle=np.ones((1, 3, 4)), dtype="float32", **_sensors(3))
    assert tensors.curvature.dtype == np.float32
    np.testing.assert_array_equal(tensors.curvature, 2.0)


@pytest.mark.parametrize("planes", [(), (2,), (3,)], ids=["planar", "bends", "twists"])
def test_every_sensor_has_its_number_from_the_base_and_all_that_was_given_of_it(planes):
    """Numbers of sensors, as those of hinges, begin with 1; those of trials with 0."""
    given = _sensors(3) | {"segment": [2, 5, 9], "segment_length": np.array([0.5, 0.4, 0.25])}
    angle = np.random.default_rng(0).normal(size=(1, *planes, 3, 4))
    tensors = make_tensors(angle=angle, **given)
    numbers = {"sensor": [1, 2, 3], "segment": [2, 5, 9], "trial": [0], "time": [0, 1, 2, 3]}
    for name, values in numbers.items():
        assert tensors[name].values.tolist() == values
    for name in ("position", "segment_length"):
        np.testing.assert_array_equal(tensors[name], given[name])
    np.testing.assert_array_equal(tensors["angle"], angle)
    np.testing.assert_allclose(tensors["curvature"], angle / given["segment_length"][:, None])
    assert list(tensors.coords.get("plane", [])) == ["x", "z", "twist"][: sum(planes)]
    for name in numbers.keys() - {"segment", "trial", "sensor"}:
        assert tensors[name].attrs["units"] == QUANTITIES[name].unit


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"strain": 1}, "unknown quantity 'strain'"),
        ({"angle": None}, "need angle="),
        ({"trials": {}}, "trials lacks"),
    ],
)
def test_what_is_missing_or_unknown_is_named(change, words):
    arguments = {"angle": np.ones((1, 3, 4)), **_sensors(3), **change}
    with pytest.raises(InvalidInput, match=words):
        make_tensors(**arguments)


def test_only_quantities_with_gaps_may_be_nan():
    angle, place = np.ones((1, 3, 4)), np.full((1, 4), np.nan)
    assert find_errors(make_tensors(angle=angle, contact_place=place, **_sensors(3))) == []
    broken = make_tensors(angle=angle, base_moment=place, **_sensors(3))
    assert find_errors(broken) == ["'base_moment' has values that are not finite numbers"]


def test_a_contact_lies_at_its_arc_length_whatever_its_segment_s_length():
    """On a straight antenna of unequal segments the arc is the height."""
    cockroach, place = feeler.presets.cockroach(), np.array([0.0, 0.31, 0.8, np.nan])
    motion = SimpleNamespace(contact_place=place, angle=np.zeros((4, cockroach.n_segments)))
    points = _find_contact(cockroach, motion)
    np.testing.assert_allclose(points[:, 1], place * cockroach.length, atol=1e-9)
    np.testing.assert_allclose(points[:3, 0], 0.0, atol=1e-9)
