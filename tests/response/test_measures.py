"""Deflection ratios, restitution and bending stiffness on motions with known answers."""

import numpy as np
import pytest

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.experiment.bend import bend
from feeler.response import (
    measure_bending_stiffness,
    measure_deflection_ratios,
    measure_restitution,
)

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


def bounce(e):
    return np.where(TIME < 20, 0.5 * (20 - TIME), np.where(TIME > 24, 0.5 * e * (TIME - 24), 0.0))


@pytest.mark.parametrize(
    ("e", "touch"),
    [(0.3, None), (1.0, None), (0.0, (20.0, 24.0)), (0.3, (20.0, 24.0)), (1.0, (20.0, 24.0))],
)
def test_restitution_of_a_bounce(e, touch):
    assert measure_restitution(TIME, bounce(e), touch=touch) == pytest.approx(e, abs=1e-12)


@pytest.mark.parametrize("e", [0.3, 1.0])
def test_bodies_that_never_quite_meet_turn_where_they_are_nearest(e):
    gap = 0.2 + np.where(TIME < 20, 0.5 * (20 - TIME), 0.5 * e * (TIME - 20))
    assert measure_restitution(TIME, gap) == pytest.approx(e)


def test_bodies_that_stay_together_leave_no_samples_after_contact():
    with pytest.raises(InvalidInput, match="samples are needed before and after"):
        measure_restitution(TIME, bounce(0.0))


@pytest.mark.parametrize("e", [0.3, 1.0])
@pytest.mark.parametrize("n_samples", [2, 4, 7])
def test_no_sample_of_the_contact_is_in_a_slope(e, n_samples):
    """Bodies that press into each other from 19.6 to 24.3 ms, between samples; outside the gap is
    two straight lines.
    """
    pressed = -0.05 * np.sin(np.pi * (TIME - 19.6) / 4.7)
    gap = np.where(
        TIME < 19.6, 0.5 * (19.6 - TIME), np.where(TIME > 24.3, 0.5 * e * (TIME - 24.3), pressed)
    )
    for touch in (None, (19.6, 24.3), (19.5, 24.0)):
        assert measure_restitution(TIME, gap, touch=touch, n_samples=n_samples) == pytest.approx(
            e, abs=1e-12
        )


def test_four_samples_are_taken_unless_another_number_is_given():
    """A gap that curves has another slope over four samples, −0.5 − 0.02 · 2.5 at 2.5 ms before
    contact, than over five.
    """
    before, after = TIME - 20, TIME - 24
    gap = np.where(
        before < 0,
        -0.5 * before + 0.01 * before**2,
        np.where(after > 0, 0.3 * after + 0.01 * after**2, 0.0),
    )
    for touch in (None, (20.0, 24.0), (19.5, 24.4)):
        assert measure_restitution(TIME, gap, touch=touch) == pytest.approx(
            (0.3 + 0.02 * 2.5) / (0.5 + 0.02 * 2.5)
        )
    assert measure_restitution(TIME, gap, n_samples=5) == pytest.approx(
        (0.3 + 0.02 * 3) / (0.5 + 0.02 * 3)
    )


def test_samples_before_and_after_contact_must_all_be_there():
    gap = bounce(0.5)
    assert measure_restitution(TIME[16:29], gap[16:29]) == pytest.approx(
        0.5
    )  # four before 20 ms, four after 24 ms
    for cut in (slice(17, 29), slice(16, 28)):
        with pytest.raises(InvalidInput, match="4 samples are needed before and after"):
            measure_restitution(TIME[cut], gap[cut])


def test_restitution_refuses_bodies_that_part():
    with pytest.raises(InvalidInput, match="do not approach"):
        measure_restitution(TIME, TIME + 1.0, touch=(20.0, 24.0))


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
    assert measure_bending_stiffness(force, tip, antenna.length) == pytest.approx(
        rigidity, rel=0.01
    )


def test_rigidity_by_hand_and_for_many_loads():
    """F a³ / 3 δ: 0.002 N at 10 mm bending by 0.5 mm is 4/3 N·mm²; both signs may turn."""
    assert measure_bending_stiffness(0.002, 0.5, 10.0) == pytest.approx(4 / 3)
    assert measure_bending_stiffness(24.0, 0.5, 0.5) == pytest.approx(
        2.0
    )  # less than a millimetre from the clamp
    found = measure_bending_stiffness(
        np.array([-0.002, 0.004]), np.array([-0.5, 0.5]), np.array([10.0, 5.0])
    )
    np.testing.assert_allclose(found, [4 / 3, 1 / 3])


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ((1.0, 0.0, 10.0), "non-zero"),
        ((0.0, 1.0, 10.0), "non-zero"),
        ((1.0, np.array([1.0, 0.0]), 10.0), "non-zero"),
        ((np.array([1.0, -1.0]), 1.0, 10.0), "of one sign"),
        ((1.0, -1.0, 10.0), "of one sign"),
        ((1.0, 1.0, 0.0), "> 0 mm"),
        ((1.0, 1.0, np.array([5.0, -5.0])), "> 0 mm from the clamp, got -5"),
        ((np.nan, 1.0, 1.0), "force must be finite"),
        ((1.0, np.array([1.0, np.inf]), 1.0), "deflection must be finite"),
    ],
)
def test_bending_refuses_what_has_no_stiffness(arguments, match):
    with pytest.raises(InvalidInput, match=match):
        measure_bending_stiffness(*arguments)
