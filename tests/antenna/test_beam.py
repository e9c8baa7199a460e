"""A beam's antenna deflects and rings as Euler and Bernoulli say."""

import numpy as np
import pytest

from feeler.antenna import Antenna, compute_modes
from feeler.antenna.files import load_antenna, save_antenna
from feeler.errors import InvalidInput

BEAM = {"length": 40.0, "modulus": 2000.0, "density": 1.1e-3}


@pytest.mark.parametrize(
    ("section", "moment", "area"),
    [
        ({"radius": 0.1}, np.pi / 4 * 0.1**4, np.pi * 0.1**2),
        ({"width": 5.0, "thickness": 0.2}, 5.0 * 0.2**3 / 12, 5.0 * 0.2),
    ],
)
def test_a_uniform_beam_has_the_cantilevers_frequencies_and_deflection(section, moment, area):
    beam = Antenna.from_beam(**BEAM, **section, n_segments=120)
    exact = (
        np.array([1.8751, 4.6941, 7.8548]) ** 2
        / (2 * np.pi * 40**2)
        * np.sqrt(2000 * moment / (1.1e-3 * area))
    )
    np.testing.assert_allclose(compute_modes(beam, 3).frequency, exact, rtol=0.01)
    np.testing.assert_array_equal(
        beam.radius, section.get("radius") or section["thickness"] / 2
    )
    arm = beam.length - beam.hinge_position
    assert np.sum(arm**2 / beam.stiffness) == pytest.approx(
        40**3 / (3 * 2000 * moment), rel=0.001
    )


@pytest.mark.parametrize("n", [1, 2, 5])
def test_hinges_bend_as_the_trapezium_rule_says(n):
    """Each hinge bends for the halves of the segments beside it: ∫ (L − x)² / EI dx by trapezia is
    L³/3EI (1 + 1/2n²).
    """
    beam = Antenna.from_beam(**BEAM, radius=0.1, n_segments=n)
    exact = 40**3 / (3 * 2000 * np.pi / 4 * 0.1**4) * (1 + 1 / (2 * n**2))
    assert np.sum((beam.length - beam.hinge_position) ** 2 / beam.stiffness) == pytest.approx(
        exact, rel=1e-12
    )


def test_a_taper_is_a_function_and_the_file_gives_the_same_antenna(tmp_path):
    taper = Antenna.from_beam(
        **BEAM, radius=lambda x: 0.2 - 0.15 * x, damping_time=0.5, name="taper", sensors=[1, 30]
    )
    assert taper.segment_mass.sum() == pytest.approx(
        1.1e-3 * np.pi * 40 * (0.2**2 + 0.2 * 0.05 + 0.05**2) / 3, rel=1e-3
    )
    np.testing.assert_allclose(taper.damping, 0.5 * taper.stiffness)
    save_antenna(taper, tmp_path / "t.toml")
    np.testing.assert_array_equal(load_antenna(tmp_path / "t.toml").stiffness, taper.stiffness)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({}, "either radius"),
        ({"radius": 0.1, "width": 1.0}, "either radius"),
        ({"radius": lambda x: 0.1 - 0.2 * x}, "radius must be finite and > 0 all along"),
        ({"radius": 0.1, "length": 0.0}, "length must be finite and > 0, got 0.0"),
        ({"radius": 0.1, "n_segments": 0}, "n_segments must be finite and > 0, got 0"),
        ({"radius": 0.1, "modulus": -1.0}, "modulus must be"),
        ({"radius": 0.1, "damping_time": -1.0}, "damping_time must be"),
    ],
)
def test_a_beam_that_cannot_be_made_is_refused(options, match):
    with pytest.raises(InvalidInput, match=match):
        Antenna.from_beam(**{**BEAM, **options})
