"""The report's section: what is stored comes out again, and other antennae are not shown it."""

import pytest

from feeler.active.contests import load_contest
from feeler.errors import InvalidInput
from feeler.presets import cockroach
from feeler.report import Section
from paper.context import Context
from studies.active import section as open_active
from studies.active.section import load_stored


def make_section(folder):
    return Section(name="tradeoff", title="", folder=folder, vector=False)


@pytest.mark.long
def test_what_is_stored_comes_out_again(tmp_path):
    section = make_section(tmp_path)
    open_active.show(Context(), section)
    assert abs(section.values["active.again"]) < 1e-6
    assert 0 <= section.values["active.pays"] <= len(load_contest().deadlines)
    fresh = load_stored(load_contest())["confirmed"]["data_vars"]["gain"]["data"]
    assert section.values["active.confirmed"] == sum(
        gain >= load_contest().gain for gain in fresh
    )
    assert {"active"} <= {*section.list_figures()}


def test_another_antenna_is_not_shown_what_is_stored_for_the_published_one(tmp_path):
    section = make_section(tmp_path)
    open_active.show(Context(antenna=cockroach("linear"), is_cockroach=False), section)
    assert not section.blocks


def test_results_of_other_choices_are_refused():
    with pytest.raises(
        InvalidInput, match=r"made with noise common:0.03, declared is common:0.05"
    ):
        load_stored(load_contest(noise="common:0.05"))
