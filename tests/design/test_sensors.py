"""Sensors and fronts: planted ones are found, and known motions come to rest when they must."""

import numpy as np
import pytest

import feeler
from feeler.design.scoring import CHOICES, _touch_classes, choose_sensors, measure_sensors
from feeler.errors import InvalidInput
from studies.design import measure
from tests.design.test_design import ANTENNA, TASK


@pytest.fixture(scope="module")
def planted():
    """Six sensors of which the fourth and the second tell the classes, the fourth better."""
    tensors = 0.01 * np.random.default_rng(0).standard_normal((3, 4, 6, 5))
    tensors[:, :, 3] += np.array([-1.0, 0.0, 1.0])[:, None, None]
    tensors[:, :, 1] += np.array([0.3, -0.6, 0.3])[:, None, None]
    return tensors


def test_the_sensors_that_tell_are_chosen_first(planted):
    assert list(CHOICES["d-optimal"](planted, 0.5, 2)) == [3, 1]


def test_sparse_placement_finds_them_too(planted):
    pytest.importorskip("pysensors")
    assert set(CHOICES["sspoc"](planted, 0.5, 2)) == {1, 3}


@pytest.mark.parametrize("choice", ["d-optimal", "even", "random"])
def test_all_sensors_tell_what_the_antenna_tells_and_fewer_less(choice):
    whole = feeler.design.score(ANTENNA, TASK, "test", workers=1)
    one, all_ = measure_sensors(ANTENNA, TASK, [1, 6], choice)
    assert all_ == pytest.approx(whole.bits)
    assert one < all_
    few = ANTENNA.replace(sensors=[2, 5, 6])  # hinges that are not the numbers of their sensors
    assert set(choose_sensors(few, TASK, 2, choice)) <= {2, 5, 6}


def test_sensors_are_chosen_on_other_touches_than_those_they_are_asked_about(monkeypatch):
    seen = []
    monkeypatch.setitem(
        CHOICES._entries, "spy", lambda tensors, _, n: seen.append(tensors) or np.arange(n)
    )
    measure_sensors(ANTENNA, TASK, [2], "spy")
    known = _touch_classes(ANTENNA, TASK, "optimiser", TASK.speeds[0])
    peaks = np.abs(known).max(axis=(2, 3), keepdims=True)
    np.testing.assert_allclose(seen[0], known / peaks)


def test_more_sensors_than_there_are_are_refused():
    with pytest.raises(InvalidInput, match="at most the antenna's 6 sensors"):
        choose_sensors(ANTENNA, TASK, 7)


def test_the_front_holds_what_nothing_beats():
    costs = np.array([[1.0, 5.0], [2.0, 2.0], [3.0, 3.0], [5.0, 1.0], [2.0, 2.5]])
    assert list(measure.find_front(costs)) == [0, 1, 3]


@pytest.mark.parametrize("damping", [0.2, 30.0])
def test_one_hinge_settles_as_the_closed_form_says(damping):
    one = feeler.Antenna(
        segment_length=[10.0],
        segment_mass=1e-3,
        radius=0.2,
        stiffness=0.5,
        damping=damping,
        sensors=[1],
    )
    inertia = 1e-3 * 10.0**2 / 3
    roots = np.roots([inertia, damping, 0.5])
    assert measure.compute_settling(one) == pytest.approx(np.log(20) / np.abs(roots.real).min())
