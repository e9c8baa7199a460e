"""A formula says what its numbers are, to the last bit, and does nothing else."""

import numpy as np
import pytest

from feeler.antenna import Antenna, Exponential, Sigmoid
from feeler.antenna.files import Source, parse_antenna, read_antenna_file, save_antenna
from feeler.antenna.profiles import _list_names, evaluate
from feeler.errors import InvalidInput
from feeler.presets import PRESETS, make_preset, read_preset

BEAM = """schema = "feeler.antenna/1"
n_segments = 50
beam.length = {unit = "cm", value = 2.0}
beam.radius = {unit = "µm", formula = "200 - 150 * x"}
beam.modulus = {unit = "GPa", value = 2}
beam.density = {unit = "mg/mm3", value = 1.1}
"""


@pytest.mark.parametrize(
    ("formula", "value"),
    [
        ("2 * x ** 2 - 1", lambda n, x: 2 * x**2 - 1),
        (
            "37.78 * exp(-0.0827 * (n - 1))",
            lambda n, x: Exponential(base=37.78, rate=-0.0827).sample(5),
        ),
        ("spread(42, n)", lambda n, x: 42 * n / 15),
        (
            "max(1 - 2 * x, 0) + min(x, 0.5)",
            lambda n, x: np.maximum(1 - 2 * x, 0) + np.minimum(x, 0.5),
        ),
        ("-pi / N + 0 * n", lambda n, x: np.full(5, -np.pi / 5)),
    ],
)
def test_a_formula_is_its_arithmetic(formula, value):
    n = np.arange(1.0, 6)
    np.testing.assert_array_equal(evaluate(formula, _list_names(5)), value(n, (n - 0.5) / 5))


@pytest.mark.parametrize(
    ("formula", "match"),
    [
        ("__import__('os').system('true')", "is not understood"),
        ("x.real", "'x.real' is not understood"),
        ("(lambda: 1)()", "is not understood"),
        ("y + 1", "'y' is not understood in a formula; valid: .* pi, n, N, x"),
        ("exp(x, out=x)", "is not understood"),
        ("True + 1", "'True' is not understood"),
        ("2 x", "'2 x' is no formula"),
        ("exp()", "is no formula"),
        ("(" * 300 + "1" + ")" * 300, "is no formula"),
        ("1 + " * 300 + "1", "at most 1000 characters, got 1201"),
    ],
)
def test_what_is_no_formula_is_refused_and_nothing_runs(formula, match):
    with pytest.raises(InvalidInput, match=match):
        evaluate(formula, _list_names(5))


def test_powers_do_not_grow_without_bounds():
    assert evaluate("9 ** 9 ** 9 ** 9", {}) == np.inf


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_files_of_formulas_that_return_to_the_last_bit(tmp_path, name):
    found = read_preset(name)
    save_antenna(found.antenna, tmp_path / "a.toml", found.sources)
    again = read_antenna_file(tmp_path / "a.toml")
    assert again == found and again.antenna == make_preset(name)
    # a parabola is no formula of the arc length, and two planes are listed as numbers
    listed = {"matched": 120, "rat-whisker": 120, "cockroach-in-space": 240}
    assert len((tmp_path / "a.toml").read_text().splitlines()) < listed.get(name, 60)


def test_profiles_formulas_and_numbers_make_one_antenna():
    share = Sigmoid(low=0.003, rise=0.006, slope=11.0, centre=0.4).sample(40)
    plain = Antenna(
        segment_length=42 * share / share.sum(),
        segment_mass=1e-5,
        radius=0.2,
        stiffness=20 / np.arange(1, 41),
        damping=1,
    )
    made = Antenna.from_profile(
        40,
        segment_length="spread(42, 0.003 + 0.006 / (1 + exp(-11.0 * (x - 0.4))))",
        segment_mass=1e-5,
        radius=np.full(40, 0.2),
        stiffness="20 / n",
        damping="1",
    )
    assert made == plain
    assert Antenna.from_profile(
        4, length=8, segment_mass=1, radius=1, stiffness="l", damping="s"
    ).damping == pytest.approx([1 / 8, 3 / 8, 5 / 8, 7 / 8])
    with pytest.raises(InvalidInput, match="give either length"):
        Antenna.from_profile(4, segment_mass=1, radius=1, stiffness=1, damping=1)


def test_a_changed_antenna_is_not_written_as_the_formula_it_came_from(tmp_path):
    found = read_preset("cricket")
    softer = found.antenna.replace(stiffness=found.antenna.stiffness / 2)
    save_antenna(softer, tmp_path / "a.toml", found.sources)
    assert read_antenna_file(tmp_path / "a.toml").antenna == softer


def test_a_file_of_a_beam_is_from_beam_in_any_unit(tmp_path):
    found = parse_antenna(BEAM)
    taper = Antenna.from_beam(
        length=20, radius="(200 - 150 * x) * 0.001", modulus=2000, density=1.1e-3, n_segments=50
    )
    assert found.antenna == taper
    np.testing.assert_allclose(taper.radius, 0.2 - 0.15 * (np.arange(50) + 0.5) / 50)
    save_antenna(found.antenna, tmp_path / "a.toml", found.sources)
    assert "[beam.radius]" in (tmp_path / "a.toml").read_text()
    assert read_antenna_file(tmp_path / "a.toml") == found


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("2.0}", "2.0, tag = 'Q'}"), "tag must be one of"),
        (('"µm"', '"ell"'), r"line 4, beam.radius.unit: must be one of mm"),
        (("beam.modulus", "beam.moduluss"), "beam.moduluss: unknown key; valid here: length"),
        (("200 - 150 * x", "200 - 250 * x"), "radius must be finite and > 0 all along"),
        (("200 - 150 * x", "200 - 150 * y"), "'y' is not understood"),
        (('beam.modulus = {unit = "GPa", value = 2}', ""), "missing: modulus"),
        (
            ("n_segments = 50", "n_segments = 50\nstiffness = {unit = 'N·mm/rad', value = 1}"),
            "given twice",
        ),
    ],
)
def test_faults_of_a_beam_are_named(change, match):
    with pytest.raises(InvalidInput, match=match):
        parse_antenna(BEAM.replace(*change))


def test_sources_of_what_is_not_there_are_refused():
    with pytest.raises(InvalidInput, match=r"no quantity 'beam\.colour'"):
        save_antenna(make_preset("robot"), "never.toml", {"beam.colour": Source(tag="C")})
