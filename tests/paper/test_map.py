"""Planted bases and codes: when and where they act, and which contacts drive them."""

from types import SimpleNamespace

import numpy as np
import pytest

from feeler.report import Section
from paper.fig4 import compute_map as compute
from paper.fig4 import keep_values, measure_margin, span

LAGS = (2, 11, 29)
PLACES = (0.5, 0.6, 0.7, 0.9)
DRIVEN = {0.5: 0, 0.6: 1, 0.7: 1, 0.9: 2}


class PlantedEncoder:
    """Bases that act at one sensor and one lag each; a trial's code is the basis it is told."""

    def __init__(self, driven):
        bases = np.zeros((3, 5, 40))
        for k, lag in enumerate(LAGS):
            bases[k, 2 * k, lag] = 1.0
        self.restart_components_ = np.stack([bases, np.roll(bases, 1, axis=2)])
        self.driven = driven

    def transform(self, data, code):
        assert code == "ridge"
        codes = np.zeros((len(self.driven), 3, 6))
        codes[np.arange(len(self.driven)), self.driven, 1] = 1.0
        return codes


def measure(locations, driven):
    return compute(PlantedEncoder(driven), np.zeros((len(driven), 5, 60)), np.array(locations))


def test_every_start_says_when_and_where_its_bases_act():
    locations = np.repeat(PLACES, 3)
    found = measure(locations, [DRIVEN[place] for place in locations])
    np.testing.assert_allclose(found.lag, [LAGS, np.add(LAGS, 1)])
    np.testing.assert_allclose(found.place, [[0.0, 0.5, 1.0]] * 2)
    np.testing.assert_allclose(found.margin, 1.0)
    assert max(one.p_information for one in found.mappings) < 0.01


def test_the_table_of_bases_is_the_best_start_s_which_comes_first():
    one = SimpleNamespace(share=np.array([[0.7, 0.3], [0.2, 0.8]]), locations=(0.5, 0.9))
    mappings = [SimpleNamespace(**vars(one), p_information=p) for p in (0.01, 0.2)]
    starts = {"lag": [[1.0, 2.0], [3.0, 5.0]], "place": [[0.1, 0.4], [0.6, 0.9]]}
    arrays = {name: np.array(values) for name, values in starts.items()}
    found = SimpleNamespace(
        **arrays, span=np.ones((2, 2)), margin=np.ones(2), mappings=mappings
    )
    keep_values(section := Section(name="some", title="Some", folder=None), found)
    assert section.blocks[-1]["rows"] == [
        ["1", "1", "0.1", "0.7", "0.2"],
        ["2", "2", "0.4", "0.3", "0.8"],
    ]


@pytest.mark.parametrize("basis", [0, 1, 2])
def test_a_basis_that_every_contact_drives_knows_no_place(basis):
    assert (measure(np.repeat(PLACES, 3), [basis] * 12).margin <= 0).all()


@pytest.mark.parametrize(
    ("share", "margin"),
    [
        ([[0.7, 0.2, 0.1], [0.1, 0.3, 0.6]], 0.3),
        ([[0.5, 0.1, 0.4], [0.4, 0.0, 0.6]], 0.1),  # its own share at the other end counts too
        ([[0.2, 0.7, 0.1], [0.1, 0.3, 0.6]], -0.5),
        ([[0.1, 0.3, 0.6], [0.7, 0.2, 0.1]], -0.6),  # the mirror image: 0.1 − 0.7
    ],
)
def test_the_margin_is_the_least_of_four(share, margin):
    assert measure_margin(np.array(share)) == pytest.approx(margin)


def test_the_values_span_the_starts_and_say_how_many_there_are(tmp_path):
    section = Section(name="s", title="", folder=tmp_path, vector=False)
    locations = np.repeat(PLACES, 3)
    keep_values(section, measure(locations, [DRIVEN[place] for place in locations]))
    # of 29 and 30: Student's t for one degree of freedom is 12.706 at 95 %
    half = 12.7062 * np.sqrt(0.5) / np.sqrt(2)
    expected = {"value": 29.5, "low": 29.5 - half, "high": 29.5 + half, "n": 2}
    assert section.values["encoding.lag.3"] == pytest.approx(expected, rel=1e-5)
    assert section.values["encoding.location_p"]["n"] == 2
    assert span(np.array([1.0])) == {"value": 1.0, "n": 1}
    assert "undefined" in span(np.array([1.0, np.nan]))
