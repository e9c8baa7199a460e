"""Whoever gives numbers, under every change of the world of which the answer is known.

Read CHANGES and PRODUCERS: each that fits is multiplied with each. What does not apply is listed
here once, with the reason.
"""

import warnings
from fnmatch import fnmatch
from functools import cache, partial

import pytest

from feeler.errors import InvalidInput
from feeler.physics.engine import DEFAULT_ENGINE, ENGINES
from tests.relations import worlds
from tests.relations.changes import CHANGES
from tests.relations.producers import PRODUCERS
from tests.relations.relation import assert_same
from tests.relations.worlds import (
    Animals,
    Bases,
    Film,
    Hand,
    Lines,
    Record,
    Scene,
    Touches,
    Trains,
    Wish,
)

WORLDS = {
    "scene": (Scene, worlds.make_scene),
    **{f"scene by {name}": (Scene, partial(worlds.make_scene, engine=name, timestep=0.02))
       for name in ENGINES if name not in (DEFAULT_ENGINE, *worlds.RODS)},
    **{f"scene by {name}": (Scene, partial(worlds.make_wall, name)) for name in worlds.RODS},
    "scene in space": (Scene, worlds.make_spatial),
    "hand": (Hand, worlds.make_hand),
    "hand with its speed told": (Hand, partial(worlds.make_hand, contact=worlds.TOLD_SPEED)),
    "touches": (Touches, worlds.make_touches),
    "trains": (Trains, worlds.make_trains),
    "record": (Record, worlds.make_record),
    "bases": (Bases, worlds.make_bases),
    "film": (Film, worlds.make_film),
    "film with doubts": (Film, partial(worlds.make_film, doubted=True)),
    "lines": (Lines, worlds.make_lines),
    "framed lines": (Lines, partial(worlds.make_lines, framed=True)),
    "animals": (Animals, worlds.make_animals),
    "wish": (Wish, worlds.make_wish),
    "wish with a study": (Wish, partial(worlds.make_wish, study=True)),
}  # fmt: skip
"""One of each kind, and awkward ones; made when first asked for."""

NOT_APPLICABLE = {
    "bases/filter in time/[!l]*": "a filter moves no basis along the antenna; its shape is another",
    "lines/after another session/*": "only framed lines say that a board began anew",
    "framed lines/other separators/*": "the sum of a frame's bytes covers its commas",
    "film with doubts/*_tip unseen*": "it has such gaps already",
    "film with doubts/abdomen unseen*": "it has such gaps already",
    "film with doubts/in another format*": "a plain table has no likelihoods",
}
"""Cells that say nothing, and why."""

LONG = ("scene by mujoco/*", "scene in space/*", "wish with a study/*", "scene by rod*")
"""Worlds that take seconds."""


def list_cells():
    """The product, without what does not apply."""
    for name, (kind, make) in WORLDS.items():
        for change in CHANGES:
            for producer in PRODUCERS:
                if not issubclass(kind, change.of) or kind is not producer.of:
                    continue
                cell = f"{name}/{change.name}/{producer.name}"
                if any(fnmatch(cell, pattern) for pattern in NOT_APPLICABLE):
                    continue
                slow = change.long or producer.long or any(fnmatch(cell, p) for p in LONG)
                marks = [pytest.mark.long] if slow else []
                yield pytest.param(make, change, producer, id=cell, marks=marks)


@cache
def make_world(make):
    return make()


@cache
def change_world(change, world):
    return change.apply(world)


@cache
def ask(producer, world):
    """The answer, and what was warned of; an error as itself."""
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        return producer.make(world)


@pytest.mark.parametrize(("make", "change", "producer"), [*list_cells()])
def test_relation(make, change, producer):
    world = make_world(make)
    if change.refusal:
        with pytest.raises(InvalidInput, match=change.refusal):
            producer.make(change_world(change, world))
        return
    wanted = change.expect(ask(producer, world))
    found = change.look(ask(producer, change_world(change, world)))
    assert_same(found, wanted, change.tolerance)


def test_what_does_not_apply_is_still_asked_for():
    """No pattern without a cell."""
    cells = [f"{w}/{c.name}/{p.name}" for w in WORLDS for c in CHANGES for p in PRODUCERS]
    unused = [p for p in NOT_APPLICABLE if not any(fnmatch(cell, p) for cell in cells)]
    assert unused == []
