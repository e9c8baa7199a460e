"""Where to touch next: to be greedy takes no more touches than to guess, and what is sure is right
as often as it says.
"""

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from studies.active import places as parked

search_places, simulate_places = parked.search_places, parked.simulate_places

SHAPES = [feeler.Ball(radius=2.0), feeler.Box(half_width=1.6, half_height=1.6, rounding=0.4)]


@pytest.fixture(scope="module")
def places():
    return simulate_places(
        feeler.presets.cockroach(),
        SHAPES,
        locations=(0.6, 0.9),
        approaches=(80.0, 100.0),
        duration=25.0,
    )


def test_every_hypothesis_is_felt_in_every_touch(places):
    assert places.felt.shape == (4, 18, 56, 25)
    assert np.bincount(places.label).tolist() == [9, 9]
    assert np.all(np.abs(places.felt).max(axis=(2, 3)) > 1e-4)


def test_who_chooses_by_information_needs_fewer_touches(places):
    counts = {
        name: search_places(places, name, 0.02, n=40, most=8)
        for name in ("random", "grid", "greedy")
    }
    assert all(np.all(found.count[found.sure] >= 1) for found in counts.values())
    assert counts["greedy"].count.mean() <= counts["random"].count.mean()
    for found in counts.values():
        assert found.right[found.sure].mean() > 0.85


def test_a_grid_touches_no_place_twice(places):
    chosen = search_places(places, "grid", 1.0, n=20, most=4).chosen
    for row in chosen:
        row = row[row >= 0]
        assert len(np.unique(row)) == len(row)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda p: search_places(p, "clever", 0.1),
            "chooser must be one of random, grid, greedy",
        ),
        (lambda p: search_places(p, "grid", 0.0), "noise must be > 0"),
        (lambda p: simulate_places(feeler.presets.cockroach(), SHAPES[:1]), "at least two"),
    ],
)
def test_what_cannot_be_searched_is_named(places, make, said):
    with pytest.raises(InvalidInput, match=said):
        make(places)
