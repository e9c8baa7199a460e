"""Laws of static equilibria in front of a wall: closed forms and what refuses."""

import numpy as np
import pytest

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.physics.equilibrium import Equilibrium, solve_static
from feeler.presets import make_preset


def make(n: int = 24, **fields: object) -> Antenna:
    base = {"segment_mass": 1e-6, "radius": 0.25, "stiffness": 1e-2, "damping": 1e-2}
    return Antenna(**{"segment_length": np.full(n, 0.4)} | base | fields)


def bring(antenna: Antenna, walls: np.ndarray, friction: float = 0.0) -> Equilibrium:
    """The antenna, leaning towards a wall that comes to the last of these distances [mm]."""
    standing = Equilibrium(antenna, friction, 0.5)
    assert all(standing.settle(wall).balanced for wall in walls)
    return standing


def test_away_from_the_wall_it_keeps_its_slack_shape():
    antenna = make(rest_angle=np.linspace(-0.1, 0.02, 24))
    standing = bring(antenna, [50.0])
    np.testing.assert_allclose(standing.angle, antenna.rest_angle, atol=1e-12)
    assert np.isnan(standing.contact_place)


def test_a_tip_against_a_frictionless_wall_stands_as_under_one_force():
    """All hinges carry one force across the wall, and that force alone holds the same shape; the
    tip stands a radius before the wall.
    """
    antenna = make(stiffness=np.linspace(2e-2, 1e-2, 24))
    standing = bring(antenna, np.linspace(4.8, 4.3, 6))
    assert standing.contact_place == pytest.approx(1.0)
    points = antenna.shape(standing.angle, base_angle=0.5)
    assert points[-1, 0] == pytest.approx(4.3 - 0.25, abs=2e-3)
    force = antenna.stiffness * standing.angle / (points[-1, 1] - points[:-1, 1])
    np.testing.assert_allclose(force, force.mean(), rtol=1e-4)
    turned = force.mean() * np.array([np.cos(0.5), np.sin(0.5)])  # in the base's frame
    np.testing.assert_allclose(standing.angle, solve_static(antenna, turned), atol=1e-5)


def test_friction_is_at_most_its_coefficient_times_the_pressure():
    """Seen by the moments of two hinges, the force leans no more than friction lets it; and it
    leans.
    """
    antenna = make()
    standing = bring(antenna, np.linspace(4.8, 4.2, 13), friction=0.3)
    points = antenna.shape(standing.angle, base_angle=0.5)
    lever = points[-1] - points[:-1]
    normal, along = np.linalg.lstsq(
        np.stack([lever[:, 1], -lever[:, 0]], axis=1), antenna.stiffness * standing.angle
    )[0]
    assert normal < 0 and 0.05 < abs(along / normal) < 0.3 * 1.02


@pytest.mark.parametrize(
    ("antenna", "message"),
    [
        (make(2, stiffness=[0.0, 1.0], damping=0.0), "stiffness or damping > 0"),
        (make_preset("rat-whisker"), "in space"),
    ],
)
def test_what_it_cannot_do_is_named(antenna, message):
    with pytest.raises(InvalidInput, match=message):
        Equilibrium(antenna, 0.0, 0.0)
