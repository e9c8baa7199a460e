"""Small scenes that several files of laws share."""

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.objects import Feature, Outline, Trial, make_feature
from feeler.objects.motion import BaseMotion
from feeler.physics.contact import Contact
from feeler.physics.scene import Motion, Scene, make_scene
from feeler.presets import make_preset

CHAINS = ("chain", "chain-consistent")
DYNAMIC = (*CHAINS, "mujoco")
HOOK = Outline(vertices=((0.0, 0.1), (-2.0, 1.5), (-1.0, 0.3), (-3.0, -1.0), (-1.0, -1.2)))


def uniform(n: int, stiffness: float = 1e-3, damping: float = 0.0, **fields: object) -> Antenna:
    """A chain of equal segments, 0.3 mm and 1 µg each."""
    base = {"segment_length": np.full(n, 0.3), "segment_mass": 1e-6, "radius": 0.1}
    return Antenna(**base, stiffness=stiffness, damping=damping, **fields)


def make_stub(n: int = 12, **changes: object) -> Antenna:
    """A stub that MuJoCo steps in microseconds: the cockroach's numbers at its tip."""
    whole = make_preset("cockroach")
    fields = ("segment_length", "segment_mass", "radius", "stiffness", "damping", "rest_angle")
    values = {name: getattr(whole, name)[-n:] for name in fields} | changes
    return Antenna(**values, name="stub")


def touch(
    feature: str | Feature = "ball",
    size: float = 1.0,
    n: int = 30,
    contact: Contact | str = "hard",
    whole: bool = False,
    **fields: object,
) -> Scene:
    """A cockroach's last segments, touched from the left."""
    options = {"location": 0.6123, "speed": 0.3, "lead": 0.5432} | fields
    feature = make_feature(feature, size) if isinstance(feature, str) else feature
    antenna = make_preset("cockroach") if whole else make_stub(n)
    return make_scene(antenna, Trial(feature=feature, **options), contact)


def shake(
    duration: float,
    across: float = 0.3,
    along: float = 0.1,
    turn: float = 0.03,
    hertz: float = 50.0,
) -> BaseMotion:
    """A base that swings from its place and with its speed: amplitudes [mm, mm, rad], sampled every
    0.5 ms.
    """
    time = np.linspace(0.0, duration + 2.0, round(2 * duration) + 5)
    phase = 2e-3 * np.pi * hertz * time
    swing = [across * np.sin(phase), along * np.sin(phase), turn * np.sin(phase)]
    return BaseMotion(time=time, pose=np.stack(swing, axis=1))


def compute_energy(antenna: Antenna, motion: Motion) -> np.ndarray:
    """Kinetic plus elastic energy at each sample [N·mm]; the base is at rest."""
    return compute_kinetic(antenna, motion, np.zeros((len(motion.time), 3))) + compute_spring(
        antenna, motion
    )


def compute_kinetic(antenna: Antenna, motion: Motion, rate: np.ndarray) -> np.ndarray:
    """Kinetic energy at each sample, for the base's rates (sample, 3) then."""
    heading = motion.base[:, 2, None] + np.cumsum(motion.angle, axis=1)
    turn = rate[:, 2, None] + np.cumsum(motion.velocity, axis=1)
    length, mass = antenna.segment_length, antenna.segment_mass
    along = np.stack([np.cos(heading), -np.sin(heading)], axis=-1) * (turn * length)[..., None]
    centre = rate[:, None, :2] + np.cumsum(along, axis=1) - along / 2
    return 0.5 * (mass * (centre**2).sum(-1) + mass * length**2 / 12 * turn**2).sum(axis=1)


def compute_spring(antenna: Antenna, motion: Motion) -> np.ndarray:
    """Elastic energy at each sample."""
    return 0.5 * (antenna.stiffness * (motion.angle - antenna.rest_angle) ** 2).sum(axis=1)


FORCES = ("base_force", "base_moment", "work")


def check_alike(
    ours: Motion, theirs: Motion, slack: float, share: float, names: tuple = FORCES
) -> None:
    """Angles and bases agree to ``slack``, all else to a share of its greatest value."""
    for name in ("angle", "base", *names):
        got, wanted = getattr(ours, name), getattr(theirs, name)
        limit = share * np.nanmax(np.abs(wanted)) if name in names else slack
        np.testing.assert_allclose(got, wanted, rtol=0, atol=limit, err_msg=name)
