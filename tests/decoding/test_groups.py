"""Both comparisons by hand: what is put beside what, on which scale, in which order, and fitted how
often.
"""

from typing import ClassVar

import numpy as np
import pytest
import xarray as xr
from sklearn.base import BaseEstimator

from feeler.decoding import group_tensors, list_groups, make_null
from feeler.decoding.curves import configure
from feeler.decoding.sweeps import Plan
from feeler.errors import InvalidInput, ModelValidityWarning

PLAN = Plan(ratios=(0.1,), n_repeats=1, null_iter=5)
SLOW, FAST = 0.06, 0.6


def make_set(seed, speeds=(FAST, SLOW)):
    """Two places at each speed, the farther one first; the negative half is what rectification
    takes away.
    """
    rng = np.random.default_rng(seed)
    speed, place = np.repeat(speeds, 2), np.tile([0.9, 0.5], len(speeds))
    labels = {
        "feature": ["ball"] * len(speed),
        "size": np.full(len(speed), 1.5),
        "location": place,
        "speed": speed,
        "side": ["left"] * len(speed),
    }
    return xr.Dataset(
        {"angle": (("trial", "sensor", "time"), rng.normal(size=(len(speed), 3, 8)))},
        coords={name: ("trial", values) for name, values in labels.items()},
    )


SETS = {"exponential": make_set(0), "uniform": make_set(1), "linear": make_set(2, (SLOW,))}
PEAK = max(float(data.angle.max()) for data in SETS.values())


class Noting(BaseEstimator):
    """Joint codes are sums over the antenna, as many times as there were trials in the fit; every
    fit is noted.
    """

    fits: ClassVar[list[tuple[int, int, int]]] = []

    def __init__(self, n_restarts=1, max_iter=100):
        self.n_restarts, self.max_iter = n_restarts, max_iter

    def fit(self, X):
        Noting.fits.append((len(X), self.n_restarts, self.max_iter))
        self.n_iter_, self.activations_ = self.max_iter, len(X) * X.sum(axis=1, keepdims=True)
        return self

    def transform(self, X, *, code):
        return X.max(axis=1, keepdims=True)


def pick(name, *trials):
    return np.maximum(SETS[name].angle.values[list(trials)], 0) / PEAK


def test_groups_are_rectified_on_one_scale_slowest_first_and_sorted_by_what_was_touched():
    listed = list_groups(SETS)
    assert {kind: list(groups) for kind, groups in listed.items()} == {
        "speed": ["0.06 m/s", "0.6 m/s"],
        "profile": ["exponential", "uniform", "linear"],
    }
    expected = {
        "speed": [pick("exponential", 3, 2), pick("exponential", 1, 0)],
        "profile": [pick("exponential", 3, 2), pick("uniform", 3, 2), pick("linear", 1, 0)],
    }
    for kind, groups in listed.items():
        for (array, labels), tensors in zip(groups.values(), expected[kind], strict=True):
            np.testing.assert_allclose(array, tensors)
            assert labels.tolist() == ["ball 1.5 0.5", "ball 1.5 0.9"]


def test_a_comparison_of_one_is_left_out_and_a_reference_must_be_there():
    assert list(list_groups({"exponential": SETS["exponential"]})) == ["speed"]
    assert list(
        list_groups({"linear": SETS["linear"], "uniform": SETS["uniform"]}, reference="linear")
    ) == ["profile"]
    with pytest.raises(
        InvalidInput, match="no tensors of the reference antenna 'linear'; given: uniform"
    ):
        list_groups({"uniform": SETS["uniform"]}, reference="linear")


def test_speeds_share_one_fit_profiles_have_their_own_and_each_null_is_fitted_once():
    Noting.fits = []
    groups = group_tensors(SETS, Noting(n_restarts=7), PLAN)
    nulls = [fit for fit in Noting.fits if fit[2] == PLAN.null_iter]
    assert sorted(fit[0] for fit in Noting.fits if fit[2] == 100) == [
        2,
        2,
        2,
        4,
    ]  # both speeds together: 4 touches
    assert (
        len(nulls) == 4
    )  # slow, fast, uniform, linear: the slow ones stand in both comparisons
    assert {fit[1] for fit in Noting.fits if fit[2] == 100} == {7}  # the encoder's own
    assert {fit[1] for fit in nulls} == {PLAN.null_restarts}
    for kind, found in groups.items():
        size = 4 if kind == "speed" else 2
        for group in found.values():
            sums = group.tensors.sum(axis=1, keepdims=True)
            np.testing.assert_allclose(group.codes["joint"], size * sums)
            np.testing.assert_allclose(
                group.codes["ridge"], group.tensors.max(axis=1, keepdims=True)
            )
            np.testing.assert_allclose(
                group.null.codes, 2 * make_null(group.tensors).sum(axis=1, keepdims=True)
            )
    slow, same = groups["speed"]["0.06 m/s"], groups["profile"]["exponential"]
    assert slow.null is same.null and slow.null is not groups["speed"]["0.6 m/s"].null
    assert groups["speed"]["0.6 m/s"].encoder is slow.encoder is not same.encoder


def test_an_encoder_is_given_only_what_it_knows():
    found = configure(Noting(max_iter=3), {"n_restarts": 2, "random_state": 1})
    assert found.get_params() == {"n_restarts": 2, "max_iter": 3}


def make_positive(seed, **labels):
    """A set that bends one way."""
    made = make_set(seed)
    made["angle"] = abs(made["angle"]) + 0.1
    return made.assign_coords({name: ("trial", [value] * 4) for name, value in labels.items()})


@pytest.mark.parametrize("labels", [{"side": ""}, {"azimuth": 180.0}])
def test_of_an_antenna_touched_on_both_sides_groups_lose_neither(labels):
    """Where no label says which way a trial bends, both ways are kept."""
    data = make_positive(0, **labels)
    data["angle"] = data["angle"] * xr.DataArray([1.0, -1.0, 1.0, -1.0], dims="trial")
    with pytest.warns(
        ModelValidityWarning, match="much of a touch's signal.*both ways is kept"
    ):
        listed = list_groups({"exponential": data})["speed"]
    peak = float(abs(data["angle"]).max())
    for (array, _), rows in zip(listed.values(), ([3, 2], [1, 0]), strict=True):
        assert array.shape == (2, 6, 8) and array.min() == 0
        np.testing.assert_allclose(
            array[:, :3] - array[:, 3:], data["angle"].values[rows] / peak
        )


def test_sets_that_were_touched_otherwise_or_are_in_another_unit_are_not_compared():
    """Paired differences would compare one touch with another, and one noise be in two units."""
    moved = SETS["uniform"].assign_coords(location=SETS["uniform"]["location"] + 0.01)
    for other in (moved, SETS["uniform"].isel(trial=slice(1)), make_set(1, (0.3,))):
        with pytest.raises(InvalidInput, match=r"'uniform' and 'exponential' were not touched"):
            list_groups(SETS | {"uniform": other})
    turned = {name: one.copy() for name, one in SETS.items()}
    turned["linear"]["angle"] = turned["linear"]["angle"].assign_attrs(units="deg")
    with pytest.raises(InvalidInput, match="angle is in no unit and in deg"):
        list_groups(turned)
