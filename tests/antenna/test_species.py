"""Presets of other animals do what was published of them, as far as their choices allow; the rest
is on the page.
"""

import numpy as np
import pytest
from scipy.linalg import eigh

import feeler
from feeler.antenna import compute_base_response, compute_modes
from feeler.antenna.animals import FOLLICLE
from feeler.antenna.segments import to_matrix
from feeler.presets import SPECIES, cockroach, make_preset, rat_whiskers, read_preset


def release_tip(antenna, duration):
    """The tip's way back as a share of where it was let go."""
    tip = feeler.release(
        antenna, at=0.25 * antenna.length, deflection=0.02 * antenna.length, duration=duration
    )["tip"]
    return tip.values[0, :, 0] / tip.values[0, 0, 0]


@pytest.mark.parametrize("name", SPECIES)
def test_every_number_has_a_tag_and_what_was_published_a_reference(name):
    found = read_preset(name)
    assert found.sources and all(source.tag for source in found.sources.values())
    assert all(
        source.reference.count("doi:") + source.reference.count("arXiv:")
        for source in found.sources.values()
        if source.tag != "C"
    )


def test_the_crickets_first_mode_is_11_hz_and_its_tip_resonates_near_30_hz():
    modes = compute_modes(make_preset("cricket"), 1)
    assert modes.frequency[0] == pytest.approx(0.011, rel=1e-3) and modes.damping_ratio[
        0
    ] == pytest.approx(1, rel=1e-3)
    frequency = np.arange(5.0, 60.0, 2.5) * 1e-3
    # as seen from the base
    swing = abs(compute_base_response(make_preset("cricket"), frequency) - 1)
    best = swing[:, -1].argmax()
    assert 0.025 < frequency[best] < 0.035 and swing[best, 40] < 0.1 * swing[best, -1]


def test_the_stick_insect_returns_without_oscillation_and_is_a_hundred_times_as_long_as_wide():
    antenna = make_preset("stick-insect")
    assert antenna.length / (2 * antenna.radius[0]) == pytest.approx(100, rel=0.01)
    assert release_tip(antenna, 200.0).min() > -1e-3
    assert (
        antenna.damping[0] / antenna.stiffness[0]
        > 2 * antenna.damping[60] / antenna.stiffness[60]
    )


def test_a_load_at_the_lobsters_tip_bends_it_evenly():
    """Hinges are k = EI/ℓ with EI in proportion to the distance from the tip, so that M / EI is the
    load over a constant.
    """
    antenna = make_preset("lobster")
    bend = (antenna.length - antenna.hinge_position) / antenna.stiffness
    assert np.ptp(bend) / bend.mean() < 1e-12


def test_the_whisker_rings_as_whiskers_do():
    modes = compute_modes(make_preset("whisker"), 1)
    assert 0.027 < modes.frequency[0] < 0.260 and 0.11 < modes.damping_ratio[0] < 0.17


def test_the_cockroach_in_space_has_its_flagellum_behind_two_joints_across_each_other():
    flat, whole = feeler.presets.cockroach(), make_preset("cockroach-in-space")
    for name in ("segment_length", "segment_mass", "radius", "stiffness", "damping"):
        behind = getattr(whole, name)[..., 2:]
        np.testing.assert_allclose(
            behind, np.broadcast_to(getattr(flat, name), behind.shape), rtol=1e-12
        )
    yields = whole.stiffness[:, :2].argmin(axis=0)
    assert [whole.planes[plane] for plane in yields] == ["x", "z"]
    np.testing.assert_array_equal(whole.sensors, [1, 2, *(flat.sensors + 2)])


@pytest.mark.long
@pytest.mark.parametrize("azimuth", [0.0, 90.0])
def test_a_push_turns_the_joint_that_lies_across_it(azimuth):
    """From the side the scape gives way, from above the pedicel: k θ + c θ̇ is the force's moment
    there. The other joint turns by a hundredth of that.
    """
    antenna = make_preset("cockroach-in-space")
    trial = feeler.Trial(
        feature=feeler.Peg(radius=1.0), location=0.3, speed=0.02, azimuth=azimuth
    )
    runs = feeler.Simulation(antenna, trial)
    runs.step(60.0)
    plane = int(azimuth / 90)
    turned = runs.angle[plane, :2]
    assert turned[plane] > 1e-2
    assert 0.005 < turned[1 - plane] / turned[plane] < 0.02
    arms = runs.contacts.point - runs.shape()[plane]
    moment = np.linalg.norm(np.cross(arms, runs.contacts.force).sum(axis=0))
    held = turned[plane] + 0.668 * runs.velocity[plane, plane]
    assert held == pytest.approx(moment, rel=0.01)


RIGHT, LEFT = rat_whiskers("right"), rat_whiskers("left")


def put(whisker):
    """Points (joint, 3) on the head [mm]."""
    frame = to_matrix(whisker[1][3:])
    return whisker[1][:3] + whisker[0].shape() @ frame.T


def test_there_are_thirty_a_side_and_the_left_are_the_mirror_of_the_right():
    names = [f"{row}{k}" for row, n in zip("ABCD", (5, 5, 7, 7), strict=True) for k in range(n)]
    assert [*RIGHT] == [*LEFT] == [*names, *(f"E{k}" for k in range(1, 7))]
    for name, one in RIGHT.items():
        np.testing.assert_allclose(put(LEFT[name]), put(one) * [-1, 1, 1], atol=1e-9)


def test_they_leave_the_cheek_as_their_angles_say():
    """Towards azimuth θ from the back and elevation φ: sin θ, −cos θ, tan φ."""
    theta, phi = 1.0263, -0.041713  # D1
    along = to_matrix(RIGHT["D1"][1][3:])[:, 1]
    wanted = [np.sin(theta) * np.cos(phi), -np.cos(theta) * np.cos(phi), np.sin(phi)]
    np.testing.assert_allclose(along, wanted, atol=1e-12)
    for one in RIGHT.values():
        assert to_matrix(one[1][3:])[0, 1] > 0  # away from the head


def test_a_whisker_rests_on_its_parabola():
    """Chords of y = A x² with A 0.00885 and 45.2 mm of arc: C1."""
    fine = rat_whiskers(n_segments=80)["C1"][0]
    x, y, z = fine.shape().T
    assert not z.any()
    np.testing.assert_allclose(x, 0.00885 * y**2, atol=2e-3)
    assert fine.length == pytest.approx(45.2)


def test_radii_are_the_published_equations():
    """A1: row 1, column 1, 31 mm. Where the slope would end below 1.5 µm, the tip has that (C1)."""
    middle = (np.arange(20) + 0.5) / 20
    slope = 0.0012 + 0.00017 - 0.000066 + 0.00011
    for name, row, length, tip in (("A1", 1, 31.0, None), ("C1", 3, 45.2, 0.0015)):
        base = 0.5 * (0.041 + 0.002 * length + 0.011 * row - 0.0039)
        tip = base - slope * length if tip is None else tip
        np.testing.assert_allclose(RIGHT[name][0].radius, base + (tip - base) * middle)


def test_first_modes_are_those_of_hartmann_and_damped_alike():
    for one in RIGHT.values():
        modes = compute_modes(one[0], 1)
        assert modes.damping_ratio[0] == pytest.approx(0.14)
        assert one[0].length < 20 or 27 < 1e3 * modes.frequency[0] < 260


@pytest.mark.long
def test_a_whisker_on_the_head_meets_a_peg_there():
    """Where its tip is, a peg pushes it; where another's is, none does."""
    whisker = RIGHT["C2"]
    base = feeler.BaseMotion(time=np.linspace(0, 30, 4), pose=np.tile(whisker[1], (4, 1)))
    middle = put(whisker)[14]
    across = to_matrix(whisker[1][3:])[:, 0]
    peg = feeler.Object(
        feature=feeler.Ball(radius=0.5),
        place=tuple(middle + 0.2 * across),
        forward=tuple(-across),
        velocity=tuple(-0.05 * across),
    )
    simulation = feeler.Simulation(whisker[0], peg, base=base)
    simulation.step(20.0)
    assert simulation.force @ across < 0


@pytest.mark.long
def test_a_follicle_changes_what_holds_a_whisker_and_nothing_else():
    """Clamped unless asked for; let go of, its base stands aside by force over stiffness."""
    held = rat_whiskers("left", follicle=FOLLICLE)
    for name, (antenna, pose) in held.items():
        assert LEFT[name][0].follicle is None and antenna.follicle == FOLLICLE
        assert antenna.replace(follicle=None) == LEFT[name][0]
        np.testing.assert_array_equal(pose, LEFT[name][1])
    gravity = np.array([2e-3, -9e-3, 4e-3])
    runs = feeler.Simulation(held["C2"][0], gravity=tuple(gravity), timestep=0.05)
    runs.step(400.0)
    np.testing.assert_allclose(
        runs.base[:3], gravity * held["C2"][0].segment_mass.sum() / 0.03, rtol=1e-6
    )


N = np.arange(1, 141)
X = (N - 0.5) / 140


def make_length():
    """[mm]; a sigmoid of the segment's number [P form, D numbers], 42 mm together [D]."""
    share = 0.00349 + 0.00588 / (1 + np.exp(-11.06 * (X - 0.377)))
    return 42.0 * share / share.sum()


def make_mass():
    """[g]; 1.1 mg/mm³ in discs whose radius falls from 0.20 mm at the base to 0.052 mm at the tip
    [D].
    """
    length = make_length()
    middle = (np.cumsum(length) - length / 2) / 42.0
    return 1.1e-3 * np.pi * (0.20 * (0.052 / 0.20) ** middle) ** 2 * length


def test_segments_are_those_of_the_sources():
    antenna = cockroach()
    np.testing.assert_allclose(antenna.segment_length, make_length(), rtol=1e-12)
    np.testing.assert_allclose(antenna.segment_mass, make_mass(), rtol=1e-12)
    np.testing.assert_array_equal(antenna.radius, 0.225)  # mm [D]; constant [P]
    np.testing.assert_array_equal(antenna.rest_angle, 0.0)
    assert antenna.segment_length[[0, -1]] == pytest.approx([0.150, 0.393], abs=5e-4)  # mm
    assert 1e3 * antenna.segment_mass.sum() == pytest.approx(2.009, abs=5e-4)  # mg
    radius = np.sqrt(antenna.segment_mass / (1.1e-3 * np.pi * antenna.segment_length))
    assert radius[[0, -1]] == pytest.approx([0.200, 0.052], abs=6e-4)  # mm


def test_first_two_modes_of_rods_in_absolute_angles():
    """Rods that turn by φ: T = ½ Σ m ẏ² + I φ̇², V = ½ Σ k (φ_n − φ_(n−1))², which needs no matrix
    of the library's.
    """
    length, mass = make_length(), make_mass()
    place = np.tril(np.ones((140, 140)), -1) * length + np.diag(
        length / 2
    )  # a middle's sideways way per angle
    kinetic = place.T @ (mass[:, None] * place) + np.diag(mass * length**2 / 12)
    bend = np.eye(140) - np.eye(140, k=-1)
    stiffness, damping = 37.78 * np.exp(-0.0827 * (N - 1)), 25.24 * np.exp(-0.0533 * (N - 1))
    square, shape = eigh(bend.T @ (stiffness[:, None] * bend), kinetic, subset_by_index=(0, 1))
    ratio = np.sum(damping[:, None] * (bend @ shape) ** 2, axis=0) / (2 * np.sqrt(square))
    modes = compute_modes(cockroach(), 2)
    np.testing.assert_allclose(
        modes.frequency, np.sqrt(square) / (2 * np.pi), rtol=2e-5
    )  # rounding: k falls 1e5-fold
    np.testing.assert_allclose(modes.damping_ratio, ratio, rtol=2e-5)
    assert 1e3 * modes.frequency == pytest.approx([17.95, 53.62], abs=0.005)  # Hz
    assert modes.damping_ratio == pytest.approx([0.628, 2.298], abs=5e-4)


@pytest.mark.parametrize(
    ("profile", "stiffness", "damping", "frequency"),
    [
        ("linear", [0.572, 3.85e-4], [4.44, 0.0176], [22.12, 100.93]),
        ("uniform", [0.395, 0.395], [3.17, 3.17], [21.28, 120.21]),
        ("matched", [4.27287e-3, 4.27287e-3], [0.386198, 0.386198], [2.213, 12.502]),
    ],
)
def test_controls_are_straight_lines_between_their_ends(profile, stiffness, damping, frequency):
    """[D+C]: fitted to the same targets; Hz of the first two modes."""
    antenna = cockroach(profile)
    np.testing.assert_allclose(antenna.stiffness, np.linspace(*stiffness, 140), rtol=2e-6)
    np.testing.assert_allclose(antenna.damping, np.linspace(*damping, 140), rtol=2e-6)
    assert 1e3 * compute_modes(antenna, 2).frequency == pytest.approx(frequency, rel=5e-4)


@pytest.mark.parametrize(
    ("sensors", "expected"),
    [
        ("even", np.round(np.linspace(1, 140, 56))),
        ("distal", np.arange(29, 141, 2)),
        ("all", np.arange(1, 141)),
    ],
)
def test_sensors_sit_where_their_names_say(sensors, expected):
    np.testing.assert_array_equal(cockroach(sensors=sensors).sensors, expected)


def test_a_shaken_rod_swings_as_a_pendulum_on_a_spring_does():
    """One rod: (k + iωc − ω²J) θ = ω² m a with J = m ℓ²/3 and a = ℓ/2; the tip swings by 1 + ℓ
    θ.
    """
    rod = feeler.Antenna(
        segment_length=[3.0], segment_mass=[0.5], radius=1, stiffness=2.0, damping=0.7
    )
    omega = np.array([0.0, 0.5, 1.1, 4.0])
    angle = omega**2 * 0.5 * 1.5 / (2.0 + 0.7j * omega - omega**2 * 0.5 * 3)
    swing = compute_base_response(rod, omega / (2 * np.pi))
    np.testing.assert_allclose(swing, np.stack([np.ones(4), 1 + 3 * angle], axis=1), rtol=1e-12)
