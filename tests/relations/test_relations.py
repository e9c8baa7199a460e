"""Whoever gives numbers, under every change of the world of which the answer is known.

Read CHANGES and PRODUCERS: each that fits is multiplied with each. What does not apply is listed
here once, with the reason.
"""

import re
import warnings
from fnmatch import fnmatch
from functools import cache, partial
from importlib import import_module

import numpy as np
import pytest
import typer

import feeler
from feeler.errors import InvalidInput
from feeler.physics.engine import DEFAULT_ENGINE, ENGINES
from tests.cli._command import run
from tests.relations import worlds
from tests.relations.changes import CHANGES
from tests.relations.producers import PRODUCERS
from tests.relations.relation import assert_same, read_json

WORLDS = {
    "scene": (worlds.Scene, worlds.make_scene),
    **{f"scene by {name}": (worlds.Scene, partial(worlds.make_scene, engine=name, timestep=0.02))
       for name in ENGINES if name != DEFAULT_ENGINE},
    "scene in space": (worlds.Scene, worlds.make_spatial),
    "scene in space by chain": (
        worlds.Scene, partial(worlds.make_spatial, engine="chain", timestep=0.02)
    ),
    "hand": (worlds.Hand, worlds.make_hand),
    "hand with its speed told": (worlds.Hand, partial(worlds.make_hand, contact=worlds.TOLD_SPEED)),
    "touches": (worlds.Touches, worlds.make_touches),
    "trains": (worlds.Trains, worlds.make_trains),
    "record": (worlds.Record, worlds.make_record),
    "bases": (worlds.Bases, worlds.make_bases),
    "film": (worlds.Film, worlds.make_film),
    "film with doubts": (worlds.Film, partial(worlds.make_film, doubted=True)),
    "lines": (worlds.Lines, worlds.make_lines),
    "framed lines": (worlds.Lines, partial(worlds.make_lines, framed=True)),
    "bent": (worlds.Bent, worlds.make_bent),
    "animals": (worlds.Animals, worlds.make_animals),
    "fitted": (worlds.Calls, partial(worlds.Calls, calls=("fit",))),
    "learning on": (worlds.Calls, partial(worlds.Calls, calls=("fit", "partial_fit"))),
    "named": (worlds.Named, worlds.Named),
    "release": (worlds.Release, worlds.make_release),
    "wish": (worlds.Wish, worlds.make_wish),
    "wish with a study": (worlds.Wish, partial(worlds.make_wish, study=True)),
}  # fmt: skip
"""One of each kind, and awkward ones; made when first asked for."""

NOT_APPLICABLE = {
    "scene/*/turnable view": "only what is in space can be turned by hand",
    "scene by*/turnable view": "only what is in space can be turned by hand",
    "scene in space*/[!e]*/turnable view": "it is drawn from the quantities, frame by frame",
    "scene in space by chain/every*/turnable view": "as by the default engine",
    "scene*/[!m]*/touch --json": "it takes one touch, with the antenna's own contact",
    "scene by*/mirror/touch --json": "the same command",
    "scene in space*/mirror/touch --json": "as in the plane, at ten times the price",
    "scene*/every second sample/plot_touch": "a peak may fall between the samples",
    "scene/half the speed*": "what has inertia is another touch then",
    "scene by*/half the speed*": "what has inertia is another touch then",
    "scene in space/half the speed*": "what has inertia is another touch then",
    "scene/by MuJoCo*": "it steps otherwise; the engine chain does so as MuJoCo",
    "scene in space/by MuJoCo*": "it steps otherwise; the engine chain does so as MuJoCo",
    "scene by [!c]*/by MuJoCo*": "it is MuJoCo, or has other equations",
    "scene in space by chain/half the speed*": "what has inertia is another touch then",
    "hand/told later/*": "whose contact reckons with the speed at the start",
    "touches/mirror/scale_peaks": "it gives the touches themselves",
    "touches/alone/compute_*": "a measure of the set",
    "touches/alone/find_*": "a measure of the set",
    "touches/alone/scale_peaks": "of known touches, which stay",
    "touches/append silent trials/compute_*": "of known touches, which stay",
    "touches/append silent trials/find_*": "of known touches, which stay",
    "touches/append silent trials/scale_peaks": "of known touches, which stay",
    "touches/permute trials/compute_[!e]*": "it draws noise in the order of the trials",
    "touches/permute trials/find_*": "it draws noise in the order of the trials",
    "touches/permute sensors/code *": "the bases know the sensors by their order",
    "touches/permute sensors/classifier cnn": "its kernels see neighbours",
    "touches/mirror/classifier cnn": "its layers take the greatest values; it learns each side",
    "touches/permute sensors/ssim": "it compares neighbours",
    "touches/permute sensors/compute_information": "it draws noise in the order of the sensors",
    "touches/permute sensors/*_told": "it draws noise in the order of the sensors",
    "touches/amplitude*/classifier stream": "it notices contact by an angle in rad",
    "touches/amplitude*/classifier svm": "scikit-learn takes so small a spread for none",
    "trains/mirror/*": "counts have no sign; sides are units of their own",
    "trains/amplitude*": "counts are whole numbers",
    "record/reload from csv/[!q]*": "a CSV holds one variable of one trial",
    "record/permute trials/spikes --json": "a train is drawn by the number of its trial",
    "record/mirror/spikes --json": "a train is drawn by the number of its unit",
    "record/reload from [!n]*/spikes --json": "it reads Datasets as every other command",
    "record/reload from nwb/spikes --json": "it reads Datasets as every other command",
    "bases/filter in time/[!l]*": "a filter moves no basis along the antenna; its shape is another",
    "lines/after another session/*": "only framed lines say that a board began anew",
    "framed lines/other separators/*": "the sum of a frame's bytes covers its commas",
    "film with doubts/*_tip unseen*": "it has such gaps already",
    "film with doubts/abdomen unseen*": "it has such gaps already",
    "film with doubts/in another format*": "a plain table has no likelihoods",
    "film with doubts/rate by a column*": "this format has no clock",
    "film with doubts/a rate that its clock*": "this format has no clock",
}
"""Cells that say nothing, and why."""

LONG = (
    "scene by mujoco/*",
    "scene in space*",
    "wish with a study/*",
    "release/*",
)
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
            ask(producer, change_world(change, world))
        return
    wanted = change.expect(ask(producer, world))
    try:
        found = change.look(ask(producer, change_world(change, world)))
    except InvalidInput as error:
        if change.or_refusal and re.search(change.or_refusal, str(error)):
            return
        raise
    assert_same(found, wanted, max(change.tolerance, producer.tolerance))


def test_what_does_not_apply_is_still_asked_for():
    """No pattern without a cell."""
    cells = [f"{w}/{c.name}/{p.name}" for w in WORLDS for c in CHANGES for p in PRODUCERS]
    unused = [p for p in NOT_APPLICABLE if not any(fnmatch(cell, p) for cell in cells)]
    assert unused == []


SAYS = {
    "touch --location 0.8 --speed 0.4 --side right --duration 40 --no-movie --out o": (
        "o/tensor.nc",
        {
            "peak_hinge_angle": lambda d: np.rad2deg(abs(d["angle"]).max()),
            "peak_curvature": lambda d: abs(d["curvature"]).max(),
            "peak_force": lambda d: 1e3 * (d["force"] ** 2).sum("axis").max() ** 0.5,
        },
    ),
    "spikes --touches set.nc --gain 5 --out o": (
        "o/spikes.nc",
        {
            "units": lambda d: d.sizes["unit"],
            "spikes_per_touch": lambda d: d["spike_time"].count() / d.sizes["trial"],
            "units_that_fire": lambda d: d["spike_time"].notnull().any("event").mean(),
            "greatest_rate": lambda d: d["rate"].max(("unit", "time")).median(),
        },
    ),
}
"""What commands say, each number from the file that the same command wrote."""


@pytest.mark.parametrize("words", SAYS)
def test_a_command_says_what_its_file_holds(words, tmp_path):
    feeler.save(make_world(worlds.make_record).dataset, tmp_path / "set.nc")
    said = read_json(run(*words.split(), "--json", cwd=tmp_path))
    file, numbers = SAYS[words]
    held = feeler.load(tmp_path / file)
    for name, compute in numbers.items():
        assert abs(said[name]) == pytest.approx(float(compute(held)), rel=1e-6), name


ASKED = {"touch", "spikes", "tracks", "calibrate", "wall", "validate"}
"""Commands with JSON that PRODUCERS or SAYS ask."""
NOT_ASKED = {
    "info": "it says what a file is, in words",
    "compare": "minutes; what it computes is asked as groups, codes, indices and classifiers",
    "tradeoff": "minutes; as compare",
    "animal": "its plan names a folder of films; tests/animal",
    "active": "minutes; its observer is the ideal one",
    "design": "minutes; it minimises a score of the same classifiers",
    "follow": "a closed loop, in which no change has a known answer",
    "robot": "stream and classify are asked, and its lines; the rest in tests/robot",
}


def test_each_command_with_json_is_asked_or_says_why_not():
    commands = typer.main.get_command(import_module("feeler.cli.app").app).commands
    known = {name for name, command in commands.items() if speaks_json(command)}
    assert known == ASKED | NOT_ASKED.keys()


def speaks_json(command):
    inner = getattr(command, "commands", {}).values()
    return any("--json" in p.opts for p in command.params) or any(map(speaks_json, inner))
