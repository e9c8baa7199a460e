"""A race: the observer is Bayes under whatever the person's base did, and whoever is sure first,
and right, wins.
"""

import numpy as np
import pytest

import feeler
from feeler.active import compute_posterior
from feeler.errors import InvalidInput
from feeler.studio.race import KNOWN, NOISE, SHAPES, Race
from feeler.studio.wish import TouchWish
from tests.studio.test_session import Page, run_hand

WISH = TouchWish(kind="box", speed=0.5, lead=6.0)
MOVES = (5, -0.8), (25, -0.4)  # ms, mm/ms


def move(race, *rates):
    """So many samples [ms] at each velocity [mm/ms]."""
    for n, vx in rates:
        race.apply([(0, -1, vx, 0.0, -0.005)])
        for _ in range(n):
            race.step()


@pytest.fixture(scope="module")
def raced():
    race = Race(WISH)
    move(race, *MOVES)
    return race


def test_the_persons_observer_is_bayes(raced):
    """A second source: one simulation for each known touch, moved by hand, and the posterior of the
    whole.
    """
    task, felt = raced.task, []
    for k in range(KNOWN):
        one = feeler.Simulation(
            task.antenna, task.make_start(k).scene.objects[0], timestep=task.timestep
        )
        rows = []
        for n, vx in MOVES:
            one.move_base((vx, 0.0), -0.005)
            for _ in range(n):
                one.step(1.0)
                rows.append(one.angle[task.first_antenna.sensors - 1])
        felt.append(rows)
    known = np.array(felt)
    noise = np.random.default_rng([0, 1]).standard_normal(known.shape[1:])
    expected = compute_posterior(known[task.place] + NOISE * noise, known, NOISE)
    members = np.eye(len(SHAPES))[[int(task.get_target(k)) for k in range(KNOWN)]]
    np.testing.assert_allclose(raced.belief, expected @ members, atol=1e-6)
    assert np.ptp(raced.belief[-1]) > 0.2


def test_the_shown_touch_is_one_of_those_known_and_every_shape_is_as_likely(raced):
    shown = WISH.make_trial()
    found = raced.task.get_trial(raced.task.place)
    assert (found.feature, found.location) == (shown.feature, shown.location)
    assert found.speed * found.lead == pytest.approx(shown.speed * shown.lead)
    assert raced.belief[0] == pytest.approx([1 / 3] * 3)
    assert SHAPES[raced.target] == "box"


def test_who_stands_still_learns_nothing():
    race = Race(WISH)
    move(race, (10, 0.0))
    assert race.belief[-1] == pytest.approx([1 / 3] * 3)
    assert race.judge()["you"] == {"time": 10.0, "shape": "", "right": False}
    assert race.judge()["won"] == "policy"


@pytest.mark.parametrize(
    ("when", "shape", "won"),
    [(2, "box", "you"), (2, "ball", "policy"), (10**3, "box", "policy"), (None, "box", "both")],
)
def test_whoever_is_sure_first_and_right_has_won(raced, when, shape, won, monkeypatch):
    theirs = raced.judge()["policy"]
    assert theirs["right"]
    when = int(theirs["time"]) if when is None else when
    belief = np.full((10**3 + 1, 3), 1 / 3)
    belief[when:] = np.eye(3)[SHAPES.index(shape)]
    monkeypatch.setattr(raced, "belief", [*belief])
    assert raced.judge()["won"] == won
    assert raced.judge()["you"]["right"] == (shape == "box")


@pytest.mark.parametrize("changes", [{"kind": "wall"}, {"objects": ({"kind": "ball"},)}])
def test_what_cannot_be_raced_about_is_said(changes):
    with pytest.raises(InvalidInput, match="a race is about one ball, box or triangle"):
        Race(TouchWish(**changes))


def test_a_race_ends_when_the_person_is_sure_and_only_the_base_can_be_taken():
    page = Page()
    run_hand(
        page,
        [{"what": 0, "x": 9.0, "y": 9.0}, {"what": -1, "x": -12.0}],
        race=True,
        wish={"kind": "box", "lead": 60.0},
    )
    end, _ = page.find("touch", "end")[0]
    begin, _ = page.find("touch", "begin")[0]
    belief = page.join("belief")
    assert {command[1] for command in end["commands"][2:]} == {-1}
    assert belief.shape == (len(page.join("angle")), 3)
    assert belief[-1].max() >= begin["race"]["sure"] > belief[:-1].max()
    assert end["race"]["you"]["time"] == len(belief) - 1
