"""Deflection ratios and a cantilever's bending on motions with known answers."""

import numpy as np
import pytest

from feeler.analysis import measure_deflection_ratios
from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.experiments.mechanics import bend

TIME = np.arange(0.0, 50.0, 1.0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("peak", [20.0, 20.3, 20.77])
def test_ratios_of_points_that_follow_the_tip(sign, peak):
    tip = sign * (10 - 0.01 * (TIME - peak) ** 2)
    ratios = measure_deflection_ratios(TIME, np.outer([0.22, 0.55], tip), tip)
    np.testing.assert_allclose(ratios, [0.22, 0.55], rtol=1e-12)


def test_ratios_belong_to_the_moment_between_samples():
    tip = 10 - 0.01 * (TIME - 20.4) ** 2
    point = 0.3 * TIME
    assert measure_deflection_ratios(TIME, point, tip)[0] == pytest.approx(
        0.3 * 20.4 / 10, rel=1e-12
    )


@pytest.mark.parametrize("curve", [0.0, 0.02, -0.05])
def test_points_are_read_on_parabolas_of_their_own(curve):
    """A point that itself turns, sampled every 2 ms: its value at the tip's vertex, 20.9 ms, is
    that of its parabola.
    """
    time = 2.0 * np.arange(20)
    tip, point = 10 - 0.01 * (time - 20.9) ** 2, 3.0 + 0.1 * time + curve * (time - 17.0) ** 2
    expected = (3.0 + 2.09 + curve * 3.9**2) / 10
    assert measure_deflection_ratios(time, point, tip)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("bend", [0.5, 1.0, 2.0])
def test_the_moment_is_the_vertex_however_sharp_the_turn(bend):
    tip = 10 - bend / 2 * (TIME - 20.25) ** 2
    assert measure_deflection_ratios(TIME, 0.3 * TIME, tip * (np.abs(tip) < 11))[
        0
    ] == pytest.approx(0.3 * 20.25 / 10)


def test_a_tip_that_never_turns_is_refused():
    for tip, word in ((TIME, "last"), (TIME[::-1], "first")):
        with pytest.raises(InvalidInput, match=f"farthest out at the {word} sample"):
            measure_deflection_ratios(TIME, TIME, tip)


@pytest.mark.parametrize("peak", [1.1, 47.9])
def test_a_tip_may_turn_beside_the_ends_of_the_trace(peak):
    tip = 10 - 0.001 * (TIME - peak) ** 2
    assert measure_deflection_ratios(TIME, 0.3 * TIME, tip)[0] == pytest.approx(0.3 * peak / 10)


def test_a_tip_that_rests_at_its_farthest_but_for_a_bit_is_read_there():
    tip = np.clip(TIME / 20, 0.0, 1.0) * np.clip((49 - TIME) / 20, 0.0, 1.0)
    tip[20] = np.nextafter(1.0, 0.0)
    assert np.argmax(tip) == 21 and measure_deflection_ratios(TIME, 0.3 * TIME, tip)[
        0
    ] == pytest.approx(0.3 * 21)


def test_gaps_and_shapes_of_points_are_refused():
    tip = 10 - 0.1 * (TIME - 20.4) ** 2
    with pytest.raises(InvalidInput, match="missing samples"):
        measure_deflection_ratios(TIME, np.where(TIME == 9, np.nan, tip), tip)
    with pytest.raises(InvalidInput, match="with 50 samples"):
        measure_deflection_ratios(TIME, tip[:-1], tip)


def test_a_uniform_cantilever_gives_back_its_rigidity():
    """n hinges of stiffness k, each half a segment from the clamp's side, approach EI = k ℓ."""
    n, rigidity = 200, 0.5
    length = 40.0 / n
    antenna = Antenna(
        segment_length=np.full(n, length),
        segment_mass=1e-5,
        radius=0.1,
        stiffness=rigidity / length,
        damping=1.0,
    )
    force = 1e-6
    tip = float(bend(antenna, force)["tip"].values[0, 0])
    assert force * antenna.length**3 / (3 * tip) == pytest.approx(rigidity, rel=0.01)
