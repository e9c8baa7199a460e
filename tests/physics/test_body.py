"""Several antennas on a moving body, and objects that come, go and are pushed."""

import copy

import numpy as np
import pytest
from awkward_touches import make_antenna

import feeler
from feeler.errors import InvalidInput, ModelValidityWarning

ANTENNA = make_antenna()
LONG = ANTENNA.length
BALL = feeler.Object(feature=feeler.Ball(radius=1.5), place=(-2.0, 0.6 * LONG))
MOUNTS = {"left": (-3.0, 1.0, -0.4), "right": (3.0, 1.0, 0.4)}


def make_body(objects=(), antenna=ANTENNA, mounts=MOUNTS, **options):
    return feeler.Body(dict.fromkeys(mounts, antenna), mounts, objects, **options)


def turn(vector, heading):
    """By a heading, from +y towards +x."""
    c, s = np.cos(heading), np.sin(heading)
    return np.array([c * vector[0] + s * vector[1], c * vector[1] - s * vector[0]])


@pytest.mark.further
@pytest.mark.parametrize("engine", ["chain-consistent", "mujoco"])
def test_one_antenna_on_a_body_is_a_simulation(engine):
    ball = BALL.replace(velocity=(0.2, 0.0))
    body = make_body(ball, mounts={"only": (0.0, 0.0, 0.0)}, engine=engine)
    alone = feeler.Simulation(ANTENNA, ball, engine=engine)
    body.set_velocity((-0.05, 0.02))
    alone.set_velocity("base", (-0.05, 0.02))
    for _ in range(5):
        body.step(4.0), alone.step(4.0)
    assert np.abs(alone.force).max() > 0
    np.testing.assert_allclose(body.angle("only"), alone.angle, atol=1e-12)
    np.testing.assert_allclose(body.force, -alone.base_force, atol=1e-12)
    np.testing.assert_allclose(body.moment, -alone.base_moment, atol=1e-12)


def test_a_turned_world_is_the_same_world_in_the_body_s_frame():
    heading, start = 0.8, np.array([5.0, -7.0])
    found = []
    for h, at in ((0.0, np.zeros(2)), (heading, start)):
        item = BALL.replace(
            place=tuple(turn(BALL.place, h) + at),
            forward=tuple(turn(BALL.forward, h)),
            velocity=tuple(turn((0.2, 0.0), h)),
        )
        body = make_body(item, pose=(*at, h), mounts={"a": (0.0, 0.0, 0.0), "b": (9.0, 2, 0.4)})
        body.set_velocity(tuple(turn((0.0, 0.03), h)), turn=0.002)
        body.step(8.0)
        found.append([body.angle("a"), body.force, body.moment])
        assert body.pose[2] == pytest.approx(h + 0.016)
    assert np.abs(found[0][1]).max() > 1e-7
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)


def test_a_mirror_image_pair_feels_mirror_images():
    antenna = feeler.presets.robot()
    balls = [
        feeler.Object(
            feature=feeler.Ball(radius=2.0), place=(s * 10.0, 50.0), forward=(-s, 0.0), name=n
        )
        for s, n in ((-1, "l"), (1, "r"))
    ]
    mounts = {"left": (-4.0, 0.0, 0.0), "right": (4.0, 0.0, 0.0)}
    body = make_body(balls, antenna, mounts)
    body.set_velocity((-0.1, 0.0), of="r")
    body.set_velocity((0.1, 0.0), of="l")
    body.step(80.0)
    np.testing.assert_allclose(body.angle("left"), -body.angle("right"), atol=1e-6)
    left, right = body.forces["left"], body.forces["right"]
    np.testing.assert_allclose(left, right * [-1, 1], atol=1e-9)
    assert left[0] > 1e-5 and abs(body.moment) < 1e-7


def test_a_pushed_object_gives_the_antenna_the_momentum_it_loses():
    """Impulse of the contact on a ball that nothing else touches; and a free one under a force."""
    ball = BALL.replace(velocity=(0.3, 0.0))
    body = make_body(ball, mounts={"a": (0.0, 0.0, 0.0)}, masses={"ball": 0.05})
    impulse = np.zeros(2)
    for _ in range(round(20 / body.timestep)):
        body.step(body.timestep)
        impulse += body.timestep * body._groups[0].force[0, 0]
    lost = 0.05 * (np.array(ball.velocity) - body.objects[0].velocity)
    assert np.abs(lost).max() > 1e-6
    np.testing.assert_allclose(lost, impulse, rtol=0, atol=0.02 * np.abs(impulse).max())
    body.remove_object("ball")
    body.add_object(ball.replace(place=(-50.0, 0.0), velocity=(0.0, 0.0)), mass=2.0)
    body.step(10.0, forces={"ball": (0.0, 0.04)})
    np.testing.assert_allclose(body.objects[0].velocity, [0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(body.place[0], [-50.0, 1.0], atol=0.01)


@pytest.mark.parametrize(
    "engine", ["chain-consistent", pytest.param("mujoco", marks=pytest.mark.long)]
)
@pytest.mark.parametrize(("speed", "tolerance"), [(0.0, 1e-8), (0.05, 2e-4)])
def test_objects_that_are_replaced_by_themselves_change_nothing(engine, speed, tolerance):
    """In the middle of a touch; the base's speed then counts for the softness of contact."""
    ball = BALL.replace(velocity=(0.2, 0.0), turn=0.01)
    one, other = (feeler.Simulation(ANTENNA, ball, engine=engine) for _ in range(2))
    for simulation in (one, other):
        simulation.set_velocity("base", (0.0, speed), speed / 50)
        simulation.step(14.0)
    assert len(one.contacts)
    far = feeler.Object(feature=feeler.Ball(radius=1.0), place=(300.0, 0.0), name="far")
    one.add_object(far)
    one.step(3.0), other.step(3.0)
    one.remove_object("far")
    one.step(3.0), other.step(3.0)
    assert one.time == other.time == 20.0
    np.testing.assert_allclose(one.angle, other.angle, rtol=0, atol=tolerance)
    one.place_object("ball", (-60.0, 0.0))
    one.step(1.0)
    assert not len(one.contacts) and one.place[0] == pytest.approx([-59.8, 0.0], abs=0.05)
    one.reset()
    assert one.time == 0 and one.place[0] == pytest.approx(ball.place)


@pytest.mark.long
def test_whiskers_of_different_lengths_in_space_on_one_head():
    rods = {n: feeler.presets.make_preset("rat-whisker").replace(name=n) for n in ("A", "B")}
    mounts = {"A": (0, 0, 0, 0, 0, 0), "B": (0, 0, 4.0, 0, 0, 0)}
    ball = feeler.Object(feature=feeler.Ball(radius=2), place=(-4, 20, 0), velocity=(0.3, 0, 0))
    body = feeler.Body(rods, mounts, ball)
    assert body.force.shape == body.moment.shape == (3,)
    alone = feeler.Simulation(rods["A"], ball)
    body.step(12.0), alone.step(12.0)
    np.testing.assert_allclose(body.angle("A"), alone.angle, atol=1e-12)
    assert np.abs(body.angle("B") - rods["B"].rest_angle).max() < 1e-6  # 4 mm above the ball
    np.testing.assert_allclose(body.moments["A"], -alone.base_moment, atol=1e-12)


def test_a_copy_and_a_reset_go_the_same_way():
    body = make_body(BALL.replace(velocity=(0.2, 0.0)), masses={"ball": 1.0})
    body.set_velocity(turn=0.01)
    body.step(3.0)
    twin = copy.deepcopy(body)
    body.step(2.0), twin.step(2.0)
    np.testing.assert_array_equal(body.angle("left"), twin.angle("left"))
    body.reset()
    body.set_velocity(turn=0.01)
    body.step(5.0)
    np.testing.assert_array_equal(body.angle("left"), twin.angle("left"))


def test_what_never_comes_near_is_said():
    passing = BALL.replace(place=(-9.0, LONG + 10.0), velocity=(0.3, 0.0))
    with pytest.warns(ModelValidityWarning, match="object 'ball' never comes near"):
        feeler.Simulation(ANTENNA, passing)
    with pytest.warns(ModelValidityWarning, match="never comes near"):
        make_body(passing)


def test_bad_input_is_named():
    with pytest.raises(InvalidInput, match="same names"):
        feeler.Body({"a": ANTENNA}, {"b": (0.0, 0.0, 0.0)})
    body = make_body(BALL)
    with pytest.raises(InvalidInput, match="'ball' has no mass"):
        body.step(1.0, forces={"ball": (1.0, 0.0)})
    with pytest.raises(InvalidInput, match="there is no object 'bull'; valid: ball"):
        body.set_velocity(of="bull")
    with pytest.raises(InvalidInput, match=r"masses\['ball'\] must be > 0"):
        make_body(BALL, masses={"ball": 0.0})
    inside = BALL.replace(place=tuple(body.shape("left")[5]), name="inside")
    with pytest.raises(InvalidInput, match="'inside' starts inside the antenna 'left'"):
        body.add_object(inside)
    assert body.names == ("ball",)
