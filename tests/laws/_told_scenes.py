"""What scenes, contacts, files and engines say of themselves; and what no engine takes."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path as File
from typing import Any

import numpy as np

import feeler
from feeler.antenna.segments import Antenna, Follicle
from feeler.errors import FeelerError
from feeler.objects.bodies import Object, Wall
from feeler.objects.trials import Trial
from feeler.physics.contact import (
    CONTACTS,
    Contact,
    compute_invweight,
    describe_sink,
    find_invweight,
    find_radius,
    get_contact,
    list_doubts,
)
from feeler.physics.engine import ENGINES, choose_timestep, get_engine
from feeler.physics.run import check_accuracy, find_coarsest, run_scene
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.physics.simulation import build_scene
from feeler.physics.spec import write_mjcf
from feeler.physics.statics import compute_reaction, solve_static
from tests.awkward_touches import list_trials, make_antenna

from ._engine_scenes import ROUNDED, SOFT, TURNED, make_fine, touch_by_hand
from ._scenes import SHAKEN, SHAPES, make_in_space


def settle(feature: Any) -> list[Any]:
    """The rod at rest against an object, and after it was put elsewhere."""
    item = Object(feature=feature, place=(-0.6, 9.1), forward=(1.0, 0.0))
    stepper = get_engine("rod").make([build_scene(make_fine(), [item])], 0.05)
    seen: list[Any] = [stepper.settle(), stepper.read()]
    seen += [stepper.settle(base=(0.1, -0.2, 0.05)), stepper.read()]
    seen += [stepper.settle(place=[(0.3, 8.0)]), stepper.read(), stepper.read_contacts(0)]
    return seen


def tell_scene(scene: Scene) -> dict[str, Any]:
    """What a scene says of itself."""
    told = {
        "base": scene.base_pose,
        "rate": scene.base_velocity,
        "speed": scene.speed,
        "follows": scene.follows,
        "guided": scene.guided,
        "gravity": scene.gravity,
        "angle": scene.initial_angle,
        "velocity": scene.initial_velocity,
    }
    return told | ({"drive": scene.compute_drive(13, 7, 0.05)} if scene.follows else {})


def soften(contact: Contact, antenna: Antenna) -> dict[str, Any]:
    """How soft a contact is along an antenna."""
    soft = contact.soften(antenna)
    return {
        "soft": list(soft),
        "moved": [soft.widen(*contact.widen(speed)) for speed in (0.0, 0.05, 0.4, 3.0)],
        "half": contact.halve(),
        "coarsest": [find_coarsest(contact, interval) for interval in (0.07, 0.3, 1.0)],
    }


def doubt(antenna: Antenna, contact: Contact | str) -> list[Any]:
    """Sentences about touches that are too fast, or steps that are too long."""
    found = get_contact(contact)
    return [
        list_doubts(antenna, found, speed, step)
        for speed in (0.1, 2.0, 30.0)
        for step in (0.003, 0.04, 0.5)
    ]


def write_file(antenna: Antenna, trial: Trial, **options: Any) -> list[str]:
    """MuJoCo's file, line by line."""
    return write_mjcf(antenna, trial, File("scene.xml"), **options).read_text().splitlines()


def react_at_once(n: int) -> Any:
    """Newton's and Euler's laws of some moment."""
    rng = np.random.default_rng(n)
    antenna = make_antenna()
    angle, rate, acceleration = rng.normal(scale=0.1, size=(3, antenna.n_segments))
    return compute_reaction(
        antenna,
        angle,
        rate,
        acceleration,
        rng.normal(scale=0.2, size=(3, 3)),
        np.array([0.002, -0.0098]),
        rng.normal(scale=5, size=(n, 2)),
        rng.normal(scale=1e-3, size=(n, 2)),
    )


def show_page(antenna: Antenna) -> str:
    """How a notebook draws a simulation."""
    items = [
        Object(feature=SHAPES["hook"], place=(-3.0, 9.0)),
        Object(feature=Wall(), place=(-9, 1)),
    ]
    return feeler.Simulation(antenna, items)._repr_html_()


def _ask(check: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return check(*arguments)
    except FeelerError as error:
        return str(error)


def list_told_scenes() -> Iterator[tuple[str, Callable[[], Any]]]:
    """Scenes by name."""
    plane, space = make_antenna(), make_in_space()
    yield from _list_told(plane, space)
    yield from _list_refused(plane, space)


def _list_told(plane: Antenna, space: Antenna) -> Iterator[tuple[str, Callable[[], Any]]]:
    trials = list_trials()
    for k, trial in enumerate(trials):
        yield f"scene {k}", partial(tell_scene, make_scene(plane, trial))
        yield f"scene {k} in space", partial(tell_scene, make_scene(space, trial))
        for control in (False, True):
            yield (
                f"file {k} {control}",
                partial(write_file, plane, trial, control=control, timestep=0.03),
            )
        yield f"file {k} in space", partial(write_file, space, trial)
    yield "scene shaken", partial(tell_scene, build_scene(plane, trials[0], base=SHAKEN))
    yield "scene shaken in space", partial(tell_scene, build_scene(space, base=SHAKEN))
    turned = build_scene(space, trials[1], base=TURNED, gravity=(0.1, 0.2, 0.3))
    yield "scene turned", partial(tell_scene, turned)
    hook = Trial(feature=SHAPES["hook"], location=0.66, speed=0.4, friction=0.2)
    yield "file of a hook", partial(write_file, plane, hook)
    yield "file of a hook in space", partial(write_file, space, hook.replace(azimuth=50))
    contacts = {name: CONTACTS[name] for name in CONTACTS} | {"own": SOFT}
    for name, contact in contacts.items():
        yield f"contact {name}", partial(soften, contact, plane)
        yield f"contact {name} in space", partial(soften, contact, space)
        yield f"doubts of {name}", partial(doubt, plane, contact)
    soft = Follicle(stiffness=(0.03, 0.05, 0.02))
    antennas = (plane, space, make_in_space(follicle=soft), make_in_space(planes=2))
    yield "inverse weights", lambda: [find_invweight(antenna) for antenna in antennas]
    yield (
        "loose weights",
        partial(compute_invweight, plane.segment_length, plane.segment_mass, loose=True),
    )
    yield "page", partial(show_page, plane)
    items = {name: Object(feature=shape) for name, shape in SHAPES.items()}
    yield "radii", lambda: {name: find_radius(item) for name, item in items.items()}
    yield "sunk", partial(describe_sink, 0.73)
    yield (
        "timesteps",
        lambda: [choose_timestep(step, e) for e in ENGINES for step in (None, 0.03)],
    )
    for kind in ENGINES:
        engine = get_engine(kind)
        yield (
            f"steps of {kind}",
            lambda engine=engine: [
                (name, step, _ask(engine.check, contacts[name], step))
                for name in contacts
                for step in (0.05, 0.15, 0.3)
            ],
        )
    yield "accuracies", lambda: [_ask(check_accuracy, x) for x in (1e-7, 1e-3, 0.5, 0.6, "x")]
    for n in (0, 1, 4):
        yield f"reaction to {n}", partial(react_at_once, n)
    for name in ROUNDED:
        yield f"rod settles at the {name}", partial(settle, ROUNDED[name])


def _list_refused(plane: Antenna, space: Antenna) -> Iterator[tuple[str, Callable[[], Any]]]:
    ball = Trial(feature=SHAPES["ball"], location=0.71, speed=0.4, lead=0.8)
    scene, other = make_scene(plane, ball), make_scene(make_fine(), ball)
    lanes = partial(feeler.Simulations, [scene, scene], timestep=0.05)
    hopeless = build_scene(plane, velocity=np.full(11, 1e200), label="hopeless")
    clock = Clock(duration=3.0, sample_interval=0.3, timestep=0.05)
    cases: dict[str, Callable[[], Any]] = {
        "no lanes": lambda: feeler.Simulations([], timestep=0.05),
        "lanes of two antennae": lambda: feeler.Simulations([scene, other], timestep=0.05),
        "no step": lambda: lanes().step(0.0),
        "part of a step": lambda: lanes().step(0.17),
        "a lane beyond": lambda: lanes().get_scene(2),
        "a lane below": lambda: lanes().move_base(-1, (0.1, 0.0)),
        "an object beyond": lambda: lanes().move_object(1, 1, (0.1, 0.0)),
        "a base too fast": lambda: lanes().move_base(0, (30.0, 40.0)),
        "a base that turns too fast": lambda: lanes().move_base(0, (0.0, 0.0), 9.0),
        "an object too fast": lambda: lanes().move_object(1, 0, (300.0, 0.0)),
        "another antenna": lambda: lanes().reset(1, other),
        "an antenna in space": lambda: lanes().reset(1, make_scene(space, ball)),
        "two rates": lambda: lanes().move_base(0, (0.1, 0.0, 0.1)),
        "a step below 0": lambda: feeler.Simulations([scene], timestep=-0.05),
        "a hopeless scene": lambda: run_scene(hopeless, clock),
        "control in space": lambda: write_file(space, ball, control=True),
        "a sharp corner": lambda: touch_by_hand(
            plane, ball.replace(feature=SHAPES["hook"]), "rod"
        ),
        "a rod with hard contact": lambda: touch_by_hand(plane, ball, "rod", contact="hard"),
        "a rod that swings": lambda: feeler.Simulation(
            plane, velocity=0.1 * np.ones(11), engine="rod"
        ),
        "a limp rod": lambda: feeler.Simulation(
            plane.replace(stiffness=0.0, damping=0.0), engine="rod"
        ),
        "a path beyond": lambda: feeler.Simulation(plane, base=SHAKEN).step(30.0),
        "an object inside": lambda: feeler.Simulation(
            plane, Object(feature=SHAPES["ball"], place=(0.3, 7.0))
        ),
        "a force": lambda: solve_static(plane, (0.1, np.nan)),
        "a force in space": lambda: solve_static(space, (0.1, 0.0)),
        "a limp antenna": lambda: solve_static(plane.replace(stiffness=0.0), (0.01, 0.0)),
        "a force too large": lambda: solve_static(plane, (0.3, -90.0)),
        "a solref": lambda: Contact(solref=(0.3, 0.0)),
        "a solimp": lambda: Contact(solimp=(0.3, 0.9, 0.1)),
        "another solimp": lambda: Contact(solimp=(0.9, 0.3, 0.1, 0.5, 2)),
        "a share": lambda: Contact(share=1.0),
        "a speed": lambda: Contact(speed=-0.1),
        "a clock": lambda: Clock(duration=0.0, timestep=0.1),
        "an uneven clock": lambda: Clock(duration=3.0, sample_interval=0.3, timestep=0.07),
        "a short clock": lambda: Clock(duration=0.1, sample_interval=0.3, timestep=0.1),
        "a long clock": lambda: Clock(duration=1e9, sample_interval=0.3, timestep=0.1),
    }
    yield from cases.items()
