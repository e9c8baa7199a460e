"""The one door: every breach of the data contract is found, and nothing else is one."""

from types import SimpleNamespace

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.tensors import find_errors, rectify, scale_common, validate
from feeler.tensors.schema import QUANTITIES, Quantity

from ._sets import make_set

REQUIRED = [
    name for name, quantity in QUANTITIES.items() if quantity.coordinate and quantity.required
]


def change(name, values):
    return lambda tensors: tensors.assign_coords({name: (tensors[name].dims, values)})


def poke(name, value):
    def spoil(tensors):
        tensors = tensors.copy(deep=True)
        tensors[name].values.flat[-1] = value
        return tensors

    return spoil


def name_unit(name, unit):
    def spoil(tensors):
        tensors = tensors.copy(deep=True)
        tensors[name].attrs["units"] = unit
        return tensors

    return spoil


def test_a_whole_set_passes_and_comes_back_itself():
    tensors = make_set()
    assert find_errors(tensors) == []
    assert validate(tensors) is tensors


BREACHES = [
    (change("time", [0.0, *range(39)]), "'time' must rise strictly"),
    (change("time", [*range(39), 37.0]), "'time' must rise strictly"),
    (
        change("position", [0.0, 0.25, 0.25, 0.75, 1.0]),
        "sensors must run from base to tip: 'position' must rise strictly",
    ),
    (
        change("position", [1.0, 0.75, 0.5, 0.25, 0.0]),
        "sensors must run from base to tip: 'position' must rise strictly",
    ),
    (poke("angle", np.nan), "'angle' has values that are not finite numbers"),
    (poke("curvature", -np.inf), "'curvature' has values that are not finite numbers"),
    (poke("tip", np.nan), "'tip' has values that are not finite numbers"),
    (change("time", [*range(39), np.inf]), "'time' has values that are not finite numbers"),
    (
        lambda t: t.assign(angle=t.angle.astype(complex)),
        "'angle' has values that are not finite numbers",
    ),
    (change("size", ["1"] * 8), "'size' has values that are not finite numbers"),
    (name_unit("angle", "deg"), "'angle' must be in rad, says 'deg'"),
    (name_unit("time", "s"), "'time' must be in ms, says 's'"),
    (
        change("source", ["simulation"] * 7 + ["dream"]),
        "'source' must be one of simulation, robot, surrogate, got ['dream']",
    ),
    (
        lambda t: t.transpose("sensor", "trial", ...),
        "'angle' must have dims ('trial', 'sensor', 'time'), got ('sensor', 'trial', 'time')",
    ),
    (lambda t: t.isel(axis=[0, 1, 1]).drop_vars("axis"), "'tip' must have 2 axes, got 3"),
    (lambda t: t.isel(axis=[0]).drop_vars("axis"), "'tip' must have 2 axes, got 1"),
    (
        lambda t: t.drop_vars("angle"),
        "variable 'angle' ('trial', 'sensor', 'time') is missing; found ['curvature', 'tip']",
    ),
]


@pytest.mark.parametrize(
    ("spoil", "words"), BREACHES, ids=[words[:40] for _, words in BREACHES]
)
def test_each_breach_is_named(spoil, words):
    tensors = spoil(make_set())
    assert words in find_errors(tensors)
    with pytest.raises(InvalidInput, match="not a valid set of tactile tensors:\n  - "):
        validate(tensors)


@pytest.mark.parametrize("name", REQUIRED)
def test_a_missing_coordinate_is_named_but_not_of_a_part(name):
    tensors = make_set().drop_vars(name)
    assert find_errors(tensors) == [
        f"coordinate '{name}' along {QUANTITIES[name].dims[0]} is missing"
    ]
    assert find_errors(tensors, whole=False) == []
    assert find_errors(tensors.drop_vars("angle"), whole=False) == []


@pytest.mark.parametrize("source", ["simulation", "robot", "surrogate"])
def test_labels_may_be_unknown_and_sources_are_three(source):
    tensors = change("source", [source] * 8)(make_set())
    assert find_errors(change("speed", np.full(8, np.nan))(tensors)) == []


def test_what_each_dataset_must_have_and_what_is_recorded_only_when_asked_for():
    assert {*REQUIRED} == {
        *("time", "position", "segment"),
        *("feature", "size", "location", "speed", "antenna", "source", "seed"),
    }
    optional = {name for name, quantity in QUANTITIES.items() if quantity.optional}
    assert optional == {"contact_point", "velocity", "base_pose", "work", "timestep", "error"}
    assert {name for name, quantity in QUANTITIES.items() if quantity.required} == {
        *REQUIRED,
        "angle",
    }
    assert not Quantity(dims=("trial",)).required and not Quantity(dims=("trial",)).optional


def test_angles_and_velocities_are_those_of_the_hinges_that_carry_sensors():
    antenna = SimpleNamespace(sensors=np.array([1, 3, 4]))
    motion = SimpleNamespace(
        angle=np.arange(8.0).reshape(2, 4), velocity=10 * np.arange(8.0).reshape(2, 4)
    )
    for name, factor in (("angle", 1), ("velocity", 10)):
        np.testing.assert_array_equal(
            QUANTITIES[name].make(antenna, motion), factor * np.array([[0, 4], [2, 6], [3, 7]])
        )


def test_several_breaches_are_told_together():
    tensors = poke("tip", np.nan)(change("time", np.zeros(40))(make_set()))
    assert len(find_errors(tensors)) == 2


def test_a_set_larger_than_a_block_is_looked_at_to_its_end(monkeypatch):
    monkeypatch.setattr("feeler.tensors.schema.BLOCK", 2 * 5 * 40 * 8)
    assert find_errors(make_set()) == []
    for trial in range(8):
        tensors = make_set()
        tensors.angle.values[trial, 2, 3] = np.inf
        assert find_errors(tensors) == ["'angle' has values that are not finite numbers"]


def test_rectified_is_the_greater_of_the_value_and_zero():
    values = np.array([[-1.0, 0.0, 2.0], [0.5, -0.5, 1e-9]])
    np.testing.assert_array_equal(rectify(values), [[0.0, 0.0, 2.0], [0.5, 0.0, 1e-9]])
    np.testing.assert_array_equal(rectify(make_set().angle), np.maximum(make_set().angle, 0.0))


@pytest.mark.parametrize(
    "values", [[[1.0, -4.0], [2.0, 0.0]], [[1.0, 4.0], [2.0, 0.0]], [[-1.0, -4.0], [-2.0, 0.0]]]
)
def test_one_factor_brings_the_greatest_magnitude_to_one(values):
    np.testing.assert_array_equal(scale_common(np.array(values)), np.array(values) / 4.0)


@pytest.mark.parametrize(
    "values", [np.zeros((2, 2)), np.array([1.0, np.nan]), np.array([1.0, np.inf])]
)
def test_what_has_no_greatest_magnitude_cannot_be_scaled(values):
    with pytest.raises(InvalidInput, match="cannot scale tensors whose greatest magnitude is"):
        scale_common(values)
