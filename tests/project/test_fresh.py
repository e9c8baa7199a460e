"""No stale state: whatever can be reset or restored answers as a fresh one does, whatever it was
asked, and however it had failed, before.
"""

import numpy as np
import pytest
from awkward_touches import list_trials, make_antenna

import feeler
from feeler.decoding import StreamDecoder
from feeler.errors import FeelerError, InvalidInput
from feeler.physics.engine import ENGINES, get_engine
from feeler.physics.scene import make_scene
from feeler.physics.simulation import build_scene

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
    fresh = get_engine(engine).make([asked], TIMESTEP)
    for ruin in (False, True):
        used = get_engine(engine).make([first], TIMESTEP)
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
    fresh = get_engine(engine).make([asked], timestep)
    used = get_engine(engine).make([first], timestep)
    used.step(90)
    used.move_base(0, (0.1, 0.2, -0.1), (0.01, 0.0, 0.02))
    used.step(40)
    used.reset(0, asked)
    yield used, read_state
    yield fresh, read_state


def ask_simulation(kind):
    antenna, trial = make_antenna(), list_trials()[0]

    def make():
        if kind == "one":
            return feeler.Simulation(antenna, [trial], timestep=TIMESTEP)
        return feeler.Simulations([make_scene(antenna, trial)], timestep=TIMESTEP)

    def read(simulation):
        simulation.step(4.0)
        if kind == "one":
            names = ("angle", "velocity", "tip", "force", "base_force", "place", "time")
            return {name: np.array(getattr(simulation, name)) for name in names}
        return {name: np.array(value) for name, value in vars(simulation.state).items()}

    used = make()
    kept = used.snapshot()
    used.step(7.0)
    used.restore(kept)
    yield used, read
    yield make(), read


def ask_reset_lane(_):
    """Of the lanes of a simulation."""
    _, asked = make_scenes()

    def read(simulations):
        simulations.step(4.0)
        return {name: np.array(value) for name, value in vars(simulations.state).items()}

    used = feeler.Simulations([asked], timestep=TIMESTEP)
    used.step(9.0)
    used.reset(0)
    yield used, read
    yield feeler.Simulations([asked], timestep=TIMESTEP), read


def ask_stream(_):
    time = np.arange(120.0)
    rising, swinging = 0.01 * np.maximum(time - 20, 0), 0.02 * np.sin(time)
    touches = [np.stack([sign * rising, swinging]) for sign in (1, -1)]
    decoder = StreamDecoder(window=60, correlation=9.0).fit(touches, ["up", "down"])

    def read(stream):
        states = [stream.update(sample, 5.0 + k) for k, sample in enumerate(touches[1].T)]
        states.append(stream.update(touches[1][:, -1], 124.0))  # one too many is let pass
        return {
            "posterior": np.array([state.posterior for state in states]),
            "since": np.array([state.since_contact for state in states]),
            "surplus": np.array(stream.surplus),
        }

    used = decoder.start()
    with pytest.raises(InvalidInput, match="faster"):
        for k in range(600):
            used.update(touches[0][:, k % 120], 0.1 * k)
    used.reset()
    yield used, read
    yield decoder.start(), read


def ask_sensilla(_):
    spikes = pytest.importorskip("feeler.spikes")
    bending = 0.02 * np.sin(0.3 * np.arange(80))[:, None] * np.array([1.0, -0.7, 0.4])
    position = np.array([0.1, 0.45, 0.8])

    def make():
        population = spikes.Population(
            position=position, side=[1, -1, 1], gain=[30.0, 41.0, 23.0]
        )
        return spikes.SensillaStream(population, position, 1.3, seed=4)

    def read(stream):
        fired = [stream.push(sample) for sample in bending]
        units, times = (np.concatenate(column) for column in zip(*fired, strict=True))
        return {
            "units": units,
            "times": times,
            "rate": stream.rate,
            "time": np.array(stream.time),
        }

    used = make()
    for sample in bending[40:]:
        used.push(3 * sample)
    used.reset()
    yield used, read
    yield make(), read


def ask_environment(lanes):
    pytest.importorskip("gymnasium")
    from feeler.active import TouchTask
    from feeler.active.environment import TouchEnv, TouchVectorEnv

    balls = [feeler.Ball(radius=1.5), feeler.Box(half_width=3.0, half_height=2.0)]

    def make():
        task = TouchTask(features=balls, pool=5, duration=12.0)
        return TouchVectorEnv(task, 2) if lanes == "lanes" else TouchEnv(task)

    def read(environment, seed=11):
        observation, _ = environment.reset(seed=seed)
        rows = [observation]
        shape = (2, 2) if lanes == "lanes" else (2,)
        move = np.broadcast_to([0.21, 0.003], shape)
        action = {"action": move, "prediction": np.zeros(shape)}
        for _ in range(7):
            observation, reward, *_ = environment.step(action)
            rows.append({**observation, "reward": np.array(reward)})
        return {f"{k} {name}": v for k, row in enumerate(rows) for name, v in row.items()}

    used = make()
    read(used, seed=3)
    yield used, read
    yield make(), read


def ask_plain(_):
    pytest.importorskip("gymnasium")
    from feeler.active import TouchTask
    from feeler.active.environment import TouchEnv

    def make():
        balls = [feeler.Ball(radius=1.5), feeler.Box(half_width=3.0, half_height=2.0)]
        return TouchEnv(TouchTask(features=balls, pool=5, duration=80.0), plain=True)

    def read(environment, seed=11):
        rows = {"0": environment.reset(seed=seed)[0]}
        middle = np.full(environment.action_space.shape, 0.3, dtype=np.float32)
        for k in range(1, 6):
            seen, reward, *_ = environment.step(middle)
            rows |= {str(k): seen, f"reward {k}": np.array(reward)}
        return rows

    used = make()
    read(used, seed=3)
    yield used, read
    yield make(), read


CASES = {
    "Stepper": (ask_stepper, [*ENGINES]),
    "ChainStepper": (ask_stepper, ["chain-consistent"]),
    "MujocoStepper": (ask_stepper, ["mujoco"]),
    "RodStepper": (ask_stepper, ["rod"]),
    "SpaceChainStepper": (ask_space_stepper, ["chain-consistent", "chain"]),
    "SpaceMujocoStepper": (ask_space_stepper, ["mujoco"]),
    "Simulation": (ask_simulation, ["one"]),
    "Simulations": (ask_simulation, ["lanes"]),
    "Simulations reset": (ask_reset_lane, [""]),
    "Stream": (ask_stream, [""]),
    "SensillaStream": (ask_sensilla, [""]),
    "TouchVectorEnv": (ask_environment, ["lanes"]),
    "TouchEnv": (ask_environment, ["one"]),
    "TouchEnv, plain": (ask_plain, [""]),
}
ASKED = sorted(
    {(ask, option) for ask, options in CASES.values() for option in options}, key=str
)


@pytest.mark.further
@pytest.mark.parametrize(
    ("ask", "option"),
    [
        pytest.param(*one, marks=pytest.mark.long) if one[1] == "rod-inertia" else one
        for one in ASKED
    ],
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


def test_a_lane_that_failed_is_as_new_once_it_is_reset():
    antenna = make_antenna()
    ball = make_scene(antenna, list_trials()[1])
    hopeless = build_scene(antenna, velocity=np.full(11, 1e200))
    used = feeler.Simulations([hopeless], timestep=TIMESTEP)
    used.step(1.0)
    assert isinstance(used.failed[0], FeelerError)
    used.reset(0, ball)
    fresh = feeler.Simulations([ball], timestep=TIMESTEP)
    for one in (used, fresh):
        one.step(6.0)
        assert one.failed == [None]
    np.testing.assert_array_equal(used.state.angle, fresh.state.angle)
