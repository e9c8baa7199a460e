"""Laws of an antenna: validated, frozen, straight along +y at rest."""

import copy
import pickle

import numpy as np
import pytest

from feeler import Antenna, presets
from feeler.antenna import Constant, Exponential, Linear, Sigmoid, compute_modes
from feeler.antenna.animals import FACTS, PROFILE_NAMES
from feeler.antenna.segments import compute_mass_matrix
from feeler.errors import InvalidInput

GOOD = {
    "segment_length": [1.0, 2.0],
    "segment_mass": 1e-3,
    "radius": 0.2,
    "stiffness": 1.0,
    "damping": 0.1,
}


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        (
            "segment_length",
            [1.0, -2.0],
            r"segment_length must be finite and > 0 .* -2.0 in segment 2",
        ),
        ("segment_mass", 0.0, "segment_mass must be finite and > 0"),
        ("stiffness", [1.0, np.nan], "stiffness must be finite and ≥ 0 .* nan in segment 2"),
        ("stiffness", 0.0, "nothing holds the antenna"),
        ("damping", [1.0, 2.0, 3.0], r"one number or 2 numbers .* \(3,\)"),
        ("rest_angle", 4.0, "within ±π"),
        ("sensors", [2, 1], "rise from base to tip"),
        ("sensors", [0, 1], "within 1…2"),
        ("sensors", [1.5], "whole hinge numbers"),
        ("segment_length", np.ones(1001), "1 to 1000 segments, got .* 1001"),
        ("radius", "thick", "radius must be an array of numbers"),
    ],
)
def test_bad_arrays_are_named(field, value, message):
    with pytest.raises(InvalidInput, match=message):
        Antenna(**(GOOD | {field: value}))


COPIES = [
    copy.deepcopy,
    copy.copy,
    lambda a: pickle.loads(pickle.dumps(a)),
    lambda a: Antenna(**a.to_plain()),
]


@pytest.mark.parametrize("copied", [lambda a: a, *COPIES])
@pytest.mark.parametrize("name", ["stiffness", "sensors"])
def test_arrays_are_frozen(copied, name):
    antenna = copied(Antenna(**GOOD))
    with pytest.raises(ValueError, match="read-only"):
        getattr(antenna, name)[0] = 2


@pytest.mark.parametrize("copied", [*COPIES, lambda a: a.replace()])
def test_equal_antennas_are_equal(copied):
    antenna = Antenna(**GOOD)
    hash(antenna)
    twin = copied(antenna)
    assert twin == antenna
    assert hash(twin) == hash(antenna)
    assert twin.replace(damping=0.2) != antenna
    assert len({antenna, twin, antenna.replace(name="other")}) == 2
    assert antenna != "antenna"


def test_the_sign_of_zero_makes_no_difference():
    one, other = (Antenna(**GOOD, rest_angle=angle) for angle in (0.0, -0.0))
    assert one == other
    assert hash(one) == hash(other)


def test_positive_angles_bend_towards_plus_x():
    assert Antenna(**GOOD).shape([0.1, 0.1])[-1, 0] > 0


@pytest.mark.parametrize("size", [(7,), (5, 7), (2, 3, 7)])
def test_the_tip_is_where_the_shape_ends(size):
    antenna = Antenna(
        segment_length=np.linspace(0.2, 0.5, 7),
        segment_mass=1e-6,
        radius=0.1,
        stiffness=1.0,
        damping=1.0,
    )
    angle = np.random.default_rng(0).normal(0, 0.3, size)
    np.testing.assert_allclose(
        antenna.tip(angle, 0.4), antenna.shape(angle, 0.4)[..., -1, :], atol=1e-14
    )
    np.testing.assert_allclose(antenna.tip(), antenna.shape()[-1], atol=1e-14)


@pytest.mark.parametrize(
    ("profile", "expected"),
    [
        (Exponential(base=2.0, rate=-1.0), [2.0, 2.0 / np.e, 2.0 / np.e**2]),
        (Linear(base=3.0, tip=1.0), [3.0, 2.0, 1.0]),
        (Constant(value=4.0), [4.0, 4.0, 4.0]),
        (Sigmoid(low=1.0, rise=2.0, slope=0.0, centre=0.5), [2.0, 2.0, 2.0]),
    ],
)
def test_profiles_sample_their_formula(profile, expected):
    np.testing.assert_allclose(profile.sample(3), expected)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Exponential(base=np.nan, rate=-1.0), "Exponential.base must be finite"),
        (lambda: Linear(base=1.0, tip=np.inf), "Linear.tip must be finite"),
    ],
)
def test_a_profile_that_gives_no_numbers_is_refused(make, match):
    with pytest.raises(InvalidInput, match=match):
        make()


@pytest.mark.parametrize("name", PROFILE_NAMES)
def test_cockroach_shares_everything_but_its_hinges(name):
    reference, antenna = presets.cockroach(), presets.cockroach(name)
    assert (antenna.n_segments, antenna.sensors.size) == (140, 56)
    assert antenna.length == pytest.approx(42.0)
    np.testing.assert_array_equal(antenna.segment_mass, reference.segment_mass)


def test_cockroach_has_the_published_hinges():
    antenna, n = presets.cockroach(), np.arange(1, 141)
    np.testing.assert_allclose(antenna.stiffness, 37.78 * np.exp(-0.0827 * (n - 1)))
    np.testing.assert_allclose(antenna.damping, 25.24 * np.exp(-0.0533 * (n - 1)))
    assert 1e3 * antenna.segment_mass.sum() == pytest.approx(2.0, abs=0.05)


def test_every_fact_has_a_tag_and_a_unit():
    assert all(fact.tag and fact.unit and fact.reference for fact in FACTS.values())


@pytest.mark.parametrize(
    "call", [lambda: presets.cockroach("cubic"), lambda: presets.make_preset("spider")]
)
def test_unknown_names_list_the_valid_ones(call):
    with pytest.raises(InvalidInput, match=r"valid: .*exponential.*uniform"):
        call()


def test_the_old_name_of_the_uniform_antenna_is_answered_with_a_line():
    for call in (presets.cockroach, presets.make_preset):
        with pytest.warns(FutureWarning, match="'constant' is now 'uniform'"):
            assert call("constant") == presets.cockroach("uniform")


@pytest.mark.parametrize("angle", [np.zeros(3), np.zeros((4, 5)), 0.0])
def test_shape_needs_an_angle_for_every_hinge(angle):
    antenna = Antenna(
        segment_length=np.ones(4), segment_mass=1e-5, radius=0.1, stiffness=1.0, damping=1.0
    )
    with pytest.raises(InvalidInput, match=r"angles of all 4 hinges .* all_hinges=True"):
        antenna.shape(angle)


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_hinge_may_rest_folded_back_and_no_further(sign):
    assert Antenna(**GOOD, rest_angle=sign * np.pi).rest_angle[0] == sign * np.pi
    with pytest.raises(InvalidInput, match="within ±π rad"):
        Antenna(**GOOD, rest_angle=sign * np.nextafter(np.pi, 4))


def test_matched_control_has_the_same_total_compliance():
    exponential, matched = presets.cockroach(), presets.cockroach("matched")
    assert np.sum(1 / matched.stiffness) == pytest.approx(np.sum(1 / exponential.stiffness))


def test_mass_matrix_is_the_kinetic_energy_of_thin_rods():
    """Against a slow, obvious reference: the energy of every rod for random hinge rates."""
    rng = np.random.default_rng(1)
    antenna = Antenna(
        **(
            GOOD
            | {
                "segment_length": rng.uniform(0.5, 2.0, 6),
                "segment_mass": rng.uniform(1, 2, 6),
            }
        )
    )
    rate = rng.normal(size=6)
    energy, velocity = 0.0, 0.0
    for n in range(6):
        spin = rate[: n + 1].sum()
        length = antenna.segment_length[n]
        mass = antenna.segment_mass[n]
        centre = velocity + spin * length / 2
        energy += 0.5 * mass * centre**2 + 0.5 * mass * length**2 / 12 * spin**2
        velocity += spin * length
    assert 0.5 * rate @ compute_mass_matrix(antenna) @ rate == pytest.approx(energy)


@pytest.mark.parametrize(("mode", "root"), [(0, 1.8751041), (1, 4.6940911)])
def test_uniform_chain_has_euler_bernoulli_modes(mode, root):
    """ω = β² √(EI / m̄ L⁴); the clamped half segment makes hinge 1 twice as stiff."""
    n, length, stiffness, density = 200, 40.0, 5.0, 1e-4
    step = length / n
    k = np.full(n, stiffness / step)
    k[0] *= 2
    antenna = Antenna(
        segment_length=np.full(n, step),
        segment_mass=density * step,
        radius=0.1,
        stiffness=k,
        damping=0.0,
    )
    expected = root**2 * np.sqrt(stiffness / (density * length**4)) / (2 * np.pi)
    assert compute_modes(antenna, 2).frequency[mode] == pytest.approx(expected, rel=2e-3)
