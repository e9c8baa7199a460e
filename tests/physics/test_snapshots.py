"""A snapshot belongs to what it was taken of; simulations and environments can be copied."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest

import feeler
import feeler.active.environment as environment
from feeler.errors import InvalidInput
from feeler.physics.engine import ENGINES
from feeler.physics.scene import Path, Scene
from feeler.physics.simulation import build_scene

from .scenes import make_stub, shake

COPIES = {"pickle": lambda given: pickle.loads(pickle.dumps(given)), "deepcopy": copy.deepcopy}
BOTH = ["pickle", pytest.param("deepcopy", marks=pytest.mark.long)]
BALL = feeler.Object(feature=feeler.Ball(radius=1.0), place=(-1.5, 5.0), velocity=(0.3, 0.0))
BOX = feeler.Object(
    feature=feeler.Box(half_width=0.8, half_height=0.5), place=(1.6, 3.0), forward=(-1.0, 0.0)
)


def make_antenna(space: bool = False, **changes: object) -> feeler.Antenna:
    antenna = make_stub(20)
    if space:
        antenna = antenna.replace(stiffness=np.stack([antenna.stiffness, antenna.stiffness]))
    return antenna.replace(**changes)


def read(simulations: feeler.Simulations) -> list[bytes]:
    return [np.array(value).tobytes() for value in vars(simulations.state).values()]


def read_all(simulation: feeler.Simulation) -> list:
    own = simulation._lanes
    return [simulation.time, repr(simulation), *read(own), own.read_contacts(0).force.tobytes()]


@pytest.mark.parametrize("copying", BOTH)
@pytest.mark.parametrize("ms", [0.0, 6.0])
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("space", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_copy_goes_on_to_the_last_bit_and_independently(engine, space, ms, copying):
    original = feeler.Simulation(make_antenna(space), BALL, engine=engine, gravity=(0.0, -1e-3))
    if ms:
        original.step(ms)
        original.move_base((0.02, 0.01))
        original.step(1.0)
    twin, other = COPIES[copying](original), COPIES[copying](original)
    assert read_all(twin) == read_all(original)
    before = read_all(original)
    other.move_object("ball", velocity=(0.05, 0.1))
    other.step(4.0)
    assert read_all(original) == before
    for each in (original, twin):
        each.move_object("ball", velocity=(0.2, 0.0))
        each.step(4.0)
    assert read_all(twin) == read_all(original)
    assert read_all(other) != read_all(original)


@pytest.mark.parametrize("copying", COPIES)
def test_lanes_are_copied_with_what_each_has_become(copying):
    """Some were commanded, one has begun another scene with more objects, one has diverged."""
    antenna = make_antenna()
    scenes = [build_scene(antenna, BALL.replace(velocity=(v, 0.0))) for v in (0.1, 0.2, 0.3)]
    scenes += [build_scene(antenna, BALL, base=shake(30.0))]
    scenes += [build_scene(antenna, velocity=np.full(20, 1e200), label="too fast")]
    scenes += [Scene(antenna=antenna, objects=(BALL,), paths=(Path(velocity=((0.1, 0),)),))]
    lanes = feeler.Simulations(scenes, workers=2)
    lanes.step(3.0)
    lanes.reset(1, build_scene(antenna, [BALL, BOX]))
    lanes.step(1.0)
    lanes.reset(2, build_scene(antenna))
    lanes.move_base(3, (0.0, 0.01))
    lanes.step(2.0)
    twin = COPIES[copying](lanes)
    assert twin.time.tolist() == lanes.time.tolist()
    assert str(twin.failed[4]) == str(lanes.failed[4]) != "None"
    for each in (lanes, twin):
        each.step(5.0)
        each.reset(2)
        each.step(1.0)
    assert read(twin) == read(lanes)


@pytest.mark.parametrize("copying", BOTH)
@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("name", environment.TASKS)
def test_an_environment_is_copied_in_the_middle_of_an_episode(name, plain, copying):
    env = gymnasium.make(name, plain=plain, **({} if "Wall" in name else {"pool": 8}))
    untouched = COPIES[copying](env)
    untouched.reset(seed=3)
    env.reset(seed=3)
    env.action_space.seed(0)
    for _ in range(8):
        env.step(env.action_space.sample())
    twin, other = COPIES[copying](env), COPIES[copying](env)
    other.step(env.action_space.sample())
    for _ in range(12):
        action = env.action_space.sample()
        assert repr(twin.step(action)) == repr(env.step(action))
    assert repr(twin.reset()) == repr(env.reset())


def test_a_vector_of_environments_is_copied():
    env = gymnasium.make_vec("feeler/Touch-v0", num_envs=3, plain=False, pool=8)
    env.reset(seed=1)
    env.action_space.seed(0)
    for _ in range(5):
        env.step(env.action_space.sample())
    twin = copy.deepcopy(env)
    for _ in range(5):
        action = env.action_space.sample()
        assert repr(twin.step(action)) == repr(env.step(action))


def make(**changes: object) -> feeler.Simulation:
    given = {"antenna": make_antenna(), "objects": BALL} | changes
    return feeler.Simulation(**given)


OTHERS = {
    "antenna": (
        {"antenna": make_antenna(stiffness=3e-3, name="other")},
        r"antenna 'other' for 'stub' \(stiffness, name\)",
    ),
    "segments": ({"antenna": make_stub(12)}, r"antenna 'stub' for 'stub' \(segment_length"),
    "planes": ({"antenna": make_antenna(space=True)}, "antenna"),
    "object": (
        {"objects": BALL.replace(velocity=(0.2, 0.0), feature=feeler.Ball(radius=1.2))},
        r"object 'ball' \(feature, velocity\)",
    ),
    "objects": ({"objects": [BALL, BOX]}, "objects ball, box for ball"),
    "none": ({"objects": ()}, "objects none for ball"),
    "gravity": ({"gravity": (0.0, -9.81e-3)}, r"gravity \(0.0, -0.00981\) for \(0.0, 0.0\)"),
    "timestep": ({"timestep": 0.1}, "timestep 0.1 ms for 0.05 ms"),
    "contact": ({"contact": "hard"}, r"contact \(solimp, share"),
    "base": ({"base": feeler.BaseMotion(velocity=(0.01, 0.0))}, "base motion"),
    "path": ({"base": shake(20.0)}, "base motion"),
    "engine": ({"engine": "mujoco"}, "engine mujoco for chain-consistent; timestep 0.02 ms"),
    "scheme": ({"engine": "chain", "timestep": 0.05}, "engine chain for chain-consistent"),
}


@pytest.mark.parametrize(
    "what",
    [
        pytest.param(name, marks=pytest.mark.long) if name == "planes" else name
        for name in OTHERS
    ],
)
def test_a_snapshot_of_something_else_is_refused_by_name(what):
    changes, words = OTHERS[what]
    other, own = make(**changes), make()
    for each in (other, own):
        each.step(2.0)
    before = read_all(own)
    with pytest.raises(InvalidInput, match=f"snapshot is of another simulation.*{words}"):
        own.restore(other.snapshot())
    assert read_all(own) == before
    with pytest.raises(InvalidInput, match="snapshot is of another simulation"):
        other.restore(own.snapshot())


def test_what_is_no_snapshot_is_refused():
    with pytest.raises(InvalidInput, match=r"takes what snapshot\(\) gave, got dict"):
        make().restore({})


@pytest.mark.parametrize("engine", ENGINES)
def test_another_simulation_that_is_made_alike_takes_it(engine):
    one = make(engine=engine)
    two = make(engine=engine, antenna=make_antenna(), objects=BALL.replace(), gravity=(0, 0))
    one.step(4.0)
    one.move_base((0.0, 0.02))
    two.step(1.0)
    moment = pickle.loads(pickle.dumps(one.snapshot()))
    two.restore(moment)
    for each in (one, two):
        each.step(3.0)
    assert read_all(two) == read_all(one)


def test_a_base_that_has_left_its_path_goes_back_to_it():
    """What commands replace is no difference: neither in one's own snapshots nor in a twin's."""
    one, twin = (make(base=shake(20.0)) for _ in range(2))
    one.step(2.0)
    moment = one.snapshot()
    twin.step(1.0)
    twin.move_base((0.0, 0.0))
    twin.restore(moment)
    one.move_base((0.0, 0.03))
    left = one.snapshot()
    one.restore(moment)
    for each in (one, twin):
        each.step(3.0)
    assert read_all(twin) == read_all(one)
    twin.restore(left)
    twin.step(1.0)
    assert twin.base[1] == pytest.approx(one_base_y(left, make(base=shake(20.0))))


def one_base_y(left, fresh: feeler.Simulation) -> float:
    fresh.restore(left)
    fresh.step(1.0)
    return float(fresh.base[1])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("space", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_base_that_leaves_a_path_goes_on_from_where_it_is(engine, space):
    """The path does not begin at the origin."""
    time = np.linspace(0.0, 20.0, 41)
    pose = np.stack([3 + 0.1 * time, 1 - 0.02 * time, 0.2 + 0.01 * time], axis=1)
    path = feeler.BaseMotion(time=time, pose=pose)
    simulation = feeler.Simulation(make_antenna(space), base=path, engine=engine)
    simulation.step(2.0)
    before = simulation.base
    assert before[0] == pytest.approx(3.2)
    simulation.move_base((0.05, 0.0))
    np.testing.assert_allclose(simulation.base, before, atol=1e-12)
    moment = simulation.snapshot()
    simulation.step(1.0)
    assert simulation.base[0] - before[0] == pytest.approx(0.05, rel=0.3)
    np.testing.assert_allclose(simulation.base[1:], before[1:], atol=1e-3)
    after = read_all(simulation)
    for again in (
        simulation,
        make(antenna=make_antenna(space), objects=(), base=path, engine=engine),
    ):
        again.restore(moment)
        again.step(1.0)
        assert read_all(again) == after


def test_lanes_go_back_to_scenes_of_their_own_only():
    antenna = make_antenna()
    scenes = [build_scene(antenna, BALL.replace(velocity=(v, 0.0))) for v in (0.1, 0.2)]
    hard = build_scene(antenna, BALL, contact="hard", gravity=(0.0, -1e-3))
    lanes, fresh = feeler.Simulations(scenes), feeler.Simulations(scenes)
    lanes.step(3.0)
    moment = lanes.snapshot([1])
    fresh.restore(lanes.snapshot())
    lanes.reset(1, hard)
    lanes.step(2.0)
    with pytest.raises(InvalidInput, match=r"in lane 1 contact .*; in lane 1 gravity"):
        fresh.restore(lanes.snapshot([1]))
    lanes.restore(moment)
    for each in (lanes, fresh):
        each.step(2.0)
    assert np.array_equal(lanes.state.angle[1], fresh.state.angle[1])
    with pytest.raises(InvalidInput, match="there is no lane 1"):
        feeler.Simulations(scenes[:1]).restore(moment)


@pytest.mark.parametrize(
    ("ms", "words"),
    [
        (1e300, r"1e\+300 ms are 2e\+301 timesteps of 0.05 ms; .* at most 1e\+10, 5e\+08 ms"),
        (1e9, "at most"),
        (10**400, "must be a finite number"),
    ],
)
def test_a_step_without_end_is_refused(ms, words):
    simulation = make()
    with pytest.raises(InvalidInput, match=words):
        simulation.step(ms)
    assert simulation.time == 0.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"duration": 1e300}, "samples; allowed are 1 to"),
        ({"timestep": 1e-300}, r"timesteps of 1e-300 ms; allowed are 1e\+10"),
        ({"timestep": 5e-324}, "timesteps of .* allowed are"),
        ({"duration": 1e300, "sample_interval": 1e-300}, "samples; allowed"),
        ({"duration": 1e300, "sample_interval": 1e295}, "timesteps of 0.05 ms; allowed"),
        ({"sample_interval": 1e300}, "gives 0 samples"),
        ({"workers": 10**9}, "workers must be .* ≤ 1024, got 1000000000"),
    ],
)
def test_a_touch_without_end_is_refused(given, words):
    trial = feeler.Trial(feature=feeler.Ball(radius=1.0), location=0.7, speed=0.3)
    with pytest.raises(InvalidInput, match=words):
        feeler.touch(make_antenna(), trial, **({"duration": 2.0} | given))
