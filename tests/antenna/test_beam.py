"""A beam's antenna deflects and rings as Euler and Bernoulli say."""

import numpy as np
import pytest

from feeler.antenna import Antenna, compute_modes
from feeler.antenna.files import load_antenna, save_antenna
from feeler.errors import InvalidInput, ModelValidityWarning

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


def test_segments_of_unequal_length_make_the_same_beam(tmp_path):
    """A cone of segments as long as they happen to be: its compliance, mass and modes are those of
    the cone, in the plane and in space, and an array of radii is the cone's formula.
    """
    lengths = np.random.default_rng(3).uniform(0.4, 1.6, 160)
    lengths *= BEAM["length"] / lengths.sum()
    middle = (np.cumsum(lengths) - lengths / 2) / BEAM["length"]
    made = {**BEAM, "length": lengths, "planes": 3, "shear_modulus": 800.0}
    cone = Antenna.from_beam(**made, radius=0.2 - 0.15 * middle)
    again = Antenna.from_beam(**made, radius="0.2 - 0.15 * x")
    even = Antenna.from_beam(**BEAM, radius="0.2 - 0.15 * x", n_segments=160)
    for name in ("segment_mass", "radius", "stiffness", "taper"):
        np.testing.assert_allclose(getattr(cone, name), getattr(again, name), rtol=1e-9)
    np.testing.assert_array_equal(cone.segment_length, lengths)
    arm = cone.length - cone.hinge_position
    exact = 40**3 / (3 * 2000 * np.pi / 4 * 0.2**3 * 0.05)  # of a cone, loaded at its tip
    assert np.sum(arm**2 / cone.stiffness[0]) == pytest.approx(exact, rel=2e-3)
    np.testing.assert_allclose(
        compute_modes(cone.flatten(), 3).frequency, compute_modes(even, 3).frequency, rtol=5e-3
    )
    save_antenna(cone, tmp_path / "cone.toml")
    assert load_antenna(tmp_path / "cone.toml") == cone


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"length": [1.0, 0.0]}, "lengths of all segments, finite and > 0"),
        ({"length": np.ones((2, 2))}, "lengths of all segments"),
        ({"length": [1.0, 2.0], "n_segments": 3}, "lengths of 2 segments, but n_segments is 3"),
        (
            {"length": [1.0, 2.0], "radius": [0.1, 0.1, 0.1]},
            "radius must be a number, a formula",
        ),
    ],
)
def test_rows_that_make_no_beam_are_refused(options, match):
    with pytest.raises(InvalidInput, match=match):
        Antenna.from_beam(**{**BEAM, "radius": 0.1, **options})


@pytest.mark.parametrize(
    "options", [{"length": 23912.0}, {"length": 0.024}, {"radius": 110.0}, {"radius": 1e-4}]
)
def test_micrometres_or_metres_in_the_place_of_millimetres_are_questioned(options):
    with pytest.warns(
        ModelValidityWarning, match=rf"{next(iter(options))} is outside .* not µm or m"
    ):
        Antenna.from_beam(**{**BEAM, "radius": 0.1, **options})
