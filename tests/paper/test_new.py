"""Planted tensors: what they do not depend on can be new."""

from itertools import product

import numpy as np
import pytest
import xarray as xr

from feeler.decoding.sweeps import Plan
from paper.fig5_new import compute

PLAN = Plan(ratios=(0.01,), n_repeats=1, n_copies=4, probe=0.01)
TRIALS = list(product(("ball", "box"), (1.5, 3.0), (0.5, 0.6, 0.7)))


def make_tensors(blind):
    """A blip for every trial, in a place of its own for each value of each attribute but the
    ``blind`` one.
    """
    angle = np.zeros((len(TRIALS), 3, 12))
    for trial, (feature, size, location) in enumerate(TRIALS):
        values = (feature == "box", size == 3.0, round(10 * location - 5))
        for sensor, (name, value) in enumerate(
            zip(("feature", "size", "location"), values, strict=True)
        ):
            angle[trial, sensor, 0 if name == blind else 4 * int(value) + 2] = 1.0
    features, sizes, locations = zip(*TRIALS, strict=True)
    trial = {"feature": list(features), "size": list(sizes), "location": list(locations)}
    return xr.Dataset(
        {"angle": (("trial", "sensor", "time"), angle)},
        coords={k: ("trial", v) for k, v in trial.items()},
    )


@pytest.mark.parametrize(("blind", "split"), [("size", "size"), ("location", "place")])
def test_a_new_value_of_what_is_not_felt_costs_nothing(blind, split):
    found = compute(make_tensors(blind), PLAN)
    assert found.accuracy[split] == 1.0 and found.change[blind] == 0.0
    assert list(found.parts[split].values()) == pytest.approx([1.0, 1.0])


def test_a_change_is_a_share_of_the_norm_and_neighbouring_places_only_are_compared():
    change = compute(make_tensors(None), PLAN).change
    assert all(
        value == pytest.approx(np.sqrt(2 / 3)) for value in change.values()
    )  # one of three blips moves
    assert compute(make_tensors(None), PLAN).chance == {
        "size": pytest.approx(1 / 6),
        "place": pytest.approx(1 / 4),
    }
