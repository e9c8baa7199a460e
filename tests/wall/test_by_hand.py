"""What is counted, fitted and laid out, against small cases worked out by hand and closed forms."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom

from feeler.antenna import Antenna
from feeler.presets import cockroach
from feeler.wall import Posture, count_orderings, find_peak, map_distance, slide, summarise
from feeler.wall.approach import Peak, find_parabolic_peak, find_sweep_peak
from feeler.wall.distance import SETUP_CHOICES, Case, _bootstrap_median, fit_distance
from feeler.wall.following import Course, Run, _measure_turns

N, STEP = 80, 0.5
ANTENNA = Antenna(
    segment_length=np.full(N, STEP), segment_mass=1e-5, radius=0.1, stiffness=1e-2, damping=1e-2
)
LENGTH = N * STEP


def fit(distance, position, used=None, resolution=0.1):
    used = np.ones(len(distance), bool) if used is None else used
    return fit_distance(
        np.array(distance), np.array(position), used, np.zeros(len(distance), bool), resolution
    )


def make_case(antenna, r2, friction=0.3, **measure):
    known = replace(fit([3.0, 2.0, 1.0], [3.0, 2.0, 1.0]), r2=r2)
    measure = {"quantity": "bend", "method": "smooth"} | measure
    posture = Posture(friction=friction)
    return Case(
        antenna=antenna,
        posture=posture,
        measure=measure,
        map=known,
        offset=0.0,
    )


def test_the_table_of_set_ups_by_hand():
    cases = [make_case("a", r2) for r2 in (0.2, 0.9, np.nan, 0.4)] + [make_case("b", np.nan)]
    table = summarise(cases, np.random.default_rng(0))
    assert list(table) == ["a", "b"]
    assert {
        k: table["a"][k] for k in ("set_ups", "undefined", "median", "least", "greatest")
    } == {
        "set_ups": 4,
        "undefined": 1,
        "median": 0.4,
        "least": 0.2,
        "greatest": 0.9,
    }
    assert 0.2 <= table["a"]["low"] <= 0.4 <= table["a"]["high"] <= 0.9
    assert table["b"]["set_ups"] == table["b"]["undefined"] == 1
    assert all(np.isnan(table["b"][k]) for k in ("median", "low", "high", "least", "greatest"))


def test_orders_are_counted_by_every_choice():
    """Strictly falling is in order; equal values are not; one missing value leaves it open."""
    orders = [
        ((0.9, 0.5, 0.1), 0.0),
        ((0.9, 0.5, 0.5), 0.3),
        ((0.9, np.nan, 0.1), 0.3),
        ((0.1, 0.5, 0.9), 1.0),
    ]
    names = ("exponential", "linear", "uniform")
    cases = [
        make_case(name, r2, f)
        for values, f in orders
        for name, r2 in zip(names, values, strict=True)
    ]
    cases += [
        make_case(name, r2, 0.3, method="hinge")
        for name, r2 in zip(names, (0.9, 0.5, 0.1), strict=True)
    ]
    table = count_orderings(cases[:6] + cases[9:])
    assert table["all", ""] == {"yes": 2, "no": 2, "undefined": 0}
    assert table["friction", 0.0] == {"yes": 1, "no": 0, "undefined": 0}
    assert table["friction", 0.3] == {"yes": 1, "no": 1, "undefined": 0}
    assert table["friction", 1.0] == {"yes": 0, "no": 1, "undefined": 0}
    assert table["method", "hinge"] == {"yes": 1, "no": 0, "undefined": 0}
    assert {key for key, _ in table} == {"all", *SETUP_CHOICES}
    assert count_orderings(cases[6:9])["all", ""] == {"yes": 0, "no": 0, "undefined": 1}
    assert count_orderings(cases[:2], names)["all", ""] == {"yes": 0, "no": 0, "undefined": 1}
    assert count_orderings(cases[9:12], names[::-1])["all", ""] == {
        "yes": 1,
        "no": 0,
        "undefined": 0,
    }


@pytest.mark.parametrize("level", [0.95, 0.5])
def test_the_interval_of_a_median_is_that_of_its_exact_bootstrap(level):
    """Of n values (n odd) the resampled median is at most the k-th with P(B ≥ (n + 1) / 2), B ~
    binomial(n, k / n).
    """
    n = 101
    values = np.sort(np.random.default_rng(5).normal(2.0, 0.3, n))
    share = binom.sf((n + 1) / 2 - 1, n, np.arange(1, n + 1) / n)
    expected = [np.searchsorted(share, (1 + sign * level) / 2) for sign in (-1, 1)]
    median, low, high = _bootstrap_median(
        values, np.random.default_rng(1), n_resamples=20_000, level=level
    )
    assert median == np.median(values)
    for found, k in zip((low, high), expected, strict=True):
        assert values[k - 1] <= found <= values[k + 1]


@pytest.mark.parametrize("top", [3.0, 3.2, 2.6, 0.6, 5.1])
def test_the_top_of_a_parabola_is_found_exactly_and_at_the_ends_the_sample(top):
    place = np.arange(0.0, 6.0, 0.5)
    rows = np.stack([4.0 - (place - top) ** 2, 4.0 - place, place + 1.0, np.ones(12)])
    np.testing.assert_allclose(find_parabolic_peak(rows, place), [top, 0.0, 5.5, 0.0])


def test_a_peak_has_the_curvature_of_its_place_with_its_sign():
    angle = np.zeros((3, N))
    angle[0, 30], angle[1, 0], angle[2, 9] = -0.2, 0.1, 0.9e-6 * STEP
    peak = find_peak(ANTENNA, angle, method="hinge")
    np.testing.assert_allclose(peak.position, [15.0, 0.0, np.nan])
    np.testing.assert_allclose(peak.curvature, [-0.4, 0.2, np.nan])
    assert peak.at_base.tolist() == [False, True, False]


def test_peaks_of_a_sweep_are_those_in_contact_of_what_was_asked_for():
    angle, bend = np.zeros((3, N)), np.zeros((3, N))
    angle[:, 10], bend[:, 20], bend[[0, 2], 0] = 0.1, 0.1, 0.5
    sweep = SimpleNamespace(
        antenna=ANTENNA, angle=angle, bend=bend, contact=np.array([False, True, True])
    )
    found = find_sweep_peak.__wrapped__(sweep, method="hinge")
    np.testing.assert_allclose(found.position, [np.nan, 10.0, 0.0])
    np.testing.assert_allclose(found.curvature, [np.nan, 0.2, 1.0])
    assert found.at_base.tolist() == [False, False, True]
    np.testing.assert_allclose(
        find_sweep_peak.__wrapped__(sweep, quantity="total", method="hinge").position[1:], 5.0
    )


@pytest.mark.parametrize(("prebend", "expected"), [("rest", [0, 2, 3]), ("none", [0, 1, 2, 3])])
def test_a_map_is_fitted_where_the_posture_stands_in_balance_with_its_peak_off_the_base(
    prebend, expected
):
    sweep = SimpleNamespace(
        antenna=ANTENNA,
        posture=Posture(prebend=prebend),
        distance=np.arange(20.0, 14.0, -1.0),
        contact=np.ones(6, bool),
        inverted=np.array([1, 0, 1, 1, 1, 1], bool),
        balanced=np.array([1, 1, 1, 1, 0, 1], bool),
    )
    at_base = np.array([0, 0, 0, 0, 0, 1], bool)
    peak = Peak(position=2 * sweep.distance - 3, curvature=np.ones(6), at_base=at_base)
    found = map_distance.__wrapped__(sweep, peak=peak)
    assert np.flatnonzero(found.used).tolist() == expected
    assert found.at_base.tolist() == at_base.tolist()
    assert (found.slope, found.intercept) == (pytest.approx(0.5), pytest.approx(1.5))
    np.testing.assert_allclose(found.residual[found.used], 0, atol=1e-12)
    assert np.isnan(found.residual[~found.used]).all()


def test_tracking_errors_by_hand():
    fields = dict.fromkeys(("time", "body"), np.zeros(4)) | {
        "target": 10.0,
        "collided": False,
        "map": None,
    }
    run = Run(
        distance=np.array([10.0, 13.0, 6.0, 10.0]),
        estimate=np.array([np.nan, 12.0, 6.0, 12.0]),
        **fields,
    )
    assert run.error == pytest.approx(np.sqrt(25 / 4))
    assert run.estimate_error == pytest.approx(np.sqrt(5 / 3))
    assert run.nearest == 6.0
    assert np.isnan(replace(run, estimate=np.full(4, np.nan)).estimate_error)


@pytest.mark.parametrize(("share", "tip"), [(0.25, 180.0), (0.5, 150.0), (1.0, 120.0)])
def test_a_slack_hook_is_an_arc_that_takes_its_share_and_ends_at_its_heading(share, tip):
    posture = Posture(hook_share=share, tip_heading=tip)
    bent = posture.bend(ANTENNA)
    first = round((1 - share) * N)
    np.testing.assert_allclose(bent.rest_angle[:first], 0.0)
    np.testing.assert_allclose(bent.rest_angle[first:], np.radians(tip - 30) / (N - first))
    assert posture.base_angle + bent.rest_angle.sum() == pytest.approx(np.radians(tip))


@pytest.mark.parametrize(("reading", "degrees"), [("midline", 40.0), ("total", 20.0)])
def test_reach_is_that_of_the_farthest_point_with_its_radius(reading, degrees):
    posture = Posture(inter_antennal_angle=40.0, reading=reading, prebend="none")
    a = np.radians(degrees)
    assert posture.reach(ANTENNA) == pytest.approx(LENGTH * np.sin(a) + 0.1)
    slack = posture.replace(prebend="rest", hook_share=0.25, tip_heading=180.0)
    radius = (
        0.25 * LENGTH / (np.pi - a)
    )  # a straight part, then an arc from heading a to π, where it runs along the wall
    arc = 0.75 * LENGTH * np.sin(a) + radius * (1 + np.cos(a))
    assert slack.reach(ANTENNA) == pytest.approx(arc + 0.1, abs=0.25)  # of half a segment


def test_a_thin_tip_reaches_as_far_as_it_is_thin():
    posture, thin = Posture(prebend="none"), ANTENNA.replace(radius=np.linspace(0.5, 0.1, N))
    points = ANTENNA.shape(base_angle=posture.base_angle)[:, 0]
    assert posture.reach(thin) == pytest.approx(points[-1] + 0.1)
    blunt = ANTENNA.replace(radius=np.where(np.arange(N) == N // 2, 12.0, 0.1))
    assert posture.reach(blunt) == pytest.approx(
        points[N // 2 + 1] + 12.0
    )  # where the thick segment ends


def test_a_fold_lies_straight_to_the_wall_bends_by_its_radius_and_comes_straight_back():
    posture = Posture(prebend="placed", fold_radius=2.0)
    heading = posture.lay(ANTENNA, 12.0)
    assert heading[0] == pytest.approx(np.radians(30)) and heading[-1] == pytest.approx(np.pi)
    assert np.diff(heading).max() == pytest.approx(STEP / 2.0) and np.diff(heading).min() >= 0
    x = np.cumsum(STEP * np.sin(heading))
    assert x.max() == pytest.approx(12.0 - 0.1, abs=0.05)
    assert x[-1] == pytest.approx(x.max(), abs=1e-9)


def test_turns_are_measured_to_the_left_in_degrees():
    heading = np.radians([90.0, 120.0, 60.0, 60.0, 139.0])  # anticlockwise from +x
    along = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    np.testing.assert_allclose(_measure_turns(along), [30.0, -60.0, 0.0, 79.0], atol=1e-9)


@pytest.mark.parametrize(
    ("turns", "n_blocks"),
    [
        ((-0.5,), 1),
        ((-30.0, -40.0), 1),
        ((0.5,), 2),
        ((30.0, -40.0), 2),
        ((-70.0, -70.0), 1),
        ((-76.0, -76.0), 2),
        ((-40.0, 30.0, -40.0), 2),
    ],
)
def test_a_wall_is_one_block_where_it_only_turns_away_and_by_less_than_150_degrees(
    turns, n_blocks
):
    course = Course(lengths=(50.0,) * (len(turns) + 1), turns=turns)
    assert len(course.make_object().feature.parts) == n_blocks


@pytest.mark.parametrize(
    ("posture", "angle"), [(Posture(), 30.0), (Posture(reading="total", side="left"), 15.0)]
)
def test_tensors_of_a_wall_carry_the_numbers_of_its_set_up(posture, angle):
    antenna = cockroach()
    touch = slide(antenna, posture, (9.0, 8.0), speed=0.4, duration=4.0, timestep=0.1)
    data, total = touch.make_dataset(), touch.make_dataset(relative=False)
    np.testing.assert_allclose(
        data["location"], np.array([9.0, 8.0]) / np.sin(np.radians(angle)) / antenna.length
    )
    assert data["speed"].values.tolist() == [0.4, 0.4] and np.isinf(data["size"]).all()
    assert data["distance"].attrs["units"] == "mm" and data["distance"].values.tolist() == [
        9.0,
        8.0,
    ]
    for k, motion in enumerate(touch.motions):
        sensed = motion.angle[:, antenna.sensors - 1].T
        np.testing.assert_allclose(total["angle"][k], sensed)
        np.testing.assert_allclose(
            data["angle"][k], sensed - touch.antenna.rest_angle[antenna.sensors - 1][:, None]
        )
        np.testing.assert_allclose(data["tip"][k], touch.points[k, :, -1])


def test_what_a_sliding_wall_bends_most_is_beyond_the_slack_shape():
    """A hooked antenna, pressed a little elsewhere: the dot is where it was pressed."""
    from feeler.plotting.walls import _show_drive

    hook, pressed = np.zeros(N), np.zeros(N)
    hook[60:66], pressed[18:24] = 0.3, 0.05
    antenna = ANTENNA.replace(rest_angle=hook)
    touch = SimpleNamespace(
        antenna=antenna,
        posture=Posture(),
        motions=[SimpleNamespace(angle=np.stack([hook, hook + pressed]))],
        contact=np.array([[False, True]]),
        inverted=np.array([[False, True]]),
        distance=np.array([[12.0, 11.0]]),
        points=np.stack([antenna.shape(hook), antenna.shape(hook + pressed)])[None],
    )
    peak = _show_drive(touch)["peak"][1]
    np.testing.assert_allclose(peak, antenna.hinge_position[21], atol=2 * STEP)
