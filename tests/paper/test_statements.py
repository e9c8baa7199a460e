"""What the report says beside Fig. 5 and of Fig. 1's axes, on planted tensors of known answers."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from feeler.decoding.sweeps import Plan
from feeler.presets import cockroach
from feeler.tensors.schema import label_units
from paper import fig1, fig5_data, fig5_sparse
from paper.data import WINDOWS

PLAN = Plan(ratios=(0.2,), n_repeats=3, n_copies=4)
ASKED = {
    "every_sensor": [4, 1],
    "rate": [10.0, 1000.0],
    "threshold": 0.01,
    "share": 0.1,
    "draws": 50,
}


def make_touches(angle, contact=(10, 60)):
    """Touches of three objects at as many places as it takes, in contact from 10 to 60 ms."""
    n, _, n_times = angle.shape
    force = np.zeros((n, n_times, 2))
    force[:, contact[0] : contact[1], 0] = 1.0
    data = xr.Dataset(
        {
            "angle": (("trial", "sensor", "time"), angle),
            "curvature": (("trial", "sensor", "time"), angle),
            "force": (("trial", "time", "axis"), force),
        },
        coords={
            "time": np.arange(float(n_times)),
            "feature": ("trial", np.array(["ball", "box", "triangle"])[np.arange(n) % 3]),
            "size": ("trial", np.full(n, 1.5)),
            "location": ("trial", 0.5 + 0.1 * (np.arange(n) // 3)),
        },
    )
    return label_units(data)


def make_telling(shape):
    """A tensor per touch that says its place by which sensor bends, and its object by when the last
    one does.
    """
    angle = np.zeros(shape)
    for trial in range(shape[0]):
        angle[trial, 3 * (trial // 3), 10:60] = 1.0
        angle[trial, -1, 10 + 15 * (trial % 3) : 20 + 15 * (trial % 3)] = 1.0
    return angle


def test_sparseness_of_one_sensor_at_one_moment_is_1_and_of_all_alike_0():
    angle = np.zeros((2, 4, 100))
    angle[0, 2, 30] = 1.0
    angle[1, :, 10:60] = 1.0
    found = fig5_sparse.measure(make_touches(angle))
    assert [*found] == list(fig5_sparse.SPANS)
    np.testing.assert_allclose(found["380 ms window"][0], 1.0)
    np.testing.assert_allclose(found["within each touch"], [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found["while it moves"][1], 0.0, atol=1e-12)
    assert (
        found["380 ms window"][1] > found["complete touches"][1] > 0.0
    )  # zeros before, and after


def test_an_untouched_antenna_has_no_sparseness_and_is_not_averaged():
    angle = np.zeros((2, 4, 100))
    angle[0, 2, 30] = 1.0
    found = fig5_sparse.measure(make_touches(angle))["380 ms window"]
    assert np.isnan(found[1])
    values = fig5_sparse._list_values("w", {"slow": found, "fast": found[:1]})
    assert values["sparsity.w.slow"] == {"value": 1.0, "n": 1}


def test_the_rival_of_the_exponential_profile_is_the_sparser_of_the_two_others():
    groups = {"exponential": [0.5, 0.5], "linear": [0.2, 0.4], "uniform": [0.4, 0.4]}
    values = fig5_sparse._list_values("w", {name: np.array(v) for name, v in groups.items()})
    assert values["sparsity.w.rival"] == values["sparsity.w.uniform"]


def test_bending_is_placed_at_the_sensor_that_bends_most_over_the_touch():
    antenna, angle = cockroach(), np.zeros((2, 56, 100))
    angle[0, 0, 10:60], angle[0, 50, 30] = (
        1.0,
        5.0,
    )  # long at the base, short and strong distally
    angle[1, 50, 10:60] = 1.0
    angle[1, 3, 10:60] = -9.0  # the other way: no bending
    found = fig5_sparse.measure_bending(make_touches(angle), antenna)["complete touches"]
    place = antenna.hinge_position[antenna.sensors[[0, 50]] - 1] / antenna.length
    np.testing.assert_allclose(found.top, place)
    np.testing.assert_allclose(found.share.sum(axis=1), 1.0)


def test_touches_that_bend_one_sensor_each_share_bending_over_all_touches_only():
    one_each, even = np.eye(8), np.full((8, 8), 1 / 8)
    found = fig5_sparse.measure_recruitment(one_each)
    assert found["in a touch"].estimate == pytest.approx(1.0)
    assert found["over all touches"].estimate == pytest.approx(0.0, abs=1e-12)
    for mean in fig5_sparse.measure_recruitment(even).values():
        np.testing.assert_allclose([mean.estimate, mean.low, mean.high], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("n", "step", "chosen"), [(8, 1, [*range(8)]), (8, 3, [1, 4, 7]), (3, 5, [1]), (1, 4, [0])]
)
def test_sensors_and_samples_are_left_out_evenly(n, step, chosen):
    assert [*range(n)[fig1._choose(n, step)]] == chosen


def test_fewer_sensors_lose_the_place_and_fewer_samples_the_object():
    found = fig1.compute_reading(make_touches(make_telling((12, 12, 100))), ASKED, PLAN)
    assert found.place[1]["value"] == 1.0 and found.place[1]["n"] == 12
    assert found.place[4]["value"] < 1.0
    assert found.thing[1000.0]["value"] == 1.0 > found.thing[10.0]["value"]
    assert found.chance == {"place": 0.25, "thing": pytest.approx(1 / 3)}


@pytest.mark.parametrize("planted", ["white", "one tensor repeated"])
def test_of_nothing_neither_place_nor_object_is_read(planted):
    rng = np.random.default_rng(3)
    angle = rng.random((12, 12, 100))
    if planted != "white":
        angle[:] = angle[0]
    found = fig1.compute_reading(make_touches(angle), ASKED, PLAN)
    for value in (*found.place.values(), *found.thing.values()):
        assert value["value"] < 0.5


def test_active_sensors_are_counted_above_each_threshold():
    angle = np.zeros((6, 10, 100))
    angle[:, :2, 20], angle[:, 2:5, 30], angle[:, 5:, 40] = 1.0, 0.05, -1.0
    angle[:3, 9, 50] = 0.02
    angle[:, 0] *= np.arange(1.0, 7.0)[:, None]  # so that an ideal observer discriminates them
    active = fig1.compute_activity(make_touches(angle), ASKED).active
    assert active["threshold 0.01 rad"].mean() == pytest.approx((3 * 6 + 3 * 5) / 6)
    assert active["threshold a tenth of the peak"].mean() == pytest.approx(2.0)


def test_a_stiffer_antenna_is_damped_in_proportion():
    antenna, stiffer = cockroach(), fig1.scale_stiffness(cockroach(), 4.0)
    np.testing.assert_allclose(stiffer.stiffness, 4 * antenna.stiffness)
    np.testing.assert_allclose(
        stiffer.damping / stiffer.stiffness, antenna.damping / antenna.stiffness
    )


def test_identical_tensors_are_told_apart_by_chance():
    angle = make_telling((12, 12, 100))
    labels = np.array([f"{k:02d}" for k in range(12)])
    sweeps, null = fig5_data.sweep_speeds({"slow": (angle, labels)}, replace(PLAN, n_copies=10))
    assert sweeps["slow"].noisy.mean() > 0.5 and null.noisy.mean() < 0.25


def test_both_windows_have_a_reading_of_every_claim_on_profiles():
    assert tuple(f"tensors, {window}" for window in WINDOWS) == fig5_data.TENSORS
