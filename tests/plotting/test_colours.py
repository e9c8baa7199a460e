"""One colour, one meaning: in every figure, in whatever order and company a thing comes."""

from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb

from feeler import records as shown
from feeler.antenna.files import save_antenna
from feeler.cli.choose import _name_antennas
from feeler.plotting.antennas import OBJECT_COLOUR
from feeler.plotting.style import (
    ANTENNA_COLOURS,
    BASIS_COLOURS,
    FEATURE_COLOURS,
    NOISE_COLOURS,
    PALETTE,
    PROFILE_COLOURS,
    pick_colours,
)
from feeler.presets import cockroach

MEANINGS = {
    "profiles": {*PROFILE_COLOURS.values()},
    "features": {*FEATURE_COLOURS.values()},
    "bases": {*BASIS_COLOURS},
    "noise": {*NOISE_COLOURS.values()},
    "others": {*PALETTE},
    "speeds": {to_hex(shade) for shade in mpl.colormaps["viridis"](np.linspace(0, 0.85, 3))},
    "what is touched": {OBJECT_COLOUR},
    "the antenna": {*ANTENNA_COLOURS},
}


@pytest.mark.parametrize(("one", "other"), combinations(MEANINGS, 2))
def test_no_colour_has_two_meanings(one, other):
    assert not {*map(to_hex, MEANINGS[one])} & {*map(to_hex, MEANINGS[other])}


@pytest.mark.parametrize("names", [("uniform", "linear"), ("linear", "exponential", "uniform")])
def test_a_profile_keeps_its_colour_in_any_company(names):
    assert pick_colours(names) == {name: PROFILE_COLOURS[name] for name in names}


def test_the_slower_the_darker_in_any_order():
    found = pick_colours(["0.6 m/s", "0.06 m/s", "0.3 m/s"])
    light = [sum(to_rgb(found[name])) for name in ("0.06 m/s", "0.3 m/s", "0.6 m/s")]
    assert light == sorted(light) and len({*light}) == 3
    words = pick_colours(["fast", "slow", "medium"])
    assert [words[name] for name in ("slow", "medium", "fast")] == [
        found[name] for name in ("0.06 m/s", "0.3 m/s", "0.6 m/s")
    ]


def test_what_has_no_colour_of_its_own_takes_one_in_turn():
    names = ["a", "linear", "b", "exponential", "c", "d", "e"]
    found = pick_colours(names)
    assert list(found) == names and len({*found.values()}) == len(names)
    assert found["linear"] == PROFILE_COLOURS["linear"]
    assert pick_colours(names + names[::-1]) == found  # who is asked for twice has one colour
    assert pick_colours([]) == {}


def test_what_is_touched_has_one_colour_in_pictures_and_in_notebooks():
    assert shown.OBJECT == OBJECT_COLOUR and ANTENNA_COLOURS[0] == shown.INK


@pytest.mark.parametrize("name", [*PROFILE_COLOURS, *FEATURE_COLOURS, "slow", "mine"])
def test_an_antenna_of_one_s_own_takes_no_colour_that_means_something_else(name, tmp_path):
    """Not even where its file is called as something that has one."""
    save_antenna(cockroach(), path := tmp_path / f"{name}.toml")
    chosen = _name_antennas(["exponential", str(path)])
    assert [*chosen] == ["exponential", name if name == "mine" else f"{name}.toml"]
    assert pick_colours(chosen)[[*chosen][1]] in PALETTE
