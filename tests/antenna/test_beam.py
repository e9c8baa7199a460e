"""A beam's antenna deflects and rings as Euler and Bernoulli say."""

import numpy as np
import pint
import pytest

from feeler.antenna import Antenna, Sigmoid, compute_modes
from feeler.antenna.animals import fit_sigmoid
from feeler.antenna.files import BEAM_UNITS, FILE_UNITS, load_antenna, save_antenna
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


EVERY = [(name, unit) for name, units in (FILE_UNITS | BEAM_UNITS).items() for unit in units]


def read(unit):
    return pint.get_application_registry().parse_units(
        unit.replace("·", "*").replace("³", "**3")
    )


@pytest.mark.parametrize(("name", "unit"), EVERY)
def test_every_factor_is_pints(name, unit):
    units = (FILE_UNITS | BEAM_UNITS)[name]
    assert pint.Quantity(1.0, read(unit)).to(
        read(next(iter(units)))
    ).magnitude == pytest.approx(units[unit], rel=1e-12)


def test_a_stiffness_is_a_modulus_times_an_area_times_a_length():
    """Of a beam, E I / l: MPa · mm⁴ / mm is the N·mm that a hinge has per radian."""
    own = {name: read(next(iter(units))) for name, units in BEAM_UNITS.items()}
    made = pint.Quantity(1.0, own["modulus"] * own["radius"] ** 4 / own["length"] / read("rad"))
    assert made.to(read(next(iter(FILE_UNITS["stiffness"])))).magnitude == pytest.approx(1.0)
    weight = pint.Quantity(
        1.0, own["density"] * own["width"] * own["thickness"] * own["length"]
    )
    assert weight.to(read(next(iter(FILE_UNITS["segment_mass"])))).magnitude == pytest.approx(
        1.0
    )
    slow = pint.Quantity(1.0, own["damping_time"] * read(next(iter(FILE_UNITS["stiffness"]))))
    assert slow.to(read(next(iter(FILE_UNITS["damping"])))).magnitude == pytest.approx(1.0)


@pytest.mark.parametrize("value", [np.inf, -1.0, 0.0])
def test_one_length_that_cannot_be_is_enough_to_refuse_an_antenna(value):
    with pytest.raises(
        InvalidInput, match="antenna 1 has segment lengths that are not finite and > 0"
    ):
        fit_sigmoid([np.where(np.arange(20) == 3, value, 1.0)])


PLANTED = Sigmoid(low=0.00349, rise=0.00588, slope=11.06, centre=0.377)


def make_lengths(n, rng=None, scatter=0.0, length=42.0):
    share = PLANTED.sample(n)
    if rng is not None:
        share = share * np.exp(scatter * rng.standard_normal(n))
    return length * share / share.sum()


def test_an_exact_sigmoid_is_found_exactly():
    fit = fit_sigmoid([make_lengths(140), make_lengths(140, length=38.0)])
    total = PLANTED.sample(140).sum()
    np.testing.assert_allclose(
        [fit.sigmoid.slope, fit.sigmoid.centre], [11.06, 0.377], rtol=1e-5
    )
    np.testing.assert_allclose(
        [fit.sigmoid.low, fit.sigmoid.rise], np.array([0.00349, 0.00588]) / total, rtol=1e-5
    )
    assert fit.squared_residual < 1e-16


def test_antennae_of_different_counts_are_put_on_one_scale():
    fit = fit_sigmoid([make_lengths(140), make_lengths(150), make_lengths(133)])
    assert fit.share.shape == (3, 150)
    np.testing.assert_allclose(fit.share.sum(axis=1), 1.0)
    assert fit.sigmoid.centre == pytest.approx(0.377, abs=0.01)


def test_residuals_are_those_of_the_fit():
    rng = np.random.default_rng(4)
    fit = fit_sigmoid([make_lengths(140, rng, 0.08) for _ in range(4)])
    curve = fit.sigmoid.at(fit.x)
    assert fit.squared_residual == pytest.approx(np.sum((fit.share.mean(axis=0) - curve) ** 2))
    planted = np.sum(
        (fit.share.mean(axis=0) - PLANTED.sample(140) / PLANTED.sample(140).sum()) ** 2
    )
    assert fit.squared_residual <= planted


@pytest.mark.parametrize(
    ("lengths", "match"),
    [
        ([], "at least one antenna"),
        ([np.ones(3)], "at least 8 lengths"),
        (
            [np.ones(140), np.where(np.arange(140) == 7, np.nan, 1.0)],
            "antenna 2 has segment lengths",
        ),
        ([np.zeros(140)], "finite and > 0"),
    ],
)
def test_bad_lengths_are_refused(lengths, match):
    with pytest.raises(InvalidInput, match=match):
        fit_sigmoid(lengths)
