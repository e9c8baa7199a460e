"""Whoever gives numbers, under every change of the world of which the answer is known.

Read CHANGES and PRODUCERS: each that fits is multiplied with each. What does not apply is listed
here once, with the reason.
"""

import re
import warnings
from functools import cache
from importlib import import_module
from itertools import product

import numpy as np
import pytest
import typer

import feeler
from feeler.errors import InvalidInput
from feeler.physics.contact import get_contact, list_validity_warnings
from tests.cli._command import run
from tests.relations import worlds
from tests.relations.changes import CHANGES
from tests.relations.producers import PRODUCERS
from tests.relations.relation import assert_same, read_json
from tests.relations.worlds import WORLDS

SPACE = "scene in space( by chain)?"
NOT_APPLICABLE = {
    "(scene|scene by .*)/.*/turnable view": "only what is in space can be turned by hand",
    f"{SPACE}/(?!every).*/turnable view": "it is drawn from the quantities, frame by frame",
    "scene in space by chain/every.*/turnable view": "as by the default engine",
    "scene.*/(?!mirror).*/touch --json": "it takes one touch, with the antenna's own contact",
    "scene .*/mirror/touch --json": "the same command, or at ten times the price",
    "scene.*/every second sample/plot_touch": "a peak may fall between the samples",
    "(scene|scene by .*|scene in .*)/half the speed.*": "what has inertia is another touch then",
    "scene( in space)?/by MuJoCo.*": "it steps otherwise; the engine chain does so as MuJoCo",
    "scene by [^c].*/by MuJoCo.*": "it is MuJoCo, or has other equations",
    "hand/told later/.*": "whose contact reckons with the speed at the start",
    "touches/mirror/(scale_peaks|classifier cnn)": "the touches themselves; it learns each side",
    "touches/(alone|append .*)/(compute_|find_|scale_peaks).*": "a measure of the set",
    "touches/permute trials/(compute_[^e]|find_).*": "it draws noise in the order of the trials",
    "touches/permute sensors/(code|classifier cnn|ssim).*": "they know the sensors' order",
    "touches/permute sensors/(compute_information|.*_told)": "it draws noise in their order",
    "touches/amplitude.*/classifier (stream|svm)": "an angle is contact; so small a spread is none",
    "trains/(mirror|amplitude).*": "counts are whole numbers without a sign",
    "record/(permute trials|mirror)/spikes --json": "trains are drawn by number of trial and unit",
    "record/reload from (?!netcdf).*/spikes --json": "it reads Datasets as every other command",
    "bases/filter in time/[^l].*": "a filter moves no basis along the antenna",
    "lines/after another session/.*": "only framed lines say that a board began anew",
    "lines framed/other separators/.*": "the sum of a frame's bytes covers its commas",
    "film with doubts/(.*_tip|abdomen) unseen.*": "it has such gaps already",
    "film with doubts/(in another|rate by|a rate that).*": "the format has likelihoods, no clock",
}
"""Cells that say nothing, and why."""

LONG = (
    "scene by mujoco/|scene in space|wish with a study/|release/|.*/classifier cnn"
    "|scene by chain/|record/(?!mirror).*/plot_touch|(film.*|record)/reload from nwb/"
    "|scene/(append|kept|units of [tm]).*/plot_touch"
)
"""Cells that take seconds, and others of a picture or an engine whose like is run by default."""


def list_cells():
    """The product."""
    for world, change, producer in product(WORLDS, CHANGES, PRODUCERS):
        kind = world.split()[0]
        if producer.of == kind and change.of in (kind, "touches" if kind == "trains" else kind):
            yield f"{world}/{change.name}/{producer.name}", WORLDS[world], change, producer


CELLS = {name: cell for name, *cell in list_cells()}


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


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=[pytest.mark.long] if re.match(LONG, name) else [])
    for name in CELLS if not any(re.fullmatch(cells, name) for cells in NOT_APPLICABLE)
])  # fmt: skip
def test_relation(name):
    make, change, producer = CELLS[name]
    world = make_world(make)
    if change.refusal:
        with pytest.raises(InvalidInput, match=change.refusal):
            ask(producer, change_world(change, world))
        return
    wanted = change.expect(change.part(ask(producer, world)))
    try:
        found = change.look(change.part(ask(producer, change_world(change, world))))
    except InvalidInput as error:
        if change.or_refusal and re.search(change.or_refusal, str(error)):
            return
        raise
    assert_same(found, wanted, max(change.tolerance, producer.tolerance))


def test_what_does_not_apply_is_still_asked_for():
    """No pattern without a cell."""
    assert all(any(re.fullmatch(cells, name) for name in CELLS) for cells in NOT_APPLICABLE)


@pytest.mark.parametrize("make", [worlds.make_scene, worlds.make_spatial])
@pytest.mark.parametrize("speed", [0.2, 0.7])
def test_a_warning_begins_where_its_words_say(make, speed):
    """At half the antenna's radius in a timestep; at a contact as wide as its radius."""
    antenna = make_world(make).antenna
    contact, radius = get_contact(None, antenna), antenna.radius.max()
    d_min, d_max, _, *rest = contact.solimp
    for by in (0.97, 1.03):
        step = by * 0.5 * radius / speed
        wide = contact.replace(solimp=(d_min, d_max, by * radius, *rest))
        said = " ".join(list_validity_warnings(antenna, wide, speed, step))
        assert ("more than half the antenna's radius" in said) == (by > 1)
        assert ("more than the antenna's radius" in said) == (by > 1)


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
