"""Scenes in which nothing is even, each with everything that comes of it; and what is refused."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

import feeler
from feeler.antenna.animals import SPECIES, read_species
from feeler.antenna.modes import compute_mass_matrix
from feeler.antenna.segments import Antenna, Follicle
from feeler.objects import Task, parse_noise
from feeler.objects.bodies import Object, Wall
from feeler.objects.motion import BaseMotion, Flow, parse_flow
from feeler.objects.outlines import Outline
from feeler.objects.shapes import Ball, Box, Peg, Triangle
from feeler.objects.trials import Trial
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.physics.simulation import build_scene
from feeler.physics.spec import make_spec
from feeler.physics.statics import compute_point, solve_static
from feeler.tensors.schema import QUANTITIES
from tests.awkward_touches import list_trials, make_antenna

IN_SPACE = ("chain", "chain-consistent", "mujoco")
"""Engines of scenes in space; the others are rods, which feel no sharp corner."""
HOOK = ((0.0, 0.1), (-2.0, 1.5), (-1.0, 0.3), (-3.0, -1.0), (-1.0, -1.2))
SHAPES = {
    "ball": Ball(radius=0.9),
    "box": Box(half_width=1.1, half_height=2.3, half_length=7.0, rounding=0.2),
    "triangle": Triangle(half_width=1.3, half_height=0.8),
    "peg": Peg(radius=0.6, half_length=3.1),
    "hook": Outline(vertices=HOOK, half_length=2.5, rounding=0.05),
    "wall": Wall(profile=np.array([[0.0, 0.0], [1.1, 0.4], [2.7, 0.1], [3.9, 0.0]]), repeat=3),
}
SHAKEN = feeler.BaseMotion(
    time=np.array([0.0, 2.5, 4.0, 7.5, 11.0]),
    pose=np.array(
        [[0, 0, 0], [0.2, 0.1, 0.03], [0.1, -0.2, 0.05], [-0.3, 0.1, -0.04], [0.1, 0.2, 0.02]]
    ),
)
RECORDED = {
    name for name, quantity in QUANTITIES.items() if quantity.make and not quantity.coordinate
}


def make_in_space(planes: int = 3, **fields: Any) -> Antenna:
    """Nine uneven segments that bend differently in each plane, and twist."""
    k = np.arange(9)
    stiffness = np.array([5.0, 3.0, 8.0])[:planes, None] * np.exp(-0.3 * k)
    return Antenna(
        segment_length=2.1 - 0.11 * k,
        segment_mass=1.5e-3 * np.exp(-0.2 * k),
        radius=0.21 - 0.013 * k,
        stiffness=stiffness,
        damping=0.4 * stiffness,
        rest_angle=np.array([0.01, -0.02, 0.005])[:planes, None] * np.cos(k),
        sensors=[2, 5, 6, 9],
        name="bent both ways",
        **fields,
    )


def run(antenna: Antenna, trials: Any, engine: str = "chain-consistent", **options: Any) -> Any:
    """Touches with all quantities that there are."""
    options = {"duration": 9.3, "sample_interval": 0.3, "seed": 5} | options
    return feeler.touch(antenna, trials, engine=engine, save=sorted(RECORDED), **options)


def step_by_hand(antenna: Antenna, engine: str, **options: Any) -> list[Any]:
    """A simulation that is pushed about, goes back, and goes on."""
    turn = (0.01, -0.004, 0.002) if antenna.spatial else 0.01
    items = [
        Object(feature=SHAPES["ball"], place=(-1.4, 9.1), velocity=(0.21, 0.03), turn=turn),
        Object(
            feature=SHAPES["triangle"], place=(2.2, 6.2), forward=(-1, 0), velocity=(-0.1, 0)
        ),
    ]
    simulation = feeler.Simulation(antenna, items, engine=engine, **options)
    lines = [look(simulation)]
    simulation.step(2.6)
    lines.append(look(simulation))
    kept = simulation.snapshot()
    simulation.move_base((0.05, -0.02), 0.006)
    simulation.move_object(items[0].name, (0.3, -0.1), 0.02)
    simulation.step(3.7)
    lines.append(look(simulation))
    simulation.restore(kept)
    simulation.step(1.1)
    return [*lines, look(simulation)]


def look(simulation: feeler.Simulation) -> dict[str, Any]:
    names = "time angle velocity tip place forward force base base_force base_moment timestep"
    seen = {name: getattr(simulation, name) for name in names.split()}
    return seen | {
        "text": repr(simulation),
        "shape": simulation.shape(),
        "work": simulation.work,
        "contacts": simulation.contacts,
    }


def bend_statically(antenna: Antenna) -> dict[str, Any]:
    """Bent by forces at three places; what is held, hit and let go."""
    angle = solve_static(antenna, (0.002, -0.0007), 0.73)
    return {
        "angle": angle,
        "point": [compute_point(antenna, angle, at) for at in (0.13, 0.5, 1.0)],
        "bend": [feeler.bend(antenna, 0.003, at=at) for at in (0.31, 0.77, 1.0)],
        "mass": compute_mass_matrix(antenna),
        "modes": feeler.antenna.compute_modes(antenna, 5),
        "response": np.abs(
            feeler.antenna.compute_base_response(antenna, np.array([0.003, 0.02, 0.11]))
        ),
        "release": feeler.release(antenna, deflection=2.3, at=9.7, duration=9.0),
        "hit": feeler.hit(antenna, location=0.6, speed=0.4, radius=0.3, duration=6.0),
    }


def react(antenna: Antenna, engine: str = DEFAULT_ENGINE, base: BaseMotion = SHAKEN) -> Any:
    """A touch on a recorded base, with the force and moment that hold it."""
    trial = Trial(feature=SHAPES["box"], location=0.66, speed=0.4, lead=0.8, base=base)
    clock = Clock(duration=6.6, sample_interval=0.3, timestep=0.02)
    return run_scene(make_scene(antenna, trial), clock, engine)


def place_shape(feature: Any) -> dict[str, Any]:
    """An object of this shape, and where it stands before it touches, in the plane and in space."""
    item = Object(feature=feature, place=(-2.0, 9.0), forward=(0.8, 0.6))
    trial = Trial(feature=feature, location=0.6, speed=0.3)
    told = {
        "object": item,
        "mirrored": feature.mirror(),
        "plane": feeler.objects.place(make_antenna(), trial),
    }
    if feature.wide:  # it has no solid in space
        return told
    from_aside = trial.replace(azimuth=77, approach=70)
    return told | {
        "lifted": item.lift(),
        "space": feeler.objects.place(make_in_space(), from_aside),
    }


def list_scenes() -> Iterator[tuple[str, Callable[[], Any]]]:
    """Scenes by name."""
    plane, space = make_antenna(), make_in_space()
    for engine in IN_SPACE:
        yield f"touch by {engine}", partial(run, plane, list_trials(), engine)
        yield f"by hand with {engine}", partial(step_by_hand, plane, engine)
        yield f"by hand in space with {engine}", partial(step_by_hand, space, engine)
        yield (
            f"posed, with {engine}",
            partial(
                step_by_hand,
                plane,
                engine,
                base=SHAKEN,
                gravity=(0.002, -0.0098),
                angle=0.02 * np.cos(np.arange(11)),
                velocity=0.001 * np.sin(np.arange(11)),
            ),
        )
    for name, shape in SHAPES.items():
        trials = [
            Trial(feature=shape, location=0.71, speed=0.4, lead=0.8, approach=75, side="right"),
            Trial(feature=shape, location=0.48, speed=0.3, lead=1.2, azimuth=40, friction=0.3),
        ]
        yield f"{name} in the plane", partial(run, plane, [trials[0]])
        if not shape.wide:
            yield f"{name} in space", partial(run, space, trials)
        yield f"{name} itself", partial(place_shape, shape)
    ball = Trial(feature=SHAPES["ball"], location=0.71, speed=0.4, lead=0.8, base=SHAKEN)
    flow = Flow(drag=2e-4, along=0.7e-4, velocity=(0.3, 0.1, -0.2))
    soft = Follicle(stiffness=(0.03, 0.05, 0.02), damping=(0.04, 0.01, 0.03))
    yield "flow", partial(run, space, [ball], flow=flow)
    yield "follicle", partial(run, make_in_space(follicle=soft), [ball])
    yield "two planes", partial(run, make_in_space(planes=2), [ball], "mujoco")
    yield "hard contact", partial(run, plane, [ball], contact="hard")
    yield "all hinges", partial(run, plane, [ball], all_hinges=True, dtype="float32")
    yield "accurately", partial(run, plane, [ball], accuracy=0.02)
    yield "statics", partial(bend_statically, plane)
    yield "modes in space", lambda: feeler.antenna.compute_modes(space, 5)
    yield "mass in space", partial(compute_mass_matrix, space)
    yield "reaction", partial(react, plane)
    yield "reaction in space", partial(react, space)
    for name in SPECIES:
        yield f"species {name}", partial(read_species, name)
    drawn = feeler.sample_antennas(3, plane, stiffness=(0.5, 2.0), gradient=(-1, 1), seed=4)
    yield "drawn antennas", lambda: [drawn, list(drawn)]
    trials = feeler.sample_trials(4, approach=(60, 120), friction=(0.1, 0.9), seed=3)
    yield "drawn trials", lambda: [trials, [trial.to_plain() for trial in trials]]
    task = Task(
        objects=("ball:radius=1.2", "box:half_width=1,half_height=2"), speeds=(0.3, 0.6)
    )
    yield "task", lambda: [task, task.to_plain()]
    tensors = np.random.default_rng(2).random((3, 5, 7))
    for noise in ("relative:0.3", "common:0.2", "mixed:size=0.1,share=0.3"):
        yield f"noise {noise}", partial(_add_noise, noise, tensors)
    yield "MuJoCo's file", lambda: _read_mjcf(build_scene(plane, [ball]))
    yield "MuJoCo's file in space", lambda: _read_mjcf(build_scene(space, [ball]))


def _add_noise(noise: str, tensors: np.ndarray) -> Any:
    found = parse_noise(noise)
    return [found, found.add(tensors, np.random.default_rng(1))]


def _read_mjcf(scene: Scene) -> list[str]:
    return make_spec(scene, 0.02).to_xml().splitlines()


def list_refusals() -> Iterator[tuple[str, Callable[[], Any]]]:
    """What is odd, by name; most of it is refused."""
    plane, space, ball = make_antenna(), make_in_space(), SHAPES["ball"]
    k = np.arange(11)
    posture = 0.05 * np.ones(11)
    posed = feeler.Simulation(plane, angle=posture).shape()[6]
    inside = Object(feature=ball, place=tuple(posed))
    stands = Object(feature=ball, place=(-1.4, 9.1))
    trial = Trial(feature=ball, location=0.71, speed=0.4)
    moved = Trial(feature=ball, location=0.71, speed=0.4, base=SHAKEN)
    simulate, touch = partial(feeler.Simulation, plane), partial(feeler.touch, plane)
    cases: dict[str, Callable[[], Any]] = {
        "an object in the posture": lambda: simulate(inside, angle=posture),
        "an object at rest": lambda: simulate(Object(feature=ball, place=(0.0, 9.0))),
        "an object in space": lambda: feeler.Simulation(
            space, Object(feature=ball, place=(0.1, 9, 0))
        ),
        "two of one name": lambda: simulate([stands, stands]),
        "two bases": lambda: simulate(moved, base=SHAKEN),
        "hinges": lambda: simulate(stands, angle=posture[1:]),
        "rates": lambda: simulate(stands, velocity=posture * np.nan),
        "rows of hinges": lambda: feeler.Simulation(space, angle=np.zeros((2, 9))),
        "a step": lambda: simulate(stands).step(-0.3),
        "another object": lambda: simulate(stands).move_object("cup", (0.1, 0)),
        "a contact": lambda: simulate(stands, contact="firm"),
        "gravity": lambda: simulate(stands, gravity=(0, 0, 0, 1)),
        "no trials": lambda: touch([]),
        "an engine": lambda: touch([trial], engine="chian"),
        "a quantity": lambda: touch([trial], save=["angle", "tpi"]),
        "both accuracies": lambda: touch([trial], accuracy=0.1, timestep=0.02),
        "an accuracy": lambda: touch([trial], accuracy=1.7),
        "a duration": lambda: touch([trial], duration=0.2, sample_interval=0.3),
        "a timestep": lambda: touch([trial], duration=9.0, timestep=0.07, sample_interval=0.3),
        "a dtype": lambda: touch([trial], dtype="float16"),
        "flow in the plane": lambda: touch([trial], flow=Flow(drag=1e-4)),
        "azimuth in the plane": lambda: touch([trial.replace(azimuth=20)]),
        "statics in space": lambda: bend_statically(space),
        "a textured wall in space": lambda: run(
            space, [Trial(feature=SHAPES["wall"], location=0.71, speed=0.4)]
        ),
        "a hit in space": lambda: feeler.hit(space, location=0.6, speed=0.4, radius=0.3),
        "a rod by whole steps": lambda: run(plane, list_trials(), "rod"),
        "a rod in space": lambda: feeler.touch(space, [trial], engine="rod"),
        "a rod with two": lambda: feeler.Simulation(plane, [trial, stands], engine="rod"),
        "far aside": lambda: touch([trial.replace(approach=3)]),
        "at the base": lambda: touch([trial.replace(location=0.002)]),
        "no force": lambda: feeler.bend(plane, np.nan),
        "a place": lambda: feeler.bend(plane, 0.01, at=1.3),
        "too far": lambda: feeler.release(plane, deflection=300.0),
        "limp": lambda: feeler.bend(plane.replace(stiffness=0.0), 0.01),
        "no mass": lambda: plane.replace(segment_mass=0.1 * k),
        "two lengths": lambda: plane.replace(radius=np.ones(7)),
        "sensors": lambda: plane.replace(sensors=[3, 3, 14]),
        "sensors that fall": lambda: plane.replace(sensors=[5, 2]),
        "a follicle in the plane": lambda: plane.replace(
            follicle=Follicle(stiffness=(1.0, 1.0, 1.0))
        ),
        "four planes": lambda: space.replace(stiffness=np.ones((4, 9))),
        "a fold": lambda: Outline(vertices=((0, 0), (-1, 1), (-1, -1), (0, 1))),
        "a fold further on": lambda: Outline(
            vertices=((0, 0), (-1, 1), (-3, 1), (-3, -1), (-2, 2), (-1, -1))
        ),
        "a corner twice": lambda: Outline(vertices=((0, 0), (-1, 1), (-1, 1), (-1, -1))),
        "two corners": lambda: Outline(vertices=((0, 0), (-1, 1))),
        "flat": lambda: Outline(vertices=((0, 0), (-1, 0), (-2, 0))),
        "too round": lambda: Box(half_width=1.0, half_height=0.5, rounding=0.6),
        "a long forward": lambda: Object(feature=ball, forward=(0.8, 0.7)),
        "no rotation": lambda: Object(feature=ball, forward=(0, 1, 0), left=(0.6, 0.8, 0)),
        "time back": lambda: feeler.BaseMotion(time=[0.0, 2.0, 1.0], pose=np.zeros((3, 3))),
        "poses": lambda: feeler.BaseMotion(time=[0.0, 2.0], pose=np.zeros((3, 3))),
        "late": lambda: feeler.BaseMotion(time=[1.0, 2.0], pose=np.zeros((2, 3))),
        "a shape": lambda: feeler.objects.make_feature("bal", 1.0),
        "a line": lambda: feeler.objects.parse_feature("ball:radus=1"),
        "a number": lambda: feeler.objects.parse_feature("ball:radius=one"),
        "no flow": lambda: parse_flow("x=0.3"),
        "twice": lambda: parse_flow("drag=1e-5,drag=2e-5"),
        "another noise": lambda: parse_noise("relativ:0.1"),
        "a noise's word": lambda: parse_noise("relative:0.1,each=touch"),
        "one object": lambda: Task(objects=("ball:radius=1",)),
        "alike": lambda: Task(objects=("ball:radius=1", "ball:radius=1")),
        "locations": lambda: Task(locations=(0.5, 0.5)),
        "drawn from nothing": lambda: feeler.sample_trials(3, locations=(0.9, 0.2)),
        "none drawn": lambda: feeler.sample_antennas(0, plane),
        "all modes": lambda: feeler.antenna.compute_modes(plane, 12),
    }
    yield from cases.items()
