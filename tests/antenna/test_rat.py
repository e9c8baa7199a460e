"""The rat's whiskers stand and bend as was published."""

import numpy as np
import pytest

import feeler
from feeler.antenna import compute_modes
from feeler.antenna.animals import FOLLICLE
from feeler.antenna.segments import to_matrix
from feeler.presets import rat_whiskers

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
    a1, c1 = (rat_whiskers(n_segments=200)[name][0] for name in ("A1", "C1"))
    assert 2 * a1.radius[0] == pytest.approx(0.041 + 0.062 + 0.011 - 0.0039, rel=5e-3)
    slope = (a1.radius[0] - a1.radius[-1]) / (31.0 * 199 / 200)
    assert slope == pytest.approx(0.0012 + 0.00017 - 0.000066 + 0.00011, rel=1e-6)
    assert 0.0015 < c1.radius[-1] < 0.0018


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
