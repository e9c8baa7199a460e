"""The sensitivity table: every choice is made, and a planted order is found under each."""

import numpy as np
import pytest

from paper.choices import (
    _CHOICES,
    _choose,
    _choose_sensors,
    _count_agreement,
    _list_choices,
    _make_table,
    compute_sensitivity,
)


class Tensors(dict):
    """Stands in for the Dataset: named arrays with ``values``."""

    def __init__(self, array, size):
        n = len(size)
        super().__init__(
            size=size, feature=np.tile(["ball", "box"], n // 2), location=np.arange(n) // 4
        )
        self.array = array

    def __getitem__(self, name):
        if name in ("angle", "curvature"):
            return type(
                "Values", (), {"values": self.array * (2.0 if name == "curvature" else 1.0)}
            )
        return super().__getitem__(name)


def make_group(spread, seed=0):
    """Bumps that differ from stimulus to stimulus in place by ``spread``."""
    time, n = np.arange(40), 16
    rng = np.random.default_rng(seed)
    places = 14 + spread * (np.arange(n) - n / 2)
    bumps = np.exp(-0.5 * ((time - places[:, None]) / 3) ** 2)[:, None, :] * rng.uniform(
        0.8, 1, (n, 12, 1)
    )
    return Tensors(bumps - 0.01, np.tile([1.5, 1.5, 3.0, 3.0], n // 4))


GROUPS = {"spread": make_group(1.3), "tight": make_group(0.1, seed=1)}


def test_each_choice_departs_once_from_the_default():
    single = _list_choices()
    assert len(single) == 1 + sum(len(values) - 1 for values in _CHOICES.values())
    assert all(sum(choices[k] != single[0][k] for k in choices) == 1 for choices in single[1:])
    assert single[0] == {name: values[0] for name, values in _CHOICES.items()}


@pytest.mark.parametrize("choices", _list_choices(), ids=str)
def test_choices_do_what_they_say(choices):
    arrays, labels = _choose(GROUPS, choices)
    array = arrays["spread"]
    assert array.shape[0] == len(labels) == (16 if choices["sizes"] == "both" else 8)
    assert array.shape[1] == (12 if choices["sensors"] == "all" else 6)
    assert array.shape[2] == (40 if choices["window"] == 1 else 28)
    assert (array.min() >= 0) == (choices["sign"] == "rectified")
    assert max(a.max() for a in arrays.values()) == pytest.approx(1)
    assert (min(a.max() for a in arrays.values()) == 1) == (choices["scaling"] == "per group")


def test_planted_order_agrees_and_its_reverse_does_not():
    reverse = dict(reversed(GROUPS.items()))
    rows = compute_sensitivity({"right": GROUPS, "wrong": reverse}, indices=("pearson", "mse"))
    counts = _count_agreement(rows)
    assert counts["right", "MSE"] == (len(rows), len(rows))
    assert counts["wrong", "MSE"] == (0, len(rows))
    assert counts["right", "accuracy of tensors"][0] > counts["wrong", "accuracy of tensors"][0]
    header, cells = _make_table(rows)
    assert cells[-1][header.index("right, MSE")] == f"{len(rows)} of {len(rows)} agree"
    assert len(cells) == len(rows) + 1 and all(len(line) == len(header) for line in cells)


@pytest.mark.parametrize(
    ("which", "expected"),
    [
        ("all", [0, 1, 2, 3, 4, 5, 6]),
        ("every second", [1, 3, 5]),
        ("distal half", [3, 4, 5, 6]),
    ],
)
def test_sensors_are_chosen_from_the_end_that_is_named(which, expected):
    assert np.arange(7)[_choose_sensors(7, which)].tolist() == expected
