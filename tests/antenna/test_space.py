"""Antennas in space: shapes against closed forms, frusta against integrals, and what is refused."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from feeler.antenna.animals import cockroach
from feeler.antenna.files import (
    load_antenna,
    parse_antenna,
    read_antenna_file,
    save_antenna,
    write_antenna,
)
from feeler.antenna.segments import Antenna, _list_frustum, compute_modes, find_rate
from feeler.errors import InvalidInput

ROOTS = {
    "cylinder": (3.51602, 22.0345, 61.6972, 120.902, 199.860),  # βL² of a clamped, free beam
    "cone": (8.7193, 21.1457, 38.4538, 60.6803, 87.8336),  # Conway, Becker & Dubil 1964
}


def make(planes: int = 2, n: int = 7, **changes) -> Antenna:
    """Uneven in every way."""
    rng = np.random.default_rng(5)
    fields = {"segment_length": rng.uniform(0.5, 1.5, n), "segment_mass": 1e-3, "radius": 0.1}
    fields |= {"stiffness": rng.uniform(0.5, 2, (planes, n)), "damping": 0.1}
    return Antenna(**(fields | changes))


def test_angles_in_the_first_plane_give_the_planar_shape():
    antenna = make()
    angle = np.zeros((4, 2, 7))
    angle[:, 0] = np.random.default_rng(1).normal(0, 0.6, (4, 7))
    found, flat = antenna.shape(angle), antenna.flatten().shape(angle[:, 0])
    np.testing.assert_allclose(found[..., :2], flat, rtol=0, atol=1e-14)
    assert not found[..., 2].any()


@pytest.mark.parametrize("planes", [2, 3])
def test_shapes_are_those_of_products_of_rotations(planes):
    """Slow and obvious: each segment's frame is turned about −z, x and y in this order."""
    antenna, rng = make(planes), np.random.default_rng(2)
    angle, base = rng.normal(0, 1.0, (planes, 7)), rng.normal(0, 1.0, 3)
    frame, points = Rotation.from_rotvec(base), [np.zeros(3)]
    for i in range(7):
        for axis, a in zip(([0, 0, -1], [1, 0, 0], [0, 1, 0]), angle[:, i], strict=False):
            frame = frame * Rotation.from_rotvec(np.multiply(axis, a))
        points.append(points[-1] + frame.apply([0, antenna.segment_length[i], 0]))
    np.testing.assert_allclose(antenna.shape(angle, base), points, rtol=0, atol=1e-13)
    np.testing.assert_allclose(antenna.tip(angle, base), points[-1], rtol=0, atol=1e-13)


@pytest.mark.parametrize("size", [0.0, 1e-7, 1e-3, 0.4, 2.0, 3.1])
def test_a_changing_rotation_vector_turns_at_the_rate_of_its_matrices(size):
    """ω of Ṙ Rᵀ, by a difference of SciPy's rotations around the moment."""
    rng, step = np.random.default_rng(3), 1e-5
    way, change = rng.normal(size=3), rng.normal(size=3)
    vector = size * way / np.linalg.norm(way)
    before, after = (Rotation.from_rotvec(vector + s * change) for s in (-step, step))
    expected = (after * before.inv()).as_rotvec() / (2 * step)
    np.testing.assert_allclose(find_rate(vector, change), expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("taper", [0.0, 0.37, 1.0, 1.9])
def test_frusta_are_integrals_over_their_sections(taper):
    area = lambda x: (1 + (taper - 1) * x) ** 2  # noqa: E731
    mass = quad(area, 0, 1)[0]
    centre = quad(lambda x: x * area(x), 0, 1)[0] / mass
    inertia = quad(lambda x: (x - centre) ** 2 * area(x), 0, 1)[0] / mass
    np.testing.assert_allclose(np.ravel(_list_frustum(np.array([taper]))), [centre, inertia])


@pytest.mark.parametrize("kind", ROOTS)
def test_beams_swing_as_theory_says(kind):
    """Modes 1 to 5 within 1 % with 100 segments, the same in both planes of a round beam."""
    taper = 1.0 if kind == "cylinder" else 1e-4
    beam = Antenna.from_beam(
        length=30.0,
        radius=lambda x: 0.1 * (1 - (1 - taper) * x),
        modulus=3000.0,
        density=1.3e-3,
        n_segments=100,
        planes=2,
    )
    swift = 0.1 / (2 * 30.0**2) * np.sqrt(3000.0 / 1.3e-3) / (2 * np.pi)  # r/2 · √(E/ρ) / L²
    found = compute_modes(beam, 10).frequency.reshape(5, 2)
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=1e-12)
    np.testing.assert_allclose(found[:, 0], swift * np.array(ROOTS[kind]), rtol=0.01)


def test_a_strip_bends_its_second_way_by_its_width():
    strip = {"width": 0.6, "thickness": 0.2, "modulus": 100.0, "density": 1e-3}
    antenna = Antenna.from_beam(length=9.0, n_segments=9, planes=3, shear_modulus=40.0, **strip)
    ratio = antenna.stiffness[1:] / antenna.stiffness[0]
    np.testing.assert_allclose(ratio[0], (0.6 / 0.2) ** 2)
    twist = 0.6 * 0.2**3 * 0.263  # Timoshenko & Goodier's table for a strip thrice as wide
    np.testing.assert_allclose(antenna.stiffness[2, 1:], 40.0 * twist / 1.0, rtol=2e-3)
    # the hinge at the base is half as far from its middle, in every way that it turns
    np.testing.assert_allclose(antenna.stiffness[:, 0], 2 * antenna.stiffness[:, 3], rtol=1e-12)
    np.testing.assert_allclose(antenna.stiffness[:, 1:], antenna.stiffness[:, [3] * 8])


REFUSED = {
    "torsion without its stiffness": (
        {"rest_angle": np.zeros((3, 7))},
        "rest_angle has 3 planes, but stiffness 2.*Torsion needs its stiffness",
    ),
    "four planes": ({"stiffness": np.ones((4, 7))}, "2 rows for bending .* got 4"),
    "planes of a planar one": (
        {"stiffness": 1.0, "damping": np.ones((2, 7))},
        "damping has 2 planes, but stiffness 1",
    ),
    "curved in which plane": ({"rest_angle": np.full(7, 0.1)}, "a row for each plane"),
    "slack in one plane": (
        {"stiffness": np.stack([np.ones(7), np.zeros(7)])},
        "0 in every hinge of the plane 'z'",
    ),
    "of the wrong length": (
        {"stiffness": np.ones((2, 6))},
        "stiffness must be one number or 7",
    ),
    "a taper in one plane": (
        {"stiffness": 1.0, "taper": 0.5},
        "taper is for antennas in space",
    ),
    "a taper below a point": ({"taper": -0.1}, "taper must be finite and ≥ 0, got -0.1"),
    "NaN": (
        {"stiffness": np.full((2, 7), np.nan)},
        "stiffness must be finite.*plane 1, segment 1",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_fit_is_refused(case):
    changes, words = REFUSED[case]
    with pytest.raises(InvalidInput, match=words):
        make(**changes)


def test_angles_of_another_shape_are_refused():
    with pytest.raises(InvalidInput, match=r"plane 2, segment\), got shape \(7,\)"):
        make().shape(np.zeros(7))


def test_a_beam_that_twists_says_how_stiffly():
    beam = {"length": 10.0, "radius": 0.1, "modulus": 100.0, "density": 1e-3}
    with pytest.raises(InvalidInput, match="give shear_modulus"):
        Antenna.from_beam(**beam, planes=3)
    with pytest.raises(InvalidInput, match="planes must be 1, 2, or 3"):
        Antenna.from_beam(**beam, planes=4)


BEAM = """schema = "feeler.antenna/1"
n_segments = 12
planes = 2

[beam.length]
unit = "mm"
value = 24.0
[beam.radius]
unit = "mm"
formula = "0.1 - 0.09 * x"
[beam.modulus]
unit = "GPa"
value = 3.0
[beam.density]
unit = "g/mm³"
value = 0.0013

[rest_angle]
unit = "rad"
formula = ["0.02 * x", "-0.01"]
"""


def test_a_file_holds_an_antenna_in_space(tmp_path):
    for antenna in (make(3, rest_angle=np.full((3, 7), 0.1), taper=0.9), make(2, taper=0.3)):
        save_antenna(antenna, tmp_path / "a.toml")
        assert load_antenna(tmp_path / "a.toml") == antenna
    found = parse_antenna(BEAM)
    x = (np.arange(12) + 0.5) / 12
    np.testing.assert_allclose(found.antenna.rest_angle, [0.02 * x, np.full(12, -0.01)])
    assert found.antenna.taper[-1] == pytest.approx(0.01 / 0.0175)
    save_antenna(found.antenna, tmp_path / "b.toml", found.sources)
    again = read_antenna_file(tmp_path / "b.toml")
    assert again.antenna == found.antenna
    assert again.sources["beam.radius"].formula == "0.1 - 0.09 * x"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["0.02 * x", "-0.01"]', '["0.02 * x"]', "rest_angle.formula: must be 2 rows"),
        ("planes = 2", "planes = 3", "beam: torsion needs its stiffness"),
        ("planes = 2", "planes = 4", "planes: must be a whole number from 1 to 3"),
    ],
)
def test_a_file_that_is_wrong_names_the_key(old, new, words):
    with pytest.raises(InvalidInput, match=words):
        parse_antenna(BEAM.replace(old, new))


def test_each_mode_in_space_has_the_damping_of_its_own_plane():
    """Damping in proportion b to stiffness: a mode's ratio is b ω / 2, with b of its plane."""
    shares = np.array([[0.02], [0.3]])
    stiffness = make(2).stiffness * [[1.0], [2.7]]
    found = compute_modes(make(2, stiffness=stiffness, damping=shares * stiffness), 4)
    plane = np.abs(found.angle).sum(axis=2).argmax(axis=1)
    assert sorted(plane) == [0] * (plane == 0).sum() + [1] * (plane == 1).sum()
    assert np.count_nonzero(np.diff(plane)) > 1  # the planes' modes lie between each other's
    expected = shares[plane, 0] * 2 * np.pi * found.frequency / 2
    np.testing.assert_allclose(found.damping_ratio, expected, rtol=1e-9)


def test_a_file_s_one_stiffness_is_that_of_every_plane():
    text = write_antenna(cockroach().replace(stiffness=2.0, damping=1.0))
    found = parse_antenna(text.replace("n_segments", "planes = 2\nn_segments", 1)).antenna
    assert found.spatial and found.stiffness.shape == (2, 140)
    np.testing.assert_array_equal(found.stiffness, 2.0)
