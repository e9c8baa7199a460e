"""The best of a family of rates: planted tops, planted nothing, and a small run."""

import numpy as np
import pytest
import xarray as xr

from feeler.presets import cockroach
from paper.statements import judge, load_statements
from paper.table import Results
from studies.receptor.section import (
    PUBLISHED_RATE,
    collect_values,
    compute_run,
    find_best,
    find_jump,
    find_lag,
    find_lead,
)
from studies.stored import read_declared

ASKED = read_declared("receptor")
OWN = [one for one in load_statements() if one.id.startswith("own-receptor")]


def make_data(tops, rates, sets=8, noise=0.004, seed=0):
    """Accuracy with a parabola's top at one rate for each mixture; None: the same everywhere."""
    rates = np.array(rates)
    rng = np.random.default_rng(seed)
    shape = [np.zeros(rates.size) if top is None else -40 * (rates - top) ** 2 for top in tops]
    accuracy = (
        0.8 + np.array(shape) + noise * rng.standard_normal((sets, len(tops), rates.size))
    )
    return xr.Dataset(
        {
            "accuracy": (("set", "bend", "rate"), accuracy),
            "floor": ("bend", np.ones(len(tops))),
        },
        {"bend": ASKED["bends"][: len(tops)], "rate": rates},
    )


@pytest.mark.parametrize("top", [-0.03, -0.0827, -0.11])
def test_a_planted_top_is_found(top):
    found = find_best(make_data([top], ASKED["rates"]), 200)
    assert found["value"][0] == pytest.approx(top, abs=0.005)
    assert found["ends"][0, 0] <= top + 0.005 and found["ends"][1, 0] >= top - 0.005


@pytest.mark.parametrize(("top", "end"), [(-0.3, -0.15), (0.2, 0.02)])
def test_a_top_beyond_the_family_is_its_end(top, end):
    assert find_best(make_data([top], ASKED["rates"]), 50)["value"][0] == end


def test_the_jump_lies_between_the_mixtures_where_the_best_becomes_steeper():
    assert find_jump(make_data([-0.03, -0.05, -0.12], ASKED["rates"])) == (0.001, 0.003)
    assert find_jump(make_data([-0.03, -0.05], ASKED["rates"])) is None


def test_the_published_rate_leads_where_it_is_planted_and_lags_where_another_is():
    data = make_data([-0.03, PUBLISHED_RATE, -0.13], ASKED["rates"])
    lead = find_lead(data)
    assert lead["bend"] == data["bend"][1] and lead["low"] > 0
    lag = find_lag(data)
    truth = 4000 * (PUBLISHED_RATE - np.array([-0.03, PUBLISHED_RATE, -0.13])) ** 2
    np.testing.assert_allclose(lag["mean"], truth, atol=1.0)


def plant_nothing(seed):
    """Every antenna as good as the others: the runs of the declared study, of noise alone."""
    runs = {one["name"]: ASKED | one for one in ASKED["run"]}
    found = {}
    for number, (name, asked) in enumerate(runs.items()):
        one = make_data(
            [None] * len(asked["bends"]), asked["rates"], asked["sets"], 0.01, seed + number
        )
        one = one.assign_coords(bend=asked["bends"])
        found[name] = xr.concat([one] * len(asked["signals"]), "signal").assign_coords(
            signal=asked["signals"]
        )
    return collect_values(found, 200)


@pytest.fixture(scope="module")
def nothing():
    return [plant_nothing(seed) for seed in (0, 100, 200)]


@pytest.mark.parametrize("statement", OWN, ids=lambda one: one.id)
def test_no_rule_is_met_by_planted_nothing(statement, nothing):
    for values in nothing:
        assert statement.list_keys() <= set(values)
        assert not judge(statement, Results.make(values), "paper").holds


@pytest.mark.long
def test_a_small_run_meets_the_noise_that_was_set():
    """Over the sets on which the floor was set, the published antenna names that share right."""
    asked = ASKED | {
        "name": "small",
        "speed": 1.2,
        "interval": 4.0,
        "sets": 1,
        "calibrating": 1,
        "held": "total",
        "signals": ["sample"],
        "bends": [0.003, 1.0],
        "rates": [0.0, PUBLISHED_RATE],
        "draws": 10,
    }
    found = compute_run(cockroach(), asked, workers=1)
    own = found["accuracy"].sel(rate=PUBLISHED_RATE)
    np.testing.assert_allclose(own, 0.75, atol=0.12)
    assert (found["floor"] > 0).all()
    even = found["accuracy"].sel(rate=0.0)
    assert (even < own).all()
