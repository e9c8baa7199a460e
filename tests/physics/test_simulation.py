"""The simulation in the hand: it is the touch, it obeys, it goes back, and it refuses what cannot
be.
"""

from concurrent.futures import ThreadPoolExecutor
from threading import Timer, active_count

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput, SimulationDivergedError
from feeler.physics.simulation import build_scene

from .scenes import make_stub, shake


def make_ball(**fields: object) -> feeler.Object:
    return feeler.Object(
        feature=feeler.Ball(radius=1.0),
        **({"place": (-1.5, 5.0), "velocity": (0.3, 0.0)} | fields),
    )


@pytest.mark.parametrize("engine", ["chain-consistent", "mujoco"])
def test_stepping_is_the_touch_to_the_last_bit(engine):
    antenna = make_stub(20)
    trial = feeler.Trial(feature=feeler.Ball(radius=1.0), location=0.6, speed=0.3, lead=1.0)
    touched = feeler.touch(
        antenna,
        trial,
        duration=8,
        all_hinges=True,
        engine=engine,
        save=("velocity", "base_moment"),
    )
    simulation = feeler.Simulation(antenna, trial, engine=engine)
    assert abs(touched["angle"].values).max() > 1e-3
    for k in range(1, 8):
        simulation.step(1.0)
        assert simulation.time == pytest.approx(k)
        assert np.array_equal(simulation.angle, touched["angle"].values[0, :, k])
        assert np.array_equal(simulation.velocity, touched["velocity"].values[0, :, k])
        assert simulation.base_moment == touched["base_moment"].values[0, k]


@pytest.mark.parametrize("engine", ["chain-consistent", "mujoco"])
def test_an_object_goes_where_it_is_told(engine):
    simulation = feeler.Simulation(make_stub(), make_ball(velocity=(0.0, 0.0)), engine=engine)
    simulation.move_object("ball", velocity=(-0.2, 0.1), turn=0.05)
    simulation.step(4.0)
    np.testing.assert_allclose(simulation.place[0], [-1.5 - 0.8, 5.0 + 0.4], atol=1e-12)
    np.testing.assert_allclose(simulation.forward[0], [np.cos(0.2), -np.sin(0.2)], atol=1e-12)


@pytest.mark.parametrize("engine", ["chain-consistent", "mujoco"])
def test_a_base_goes_where_it_is_told_and_the_antenna_comes_along(engine):
    simulation = feeler.Simulation(make_stub(), engine=engine)
    simulation.move_base(velocity=(0.05, -0.02), turn=0.01)
    simulation.step(10.0)
    np.testing.assert_allclose(simulation.base, [0.5, -0.2, 0.1], atol=1e-12)
    np.testing.assert_allclose(simulation.shape()[0], [0.5, -0.2], atol=1e-12)
    assert simulation.angle.any()  # it lags behind
    assert simulation.work.base > 0


def test_lanes_are_steered_and_reset_by_themselves():
    scenes = [
        build_scene(make_stub(), make_ball(place=(-1.4 - 0.05 * k, 3.0))) for k in range(11)
    ]
    lanes = feeler.Simulations(scenes)
    alone = feeler.Simulation(make_stub(), make_ball(place=(-1.4, 3.0)))
    lanes.move_base(3, turn=0.02)
    lanes.step(3.0)
    lanes.reset(5, scenes[0])
    lanes.step(2.0)
    alone.step(2.0)
    assert np.array_equal(lanes.state.angle[5], alone.angle)
    alone.step(3.0)
    assert np.array_equal(lanes.state.angle[0], alone.angle)
    assert lanes.time.tolist() == pytest.approx([5.0] * 5 + [2.0] + [5.0] * 5)
    assert lanes.state.base[3, 2] == pytest.approx(0.1)
    assert not lanes.state.base[[0, 1, 2, 4, 5, 6]].any()


def test_a_diverged_lane_is_named_and_leaves_the_others_alone():
    antenna = make_stub()
    bad = build_scene(antenna, velocity=np.full(12, 1e200), label="much too fast")
    lanes = feeler.Simulations([build_scene(antenna, make_ball()), bad])
    lanes.step(1.0)
    assert lanes.failed[0] is None
    assert isinstance(lanes.failed[1], SimulationDivergedError)
    assert "much too fast" in str(lanes.failed[1])
    lanes.reset(1, build_scene(antenna))
    lanes.step(1.0)
    assert lanes.failed == [None, None]


def test_a_diverged_simulation_says_so_until_it_is_restored():
    simulation = feeler.Simulation(make_stub(), velocity=np.full(12, 1e200))
    before = simulation.snapshot()
    for _ in range(2):
        with pytest.raises(SimulationDivergedError, match="diverged at"):
            simulation.step(1.0)
    simulation.restore(before)
    assert simulation.time == 0.0
    assert np.isfinite(simulation.velocity).all()


def test_a_cancelled_simulation_stops_soon_and_goes_on_as_if_nothing_had_been():
    simulation, other = (feeler.Simulation(make_stub(40), make_ball()) for _ in range(2))
    simulation.step(1.0)
    before, threads = simulation.snapshot(), active_count()
    timer = Timer(0.2, simulation.cancel)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulation.step(1e7)
    timer.join()
    assert active_count() == threads
    assert simulation.time > 1.0
    np.testing.assert_allclose(simulation.place[0, 0], -1.5 + 0.3 * simulation.time, rtol=1e-9)
    simulation.restore(before)
    simulation.step(2.0)
    other.step(3.0)
    assert np.array_equal(simulation.angle, other.angle)


OBJECT = make_ball()
PATH = shake(5.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.step(0.03), "whole timesteps of 0.05 ms"),
        (lambda s: s.step(0.0), "whole timesteps"),
        (lambda s: s.step(float("nan")), "must be a finite number"),
        (lambda s: s.move_base(velocity=(np.inf, 0.0)), "two finite numbers"),
        (lambda s: s.move_base(turn="fast"), "finite number"),
        (lambda s: s.move_base(velocity=(20.0, 0.0)), "faster than the timestep"),
        (lambda s: s.move_base(turn=3.0), "faster than the timestep"),
        (lambda s: s.move_object(0, velocity=(0.0, np.nan)), "two finite numbers"),
        (lambda s: s.move_object(0, velocity=(0.0, 9.0)), "faster than the timestep"),
        (lambda s: s.move_object(1), "there is no object 1"),
        (lambda s: s.move_object("box"), "there is no object 'box'; valid: ball"),
    ],
)
def test_a_wrong_command_changes_nothing(change, message):
    simulation, other = (feeler.Simulation(make_stub(), OBJECT) for _ in range(2))
    with pytest.raises(InvalidInput, match=message):
        change(simulation)
    for each in (simulation, other):
        each.step(2.0)
    assert np.array_equal(simulation.angle, other.angle)
    assert np.array_equal(simulation.place, other.place)


def test_a_recorded_base_refuses_to_go_beyond_its_end_and_stays_where_it_is():
    simulation = feeler.Simulation(make_stub(), base=PATH)
    simulation.step(6.0)
    angle = simulation.angle
    with pytest.raises(InvalidInput, match="recorded path ends at 7 ms"):
        simulation.step(2.0)
    assert simulation.time == pytest.approx(6.0)
    assert np.array_equal(simulation.angle, angle)


def test_lanes_that_are_reset_follow_their_recorded_bases_again_and_again():
    lanes = feeler.Simulations([build_scene(make_stub(), base=PATH) for _ in range(3)])
    for _ in range(2):
        lanes.step(5.0)
        np.testing.assert_allclose(
            lanes.state.base, PATH.compute_pose(np.full(3, 5.0)), atol=1e-12
        )
        for lane in range(3):
            lanes.reset(lane)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda a: feeler.Simulation(None), "antenna"),
        (lambda a: feeler.Simulation(a, [OBJECT, OBJECT]), "two objects are called 'ball'"),
        (
            lambda a: feeler.Simulation(a, OBJECT.replace(place=(0.5, 2.0))),
            "starts inside the antenna",
        ),
        (lambda a: feeler.Simulation(a, angle=np.zeros(3)), "12 finite numbers"),
        (lambda a: feeler.Simulation(a, velocity=np.full(12, np.nan)), "12 finite numbers"),
        (
            lambda a: feeler.Simulation(a, engine="warp"),
            "unknown engine 'warp'; valid: chain-consistent",
        ),
        (
            lambda a: feeler.Simulation(a, contact="soft"),
            "unknown contact 'soft'; valid: smooth, even, hard",
        ),
        (lambda a: feeler.Simulation(a, timestep=0.2), "at most 0.1 ms"),
        (lambda a: feeler.Simulation(a, timestep=-1.0), "timestep must be > 0"),
        (lambda a: feeler.Simulation(a, gravity=(0.0,)), "gravity must be"),
        (lambda a: feeler.Simulations([]), "at least one scene"),
        (
            lambda a: feeler.Simulations([build_scene(a), build_scene(make_stub(13))]),
            "one number of segments",
        ),
    ],
)
def test_what_cannot_be_simulated_is_refused(make, message):
    with pytest.raises((InvalidInput, TypeError), match=message):
        make(make_stub())


def test_two_threads_that_share_a_simulation_wait_for_each_other():
    alone, shared = (feeler.Simulation(make_stub(20), make_ball()) for _ in range(2))
    alone.step(120.0)

    def go() -> None:
        for _ in range(300):
            shared.step(0.2)
            assert np.isfinite(shared.angle).all()

    with ThreadPoolExecutor(2) as pool:
        for future in [pool.submit(go), pool.submit(go)]:
            future.result()
    assert shared.time == pytest.approx(120.0)
    np.testing.assert_array_equal(shared.angle, alone.angle)


def test_an_object_in_the_way_of_the_given_posture_is_refused():
    """It stands where the bent tip is, far from the straight one."""
    antenna = feeler.presets.robot()
    angle = np.full(antenna.n_segments, 0.15)
    tip = tuple(antenna.shape(angle[None])[0, -1])
    ball = feeler.Object(feature=feeler.Ball(radius=1.0), place=tip)
    assert np.linalg.norm(antenna.shape(0 * angle[None])[0, -1] - tip) > 10
    feeler.Simulation(antenna, ball)
    with pytest.raises(InvalidInput, match=r"overlap|inside|starts in"):
        feeler.Simulation(antenna, ball, angle=angle)
