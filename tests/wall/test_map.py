"""Peaks and maps against shapes and lines that are known."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.presets import cockroach
from feeler.wall import (
    Posture,
    approach,
    compare,
    find_peak,
    make_postures,
    map_distance,
)
from feeler.wall.approach import _compute_smooth_curvature
from feeler.wall.distance import fit_distance


@pytest.fixture
def fine() -> Antenna:
    return Antenna(
        segment_length=np.full(200, 0.2),
        segment_mass=1e-5,
        radius=0.1,
        stiffness=1e-2,
        damping=1e-2,
    )


@pytest.mark.parametrize("centre", [10.03, 20.11, 31.27])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_smooth_peak_is_found_between_hinges(fine, centre, sign):
    bump = (
        sign
        * 0.3
        * np.exp(-0.5 * ((fine.hinge_position - centre) / 2.0) ** 2)
        * fine.segment_length
    )
    smooth, hinge = find_peak(fine, bump), find_peak(fine, bump, method="hinge")
    assert abs(smooth.position[0] - centre) < 0.01
    assert abs(hinge.position[0] - centre) <= 0.1 + 1e-9
    assert np.sign(smooth.curvature[0]) == sign


def test_smoothing_keeps_the_curvature_of_an_arc_up_to_the_ends(fine):
    place = np.linspace(0, fine.length, 50)
    np.testing.assert_allclose(
        _compute_smooth_curvature(fine, 0.07 * fine.segment_length, place)[0], 0.07, rtol=1e-9
    )


def test_peak_counts_bending_per_length_not_per_hinge():
    antenna = Antenna(
        segment_length=[1.0, 0.2, 1.0],
        segment_mass=1e-5,
        radius=0.1,
        stiffness=1e-2,
        damping=1e-2,
    )
    assert find_peak(antenna, [0.1, 0.05, 0.1], method="hinge").position[0] == 1.0


@pytest.mark.parametrize("method", ["hinge", "smooth"])
def test_peak_at_the_base_is_said_and_no_bend_has_no_peak(fine, method):
    angle = np.stack([np.linspace(0.02, 0.0, 200), np.zeros(200)])
    peak = find_peak(fine, angle, method=method)
    assert peak.at_base.tolist() == [True, False]
    assert peak.position[0] == 0.0 and np.isnan(peak.position[1])


def test_r2_and_left_out_error_are_numpys_and_by_hand():
    rng = np.random.default_rng(1)
    position = np.sort(rng.uniform(5, 40, 9))[::-1]
    distance = np.sort(rng.uniform(5, 25, 9))[::-1]
    found = fit_distance(distance, position, np.ones(9, bool), np.zeros(9, bool), 0.1)
    assert np.isclose(found.r2, np.corrcoef(position, distance)[0, 1] ** 2)
    errors = []
    for k in range(9):
        keep = np.arange(9) != k
        errors.append(
            distance[k] - np.polyval(np.polyfit(position[keep], distance[keep], 1), position[k])
        )
    assert np.isclose(found.error, np.sqrt(np.mean(np.square(errors))))


def test_undefined_is_said_never_zero():
    distance = np.linspace(20, 5, 6)
    still = fit_distance(distance, np.full(6, 38.0), np.ones(6, bool), np.zeros(6, bool), 0.1)
    few = fit_distance(distance, distance, np.arange(6) < 2, np.zeros(6, bool), 0.1)
    for found, why in ((still, "stays at one place"), (few, "2 usable distances")):
        assert np.isnan(found.r2) and np.isnan(found.slope) and why in found.undefined
        assert np.isnan(found.predict(10.0))


@pytest.mark.parametrize("way", [1, -1], ids=["to the base", "to the tip"])
def test_told_apart_is_the_longest_run_that_moves_one_way(way):
    distance = np.arange(10.0, 2.0, -1)
    position = 27 + way * np.array([3.0, 3.01, 1.0, -1.0, -3.0, -2.99, -2.0, np.nan])
    found = fit_distance(distance, position, np.isfinite(position), np.zeros(8, bool), 0.1)
    assert found.told_apart == (6.0, 9.0)
    assert not found.monotone


def test_peaks_at_the_base_hinge_are_reported_and_not_fitted():
    found = map_distance(
        approach(cockroach("uniform"), Posture(prebend="none", friction=0.0), (16.0, 12.0, 8.0))
    )
    assert found.at_base.all() and not found.used.any() and found.undefined


def test_a_stiffness_gradient_lays_the_bend_of_a_straight_antenna_where_it_meets_the_wall():
    """Peak and meeting point of the undeflected antenna, distance / sin 30°, move together."""
    sweep = approach(cockroach(), Posture(prebend="none", friction=0.0), np.linspace(15, 6, 6))
    found = map_distance(sweep)
    assert found.monotone and found.r2 > 0.99
    assert abs(found.slope - np.sin(np.radians(30))) < 0.06


def test_no_contact_no_estimate():
    found = map_distance(approach(cockroach(), Posture(), (40.0, 20.0, 15.0, 10.0)))
    assert np.isnan(found.position[0]) and not found.used[0]


def test_sweeps_go_to_the_executor_that_is_given():
    class Counting(ThreadPoolExecutor):
        asked = 0

        def submit(self, *args, **kwargs):
            self.asked += 1
            return super().submit(*args, **kwargs)

    executor = Counting(1)
    options = {
        "distances": (9.0, 8.0),
        "measures": ({"quantity": "bend", "method": "smooth"},),
        "executor": executor,
    }
    compare(
        {"exponential": cockroach()},
        make_postures(({"reading": "midline"}, {"reading": "total"})),
        **options,
    )
    assert executor.asked == 2


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda a: find_peak(a, np.zeros(200), method="best"), "smooth, hinge"),
        (lambda a: find_peak(a, np.zeros(3)), "shape"),
        (lambda a: _compute_smooth_curvature(a, np.zeros(200), np.zeros(2), 0.0), "> 0 mm"),
        (lambda a: compare({}, [Posture()]), "at least one antenna"),
        (
            lambda a: fit_distance(np.ones(3), np.ones(2), np.ones(3), np.ones(3), 0.1),
            "one step",
        ),
    ],
)
def test_bad_input_is_named(fine, call, message):
    with pytest.raises(InvalidInput, match=message):
        call(fine)
