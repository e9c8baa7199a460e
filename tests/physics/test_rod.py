"""Laws of the rod engines, through the same call as every engine: closed forms, statics, symmetry,
energy, refusals.
"""

import numpy as np
import pytest

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.objects import Ball, BaseMotion, Box, Object, Outline, Triangle, Wall
from feeler.physics.engine import get_engine
from feeler.physics.rod.stepper import RodStepper
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene
from feeler.physics.simulation import Simulation

ENGINES = ("rod", "rod-inertia")
STAR = Outline(
    vertices=[(0, 0), (-0.6, 0.4), (-1.5, 1.5), (-1.2, 0.0), (-1.5, -1.5), (-0.6, -0.4)],
    rounding=0.2,
)
SHAPES = [
    Ball(radius=0.8),
    Box(half_width=0.8, half_height=0.5, rounding=0.3),
    Triangle(half_width=1.0),
    STAR,
]


def uniform(n: int = 24, length: float = 0.4, **fields: object) -> Antenna:
    base = {"segment_mass": 1e-6, "radius": 0.25, "stiffness": 1e-2, "damping": 1e-2}
    return Antenna(**{"segment_length": np.full(n, length)} | base | fields)


def push(feature=None, **fields: object) -> Object:
    """Something that comes from the left towards the outer half of ``uniform()``."""
    base = {"place": (-0.3, 7.4), "velocity": (0.2, 0.0), "friction": 0.0}
    return Object(feature=feature or Ball(radius=0.8), **base | fields)


def bend_of(antenna: Antenna, angle: np.ndarray) -> float:
    return float(0.5 * np.sum(antenna.stiffness * (angle - antenna.rest_angle) ** 2))


@pytest.mark.parametrize("engine", ENGINES)
def test_untouched_it_keeps_its_slack_shape_however_its_base_runs(engine):
    antenna = uniform(rest_angle=np.linspace(-0.1, 0.2, 24))
    simulation = Simulation(antenna, engine=engine, base=BaseMotion(velocity=(0.2, 0.4)))
    simulation.step(20.0)
    np.testing.assert_allclose(simulation.angle, antenna.rest_angle, atol=1e-12)
    np.testing.assert_allclose(simulation.base, [4.0, 8.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(simulation.base_force, 0.0, atol=1e-15)


def test_one_damped_hinge_creeps_back_as_implicit_euler_says():
    antenna = uniform(1, damping=0.3)
    simulation = Simulation(antenna, engine="rod", timestep=2.0, angle=[0.4])
    simulation.step(20.0)
    assert simulation.angle[0] == pytest.approx(0.4 / (1 + 2.0 * 1e-2 / 0.3) ** 10, rel=1e-9)


def test_one_hinge_with_mass_swings_as_implicit_euler_says():
    antenna, h = uniform(1, damping=0.0, segment_mass=1.0), 0.5
    inertia, q, v = 0.4**2, 1e-4, 0.0
    simulation = Simulation(antenna, engine="rod-inertia", timestep=h, angle=[q])
    for _ in range(20):
        v = (v - h * 1e-2 * q / inertia) / (1 + h * h * 1e-2 / inertia)
        q += h * v
        simulation.step(h)
        assert simulation.angle[0] == pytest.approx(q, abs=1e-9)


def test_weight_bends_a_stiff_rod_like_a_cantilever():
    n, length, g = 100, 10.0, 9.81e-3
    antenna = uniform(n, length / n, stiffness=1.0, segment_mass=1e-3)
    stepper = RodStepper([Scene(antenna=antenna, gravity=(g, 0.0))], 1.0)
    assert stepper.settle().balanced
    weight = n * 1e-3 * g
    state = stepper.read()
    points = antenna.shape(state.angle[0])
    assert points[-1, 0] == pytest.approx(weight * length**3 / (8 * 1.0 * length / n), rel=0.02)
    np.testing.assert_allclose(state.base_force[0], [-weight, 0.0], rtol=1e-9, atol=1e-15)
    levers = (points[1:, 1] + points[:-1, 1]) / 2
    assert state.base_moment[0] == pytest.approx(-weight * levers.mean(), rel=1e-5)


@pytest.mark.parametrize("feature", SHAPES, ids=lambda feature: feature.kind)
def test_pushed_and_left_alone_it_stands_as_statics_says(feature):
    """The forces that each contact reports hold the shape that is seen, whatever pushes."""
    antenna = uniform()
    stepper = RodStepper([Scene(antenna=antenna, objects=(push(feature),))], 0.5)
    stepper.step(20)
    stepper.move_object(0, 0, (0.0, 0.0), 0.0)
    assert stepper.settle().balanced
    state, contacts = stepper.read(), stepper.read_contacts(0)
    assert len(contacts) and state.angle[0].sum() > 0.2
    points = antenna.shape(state.angle[0])
    lever = [points[contacts.segment] - hinge for hinge in points[:-1]]
    torque = [
        np.sum(
            (r[:, 1] * contacts.force[:, 0] - r[:, 0] * contacts.force[:, 1])[
                contacts.segment > i
            ]
        )
        for i, r in enumerate(lever)
    ]
    np.testing.assert_allclose(antenna.stiffness * state.angle[0], torque, atol=3e-8)
    np.testing.assert_allclose(state.base_force[0], -contacts.force.sum(axis=0), atol=1e-12)
    assert state.base_moment[0] == pytest.approx(-torque[0], abs=3e-8)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("feature", SHAPES, ids=lambda feature: feature.kind)
def test_surfaces_meet_where_the_rounding_says(engine, feature):
    simulation = Simulation(uniform(), push(feature), engine=engine, timestep=0.5)
    simulation.step(12.0)
    contacts = simulation.contacts
    deepest = 0.005 if engine == "rod" else 0.1
    assert (
        len(contacts) and np.all(contacts.distance < 0) and np.all(contacts.distance > -deepest)
    )
    (x, y), (cos, sin) = simulation.place[0], simulation.forward[0]
    own = (contacts.point - [x, y]) @ np.array([[cos, -sin], [sin, cos]])
    for (
        point
    ) in own:  # from the core by the rounding, less half of what the two surfaces overlap
        gap = min(_measure(point, part) for part in feature.parts)
        assert gap == pytest.approx(feature.rounding, abs=deepest)


def _measure(point: np.ndarray, part: np.ndarray) -> float:
    """Distance of a point from a convex part's boundary."""
    start, along = part, np.roll(part, -1, axis=0) - part
    share = ((point - start) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30)
    return float(
        np.min(np.linalg.norm(point - start - np.clip(share, 0, 1)[:, None] * along, axis=1))
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_sliding_wall_drags_with_the_friction_it_has(engine):
    """The wall comes nearer, then slides towards the base: of the force on the tip, the share along
    the wall is friction.
    """
    wall = Object(feature=Wall(), place=(-0.3, 0.0), velocity=(0.2, 0.0), friction=0.3)
    simulation = Simulation(
        uniform(), wall, engine=engine, timestep=0.5, base=BaseMotion(turn=-0.01)
    )
    simulation.step(10.0)
    simulation.move_base()
    simulation.move_object(0, velocity=(0.0, 0.5))
    simulation.step(30.0)
    normal, along = simulation.force[0]
    assert normal > 0 and along / normal == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("mover", ["object", "turning object", "base", "turning base"])
def test_work_is_stored_or_lost_in_the_hinges(mover):
    antenna, h = uniform(), 0.05
    item = push(Box(half_width=0.8, half_height=0.5, rounding=0.3), place=(-0.26, 7.4))
    item = item.replace(velocity=(0.2, 0.0) if mover == "object" else (0.0, 0.0))
    item = item.replace(turn=0.1 if mover == "turning object" else 0.0)
    base = {"base": (-0.2, 0.0, 0.0), "turning base": (0.0, 0.0, -0.02)}.get(
        mover, (0.0, 0.0, 0.0)
    )
    simulation = Simulation(
        antenna,
        item,
        engine="rod",
        timestep=h,
        base=BaseMotion(velocity=base[:2], turn=base[2]) if any(base) else None,
    )
    lost = 0.0
    for _ in range(120):
        simulation.step(h)
        lost += h * np.sum(antenna.damping * simulation.velocity**2)
    stored = bend_of(antenna, simulation.angle)
    assert stored > 1e-6
    assert 1e-3 * simulation.work.total == pytest.approx(stored + lost, rel=0.03)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_recorded_path_ends_in_its_place_and_a_run_keeps_every_sample(engine):
    time = np.linspace(0.0, 20.0, 21)
    pose = np.stack([0.3 * np.sin(time / 4), 0.0 * time, 0.1 * np.cos(time / 4) - 0.1], axis=1)
    scene = Scene(
        antenna=uniform(), objects=(push(),), base_motion=BaseMotion(time=time, pose=pose)
    )
    motion = run_scene(scene, Clock(duration=20.0, timestep=0.5), engine)
    np.testing.assert_allclose(motion.base, pose[:20], atol=1e-12)
    assert np.isfinite(motion.angle).all() and np.isfinite(motion.contact_place).any()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Simulation(
                uniform(8, 1.2), push(Box(half_width=1, half_height=1)), engine="rod"
            ),
            "rounding ≥ 0.595 mm",
        ),
        (
            lambda: Simulation(uniform(2, stiffness=[0.0, 1.0], damping=0.0), engine="rod"),
            "stiffness or damping > 0",
        ),
        (
            lambda: Simulation(uniform(), push(velocity=(9.0, 0.0)), engine="rod").move_base(
                (9.0, 0.0)
            ),
            "can follow",
        ),
        (
            lambda: get_engine("rod").make([Scene(antenna=uniform())] * 2, 1.0),
            "one scene at a time",
        ),
    ],
)
def test_what_it_cannot_do_is_named(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()


def test_the_rounding_that_a_refusal_asks_for_is_enough():
    box = Box(half_width=1.0, half_height=1.0, rounding=0.6)
    simulation = Simulation(uniform(8, 1.2), push(box), engine="rod")
    simulation.step(5.0)
    assert len(simulation.contacts)
