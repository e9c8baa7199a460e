"""Each engine with what the other scenes leave out: every shape by hand, lanes, paths, contacts,
accuracies, antennae that are rolled up or lost.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

import feeler
from feeler.antenna.segments import Antenna, Follicle
from feeler.errors import SimulationDiverged
from feeler.objects.bodies import Object, Wall
from feeler.objects.motion import BaseMotion, Flow
from feeler.objects.outlines import Outline
from feeler.objects.shapes import Box, Triangle
from feeler.objects.trials import Trial
from feeler.physics.contact import Contact
from feeler.physics.engine import ENGINES, get_engine
from feeler.physics.run import list_turns, make_groups, run_in_time, simulate
from feeler.physics.scene import Clock, Path, Scene, make_scene
from feeler.physics.simulation import build_scene
from tests.awkward_touches import list_trials, make_antenna

from ._scenes import HOOK, IN_SPACE, SHAKEN, SHAPES, look, make_in_space, react, run

RODS = ("rod", "rod-inertia")
ROUNDED = {
    "ball": SHAPES["ball"],
    "box": Box(half_width=1.1, half_height=2.3, rounding=0.45),
    "triangle": Triangle(half_width=1.9, half_height=1.4, rounding=0.4),
    "peg": SHAPES["peg"],
    "hook": Outline(vertices=HOOK, rounding=0.4),
    "wall": Wall(
        profile=np.array([[0.0, 0.0], [1.7, 0.4], [4.2, 0.1], [6.1, 0.0]]), rounding=0.5
    ),
}
"""The same for the rods, which feel no sharp corner."""
SOFT = Contact(solref=(0.31, 0.8), solimp=(0.02, 0.9, 0.03, 0.4, 3.0), crossing=0.2, speed=0.7)
AWAY = BaseMotion(
    time=np.array([0.0, 2.3, 4.1, 7.9]),
    pose=np.array([[0.4, -0.3, 0.06], [0.5, -0.1, 0.02], [0.1, 0.2, -0.03], [0.3, 0.1, 0.05]]),
)
TURNED = BaseMotion(
    time=np.array([0.0, 2.1, 4.4, 7.0, 12.0]),
    pose=0.1 * np.cos(np.arange(30.0)).reshape(5, 6),
)


def make_fine() -> Antenna:
    """Segments as short as the rod engines need them to feel small things."""
    n = np.arange(31)
    return Antenna(
        segment_length=0.97 - 0.012 * n,
        segment_mass=7e-4 * np.exp(-0.11 * n),
        radius=0.27 - 0.003 * n,
        stiffness=21.0 * np.exp(-0.18 * n),
        damping=11.0 * np.exp(-0.16 * n),
        rest_angle=0.0013 * np.sin(n),
        sensors=[3, 7, 12, 29],
        name="fine",
    )


def make_for(engine: str) -> Antenna:
    """An antenna that this engine can follow at every shape."""
    return make_fine() if engine in RODS else make_antenna()


def touch_by_hand(
    antenna: Antenna, trial: Trial, engine: str, **options: Any
) -> list[dict[str, Any]]:
    """One object that comes, turns away, and goes on."""
    options = ({"timestep": 0.2} if engine in RODS else {}) | options
    simulation = feeler.Simulation(antenna, [trial], engine=engine, **options)
    turn = (0.004, -0.007, 0.011) if antenna.spatial else 0.013
    away = (-0.11, 0.07, 0.03) if antenna.spatial else (-0.11, 0.07)
    simulation.step(3.2)
    seen = [look(simulation)]
    simulation.move_object(simulation.names[0], away, turn)
    simulation.move_base(tuple(-0.3 * x for x in away), 0.2 * np.asarray(turn))
    simulation.step(simulation.timestep)  # in which the base gathers speed
    seen.append(look(simulation))
    simulation.step(2.4)
    return [*seen, look(simulation)]


def list_lanes(antenna: Antenna, contact: str | None) -> list[Scene]:
    """Three scenes of one number of segments."""
    ball, box = SHAPES["ball"], (ROUNDED if contact is None else SHAPES)["box"]
    azimuth = {"azimuth": 31.0} if antenna.spatial else {}
    first = Trial(feature=ball, location=0.71, speed=0.4, lead=0.8, friction=0.5)
    second = Trial(feature=box, location=0.45, speed=0.6, lead=0.5, side="right", **azimuth)
    stiff = antenna.replace(stiffness=1.7 * antenna.stiffness)
    return [
        make_scene(antenna, first),
        make_scene(stiff, second, contact),
        build_scene(
            antenna,
            [first] if contact is None else [first, second.replace(lead=2.3)],
            gravity=(0.001, -0.003),
            base=SHAKEN,
        ),
    ]


def step_lanes(antenna: Antenna, engine: str) -> list[Any]:
    """Lanes that are commanded, saved, begun anew and brought back one by one."""
    scenes = list_lanes(antenna, "even" if engine not in RODS else None)
    side_by_side = feeler.Simulations(scenes, engine=engine, timestep=0.05)
    side_by_side.step(2.5)
    seen = [side_by_side.state, side_by_side.shape, side_by_side.read_contacts(1)]
    kept = side_by_side.snapshot([1])
    flat = () if not antenna.spatial else (0.02,)
    turn = 0.01 if not antenna.spatial else (0.003, 0.002, 0.01)
    side_by_side.move_base(1, (0.05, -0.03, *flat), turn)
    side_by_side.move_object(0, 0, (-0.2, 0.1, *flat), turn)
    side_by_side.step(1.5)
    seen += [side_by_side.state, side_by_side.time, side_by_side.get_scene(2)]
    side_by_side.reset(0, scenes[2])
    side_by_side.restore(kept)
    side_by_side.step(1.0)
    return [*seen, side_by_side.state, side_by_side.time, side_by_side.read_contacts(0)]


def run_paths(engine: str) -> list[Any]:
    """Objects that change their course, once between two samples."""
    ball = Object(feature=SHAPES["ball"], place=(-1.5, 9.4))
    path = Path(velocity=((0.6, 0.0), (-0.1, 0.2), (0.0, -0.4)), end=(2.35, 4.8))
    scene = Scene(antenna=make_for(engine), objects=(ball,), paths=(path,))
    motion = simulate(
        [scene], Clock(duration=7.2, sample_interval=0.3, timestep=0.05), engine=engine
    )
    stepper = get_engine(engine).make([scene], 0.05)
    return [motion, list_turns(stepper), scene.speed, scene.guided]


def run_many(engine: str) -> list[Any]:
    """Scenes of two sizes, one of which cannot be followed."""
    plane, few = make_for(engine), feeler.presets.make_preset("linear")
    trials = list_trials()
    scenes = [make_scene(antenna, trial) for trial in trials for antenna in (plane, few)]
    hopeless = build_scene(plane, velocity=np.full(plane.n_segments, 1e200), label="hopeless")
    if engine != "rod":
        scenes.insert(2, hopeless)
    clock = Clock(duration=4.2, sample_interval=0.6, timestep=0.05)
    found = simulate(scenes, clock, engine=engine, workers=1)
    groups = (
        make_groups(scenes, get_engine(engine)),
        make_groups(scenes, get_engine(engine), times=2),
    )
    lost = [one for one in found if isinstance(one, Exception)]
    return [
        groups,
        [str(one) if isinstance(one, Exception) else one for one in found],
        [
            [one.time, one.angle, one.velocity]
            for one in lost
            if isinstance(one, SimulationDiverged)
        ],
    ]


def rub_corners(antenna: Antenna, engine: str) -> dict[str, Any]:
    """Solids with edges, met from everywhere."""
    shapes = [SHAPES[name] for name in ("box", "triangle", "hook", "peg")]
    trials = [
        Trial(
            feature=shape,
            location=0.35 + 0.13 * (n % 5),
            speed=0.5,
            lead=0.6,
            friction=0.2,
            approach=55 + 17 * (n % 5),
            azimuth=(41 * n) % 360 - 160 if antenna.spatial else 0,
            side=("left", "right")[n % 2] if not antenna.spatial else "left",
        )
        for n, shape in enumerate(shapes * 4)
    ]
    found = {
        str(contact): run(antenna, trials, engine, contact=contact, duration=6.3)
        for contact in (None, "hard")
    }
    return {
        contact: [
            (one["angle"].values, one["force"].values) for _, one in data.groupby("trial")
        ]
        for contact, data in found.items()
    }


def run_precisely(engine: str, feature: Any, accuracy: float) -> list[Any]:
    """Motions with what they err by and the least step that was taken."""
    antenna = make_for(engine)
    scenes = [
        make_scene(antenna, Trial(feature=feature, location=at, speed=0.5, lead=0.6))
        for at in (0.5, 0.8)
    ]
    found = run_in_time(scenes, 4.2, 0.3, engine, accuracy)
    return [
        [(one.timestep, one.error, one.angle[-1]) for one in found if hasattr(one, "angle")]
    ]


def fall_apart(antenna: Antenna, engine: str) -> list[Any]:
    """A lane that cannot be followed, beside one that can."""
    ball = Trial(feature=SHAPES["ball"], location=0.71, speed=0.4, lead=0.8, friction=0.5)
    huge = np.full(antenna.rest_angle.shape, 1e200)
    begins = {"angle": 1e-3 * huge} if engine == "rod" else {"velocity": huge}
    scenes = [build_scene(antenna, [ball]), build_scene(antenna, [ball], **begins)]
    side_by_side = feeler.Simulations(scenes, engine=engine, timestep=0.05, workers=2)
    side_by_side.step(1.5)
    seen = [side_by_side.state.angle[0], side_by_side.time, *map(str, side_by_side.failed)]
    side_by_side.reset(1)
    side_by_side.step(0.5)
    return [*seen, side_by_side.time, *map(str, side_by_side.failed)]


def press_flat(antenna: Antenna, engine: str) -> list[Any]:
    """A wall without end that comes, and slides along."""
    space = antenna.spatial
    wall = Object(
        feature=Wall(),
        place=(-2.6, 9.1, 0.4) if space else (-2.6, 17.0),
        forward=(12 / 13, -3 / 13, 4 / 13) if space else (0.96, -0.28),
        velocity=(0.45, 0.02, *[0.06] * space),
        friction=0.4,
    )
    simulation = feeler.Simulation(antenna, [wall], engine=engine)
    simulation.step(4.0)
    seen = [look(simulation)]
    simulation.move_object(0, (0.02, -0.11, *[0.03] * space))
    simulation.step(3.0)
    return [*seen, look(simulation)]


def curl(antenna: Antenna, engine: str) -> list[Any]:
    """Rolled up by more than a whole turn, and let go."""
    angle = np.full(antenna.rest_angle.shape, 0.61 * 11 / antenna.n_segments)
    simulation = feeler.Simulation(antenna, angle=angle, engine=engine, gravity=(0.003, -0.009))
    seen = [look(simulation)]
    simulation.step(2.0)
    return [*seen, look(simulation)]


def list_engine_scenes() -> Iterator[tuple[str, Callable[[], Any]]]:
    """Scenes by name."""
    plane, space = make_antenna(), make_in_space()
    for engine in ENGINES:
        flat, shapes = make_for(engine), ROUNDED if engine in RODS else SHAPES
        for name, shape in shapes.items():
            trial = Trial(feature=shape, location=0.62, speed=0.4, lead=0.7, friction=0.3)
            yield f"{engine}, {name} by hand", partial(touch_by_hand, flat, trial, engine)
            if engine in IN_SPACE and name != "wall":
                lifted = trial.replace(azimuth=-63, approach=105)
                yield (
                    f"{engine}, {name} by hand in space",
                    partial(touch_by_hand, space, lifted, engine),
                )
        yield f"{engine}, paths", partial(run_paths, engine)
        yield f"{engine}, many", partial(run_many, engine)
        yield f"{engine}, lanes", partial(step_lanes, flat, engine)
        trial = list_trials()[0]
        contacts = {"hard": "hard", "even": "even", "own": SOFT}
        for name, contact in contacts.items() if engine not in RODS else ():
            yield (
                f"{engine}, contact {name}",
                partial(touch_by_hand, flat, trial, engine, contact=contact),
            )
        for antenna in (flat, space) if engine in IN_SPACE else (flat,):
            where = " in space" if antenna.spatial else ""
            yield f"{engine}, rolled up{where}", partial(curl, antenna, engine)
            yield f"{engine}, wall without end{where}", partial(press_flat, antenna, engine)
            yield f"{engine}, a lost lane{where}", partial(fall_apart, antenna, engine)
        for name in ("ball", "box", "hook"):
            yield (
                f"{engine}, {name} precisely",
                partial(run_precisely, engine, shapes[name], 0.01),
            )
        if engine in IN_SPACE:
            yield f"{engine}, corners", partial(rub_corners, plane, engine)
            yield f"{engine}, corners in space", partial(rub_corners, space, engine)
            yield f"{engine}, posed away", partial(react, plane, engine, base=AWAY)
            yield f"{engine}, posed away in space", partial(react, space, engine, base=TURNED)
        if engine in RODS:
            trials = [
                Trial(
                    feature=shape, location=0.62, speed=0.4, lead=0.7, friction=0.3, side=side
                )
                for shape, side in zip(ROUNDED.values(), ("left", "right") * 3, strict=True)
            ]
            yield (
                f"{engine}, touches",
                partial(run, flat, trials, engine, timestep=0.1, all_hinges=True),
            )
    yield from _list_in_space(space)


def _list_in_space(space: Antenna) -> Iterator[tuple[str, Callable[[], Any]]]:
    flow = Flow(drag=2e-4, along=0.7e-4, velocity=(0.3, 0.1, -0.2))
    soft = Follicle(stiffness=(0.03, 0.05, 0.02), damping=(0.04, 0.01, 0.03))
    ball = Trial(feature=SHAPES["ball"], location=0.71, speed=0.4, lead=0.8, friction=0.4)
    pushed = 1e-3 * np.sin(np.arange(27.0)).reshape(3, 9)
    for engine in IN_SPACE:
        by_hand = partial(touch_by_hand, trial=ball, engine=engine)
        yield f"{engine}, lanes in space", partial(step_lanes, space, engine)
        yield f"{engine}, flow", partial(by_hand, space, flow=flow)
        yield f"{engine}, follicle", partial(by_hand, make_in_space(follicle=soft))
        yield (
            f"{engine}, follicle in a flow",
            partial(by_hand, make_in_space(follicle=soft), flow=flow, gravity=(0.002, -0.01)),
        )
        yield f"{engine}, two planes", partial(by_hand, make_in_space(planes=2))
        yield (
            f"{engine}, all at once",
            partial(
                by_hand,
                space,
                gravity=(0.002, -0.007, 0.004),
                angle=20 * pushed,
                velocity=pushed,
                base=TURNED,
            ),
        )
        yield f"{engine}, hard in space", partial(by_hand, space, contact="hard")
