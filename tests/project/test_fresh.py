"""No stale state: whatever can be reset or restored answers as a fresh one does, whatever it was
asked, and however it had failed, before.
"""

import numpy as np
import pytest
from awkward_touches import list_trials

import feeler
from feeler.physics.engine import ENGINES
from feeler.physics.scene import make_scene

TIMESTEP = 0.05


def read_state(stepper):
    stepper.step(160)
    state = {**vars(stepper.read()), **vars(stepper.read_contacts(0))}
    return {name: np.array(value) for name, value in state.items()}


def make_scenes():
    """One to begin with, of another antenna, base and object; and one to ask about."""
    moving = list_trials()[2].base
    balls = feeler.Ball(radius=2.7), feeler.Ball(radius=1.4)
    first = feeler.Trial(feature=balls[0], location=0.7, speed=0.3, lead=1.1, base=moving)
    asked = feeler.Trial(feature=balls[1], location=0.61, speed=0.5, lead=1.7, side="right")
    antennas = (feeler.presets.make_preset(name) for name in ("uniform", "linear"))
    return tuple(map(make_scene, antennas, (first, asked)))


def ask_stepper(engine):
    first, asked = make_scenes()
    fresh = ENGINES[engine].make([asked], TIMESTEP)
    for ruin in (False, True):
        used = ENGINES[engine].make([first], TIMESTEP)
        used.step(90)
        used.move_base(0, (1e7, 1e7) if ruin else (0.1, 0.2), 1e5 if ruin else 0.01)
        used.step(40)
        used.reset(0, asked)
        yield used, read_state
    yield fresh, read_state


def make_scenes_in_space():
    """The same of antennae that bend in two planes."""
    rng, n = np.random.default_rng(5), 9
    length, mass = rng.uniform(0.4, 0.6, n), rng.uniform(1e-5, 2e-5, n)
    antennas = (
        feeler.Antenna(
            segment_length=length,
            segment_mass=mass,
            radius=0.05,
            damping=1e-3,
            stiffness=factor * rng.uniform(0.005, 0.01, (2, n)),
        )
        for factor in (1.0, 2.0)
    )
    trials = (
        feeler.Trial(
            feature=feeler.Ball(radius=radius), location=0.6, speed=0.1, azimuth=azimuth
        )
        for radius, azimuth in ((0.9, 0.3), (0.6, -0.7))
    )
    return tuple(map(make_scene, antennas, trials))


def ask_space_stepper(engine):
    first, asked = make_scenes_in_space()
    timestep = min(one.contact.scale_timestep(TIMESTEP) for one in (first, asked))
    fresh = ENGINES[engine].make([asked], timestep)
    used = ENGINES[engine].make([first], timestep)
    used.step(90)
    used.move_base(0, (0.1, 0.2, -0.1), (0.01, 0.0, 0.02))
    used.step(40)
    used.reset(0, asked)
    yield used, read_state
    yield fresh, read_state


ASKED = [
    *((ask_stepper, engine) for engine in ENGINES),
    *((ask_space_stepper, engine) for engine in ("chain-consistent", "chain", "mujoco")),
]


@pytest.mark.further
@pytest.mark.parametrize(
    ("ask", "option"),
    ASKED,
    ids=lambda one: getattr(one, "__name__", one) or "-",
)
def test_after_another_question_it_answers_as_a_fresh_one(ask, option):
    *used, (fresh, read) = ask(option)
    expected = read(fresh)
    assert any(np.any(np.nan_to_num(value) != 0) for value in expected.values())
    for one, _ in used:
        found = read(one)
        assert found.keys() == expected.keys()
        for name, value in expected.items():
            np.testing.assert_array_equal(found[name], value, name)
