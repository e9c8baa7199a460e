"""Presets of other animals do what was published of them, as far as their choices allow; the rest
is on the page.
"""

import numpy as np
import pytest

import feeler
from feeler.antenna import compute_base_response, compute_modes
from feeler.presets import SPECIES, make_preset, read_preset


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
    frequency = np.arange(5.0, 60.0, 0.5) * 1e-3
    swing = abs(
        compute_base_response(make_preset("cricket"), frequency) - 1
    )  # as seen from the base
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
