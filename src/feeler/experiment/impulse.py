"""Impulse test: a cylinder hits the antenna near its tip, pushes it aside and lets it slip off."""

from dataclasses import dataclass, replace

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.space import require_plane
from feeler.errors import InvalidInput
from feeler.physics.clock import Clock
from feeler.physics.contact import Contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.run import run_scene
from feeler.physics.scene import Motion, Path, Scene, make_scene
from feeler.physics.statics import compute_point
from feeler.records.checked import checked
from feeler.stimulus.shapes import Ball
from feeler.stimulus.trial import FRICTION, Trial

_LOCATION = 0.95  # [P] share of the length where the cylinder hits
RADIUS = 2.5  # [P] mm; half of 5 mm
# [C] mm/ms; slow enough for the quasi-static deflection ratios that the targets stand for
_SPEED = 0.2
_POINTS = (0.71, 0.86)  # [P] share of the length
IMPULSE_LEAD = 2.0  # [C] ms before contact
_LEVER_LEGS = 36  # straight pieces that stand for the lever's quarter circle


@dataclass(frozen=True, kw_only=True, eq=False)
class Impulse:
    """One impulse test, time 0 at first contact.

    Attributes
    ----------
    time : np.ndarray
        (sample,) [ms].
    points : tuple[float, ...]
        Followed points, shares of the length.
    deflection : np.ndarray
        (point, sample) [mm], across the straight antenna, positive the way the cylinder moves.
    tip : np.ndarray
        (sample,) [mm].
    angle : np.ndarray
        Hinge angles (sample, segment) [rad].
    object : np.ndarray
        Centre of the cylinder (sample, 2) [mm].
    force : np.ndarray
        Contact force on the antenna (sample, 2) [N].
    """

    time: np.ndarray
    points: tuple[float, ...]
    deflection: np.ndarray
    tip: np.ndarray
    angle: np.ndarray
    object: np.ndarray
    force: np.ndarray


@checked
def hit(
    antenna: Antenna,
    *,
    location: float = _LOCATION,
    speed: float = _SPEED,
    radius: float = RADIUS,
    lever: float | None = None,
    points: tuple[float, ...] = _POINTS,
    friction: float = FRICTION,
    duration: float | None = None,
    sample_interval: float = 0.5,
    timestep: float | None = None,
    contact: Contact | str | None = None,
    engine: str = DEFAULT_ENGINE,
) -> Impulse:
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
    Impulse
        Deflections over time; feed them to ``feeler.response.measure_deflection_ratios``.

    Raises
    ------
    InvalidInput
        Points outside (0, 1], or a lever, speed or location that make no hit.
    """
    require_plane(antenna, "hit")
    if not (len(points) and all(0 < point <= 1 for point in points)):
        raise InvalidInput(f"points must be shares of the length in (0, 1], got {points}.")
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
    if lever is not None and not (np.isfinite(lever) and lever > 0):
        raise InvalidInput(
            f"lever must be a length > 0 mm, or None for a straight path, got {lever}."
        )
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
) -> Impulse:
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
    return Impulse(
        time=motion.time - IMPULSE_LEAD,
        points=tuple(points),
        deflection=deflection,
        tip=tip,
        angle=motion.angle,
        object=centre + _travel(path, motion.time),
        force=motion.force,
    )


def _travel(path: Path, time: np.ndarray) -> np.ndarray:
    """Displacement (sample, 2) [mm] along a path since time 0."""
    starts = np.array([0.0, *path.end])
    ends = np.array([*path.end, np.inf])
    spent = np.clip(np.asarray(time)[:, None], starts, ends) - starts
    return spent @ np.array(path.velocity)
