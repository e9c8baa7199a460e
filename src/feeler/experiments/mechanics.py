"""Mechanical tests of an antenna: bend, release, hit."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
import xarray as xr

from feeler.antenna.segments import Antenna, require_plane
from feeler.errors import FeelerError, InvalidInput
from feeler.objects.shapes import Ball
from feeler.objects.trials import FRICTION, Trial
from feeler.physics.contact import Contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.equilibrium import compute_point, solve_static
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Motion, Path, Scene, make_scene
from feeler.physics.simulation import check_hinges
from feeler.provenance import LICENCE, list_versions, to_jsonable, write_canonical
from feeler.records import Gt, Le, Len, Unit
from feeler.tensors.schema import label_units, make_motion_tensors
from feeler.validation import checked

# Bend an antenna with static forces.


@checked
def bend(antenna: Antenna, force: float | Sequence[float], at: float = 1.0) -> xr.Dataset:
    """Static posture under a dead force along +x at a fraction of the length.

    Solves the equilibrium of all hinge torques directly, for any deflection; small forces on a
    uniform antenna give the cantilever ``F L³ / 3EI``, large ones the elastica.

    Parameters
    ----------
    force
        One or several forces [N], each a separate load case (dim ``load``).
    at
        Where the force acts, as a fraction of the length.

    Returns
    -------
    xarray.Dataset
        ``angle`` (load, hinge) [rad], ``points`` (load, joint, axis) [mm] from base to tip, ``tip``
        (load, axis) [mm], coordinate ``force`` [N].
    """
    forces = np.atleast_1d(np.asarray(force, dtype=float))
    if forces.ndim != 1 or not forces.size:
        raise InvalidInput(
            f"force must be one force or a row of them [N], got shape {forces.shape}."
        )
    angle = np.stack([solve_static(antenna, (value, 0.0), at) for value in forces])
    points = antenna.shape(angle)
    dataset = xr.Dataset(
        {
            "angle": (("load", "hinge"), angle),
            "points": (("load", "joint", "axis"), points),
            "tip": (("load", "axis"), points[:, -1]),
        },
        {
            "force": ("load", forces),
            "hinge": np.arange(1, antenna.n_segments + 1),
            "axis": ["x", "y"],
        },
    )
    dataset["points"].attrs["units"] = "mm"
    made_with = {
        "configuration": write_canonical({"antenna": antenna}),
        "versions": write_canonical(list_versions()),
    }
    dataset = label_units(dataset)
    return dataset.assign_attrs(at=at, antenna=antenna.name, licence=LICENCE, **made_with)


# Hold an antenna to one side, let it go, and watch it swing.


@checked
def release(
    antenna: Antenna,
    at: float = 10.0,
    deflection: float = 1.0,
    *,
    duration: float = 200.0,
    sample_interval: float = 0.1,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    angle: np.ndarray | None = None,
) -> xr.Dataset:
    """Free response after a step: the antenna held aside at one point, at rest, then released at
    time 0.

    Parameters
    ----------
    at
        Arc length from the base of the point that is held [mm] (10 mm in the animal experiments,
        Methods).
    deflection
        How far that point is held aside, along +x [mm].
    duration, sample_interval, timestep
        [ms].
    angle
        Start from these hinge angles (segment,) [rad] instead of a held posture.

    Returns
    -------
    xarray.Dataset
        One trial with ``angle``, ``curvature`` (trial, sensor, time) of every hinge and ``tip``
        (trial, time, axis) [mm].
    """
    require_plane(antenna, "release")
    start = (
        hold(antenna, at, deflection)
        if angle is None
        else check_hinges(antenna, angle, "angle")
    )
    clock = Clock(
        duration=duration,
        sample_interval=sample_interval,
        timestep=choose_timestep(timestep, engine),
    )
    scene = Scene(antenna=antenna, angle=start, label=f"release of {antenna.name}")
    motion = run_scene(scene, clock, engine)
    trial: dict[str, list] = {
        "feature": ["release"],
        "size": [0.0],
        "location": [at / antenna.length],
        "speed": [0.0],
    }
    made_with = {
        "antenna": antenna,
        "clock": clock,
        "engine": engine,
        "at": at,
        "deflection": deflection,
    }
    whole = antenna.replace(sensors=np.arange(1, antenna.n_segments + 1))
    return make_motion_tensors(
        whole,
        [motion],
        trials=trial | {"antenna": [antenna.name], "source": ["simulation"], "seed": [0]},
        attrs={
            "configuration": to_jsonable(made_with),
            "engine": engine,
            "versions": list_versions(),
            "timestep": clock.timestep,
            "timestep_units": "ms",
            "licence": LICENCE,
        },
    )


def hold(antenna: Antenna, at: float, deflection: float) -> np.ndarray:
    """Hinge angles (segment,) [rad] of an antenna pushed aside by ``deflection`` [mm] along +x at
    arc length ``at`` [mm].

    The force that does it is found by the secant method on the exact statics.
    """
    if not (np.isfinite(deflection) and abs(deflection) < at):
        raise InvalidInput(
            f"deflection must be smaller than `at` = {at:g} mm, got {deflection} mm."
        )
    share = at / antenna.length
    rest = compute_point(antenna, antenna.rest_angle, share)[0]
    forces, places = [0.0, 1e-6], [0.0]
    for _ in range(60):
        angle = solve_static(antenna, (forces[-1], 0.0), share)
        places.append(compute_point(antenna, angle, share)[0] - rest)
        if abs(places[-1] - deflection) <= 1e-10 * max(abs(deflection), 1e-3):
            return angle
        slope = (places[-1] - places[-2]) / (forces[-1] - forces[-2])
        forces.append(forces[-1] + (deflection - places[-1]) / slope)
    raise FeelerError(
        f"no force holds the antenna {deflection:g} mm aside at {at:g} mm; use a smaller"
        " deflection."
    )


# Impulse test: a cylinder hits the antenna near its tip, pushes it aside and lets it slip off.

_LOCATION = 0.95  # [P] share of the length where the cylinder hits
RADIUS = 2.5  # [P] mm; half of 5 mm
# [C] mm/ms; slow enough for the quasi-static deflection ratios that the targets stand for
_SPEED = 0.2
_POINTS = (0.71, 0.86)  # [P] share of the length
IMPULSE_LEAD = 2.0  # [C] ms before contact
_Share = Annotated[float, Gt(0), Le(1)]
_LEVER_LEGS = 36  # straight pieces that stand for the lever's quarter circle


@checked
def hit(
    antenna: Antenna,
    *,
    location: float = _LOCATION,
    speed: float = _SPEED,
    radius: float = RADIUS,
    lever: Annotated[float, Gt(0), Unit("mm")] | None = None,
    points: Annotated[tuple[_Share, ...], Len(1)] = _POINTS,
    friction: float = FRICTION,
    duration: float | None = None,
    sample_interval: float = 0.5,
    timestep: float | None = None,
    contact: Contact | str | None = None,
    engine: str = DEFAULT_ENGINE,
) -> xr.Dataset:
    """Hit an antenna with a cylinder and follow points along it.

    Parameters
    ----------
    location
        Where the cylinder first touches, as a share of the length.
    speed
        Speed of the cylinder [mm/ms].
    lever
        Length of the lever arm [mm] whose pivot lies distally, on the antenna's own line; ``None``:
        a straight path.
    points
        Points to follow, shares of the length.
    duration
        From first contact [ms]; default: long enough for the cylinder to travel 0.6 of the length,
        plus 80 ms.

    Returns
    -------
    xarray.Dataset
        ``deflection`` (point, time) and ``tip`` (time) [mm], across the straight antenna, positive
        the way the cylinder moves; ``angle`` of all hinges (time, hinge) [rad], ``object``, the
        centre of the cylinder (time, axis) [mm], and ``force``, the contact force on the antenna
        (time, axis) [N]; ``time`` [ms] is 0 at first contact. Feed deflections to
        ``feeler.analysis.measure_deflection_ratios``.

    Raises
    ------
    InvalidInput
        Points outside (0, 1], or a lever, speed or location that make no hit.
    """
    require_plane(antenna, "hit")
    scene = make_impulse_scene(
        antenna,
        location=location,
        speed=speed,
        radius=radius,
        lever=lever,
        friction=friction,
        contact=contact,
    )
    duration = 0.6 * antenna.length / speed + 80.0 if duration is None else duration
    clock = Clock(
        duration=duration + IMPULSE_LEAD,
        sample_interval=sample_interval,
        timestep=choose_timestep(timestep, engine, scene.contact),
    )
    return measure_impulse(scene, run_scene(scene, clock, engine), points)


def make_impulse_scene(
    antenna: Antenna,
    *,
    location: float = _LOCATION,
    speed: float = _SPEED,
    radius: float = RADIUS,
    lever: float | None = None,
    friction: float = FRICTION,
    contact: Contact | str | None = None,
) -> Scene:
    """The scene of ``hit``; first contact after ``IMPULSE_LEAD`` ms."""
    trial = Trial(
        feature=Ball(radius=radius),
        location=location,
        speed=speed,
        lead=IMPULSE_LEAD,
        friction=friction,
    )
    scene = make_scene(antenna, trial, contact)
    return scene if lever is None else _swing(scene, speed, lever)


def _swing(scene: Scene, speed: float, lever: float) -> Scene:
    """Straight until contact, then a quarter circle away from the base, then straight on."""
    edges = np.linspace(0, np.pi / 2, _LEVER_LEGS + 1)
    middle = (edges[:-1] + edges[1:]) / 2
    forward, distal = np.asarray(scene.objects[0].forward), np.array([0.0, 1.0])
    legs = speed * (np.cos(middle)[:, None] * forward + np.sin(middle)[:, None] * distal)
    velocity = [speed * forward, *legs, speed * distal]
    end = IMPULSE_LEAD + edges * lever / speed
    path = Path(
        velocity=tuple((float(x), float(y)) for x, y in velocity), end=tuple(map(float, end))
    )
    return replace(scene, paths=(path,), label=f"impulse, {scene.label}, lever {lever:g} mm")


def measure_impulse(
    scene: Scene, motion: Motion, points: tuple[float, ...] = _POINTS
) -> xr.Dataset:
    """Deflections of ``points`` and tip in a simulated impulse test."""
    antenna = scene.antenna
    rest, cylinder = antenna.tip(), scene.objects[0]
    forward = np.asarray(cylinder.forward)
    along = [
        compute_point(antenna, motion.angle, point)
        - compute_point(antenna, antenna.rest_angle, point)
        for point in points
    ]
    deflection = np.stack([place @ forward for place in along])
    tip = (antenna.tip(motion.angle) - rest) @ forward
    centre = np.asarray(cylinder.place) - cylinder.feature.rounding * forward
    path = (scene.paths[0] if scene.paths else None) or Path(velocity=(cylinder.velocity,))
    # Displacement (sample, 2) [mm] along a path since time 0.
    starts = np.array([0.0, *path.end])
    ends = np.array([*path.end, np.inf])
    spent = np.clip(np.asarray(motion.time)[:, None], starts, ends) - starts
    columns = {
        "deflection": (("point", "time"), deflection, {"units": "mm"}),
        "tip": ("time", tip, {"units": "mm"}),
        "angle": (("time", "hinge"), motion.angle, {"units": "rad"}),
        "object": (
            ("time", "axis"),
            centre + (spent @ np.array(path.velocity)),
            {"units": "mm"},
        ),
        "force": (("time", "axis"), motion.force, {"units": "N"}),
    }
    return xr.Dataset(
        columns,
        {
            "time": ("time", motion.time - IMPULSE_LEAD, {"units": "ms"}),
            "point": [*points],
            "axis": ["x", "y"],
        },
    )
