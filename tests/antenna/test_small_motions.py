"""Small motions in absolute headings, written out: an independent derivation of modes, damping and
the shaken base.
"""

import numpy as np
import pytest
from scipy.linalg import eigh

import feeler
from feeler.antenna import Antenna, compute_modes
from feeler.antenna.segments import compute_base_response

ANTENNA = Antenna(
    segment_length=[2.0, 1.0, 1.5],
    segment_mass=[3e-4, 2e-4, 1e-4],
    radius=0.1,
    stiffness=[5e-2, 2e-2, 1e-2],
    damping=[3e-2, 1e-2, 2e-2],
)


def write_out(antenna):
    """M, C, K (heading, heading) and the pull of the base, of rods whose headings are the
    coordinates.
    """
    length, mass, n = antenna.segment_length, antenna.segment_mass, antenna.n_segments
    inertia, pull = np.diag(mass * length**2 / 12), np.zeros(n)
    for rod in range(n):
        arm = np.where(
            np.arange(n) < rod, length, np.where(np.arange(n) == rod, length / 2, 0.0)
        )
        inertia += mass[rod] * np.outer(arm, arm)
        pull += mass[rod] * arm
    differ = np.eye(n) - np.eye(n, k=-1)  # hinge angles from headings
    spring, damper = (
        differ.T @ np.diag(values) @ differ for values in (antenna.stiffness, antenna.damping)
    )
    return inertia, damper, spring, pull


@pytest.mark.parametrize("n_modes", [1, 3, 9])
def test_modes_and_first_order_damping_are_those_of_the_headings(n_modes):
    inertia, damper, spring, _ = write_out(ANTENNA)
    squared, shapes = eigh(spring, inertia)
    found = compute_modes(ANTENNA, n_modes)
    count = min(n_modes, 3)
    np.testing.assert_allclose(
        found.frequency, np.sqrt(squared[:count]) / (2 * np.pi), rtol=1e-10
    )
    ratio = np.einsum("im,ij,jm->m", shapes, damper, shapes) / (
        2 * np.sqrt(squared)
    )  # shapes have mass one
    np.testing.assert_allclose(found.damping_ratio, ratio[:count], rtol=1e-9)
    for angle, shape in zip(found.angle, shapes.T, strict=False):
        heading = np.cumsum(angle)
        np.testing.assert_allclose(
            heading * np.sign(heading[-1]), shape * np.sign(shape[-1]), rtol=1e-8
        )


@pytest.mark.parametrize("frequency", [0.0, 0.3, 1.1, 40.0])
def test_a_shaken_base_is_the_response_of_the_headings(frequency):
    inertia, damper, spring, pull = write_out(ANTENNA)
    omega = 2 * np.pi * frequency
    heading = np.linalg.solve(
        spring + 1j * omega * damper - omega**2 * inertia, omega**2 * pull
    )
    place = 1 + np.concatenate([[0.0], np.cumsum(ANTENNA.segment_length * heading)])
    found = compute_base_response(ANTENNA, np.array([frequency]))
    assert found.shape == (1, 4) and found[0, 0] == 1
    np.testing.assert_allclose(found[0], place, rtol=1e-10)


def test_variants_are_the_antenna_times_their_factors_tilted_about_its_middle():
    antennas = feeler.sample_antennas(20, ANTENNA, seed=4)
    place = (np.array([1, 2, 3]) - 0.5) / 3 - 0.5
    for k in (0, 7, 19):
        factor = {name: values[k] for name, values in antennas.columns.items()}
        tilt = np.exp(factor["gradient"] * place)
        np.testing.assert_allclose(
            antennas[k].stiffness, ANTENNA.stiffness * factor["stiffness"] * tilt
        )
        np.testing.assert_allclose(antennas[k].damping, ANTENNA.damping * factor["damping"])
        np.testing.assert_allclose(
            antennas[k].segment_mass, ANTENNA.segment_mass * factor["mass"]
        )
        np.testing.assert_array_equal(antennas[k].segment_length, ANTENNA.segment_length)
    assert len({values[0] for values in antennas.columns.values()}) == 4
    assert [a.name for a in antennas[18:]] == ["custom 18", "custom 19"] and antennas[
        -1
    ] == antennas[19]


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("stiffness", 0.8, 1.25), ("damping", 0.8, 1.25), ("mass", 0.9, 1.1)],
)
def test_factors_fill_their_range_evenly_in_the_logarithm(name, low, high):
    values = np.sort(np.log(feeler.sample_antennas(2000, ANTENNA, seed=1).columns[name]))
    assert np.log(low) <= values[0] and values[-1] <= np.log(high)
    even = np.linspace(np.log(low), np.log(high), values.size)
    assert np.abs(values - even).max() < 1.63 / np.sqrt(values.size) * np.log(
        high / low
    )  # Kolmogorov–Smirnov at 1 %


def test_damping_in_proportion_to_stiffness_damps_each_mode_in_proportion_to_its_frequency():
    antenna = ANTENNA.replace(damping=0.7 * ANTENNA.stiffness)
    found = compute_modes(antenna, 3)
    np.testing.assert_allclose(found.damping_ratio, 0.7 * np.pi * found.frequency, rtol=1e-10)


def test_a_shake_far_above_all_modes_leaves_a_lone_rods_centre_of_percussion_still():
    """A free rod pushed at one end turns about the point two thirds along it: its other end swings
    by −½.
    """
    rod = Antenna(
        segment_length=[3.0], segment_mass=[1e-3], radius=0.1, stiffness=[1e-3], damping=[1e-4]
    )
    np.testing.assert_allclose(
        compute_base_response(rod, np.array([1e3]))[0], [1.0, -0.5], atol=1e-4
    )
