"""The chain in space against closed forms: helices, a heavy elastica in a turned plane, and the
moment by which a whisker tells how far away a peg is.
"""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from feeler.antenna.segments import Antenna, to_matrix
from feeler.objects import Peg
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.physics.simulation import Simulation

pytestmark = pytest.mark.long

LENGTH, MODULUS, RADIUS = 40.0, 5000.0, 0.1  # mm, MPa, mm
STIFF = MODULUS * np.pi / 4 * RADIUS**4


def make_beam(
    radius=RADIUS, n: int = 40, density: float = 1.4e-3, damping: float = 20.0
) -> Antenna:
    return Antenna.from_beam(
        length=LENGTH,
        radius=radius,
        modulus=MODULUS,
        density=density,
        n_segments=n,
        damping_time=damping,
        planes=2,
    )


@pytest.mark.parametrize(("bend", "twist"), [(0.3, 0.1), (0.2, -0.4), (0.5, 0.0)])
def test_bending_and_twisting_at_rest_make_a_helix(bend, twist):
    """Curvature κ and torsion τ: radius κ/(κ² + τ²), and all points on one cylinder."""
    n, size = 400, 0.05
    rest = np.stack([np.zeros(n), np.full(n, bend * size), np.full(n, twist * size)])
    antenna = Antenna(
        segment_length=np.full(n, size),
        segment_mass=1e-6,
        radius=0.01,
        stiffness=np.ones((3, n)),
        damping=0.0,
        rest_angle=rest,
    )
    points, square = antenna.shape(), bend**2 + twist**2
    along = np.diff(points, axis=0) / size
    turned = np.diff(along, axis=0) / size
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), bend, rtol=1e-3)
    axis = np.cross(turned[100], turned[101])
    axis /= np.linalg.norm(axis)
    rise = np.abs(along @ axis)
    np.testing.assert_allclose(rise, abs(twist) / np.sqrt(square), atol=3e-3)
    flat = points - np.outer(points @ axis, axis)
    middle = flat[50:-50] + np.gradient(along, size, axis=0)[49:-50] / square
    away = np.linalg.norm(flat[50:-50] - middle.mean(axis=0), axis=1)
    np.testing.assert_allclose(away, bend / square, rtol=0.02)


def solve_heavy_elastica(weight: float) -> np.ndarray:
    """Tip (across, along) of a clamped beam under its own weight per length w across it:
    EI φ″ = −w (L − s) cos φ, φ(0) = 0, φ′(L) = 0.
    """

    def slope(s, y):
        return [y[1], -weight * (LENGTH - s) * np.cos(y[0]) / STIFF]

    s = np.linspace(0, LENGTH, 200)
    found = solve_bvp(slope, lambda a, b: [a[0], b[1]], s, np.zeros((2, 200)), tol=1e-9)
    fine = np.linspace(0, LENGTH, 4001)
    angle = found.sol(fine)[0]
    return np.array([np.trapezoid(np.sin(angle), fine), np.trapezoid(np.cos(angle), fine)])


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.3])
def test_a_heavy_beam_hangs_as_the_elastica_in_any_plane(turn):
    """Bent by more than 0.8 rad at the tip; 0.5 % of the length."""
    across = np.array([np.cos(turn), 0.0, np.sin(turn)])
    antenna = make_beam()
    pull = 0.6 * 6 * STIFF / (antenna.segment_mass.sum() / LENGTH * LENGTH**3)
    runs = Simulation(antenna, gravity=tuple(pull * across), timestep=0.1)
    runs.step(500.0)
    assert np.abs(runs.velocity).max() < 1e-6
    weight = pull * antenna.segment_mass.sum() / LENGTH
    sideways, along = solve_heavy_elastica(weight)
    wanted = sideways * across + [0.0, along, 0.0]
    np.testing.assert_allclose(runs.tip, wanted, atol=0.005 * LENGTH)
    assert sideways > 0.35 * LENGTH


@pytest.mark.parametrize("turn", [0.0, 1.0])
@pytest.mark.parametrize("place", [0.4, 0.7])
def test_the_moment_at_the_base_tells_how_far_a_peg_is(turn, place):
    """Birdwell et al. 2007: M = 3 E I θ (1/a − 1/L) of a cone turned by θ against a peg at a, in
    any plane, about the axis that it is turned about.
    """
    cone = make_beam(lambda x: RADIUS * (1 - x) + 1e-4, n=60, damping=5.0)
    to_side = to_matrix([0.0, -turn, 0.0])
    push, up = to_side @ [1.0, 0.0, 0.0], to_side @ [0.0, 0.0, 1.0]
    peg, at, angle, slow = Peg(radius=0.5, half_length=5.0), place * LENGTH, 0.02, 1e-4
    thick = cone.radius[
        round(place * cone.n_segments) - 1
    ]  # of the thicker that it lies beside
    item = Object(
        feature=peg,
        place=tuple(np.array([0.0, at, 0.0]) + (thick + 1e-6) * push),
        forward=tuple(-push),
        left=tuple(np.cross(up, -push)),
        friction=0.0,
    )
    motion = BaseMotion(turn=tuple(-slow * up))
    runs = Simulation(cone, item, base=motion)
    runs.step(angle / slow)
    runs.move_base()
    runs.step(60.0)  # until damping has let go
    wanted = 3 * STIFF * angle * (1 / at - 1 / LENGTH)
    assert abs(float(runs.base_moment @ -up)) == pytest.approx(wanted, rel=0.01)
    assert np.abs(runs.base_moment @ push) < 0.02 * wanted


def whisk(antenna: Antenna, swing: float, rate: float, turn: float) -> tuple[np.ndarray, ...]:
    """Amplitudes (harmonic,) of the force along the base, across it, and of the moment, over the
    third whisk of angle swing·sin(2π·rate·t) in a plane turned about y.
    """
    step, n = 0.25, round(1 / (rate * 0.25))
    time = step * np.arange(3 * n + 1)
    angle = swing * np.sin(2 * np.pi * rate * time)
    axis = to_matrix([0.0, -turn, 0.0]) @ [0.0, 0.0, 1.0]
    pose = np.concatenate([np.zeros((time.size, 3)), angle[:, None] * axis], axis=1)
    runs = Simulation(antenna, base=BaseMotion(time=time, pose=pose), timestep=0.05)
    seen = []
    for now in angle[1:]:
        runs.step(step)
        along = to_matrix(now * axis) @ [0.0, 1.0, 0.0]
        force = runs.base_force
        seen.append([force @ along, force @ np.cross(along, axis), runs.base_moment @ axis])
    return tuple(2 * np.abs(np.fft.rfft(seen[-n:], axis=0)).T / n)


@pytest.mark.parametrize("turn", [0.0, 1.1])
def test_free_whisking_is_felt_at_once_and_at_twice_its_rate(turn):
    """Quist et al. 2014: what a stiff whisker feels of its own mass. Along it the base holds
    −S θ̇², at twice the rate of whisking; across it and about it S θ̈ and I θ̈, at the rate.
    """
    rate, swing = 0.008, 0.39  # 8 Hz, as WHISKiT whisks; rad
    antenna = make_beam(lambda x: RADIUS * (1 - 0.9 * x), n=20)
    stiff = antenna.replace(stiffness=300 * antenna.stiffness, damping=20 * antenna.damping)
    place = np.arange(20) * LENGTH / 20 + stiff.mass_centre
    first = float((stiff.segment_mass * place).sum())
    second = float((stiff.segment_mass * place**2 + stiff.inertia).sum())
    fast = 2 * np.pi * rate
    along, across, moment = whisk(stiff, swing, rate, turn)
    assert along[2] == pytest.approx(0.5 * first * fast**2 * swing**2, rel=2e-3)
    assert across[1] == pytest.approx(first * fast**2 * swing, rel=2e-3)
    assert moment[1] == pytest.approx(second * fast**2 * swing, rel=2e-3)
    assert along[[1, 3]].max() < 1e-6 * along[2]
    assert max(across[2] / across[1], moment[2] / moment[1]) < 1e-6


def test_a_curved_whisker_feels_both_rates_along_its_base():
    """As Quist et al. 2014 found: what curves lets forces along the base hold a part of S θ̈."""
    rest = np.stack([np.full(20, 0.03), np.zeros(20)])
    curved = make_beam(lambda x: RADIUS * (1 - 0.9 * x), n=20).replace(rest_angle=rest)
    along, _, moment = whisk(curved, 0.39, 0.008, 0.0)
    assert along[1] > 0.3 * along[2]
    assert along[2] > 0.3 * along[1]
    assert moment[2] < 0.01 * moment[1]
