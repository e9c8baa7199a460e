"""A wall approaches: equilibria, the inverted J, mirror images, bad input."""

from contextlib import nullcontext

import numpy as np
import pytest

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.physics.contact import get_contact
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock
from feeler.presets import cockroach
from feeler.wall import Posture, approach, map_distance, range_r2
from feeler.wall.approach import make_wall_scene

FEW = (22.0, 16.0, 10.0, 6.0)


@pytest.fixture(scope="module")
def uniform() -> Antenna:
    return Antenna(
        segment_length=np.full(40, 1.0),
        segment_mass=1e-5,
        radius=0.1,
        stiffness=1e-2,
        damping=1e-2,
        sensors=None,
    )


@pytest.mark.further
@pytest.mark.parametrize("profile", ["exponential", "linear", "uniform", "matched"])
@pytest.mark.parametrize("reading", ["midline", "total"])
def test_inverted_j_stands_at_every_distance_in_contact(profile, reading):
    sweep = approach(cockroach(profile), Posture(reading=reading))
    assert sweep.contact.sum() >= 10 and sweep.balanced.all()
    assert np.array_equal(
        sweep.contact, sweep.distance < sweep.posture.reach(cockroach(profile))
    )
    assert np.array_equal(sweep.inverted, sweep.contact)
    tip = sweep.posture.base_angle + sweep.angle.sum(axis=1)
    assert np.all(np.cos(tip[sweep.contact]) < 0)


def test_a_sweep_s_steps_are_checked():
    with pytest.raises(InvalidInput, match="substep must be > 0, got 0"):
        approach(cockroach(), Posture(), FEW, substep=0.0)


def test_no_node_is_behind_the_wall(uniform):
    sweep = approach(uniform, Posture(friction=0.0), FEW)
    deepest = sweep.points[:, 1:, 0].max(axis=1) + 0.1 - sweep.distance
    assert np.all(deepest[sweep.contact] < 0.02)
    assert np.all(deepest[sweep.contact] > -1e-9)


def test_equilibrium_minimises_energy_among_shapes_in_front_of_the_wall(uniform):
    """A random small change that does not push any touching node into the wall cannot lower the
    energy.
    """
    sweep = approach(uniform, Posture(prebend="none", friction=0.0), [12.0])
    rng = np.random.default_rng(4)
    energy = 0.5 * np.sum(uniform.stiffness * sweep.angle[0] ** 2)
    edge = sweep.points[0, :, 0].max()
    lower = 0
    for _ in range(400):
        angle = sweep.angle[0] + 1e-3 * rng.standard_normal(40)
        x = uniform.shape(angle, base_angle=sweep.posture.base_angle)[:, 0]
        lower += x.max() <= edge and 0.5 * np.sum(uniform.stiffness * angle**2) < energy * (
            1 - 1e-6
        )
    assert lower == 0


def test_tip_load_of_a_straight_antenna_matches_the_small_bend_of_a_cantilever(uniform):
    """Only the tip touches: θ_n is the tip force times its lever over k, so that force is one
    number.
    """
    reach = uniform.length * np.sin(np.radians(30))
    sweep = approach(uniform, Posture(prebend="none", friction=0.0), [reach - 0.2])
    points = sweep.points[0]
    lever = points[-1, 1] - points[:-1, 1]  # of a force across the wall
    force = -uniform.stiffness * sweep.angle[0] / lever
    np.testing.assert_allclose(force, force[0], rtol=1e-3)
    assert force[0] > 0


def test_frictionless_equilibrium_does_not_depend_on_the_distances_visited_before():
    antenna = cockroach("linear")
    posture = Posture(friction=0.0)
    many = approach(antenna, posture, (22.0, 18.0, 14.0, 10.0))
    one = approach(antenna, posture, [10.0])
    np.testing.assert_allclose(many.angle[-1], one.angle[0], atol=2e-5)


@pytest.mark.parametrize("prebend", ["rest", "none"])
def test_left_is_the_mirror_image_of_right(prebend):
    antenna = cockroach()
    right, left = (
        approach(antenna, Posture(side=side, prebend=prebend), FEW)
        for side in ("right", "left")
    )
    assert np.array_equal(left.angle, -right.angle)
    np.testing.assert_allclose(left.points, right.points * [-1, 1], atol=1e-12)


def test_a_straight_antenna_laid_in_a_j_unfolds_without_friction_and_stays_with_it():
    antenna = cockroach()
    loose, held = (
        approach(antenna, Posture(prebend="placed", friction=friction), (18.0, 16.0, 14.0))
        for friction in (0.0, 1.0)
    )
    assert loose.contact.all() and not loose.inverted.any()
    assert held.inverted.all()


@pytest.mark.parametrize(
    "posture", [Posture(), Posture(prebend="placed"), Posture(prebend="none")]
)
def test_beyond_reach_nothing_is_touched_and_nothing_bends(posture):
    reach = posture.reach(antenna := cockroach())
    sweep = approach(antenna, posture, (40.0, 30.0, reach + 0.5))
    assert not sweep.contact.any() and not sweep.inverted.any()
    np.testing.assert_allclose(sweep.bend, 0.0, atol=1e-12)


POSTURES = [Posture(friction=0.0), Posture(prebend="none", friction=0.0)]


@pytest.mark.parametrize("posture", POSTURES, ids=["hook", "straight"])
@pytest.mark.parametrize(
    ("engine", "duration", "timestep", "friction"),
    [
        ("chain", 120.0, 0.05, 0.0),
        pytest.param("mujoco", 60.0, 0.02, 0.05, marks=pytest.mark.slow),
    ],
)
def test_every_engine_comes_to_rest_at_the_static_answer(
    posture, engine, duration, timestep, friction
):
    """From a tenth too far, 3° to 14° away. At MuJoCo's smallest friction its solver diverges."""
    start, end = _simulate(posture, engine, duration, timestep, friction)
    assert start > 2.5
    assert end < (1.0 if engine == "mujoco" else 0.5)


def _simulate(
    posture: Posture, engine: str, duration: float, timestep: float, friction: float = 0.0
) -> tuple[float, float]:
    """Greatest heading difference from the static answer at the start and at the end [degrees]."""
    sweep = approach(cockroach(), posture, [12.0])
    start = sweep.antenna.rest_angle + 1.1 * sweep.bend[0]
    at = posture.replace(friction=friction)
    scene = make_wall_scene(sweep.antenna, at, 12.0, contact=get_contact("hard"), angle=start)
    end = run_scene(scene, Clock(duration=duration, timestep=timestep), engine).angle[-1]
    first, last = (
        np.degrees(np.abs(np.cumsum(angle - sweep.angle[0])).max()) for angle in (start, end)
    )
    return float(first), float(last)


@pytest.mark.parametrize(
    ("distances", "message"),
    [
        ([], "at least one distance"),
        ([10.0, 0.0], "behind the body"),
        ([-3.0], "behind the body"),
        ([np.nan], "behind the body"),
        ([0.1], "starts inside the wall"),
        ([cockroach().radius[0]], "starts inside the wall"),
    ],
)
def test_bad_distances_are_named(distances, message):
    with pytest.raises(InvalidInput, match=message):
        approach(cockroach(), Posture(), distances)


def test_a_fold_that_starts_inside_the_wall_is_refused():
    """An arc of 5 mm that begins at the base and turns from its heading α until it points back
    needs 5 (1 + cos α) mm.
    """
    posture = Posture(prebend="placed", fold_radius=5.0)
    bound = 5.0 * (1 + np.cos(posture.base_angle)) + cockroach().radius.max()
    with pytest.raises(
        InvalidInput, match=f"it needs {bound:.3g} mm, the wall stands at {bound - 1:.3g} mm"
    ):
        approach(cockroach(), posture, [bound - 1])
    for distance, fits in ((bound - 0.01, False), (bound + 0.01, True)):
        with (
            nullcontext()
            if fits
            else pytest.raises(InvalidInput, match="starts inside the wall")
        ):
            approach(cockroach(), posture, [distance])


def test_a_tip_that_points_backward_after_a_whole_turn_is_no_inverted_j():
    antenna = cockroach()
    rolled = antenna.replace(rest_angle=antenna.rest_angle + 2 * np.pi / antenna.n_segments)
    plain, coil = (approach(one, Posture(), (6.0,)) for one in (antenna, rolled))
    assert plain.contact.all() and plain.inverted.all()
    heading = np.degrees(Posture().base_angle + coil.angle.sum(axis=1))
    assert coil.contact.all() and np.all((heading > 450) & (heading < 630))
    assert not coil.inverted.any()


def test_a_straight_antenna_is_laid_in_a_j_a_millimetre_nearer_than_its_reach():
    reach = (posture := Posture(prebend="placed", friction=1.0)).reach(antenna := cockroach())
    assert approach(antenna, posture, [reach - 0.9, reach - 1.1]).contact.tolist() == [
        False,
        True,
    ]


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("inter_antennal_angle", 0.0, "> 0 and ≤ 90 degrees"),
        ("inter_antennal_angle", 91.0, "> 0 and ≤ 90 degrees"),
        ("inter_antennal_angle", np.nan, "must be finite"),
        ("reading", "both", "midline, total"),
        ("prebend", "curled", "rest, placed, rotation, none"),
        ("side", "up", "left, right"),
        ("friction", -0.1, "≥ 0"),
        ("hook_share", 0.0, "> 0 and ≤ 1"),
        ("tip_heading", 90.0, "> 90 and ≤ 180 degrees"),
        ("fold_radius", 0.0, "> 0 mm"),
    ],
)
def test_bad_postures_are_named(field, value, message):
    with pytest.raises(InvalidInput, match=message):
        Posture(**{field: value})


@pytest.mark.parametrize(("reading", "degrees"), [("midline", 30.0), ("total", 15.0)])
def test_both_readings_of_the_angle(reading, degrees):
    assert np.isclose(np.degrees(Posture(reading=reading).base_angle), degrees)


@pytest.mark.parametrize("distance", [22.0, 15.0, 9.0])
def test_the_contact_is_where_the_moments_of_the_hinges_say(uniform, distance):
    """Without friction the wall pushes with one force F across: k_i θ_i = F (y − y_i) for every
    hinge before it, a line whose zero is the place of the push.
    """
    sweep = approach(uniform, Posture(friction=0.0, hook_share=0.5), [distance])
    moment, y = (uniform.stiffness * sweep.bend)[0, [0, 5]], sweep.points[0, [0, 5], 1]
    zero = y[0] - moment[0] * np.diff(y)[0] / np.diff(moment)[0]
    arc = np.append(uniform.hinge_position, uniform.length)
    assert sweep.contact[0]
    assert np.interp(sweep.contact_position[0], arc, sweep.points[0, :, 1]) == pytest.approx(
        zero, abs=0.05
    )


def test_without_contact_there_is_no_place_of_it(uniform):
    sweep = approach(uniform, Posture(), [39.0, 15.0])
    assert np.isnan(sweep.contact_position).tolist() == [True, False]


@pytest.mark.long
def test_r2_depends_on_the_steps_of_the_wall_with_friction_alone():
    antenna, distances = cockroach("linear"), np.linspace(25.0, 10.0, 6)
    posture = Posture(hook_share=1.0, tip_heading=150.0, friction=0.0)
    low, high = range_r2(antenna, posture, distances)
    assert low == pytest.approx(high, abs=1e-3)
    rough = posture.replace(friction=0.6)
    low, high = range_r2(antenna, rough, distances)
    assert high - low > 0.02
    assert low <= map_distance(approach(antenna, rough, distances)).r2 <= high
