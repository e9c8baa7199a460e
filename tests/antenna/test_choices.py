"""The cockroach's numbers, written out a second time from their sources: a wrong one would move a
claim of the paper.

[P] Methods, antenna model (https://doi.org/10.1101/2025.10.20.683587); [D] derived from the
published video, as ``feeler antenna show`` says beside each.
"""

import numpy as np
import pytest
from scipy.linalg import eigh

from feeler.antenna import compute_modes
from feeler.presets import cockroach

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


def test_compliance_is_the_sum_of_a_geometric_series():
    """Σ 1/k_n = (e^(140 r) − 1) / (e^r − 1) / p1 with r = 0.0827 per joint and p1 = 37.78 N·mm/rad
    [P].
    """
    expected = np.expm1(140 * 0.0827) / np.expm1(0.0827) / 37.78
    assert (
        np.sum(1 / cockroach().stiffness)
        == pytest.approx(expected, rel=1e-12)
        == pytest.approx(32764.8, abs=0.1)
    )


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
