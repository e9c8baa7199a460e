"""Walls for any antenna: where it bends, and what is chosen for it."""

import json
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.presets import PRESETS, cockroach, make_preset
from feeler.wall import NEAREST, approach, explain_bending, map_distance, predict_peak
from feeler.wall.following import (
    _choose_speed,
    _choose_timestep,
    follow,
    make_turn,
    measure_scale,
)
from tests.cli._command import run

L, N = 30.0, 1000
PLACE = (np.arange(N) + 0.0) * L / N


def make(stiffness):
    return Antenna(
        segment_length=np.full(N, L / N),
        stiffness=stiffness,
        damping=np.full(N, 1.0),
        segment_mass=np.full(N, 1e-6),
        radius=np.full(N, 0.1),
        name="own",
    )


@pytest.mark.parametrize(
    ("stiffness", "expected"),
    [
        (np.exp(-PLACE / 4.0), lambda c: np.maximum(c - 4.0, 0.0)),  # c - λ, or the base
        ((1 - PLACE / L) ** 4 + 1e-12, lambda c: np.maximum((4 * c - L) / 3, 0.0)),  # a cone
        (np.ones(N), lambda c: 0.0 * c),
    ],
)
def test_an_antenna_pushed_lightly_bends_where_the_closed_form_says(stiffness, expected):
    contact = np.array([2.0, 9.3, 14.0, 22.2, 27.1])
    np.testing.assert_allclose(
        predict_peak(make(stiffness), contact), expected(contact), atol=2.1 * L / N
    )


def test_the_regime_is_named_and_agrees_with_the_map_of_a_straight_antenna():
    for name, words in (("cricket", "over its length"), ("uniform", "at its base")):
        antenna = make_preset(name)
        sweep = approach(
            antenna,
            NEAREST.replace(prebend="none", friction=0.0),
            measure_scale(antenna) * np.array([18.0, 14.0, 10.0, 6.0]),
        )
        found = map_distance(sweep)
        assert words in explain_bending(antenna) == found.bending
        assert bool(found.undefined) == (name == "uniform")


def test_a_map_in_space_is_refused_with_what_helps():
    with pytest.raises(InvalidInput, match=r"antenna.flatten\(\)"):
        predict_peak(make_preset("rat-whisker"), np.array([5.0]))


@pytest.mark.parametrize("name", [*PRESETS])
def test_the_timestep_follows_every_preset(name):
    antenna = make_preset(name)
    antenna = antenna.flatten() if antenna.spatial else antenna
    speed = _choose_speed(antenna)
    step = _choose_timestep(antenna, speed, DEFAULT_ENGINE, None)
    assert (1.0 / step) == pytest.approx(round(1.0 / step))  # a body feels once per ms
    assert step * speed <= antenna.radius.min() * (1 + 1e-9)
    assert _choose_timestep(antenna, speed, "chain", 0.02) == 0.02


@pytest.mark.long
def test_the_paper_s_order_is_that_of_the_nearest_posture():
    names = ("exponential", "linear", "uniform")
    r2 = [map_distance(approach(cockroach(name), NEAREST)).r2 for name in names]
    assert all(a > b for a, b in pairwise(r2))
    for value, paper in zip(r2, (0.985, 0.924, 0.704), strict=True):
        assert 0.5 < (1 - value) / (1 - paper) < 2.0


@pytest.mark.slow
def test_an_antenna_of_one_s_own_runs_and_leaves_page_picture_and_tables(tmp_path):
    said = run(
        "follow", "cricket", "--turn", "20", "--no-movie", "--json", "--out", "o", cwd=tmp_path
    ).stdout
    told = json.loads(said[said.index("{") : said.rindex("}") + 1])
    path, known = (pd.read_csv(tmp_path / "o" / f"{name}.csv") for name in ("follow", "map"))
    wrong = np.sqrt(
        np.mean((path["distance_mm"] - told["settings"]["controller"]["target"]) ** 2)
    )
    assert wrong == pytest.approx(told["error"], rel=1e-6)
    assert known["fitted"].sum() >= 3 and (tmp_path / "o" / "follow.html").exists()
    assert told["settings"]["penetration"] < 0.02 and told["outcome"] in ("passed", "collided")


@pytest.mark.parametrize("size", [0.1, 1.0])
def test_a_body_that_passed_has_come_past_the_turn(size):
    """Also one whose antenna is a tenth as long; its course is a tenth as long then."""
    whole = cockroach()
    antenna = whole.replace(segment_length=size * whole.segment_length)
    course = make_turn(30.0, [150.0 * measure_scale(antenna)] * 2)
    seen = follow(antenna, course, oracle=True)
    assert not seen.collided and seen.body[-1, 1] > 1.5 * course.lengths[0]


@pytest.mark.long
def test_an_antenna_without_a_map_is_a_result_with_its_reason(tmp_path):
    said = run("follow", "uniform", "--out", "o", cwd=tmp_path).stdout
    assert "no map to steer by" in said and "at its base" in said and "--oracle" in said
    assert (tmp_path / "o" / "map.png").exists() and not (
        tmp_path / "o" / "follow.csv"
    ).exists()
    with pytest.raises(InvalidInput, match="stiffness falls too little"):
        follow(cockroach("uniform"))
