"""Fig. 3 and its table from one small run."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from feeler.plotting.results import list_shapes, plot_shapes
from feeler.presets import cockroach
from feeler.wall import DISTANCES, Posture, approach, calibrate, compare, map_distance
from feeler.wall.distance import SETUP_CHOICES
from paper import fig3
from paper.fig3 import (
    Family,
    _list_readings,
    list_readings,
    list_setups,
    sweep_family,
)


def test_every_distance_is_drawn_with_its_wall():
    sweep = approach(cockroach(), Posture(side="left"))
    shapes = list_shapes(sweep)
    ax = Figure().subplots()
    plot_shapes({"exponential": shapes, "again": shapes}, ax)
    walls, lines = ax.collections
    assert len(lines.get_segments()) == len(walls.get_segments()) == 2 * len(DISTANCES)
    for k, (line, wall) in enumerate(
        zip(lines.get_segments(), walls.get_segments(), strict=True)
    ):
        gap = (
            line[:, 0].min() - wall[0, 0]
        )  # the wall is on the left: no node behind it, and one on it in contact
        assert gap > 0 and (gap < 0.4) == sweep.contact[k % len(DISTANCES)]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["exponential", "again"]


@pytest.mark.parametrize("part", ["smoke", "quick"])
def test_a_part_of_the_family_lies_within_it(part):
    whole, measures = list_setups()
    postures, same = list_setups(part)
    assert 0 < len(postures) < len(whole) == len(set(whole)) and set(postures) <= set(whole)
    assert same == measures


def make_family(r2):
    return Family(
        names=("exponential", "linear", "uniform"),
        choices=(),
        r2=np.array(r2),
        offset=np.full(np.shape(r2), np.nan),
        cases=(),
    )


@pytest.mark.parametrize(
    ("r2", "share"),
    [
        (
            [[0.9, 0.8, 0.7], [0.9, 0.8, np.nan], [0.8, 0.9, 0.7]],
            0.5,
        ),  # a set-up with an undefined R² is none of the paper's
        ([[0.9, 0.8, 0.7], [0.9, 0.8, 0.7]], 1.0),
    ],
)
def test_shares_are_of_the_set_ups_in_which_everything_is_defined(r2, share):
    family = make_family(r2)
    assert family.share(np.all(np.diff(family.defined, axis=1) < 0, axis=1)) == {
        "value": share,
        "n": 2,
    }


def make_whole_family(r2_of):
    """Every declared set-up, with R² as a function of its choices."""
    postures, measures = list_setups()
    choices = [
        (
            *(getattr(posture, name) for name in SETUP_CHOICES[:-2]),
            *(measure[name] for name in SETUP_CHOICES[-2:]),
        )
        for posture in postures
        for measure in measures
    ]
    r2 = [r2_of(dict(zip(SETUP_CHOICES, choice, strict=True))) for choice in choices]
    return replace(make_family(r2), choices=tuple(choices))


def test_the_readings_are_the_whole_family_and_none_of_it_twice():
    family = make_whole_family(lambda _: (0.9, 0.8, 0.7))
    taken = np.array([family.select(reading["choices"]) for reading in list_readings()])
    np.testing.assert_array_equal(taken.sum(axis=0), 1)


def test_what_is_said_by_reading_is_counted_from_the_family():
    """The order holds where friction is 1; below 30° linear has no R²."""

    def measure(choice):
        linear = np.nan if choice["inter_antennal_angle"] < 30 else 0.8
        return (0.9, linear, 0.7 if choice["friction"] == 1 else 0.85)

    values = _list_readings(make_whole_family(measure))
    assert values["wall.order.rubbing"] == {"value": 0.5, "n": 36}
    assert values["wall.order.slippery"] == {"value": 0.0, "n": 18}
    assert not {"wall.order.narrow", "wall.order.narrower"} & {*values}


def test_where_too_little_is_defined_nothing_is_judged():
    family = make_family([[0.9, 0.8, 0.7], *[[np.nan, 0.8, 0.7]] * 3])
    assert family.share(np.array([True])) == {
        "undefined": "R² is defined for every profile in 1 of 4 set-ups only"
    }


def test_an_undefined_r2_is_never_a_number():
    antennas = {name: cockroach(name) for name in ("exponential", "uniform")}
    family = sweep_family(
        antennas,
        part="smoke",
        known=[
            (n, approach(a, list_setups("smoke")[0][0], (12.0, 9.0, 6.0)))
            for n, a in antennas.items()
        ],
    )
    assert family.r2.shape == (3, 2)
    for case in family.cases:
        row = family.choices.index(case.choice), family.names.index(case.antenna)
        assert np.isnan(family.r2[row]) == bool(case.map.undefined)


def test_tensors_that_are_the_same_are_no_distances_told_apart():
    class Touch:
        contact = np.ones((3, 5), dtype=bool)

        @staticmethod
        def make_dataset():
            tensors = np.array(
                [np.full((2, 5), 1.0), np.full((2, 5), 1.01), np.full((2, 5), 3.0)]
            )
            return {"curvature": xr.DataArray(tensors)}

    assert fig3._compute_unique_share(Touch) == pytest.approx(1 / 3)


@pytest.mark.long
def test_the_leading_set_up_has_a_map_of_every_profile_at_rest():
    """It is one of the family; ``test_the_rule_finds_the_leading_set_up`` finds it anew."""
    assert fig3.get_lead() in list_setups()[0]
    for name in ("exponential", "linear", "uniform"):
        found = map_distance(approach(cockroach(name), fig3.get_lead()))
        assert not found.undefined and found.used.sum() >= len(found.used) / 2


@pytest.mark.slow
def test_the_rule_finds_the_leading_set_up():
    """The first posture of the family with a map of every profile, at rest and running."""

    def has_maps(posture):
        for name in ("exponential", "linear", "uniform"):
            found = map_distance(approach(cockroach(name), posture))
            if found.undefined or found.used.sum() < len(found.used) / 2:
                return False
        return not any(
            calibrate(cockroach(name), posture).undefined
            for name in ("exponential", "linear", "uniform")
        )

    assert next(filter(has_maps, list_setups()[0])) == fig3.get_lead()


def test_how_far_the_peak_is_from_the_contact_counts_every_standing_distance():
    antenna = cockroach("uniform")  # its peak stays at the base, which R² leaves out
    sweep = approach(antenna, Posture(), (20.0, 15.0, 10.0, 7.0))
    (case,) = compare(
        {"uniform": antenna},
        [Posture()],
        distances=(20.0, 15.0, 10.0, 7.0),
        measures=({"quantity": "bend", "method": "hinge"},),
        known=[("uniform", sweep)],
    )
    assert case.map.used.sum() == 0 and sweep.inverted.sum() == 4
    assert case.offset == pytest.approx(np.median(sweep.contact_position), abs=0.2)
