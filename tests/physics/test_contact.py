"""Smooth contact: its force begins at zero, so derivatives exist and the last bit stays the last
bit.
"""

import itertools
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

import feeler
from feeler.antenna.segments import Follicle
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.objects import Ball, Trial, make_feature
from feeler.physics.contact import (
    CONTACTS,
    HARDEST,
    _choose_time_constant,
    find_invweight,
    get_contact,
)
from feeler.physics.engine import choose_timestep
from feeler.physics.run import expect_motions, simulate
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.physics.simulation import Simulation
from feeler.physics.spec import compile_model
from feeler.presets import PRESETS, make_preset

from .scenes import touch

CLOCK = Clock(duration=60, timestep=0.05)


def run(scenes: list[Scene], clock: Clock = CLOCK) -> list[np.ndarray]:
    return [motion.angle for motion in simulate(scenes, clock)]


@pytest.mark.parametrize("kind", ["ball", "box", "triangle"])
@pytest.mark.parametrize("speed", [0.6, 0.06])
def test_the_last_bit_of_the_speed_moves_nothing_else(kind, speed):
    scene = touch(kind, 1.5, contact="smooth", whole=True, speed=speed)
    item = scene.objects[0]
    faster = item.replace(
        velocity=(float(np.nextafter(item.velocity[0], 1.0)), item.velocity[1])
    )
    first, second = run([scene, replace(scene, objects=(faster,))])
    assert np.abs(first).max() > 1e-3
    assert np.abs(first - second).max() < 1e-9


def test_the_impedance_is_the_one_that_mujoco_documents():
    """d(r) from d_min to d_max over the width, y(x) = a x^p below the midpoint and 1 − b (1 − x)^p
    above.
    """
    from feeler.physics.chain import fields as f
    from feeler.physics.chain.contact import compute_impedance

    low, high, width, middle, power = 0.01, 0.9, 0.05, 0.3, 3.0
    obj = np.zeros((1, f.N_OBJECT, 1))
    obj[0, [f.O_D_MIN, f.O_MIDPOINT, f.O_POWER], 0] = low, middle, power
    for depth in np.linspace(0, 1.5 * width, 31):
        x = min(depth / width, 1.0)
        y = (
            x**power / middle ** (power - 1)
            if x <= middle
            else 1 - (1 - x) ** power / (1 - middle) ** (power - 1)
        )
        assert compute_impedance.py_func(-depth, high, width, obj, 0, 0) == pytest.approx(
            low + y * (high - low), rel=1e-12
        )


class TestSoftness:
    def test_follows_from_the_antenna(self):
        """At the push of the turn it sinks in by its width, which is the share of that push."""
        antenna, contact = make_preset("whisker"), get_contact()
        soft = contact.soften(antenna)
        place = antenna.hinge_position + antenna.segment_length / 2
        assert np.allclose(soft.width, np.minimum(2.5e-5 * place, antenna.radius / 2))
        assert soft.d_max.min() == contact.solimp[1] and soft.d_max[0] == HARDEST
        assert np.all(np.diff(soft.d_max[:40]) <= 0)

    def test_widens_with_speed_up_to_half_the_radius(self):
        antenna, contact = make_preset("cockroach"), get_contact()
        soft = contact.soften(antenna)
        width = [soft.widen(*contact.widen(speed)) for speed in np.linspace(0, 3, 50)]
        assert np.all(np.diff(width, axis=0) >= 0) and np.all(width[0] == soft.width)
        assert np.all(width[-1] == antenna.radius / 2)

    def test_fixed_contacts_stay_as_they_are(self):
        soft = get_contact("even").soften(make_preset("cockroach"))
        assert np.all(soft.widen(*get_contact("even").widen(1.0)) == 0.05)
        assert np.all(soft.d_max == 0.95)


def make_thin(radius: float = 0.03) -> feeler.Antenna:
    """24 mm of 2 GPa."""
    return feeler.Antenna.from_beam(
        length=24.0,
        modulus=2000.0,
        density=1.2e-3,
        radius=radius,
        n_segments=60,
        damping_time=2.0,
    )


class TestTimeConstant:
    def test_is_that_of_the_paper_s_antennas_from_a_fifth_of_a_millimetre_on(self):
        for name in ("exponential", "linear", "uniform", "robot", "lobster", "multi-legged"):
            assert get_contact(None, make_preset(name)) is CONTACTS["smooth"]
        contact = get_contact(None, make_thin(0.2))
        assert choose_timestep(None, "chain-consistent", contact) == 0.05

    @pytest.mark.parametrize("radius", [0.002, 0.0123, 0.05, 0.0999, 0.1, 0.1001, 0.199])
    def test_is_a_whole_part_of_it_and_at_most_the_radius(self, radius):
        time = _choose_time_constant(make_thin(radius))
        parts = 0.2 / time
        assert parts == pytest.approx(round(parts)) and time <= max(radius, 0.005) * (1 + 1e-9)
        assert 0.2 / (round(parts) - 1) > radius * (1 - 1e-9)  # and no smaller than that

    @pytest.mark.parametrize("engine", ["chain-consistent", "chain", "mujoco"])
    def test_the_default_timestep_is_as_much_smaller(self, engine):
        plain = choose_timestep(None, engine)
        for parts in (1, 3, 7, 40):
            contact = get_contact(f"smooth:{0.2 / parts!r}")
            assert choose_timestep(None, engine, contact) == pytest.approx(plain / parts)
            assert choose_timestep(None, engine, get_contact(), contact) == plain / parts
        assert choose_timestep(None, engine, get_contact("smooth:0.9")) == plain
        assert choose_timestep(0.003, engine, contact) == 0.003

    def test_is_asked_for_by_name_and_kept_beside_the_numbers(self):
        antenna, trial = make_thin(), Trial(feature=Ball(radius=1.5), location=0.7, speed=0.3)
        for said, time in ((None, 0.2 / 7), ("smooth", 0.2 / 7), ("smooth:0.1", 0.1)):
            found = feeler.touch(antenna, trial, duration=20, contact=said)
            assert found.attrs["contact_time_constant"] == pytest.approx(time)
            assert found.attrs["contact_time_constant_units"] == "ms"
            assert found.attrs["timestep"] == pytest.approx(time / 4)
        for said in ("smooth:", "smooth:fast", "smooth:-1", "hard:nan"):
            with pytest.raises(InvalidInput, match="time constant must be a number > 0"):
                get_contact(said)
        with pytest.raises(InvalidInput, match="unknown contact 'soft'; valid: smooth"):
            get_contact("soft:0.1")

    def test_a_timestep_that_it_does_not_allow_is_refused_with_one_that_it_does(self):
        antenna, trial = make_thin(), Trial(feature=Ball(radius=1.5), location=0.7, speed=0.3)
        with pytest.raises(InvalidInput, match=r"0\.05 ms .* 0\.0286 ms") as refused:
            feeler.touch(antenna, trial, duration=5, timestep=0.05)
        allowed = float(re.search(r"at most (\S+) ms", str(refused.value))[1])
        feeler.touch(antenna, trial, duration=5, timestep=allowed)

    def test_a_simulation_by_hand_has_the_same(self):
        antenna = make_preset("whisker")
        trial = Trial(feature=Ball(radius=1.53), location=0.5, speed=0.6)
        angle = feeler.touch(antenna, trial, duration=12, all_hinges=True)["angle"].values
        simulation = Simulation(antenna, trial)
        simulation.step(11.0)
        np.testing.assert_array_equal(simulation.angle, angle[0, :, 11])


def touch_warily(antenna, trial, **how) -> tuple[float, list[str]]:
    """Penetration over the smaller radius, and what is warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sink = float(feeler.touch(antenna, trial, duration=60, **how)["sink"].max())
    return sink, [
        format(w.message) for w in caught if issubclass(w.category, ModelValidityWarning)
    ]


PLANAR = [name for name in PRESETS if not make_preset(name).spatial]


@pytest.mark.parametrize(
    "name",
    [
        name if name in PLANAR else pytest.param(name, marks=pytest.mark.long)
        for name in PRESETS
    ],
)
def test_no_preset_is_sunk_into_at_the_defaults(name):
    for kind, location, speed in (
        ("ball", 0.5, 0.6),
        ("triangle", 0.9, 0.6),
        ("box", 0.7, 0.3),
    ):
        trial = Trial(feature=make_feature(kind, 1.53), location=location, speed=speed)
        sink, warned = touch_warily(make_preset(name), trial)
        assert sink < 0.5 and not warned


@pytest.mark.parametrize(
    "name",
    [
        *("cricket", "own"),
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in ("cockroach", "stick-insect", "whisker")
        ),
    ],
)
@pytest.mark.parametrize(
    ("contact", "speed", "radius"),
    [
        ("smooth", 1.5, 1.53),
        ("smooth", 3.0, 1.53),
        ("smooth", 0.6, 0.05),
        ("smooth:0.2", 0.6, 1.53),
        ("even", 0.6, 1.53),
        ("hard", 0.6, 1.53),
    ],
)
def test_the_advice_against_sinking_in_is_right(name, contact, speed, radius):
    """Followed once, nothing is left to warn of."""
    antenna = make_thin(0.06) if name == "own" else make_preset(name)
    trial = Trial(feature=Ball(radius=radius), location=0.6, speed=speed)
    sink, warned = touch_warily(antenna, trial, contact=contact)
    assert (sink > 0.5) <= bool(warned)
    for words in warned:
        advised = re.search(r"contact='([^']+)'", words)[1]
        sink, left = touch_warily(antenna, trial, contact=advised)
        assert sink < 0.5 and not left


@pytest.mark.long
@pytest.mark.parametrize("name", ["cricket", "stick-insect", "whisker"])
def test_touches_of_thin_antennas_are_those_of_a_finer_timestep_and_of_mujoco(name):
    """Within 0.3 % of the peak; with a time constant of 0.2 ms it is 0.6 to 20 %."""
    antenna = make_preset(name)
    trial = Trial(feature=Ball(radius=1.53), location=0.5, speed=0.6)
    how = {"duration": 10, "all_hinges": True}
    found = feeler.touch(antenna, trial, **how)
    angle, step = found["angle"].values, found.attrs["timestep"]
    for other in ({"timestep": step / 8}, {"engine": "mujoco", "timestep": step / 4}):
        fine = feeler.touch(antenna, trial, **how, **other)["angle"].values
        assert np.abs(angle - fine).max() < 0.003 * np.abs(fine).max()


@pytest.mark.parametrize(
    "follicle", [None, Follicle(stiffness=(0.02, 0.05, 0.03), damping=(0.01, 0.02, 0.005))]
)
def test_inverse_weights_in_space_are_mujocos(follicle):
    """Also on a base that gives way, where the whole antenna moves with the first segment."""
    antenna = make_preset("rat-whisker").replace(follicle=follicle)
    weights = compile_model(Scene(antenna=antenna), 0.01).body_invweight0[2:, 0]
    np.testing.assert_allclose(find_invweight(antenna), weights, rtol=1e-9)


def test_motion_commanded_later_widens_as_much_as_motion_from_the_start():
    contact = get_contact()
    for later, now in ((0.9, 0.1), (0.1, 0.9), (0.9, 0.9)):
        assert replace(contact, speed=later).widen(now) == contact.widen(max(later, now))


ANTENNA = feeler.presets.cockroach()
CLOCK_SMOOTH = Clock(duration=35.0, timestep=0.05)
SHAPES = [
    feeler.Ball(radius=1.5),
    feeler.Box(half_width=1.5, half_height=1.5),
    feeler.Triangle(half_width=1.5, half_height=1.5),
]


@pytest.mark.parametrize("field", ["stiffness", "damping"])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.kind)
def test_difference_quotients_converge_at_second_order(shape, field):
    scene = make_scene(ANTENNA, feeler.Trial(feature=shape, location=0.7, speed=0.6))
    direction = np.random.default_rng(1).standard_normal(140)

    def differ(step: float) -> np.ndarray:
        own = getattr(ANTENNA, field)
        antennas = [
            ANTENNA.replace(**{field: own * np.exp(s * direction)}) for s in (step, -step)
        ]
        scenes = [replace(scene, antenna=antenna) for antenna in antennas]
        up, down = expect_motions(simulate(scenes, CLOCK_SMOOTH, workers=1))
        return (up.angle - down.angle) / (2 * step)

    found = [differ(step) for step in (2e-4, 1e-4, 5e-5, 2.5e-5)]
    assert np.abs(found[-1]).max() > 0.01
    first, _, last = (np.abs(a - b).max() for a, b in itertools.pairwise(found))
    assert first < 1e-7
    assert first > 8 * last  # two halvings: second order gives 16, first order 4
