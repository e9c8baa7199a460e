"""Sensilla against closed forms: adaptation is a power law, a ramp ends on a plateau."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.spikes import CAMPANIFORM, HAIR, Population, find_gain, place_sensilla
from feeler.spikes.sensilla import Sensillum, encode_touch
from tests.spikes._touches import POSITION, make_bent

OPEN = Sensillum(ceiling=1e6)


def run(stimulus, step, sensillum=OPEN):
    """Rates [Hz] of one unit with this stimulus, and the stiffness."""
    one = Population(position=[0.5], side=[1], gain=1.0, sensilla=(sensillum,))
    taps, shares = one.find_taps(np.array([0.4, 0.6]))
    rates = np.zeros((len(stimulus), 1))
    samples = np.repeat(np.asarray(stimulus, dtype=float)[:, None], 2, axis=1)
    stiff = encode_touch(samples, taps, shares, np.ones(1), one.table, step, rates)
    return rates[:, 0], stiff


@pytest.mark.parametrize("b", [1.0, 1.5, 2.2615, 3.0])
@pytest.mark.parametrize("step", [0.01, 2.0])
def test_what_is_held_adapts_as_the_closed_form_says_at_any_step(b, step):
    sensillum = OPEN.replace(b=b, c=0.0, d=0.0)
    rates, _ = run(np.full(40, 0.7), step, sensillum)
    first = rates[0] / sensillum.a  # what is left of the step after the first sample
    time = step * np.arange(40) / sensillum.tau
    left = (
        first * np.exp(-time)
        if b == 1
        else (first ** (1 - b) + (b - 1) * time) ** (1 / (1 - b))
    )
    np.testing.assert_allclose(rates, sensillum.a * left, rtol=1e-9)


@pytest.mark.parametrize("slope", [0.002, 0.013])
def test_a_ramp_ends_on_the_plateau_where_the_threshold_moves_as_fast(slope):
    time = np.arange(0, 2000, 0.5)
    rates, _ = run(slope * time, 0.5)
    lag = (OPEN.tau * slope) ** (1 / OPEN.b)
    expected = OPEN.a * lag + OPEN.c * slope * time[-1] + OPEN.d
    assert rates[-1] == pytest.approx(expected, rel=1e-5)


def test_steps_follow_a_solver_of_the_equation_in_second_order():
    def stimulus(t):
        return 1.2 * np.sin(np.asarray(t) / 40) ** 2

    def slope(t, x):
        e = stimulus(t) - x
        return np.sign(e) * np.abs(e) ** OPEN.b / OPEN.tau

    solved = solve_ivp(slope, (0, 200), [0.0], rtol=1e-10, atol=1e-12, dense_output=True)
    off = []
    for step in (1.0, 0.5, 0.25):
        time = np.arange(0, 200, step)
        u = stimulus(time)
        true = np.maximum(OPEN.a * (u - solved.sol(time)[0]) + OPEN.c * u + OPEN.d, 0)
        off.append(np.abs(run(u, step)[0] - true).max())
    assert off[0] < 0.5 and off[1] < off[0] / 3 and off[2] < off[1] / 3


@pytest.mark.parametrize("rise", [1.0, 4.0, 9.0])
def test_up_to_the_stiffness_allowed_a_ramp_is_within_five_per_cent_of_its_peak(rise):
    fine = np.arange(0, 30, 0.004)
    true, stiff = run(np.minimum(rise * fine / 8, rise), 0.004)
    step = 0.004 * np.floor(1 / stiff)  # at this slope the stiffness grows with the step
    time = np.arange(0, 30, step)
    rates, stiff = run(np.minimum(rise * time / 8, rise), step)
    assert 0.9 < stiff <= 1.0
    assert np.abs(rates - np.interp(time, fine, true)).max() < 0.05 * true.max()


def test_too_coarse_samples_are_refused_with_a_step_that_would_do():
    touches = make_bent()
    population = place_sensilla(POSITION, 400.0)
    with pytest.raises(InvalidInput, match=r"too coarse .* Sample every (0\.\d+) ms") as caught:
        population.encode(touches)
    step = float(str(caught.value).split("Sample every ")[1].split(" ")[0])
    count = int(90 / step)
    assert np.isfinite(population.encode(make_bent(steps=count, step=step))["rate"]).all()


def test_a_gain_that_saturates_every_unit_is_said():
    numb = Sensillum(ceiling=40.0)
    with pytest.warns(
        ModelValidityWarning, match="every unit that fires reaches its greatest rate"
    ):
        rates = place_sensilla(POSITION, 30.0, sensillum=numb).encode(make_bent())["rate"]
    assert rates.max() == 40


def test_phasic_and_tonic_parts_add_up_above_the_threshold():
    u = np.linspace(0, 3, 200)
    whole, phasic, tonic = (run(u, 1.0, one)[0] for one in (OPEN, OPEN.phasic, OPEN.tonic))
    above = tonic > 0
    assert above.any() and not above.all()
    np.testing.assert_allclose((phasic + tonic)[above], whole[above])


def test_hair_sensilla_answer_to_the_rate_of_bending():
    u = np.concatenate([np.linspace(0, 2, 26), np.full(10, 2.0)])
    rates, stiff = run(u, 1.0, HAIR)
    np.testing.assert_allclose(rates[1:26], HAIR.v * 0.08)
    assert not rates[26:].any() and stiff == 0


def test_each_side_feels_its_own_sign_and_between_sensors_bending_is_interpolated():
    touches = make_bent()
    places = np.array([0.25, 0.35])
    rates = place_sensilla(places, 20.0).encode(touches)["rate"]
    other = place_sensilla(places, 20.0).encode(touches.assign(angle=-touches["angle"]))["rate"]
    np.testing.assert_array_equal(rates[:, :2], other[:, 2:])
    middle = touches["angle"][:, 1:3].mean("sensor")
    alone = touches.assign(
        angle=touches["angle"] * 0 + middle.drop_vars("position", errors="ignore")
    )
    np.testing.assert_allclose(
        place_sensilla(places, 20.0).encode(alone)["rate"][:, 1], rates[:, 1], rtol=1e-9
    )
    assert rates["unit_side"].values.tolist() == [1, 1, -1, -1]


def test_a_gain_is_found_at_which_half_of_the_touches_reach_the_rate():
    touches = make_bent(5)
    found = find_gain(touches, place_sensilla(POSITION, 1.0), 150.0)
    best = found.encode(touches)["rate"].max(("unit", "time"))
    assert float(best.median()) == pytest.approx(150, rel=1e-6)
    with pytest.raises(InvalidInput, match="no gain makes half of the touches reach 150 Hz"):
        find_gain(touches.assign(angle=0 * touches["angle"]), found, 150.0)
    with pytest.raises(InvalidInput, match=r"rate must be > 0, got -3"):
        find_gain(touches, found, -3.0)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"position": [0.5, 1.2]}, "position must be finite and from 0 to 1, got 1.2"),
        ({"position": [0.5, np.nan]}, "Population.position must be finite"),
        ({"side": [1, 0]}, "side of a unit is 1 or −1"),
        ({"gain": [3.0, -1.0]}, "gain must be finite and > 0, got -1"),
        ({"sensilla": (CAMPANIFORM,) * 3}, "2 units but 3 sensilla"),
    ],
)
def test_a_population_says_what_is_wrong_with_it(wrong, words):
    right = {"position": [0.2, 0.5], "side": [1, -1], "gain": 2.0}
    with pytest.raises(InvalidInput, match=words):
        Population(**right | wrong)


def test_a_unit_without_sensors_near_it_is_refused():
    with pytest.raises(
        InvalidInput, match=r"the unit at 1 lies beyond the sensors.*0\.1 to 0\.3"
    ):
        place_sensilla(np.array([1.0]), 3.0).find_taps(np.array([0.1, 0.2, 0.3]))
