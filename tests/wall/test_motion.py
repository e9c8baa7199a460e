"""A wall in motion, and a body that follows one."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.objects.distance import compute_clearance
from feeler.presets import cockroach
from feeler.wall import (
    DISTANCES,
    FOLLOWING,
    Controller,
    Course,
    Posture,
    calibrate,
    drive,
    follow,
    make_turn,
    slide,
)
from feeler.wall.following import BODY_LOST


@pytest.mark.further
@pytest.mark.parametrize("profile", ["exponential", "linear", "uniform", "matched"])
def test_the_j_slides_and_stays_at_every_distance(profile):
    """The wall passes 18 mm backward: the tip stays behind, pressed to the wall, pointing backward,
    at every sample.
    """
    antenna = cockroach(profile)
    distances = [d for d in DISTANCES if d < Posture().reach(antenna)]
    touch = slide(antenna, Posture(), distances, duration=60.0, timestep=0.05)
    assert len(touch.motions) >= 18
    assert touch.contact.all() and touch.inverted.all()
    wall = 0.3 * 59.0
    moved = touch.points[:, -1, -1, 1] - touch.points[:, 0, -1, 1]
    assert np.all(np.abs(moved) < 0.3 * wall)  # it slides; it is not carried along


def test_a_slow_drive_passes_through_the_equilibria():
    from feeler.wall import approach

    posture = Posture(prebend="none", friction=0.0)
    touch = drive(cockroach(), posture, far=14.0, near=10.0, speed=0.02, timestep=0.1)
    still = approach(cockroach(), posture, [10.0])
    gap = np.abs(touch.points[0, -1] - still.points[0]).max()
    assert gap < 0.6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"far": 5.0, "near": 10.0}, "far to near"),
        ({"near": 0.0}, "far to near"),
        ({"far": 8.0, "near": 8.0}, "far to near"),
        ({"speed": 0.0}, "speed must be"),
    ],
)
def test_a_drive_that_goes_nowhere_is_refused(options, message):
    with pytest.raises(InvalidInput, match=message):
        drive(cockroach(), Posture(), **options)


def test_distance_from_a_course_by_hand():
    towards, away = make_turn(45.0, (100.0, 100.0)), make_turn(-45.0, (100.0, 100.0))
    np.testing.assert_allclose(towards.measure([[-5.0, 50.0], [3.0, 50.0]]), [5.0, -3.0])
    np.testing.assert_allclose(away.measure([[-4.0, 103.0]]), [5.0])  # from the corner itself
    direction = np.array([-np.sin(np.pi / 4), np.cos(np.pi / 4)])
    on_second = (
        np.array([0.0, 100.0]) + 50 * direction + 7 * np.array([-direction[1], direction[0]])
    )
    np.testing.assert_allclose(towards.measure([on_second]), [7.0])


@pytest.mark.parametrize("turns", [(30.0, -45.0), (-60.0, -70.0), (60.0, 70.0), (0.0, 20.0)])
def test_the_wall_that_engines_see_is_the_wall_that_is_measured(turns):
    course = Course(lengths=(80.0, 60.0, 80.0), turns=turns)
    wall = course.make_object()
    points = np.random.default_rng(3).uniform([-60, -50], [30, 200], (200, 2))
    far = course.measure(points)
    inside = np.abs(far) < 4.0  # nearer to the face than to the back of its block
    seen = np.array(
        [
            compute_clearance(
                np.stack([p, p + 1e-9]),
                np.zeros(1),
                wall.feature,
                np.array(wall.place),
                np.array(wall.forward),
            )
            for p in points
        ]
    )
    assert (far > 0).sum() > 50 and (inside & (far < 0)).sum() > 2
    np.testing.assert_allclose(seen[far > 0], far[far > 0], atol=1e-6)
    np.testing.assert_allclose(seen[inside & (far < 0)], 0.0, atol=1e-9)


@pytest.mark.parametrize("turn", [-79.0, -30.0, 5.0, 45.0, 79.0])
def test_behind_a_corner_there_is_no_hole(turn):
    """All around it, as far as 7 mm in: where blocks meet at an angle, they overlap."""
    course = make_turn(turn, (60.0, 60.0))
    wall, ways = course.make_object(), np.radians(np.arange(0.0, 360.0, 7.0))
    around = np.stack([np.cos(ways), np.sin(ways)], axis=1)
    points = course.corners[1] + np.concatenate(
        [deep * around for deep in (0.5, 3.0, 5.5, 7.0)]
    )
    points = points[course.measure(points) < -0.01]
    assert len(points) > 50
    frame = wall.feature, np.array(wall.place), np.array(wall.forward)
    seen = [compute_clearance(np.stack([p, p + 1e-9]), np.zeros(1), *frame) for p in points]
    np.testing.assert_allclose(np.array(seen), 0.0, atol=1e-9)


def test_corners_turn_towards_and_away():
    np.testing.assert_allclose(
        make_turn(90 - 45, (50.0, 50.0)).corners[-1], [-50 / 2**0.5, 50 + 50 / 2**0.5]
    )
    np.testing.assert_allclose(
        make_turn(-30, (50.0, 50.0)).corners[-1], [25.0, 50 + 25 * 3**0.5]
    )


@pytest.fixture(scope="module")
def known():
    return calibrate(cockroach(), FOLLOWING, np.arange(8.0, 17.0, 2.0))


def test_the_running_map_is_nearly_straight(known):
    assert known.r2 > 0.98 and known.monotone


def test_a_straight_wall_is_kept(known):
    run = follow(cockroach(), Course(lengths=(150.0,), turns=()), distance_map=known)
    assert not run.collided and run.error < 1.0


@pytest.mark.parametrize("turn", [30.0, -30.0])
def test_a_turn_is_followed(known, turn):
    run = follow(cockroach(), make_turn(turn), distance_map=known)
    assert not run.collided and run.error < 3.5
    assert abs(np.degrees(run.body[-1, 2]) + turn) < 15.0  # it now runs along the second face


@pytest.mark.parametrize("offset", [-2.0, 2.0])
@pytest.mark.parametrize("damping_ratio", [0.5, 1.0, 2.0])
def test_the_distance_obeys_the_law_that_the_controller_states(offset, damping_ratio):
    """Beside a straight wall e'' + v K_d e' + v K_p e = 0, that is e'' + 2 ζ ω e' + ω² e = 0; no
    overshoot from ζ = 1 on.
    """
    omega = 0.02
    controller = Controller(
        frequency=omega, damping_ratio=damping_ratio, delay=0.0, smoothing=1e-3
    )
    course = Course(lengths=(150.0,), turns=())
    run = follow(cockroach(), course, controller=controller, start=12.0 + offset, oracle=True)
    root = (
        np.sqrt(complex(damping_ratio**2 - 1)) * omega + 1e-9
    )  # of s² + 2 ζ ω s + ω², from their mean
    decay, t = damping_ratio * omega, run.time
    assert t[-1] == pytest.approx(
        (150.0 - 20.0) / 0.45, abs=1.0
    )  # it ends 20 mm before the wall does
    expected = np.real(
        np.exp(-decay * t) * (np.cosh(root * t) + decay / root * np.sinh(root * t))
    )
    error = (run.distance - 12.0) / offset
    np.testing.assert_allclose(error, expected, atol=0.02)
    assert (error.min() < -0.1) == (damping_ratio < 1)


def test_the_controller_waits_filters_and_has_a_limit():
    steer = Controller(delay=3.0, smoothing=5.0, max_turn=0.03).begin(speed=0.45, period=1.0)
    turns = [steer(13.0) for _ in range(60)]
    assert turns[:3] == [0.0] * 3 and turns[3] > 0
    gain = 0.02**2 / 0.45
    assert turns[3] == pytest.approx(
        (gain + 2 * 0.02 / 0.45) / 6
    )  # a low-pass of 5 ms gives a sixth at once
    assert turns[-1] == pytest.approx(gain, rel=1e-2)
    slow = Controller(delay=0.0, smoothing=5.0).begin(speed=0.45, period=2.0)
    assert slow(13.0) == pytest.approx(
        (gain + 2 * 0.02 / 0.45 / 2) * 2 / 7
    )  # the same change in twice the time
    late = Controller(delay=6.0).begin(speed=0.45, period=2.0)
    assert [late(13.0) > 0 for _ in range(5)] == [False] * 3 + [
        True
    ] * 2  # 6 ms are three periods
    wild = Controller(delay=0.0, max_turn=0.03).begin(speed=0.45, period=1.0)
    assert [wild(1e3), wild(-1e3)] == [0.03, -0.03]


@pytest.mark.parametrize(("engine", "timestep"), [("chain", 0.02), ("chain-consistent", 0.1)])
def test_any_engine_can_carry_the_antenna_along_the_wall(known, engine, timestep):
    course = Course(lengths=(60.0,), turns=())
    usual, run = (
        follow(cockroach(), course, distance_map=known, **options)
        for options in ({}, {"engine": engine, "timestep": timestep})
    )
    assert np.isfinite(run.estimate[-20:]).all()
    assert np.abs(run.distance - usual.distance).max() < 0.3


def test_a_body_that_meets_the_wall_has_ended_there():
    blind = Controller(frequency=1e-3)
    run = follow(
        cockroach(),
        make_turn(70.0),
        controller=blind,
        oracle=True,
    )
    assert run.collided and run.distance[-1] <= BODY_LOST
    assert np.all(run.distance[:-1] > BODY_LOST)


def test_steering_by_the_truth_needs_no_map():
    run = follow(cockroach("uniform"), make_turn(-30.0), oracle=True)
    assert run.map is None and not run.collided and run.error < 3.0
    assert np.isnan(run.estimate).all()


@pytest.mark.long
def test_without_a_map_there_is_nothing_to_steer_by():
    with pytest.raises(InvalidInput, match="no map to steer by"):
        follow(cockroach("uniform"), make_turn(30.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Course(lengths=(100.0,), turns=(30.0,)), "one turn fewer"),
        (lambda: Course(lengths=(5.0,), turns=()), "> 10 mm"),
        (lambda: Course(lengths=(50.0, 10.0), turns=(30.0,)), "> 10 mm"),
        (lambda: make_turn(85.0), "> -80 and < 80 degrees"),
        (lambda: make_turn(80.0), "> -80 and < 80 degrees"),
        (lambda: Controller(target=0.0), "target must be > 0 mm"),
        (lambda: Controller(delay=-1.0), "delay must be ≥ 0 ms"),
        (lambda: follow(cockroach(), speed=0.0), "speed must be"),
        (lambda: follow(cockroach(), start=-1.0), "start must be"),
        (lambda: follow(cockroach(), oracle=True, timestep=0.03), "whole timesteps"),
        (lambda: follow(cockroach(), oracle=True, engine="spring"), "unknown engine 'spring'"),
    ],
)
def test_bad_courses_and_controllers_are_named(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()
