"""Where physics leaves its ground it says so, with the number got and the one that would do."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

import feeler
from feeler.errors import ModelValidityWarning
from feeler.physics.contact import Contact, get_contact, list_validity_warnings
from feeler.physics.run import compute_error, run_accurately, run_scene
from feeler.physics.scene import Clock
from feeler.presets import cockroach

from .scenes import DYNAMIC, touch


def make_whisker(density: float = 1.4e-3, modulus: float = 5000.0) -> feeler.Antenna:
    return feeler.Antenna.from_beam(
        length=40.0,
        modulus=modulus,
        density=density,
        radius=0.1,
        n_segments=20,
        damping_time=3.0,
    )


@pytest.mark.parametrize("engine", DYNAMIC)
def test_every_engine_says_how_deep_contacts_sank(engine):
    """The greatest depth in any step, over the smaller radius, so it never falls."""
    scene = touch(n=12, size=0.5, contact="smooth")
    scene = replace(scene, contact=get_contact())
    clock = Clock(duration=10, timestep=0.02)
    sink = run_scene(scene, clock, engine).sink
    assert sink[0] == 0 and np.all(np.diff(sink) >= 0) and 0 < sink[-1] < 0.5


def test_the_depth_is_that_of_mujoco():
    scene, clock = touch(n=12, size=0.1, contact="smooth"), Clock(duration=10, timestep=0.02)
    ours, theirs = (run_scene(scene, clock, engine).sink for engine in ("chain", "mujoco"))
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-12)


def test_a_data_set_holds_the_depth_of_each_touch():
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.3)
    tensors = feeler.touch(cockroach(), [trial], duration=60)
    assert tensors["sink"].dims == ("trial",) and 0 < float(tensors["sink"][0]) < 0.5


def test_a_peg_that_sinks_in_is_warned_of():
    """The density in kg/mm3: the whisker weighs next to nothing, and contact with it."""
    with pytest.warns(
        ModelValidityWarning, match="density .* usual range: is it in g"
    ) as warned:
        whisker = make_whisker(density=1.4e-6)
    assert re.search(r"1.4e-06.* outside 0.0001 to 0.02", warned[0].message.details)
    peg = feeler.Object(
        feature=feeler.Ball(radius=0.1), place=(0.11, 12.0), forward=(-1.0, 0.0)
    )
    simulation = feeler.Simulation(whisker, peg, contact="even")
    simulation.move_base(turn=2e-3)
    with pytest.warns(ModelValidityWarning, match="outside what its model") as warned:
        simulation.step(100.0)
    assert "of the smaller radius, more than 0.5" in warned[0].message.details


@pytest.mark.parametrize("modulus", [5.0e-3, 5.0e9])
def test_a_modulus_of_another_unit_is_warned_of(modulus):
    with pytest.warns(ModelValidityWarning, match="is it in MPa"):
        make_whisker(modulus=modulus)


def test_usual_beams_are_not_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make_whisker()


@pytest.mark.parametrize(
    ("contact", "speed", "match"),
    [
        (
            get_contact(),
            6.0,
            "moves 0.3 mm in a timestep of 0.05 ms, more than half .* use contact='smooth:0.02'",
        ),
        (get_contact("even"), 1.5, "across the whole contact of 0.05 mm; use at most 0.02 ms"),
        (
            Contact(solimp=(1e-3, 0.95, 0.5, 0.5, 2.0)),
            0.1,
            "0.5 mm wide, more than .* 0.225 mm",
        ),
    ],
)
def test_what_the_timestep_cannot_follow_is_warned_of(contact, speed, match):
    ball = feeler.Object(
        feature=feeler.Ball(radius=1.5), place=(-5.0, 25.0), velocity=(speed, 0.0)
    )
    with pytest.warns(ModelValidityWarning, match="outside what its model") as warned:
        try:
            feeler.Simulation(cockroach(), ball, contact=contact)
        except feeler.errors.InvalidInput:
            assert speed > 5.0  # refused, after the warning
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=speed)
    with pytest.warns(ModelValidityWarning, match="outside what its model") as again:
        feeler.touch(cockroach(), [trial], duration=2, contact=contact)
    for first in (warned[0], again[0]):
        assert re.search(match, first.message.details)


@pytest.mark.parametrize("speed", [0.06, 0.3, 0.6, 1.5])
def test_the_default_follows_what_it_is_made_for(speed):
    assert list_validity_warnings(cockroach(), get_contact(), speed, 0.05) == []


def test_accuracy_covers_the_width_of_contact():
    """The stated error is no less than what a contact of a quarter of the width changes."""
    scene = touch("ball", 1.0, n=30, contact="even", speed=0.3)
    found = run_accurately([scene], 20.0, 1.0, "chain-consistent", 0.02)[0]
    narrow = replace(scene, contact=Contact(solimp=(1e-3, 0.95, 0.05 / 64, 0.5, 2.0)))
    truth = run_scene(narrow, Clock(duration=20.0, timestep=0.1 / 64))
    assert compute_error(scene, found, truth) <= found.error <= 0.02


def test_what_does_not_get_there_says_that_it_is_unknown():
    scene = touch("box", 1.0, n=30, contact="even", speed=0.6)
    assert run_accurately([scene], 20.0, 1.0, "chain-consistent", 1e-6)[0].error == np.inf


@pytest.mark.parametrize("speeds", [(0.3, 4.0), (4.0, 0.3), (0.3, 4.0, 0.6)])
def test_of_several_trials_the_fastest_is_warned_of_wherever_it_stands(speeds):
    trials = [
        feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=s) for s in speeds
    ]
    with pytest.warns(ModelValidityWarning, match="outside what its model") as warned:
        feeler.touch(cockroach(), trials, duration=2, timestep=0.1)
    said = warned[0].message.details
    assert re.search("^At 4 mm/ms an object moves 0.4 mm .* of 0.1 ms", said)
