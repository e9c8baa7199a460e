"""Protocols: the animal experiments in simulation, and the quantities that are measured on them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.modes import compute_modes
from feeler.errors import FeelerError, InvalidInput, SimulationDiverged
from feeler.experiment.impulse import LEAD, Impulse, make_impulse_scene, measure_impulse
from feeler.experiment.release import hold
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, TIMESTEP, get_engine
from feeler.physics.scene import Motion, Scene
from feeler.response import measure_deflection_ratios, measure_free_response

STEP_QUANTITIES = ("frequency", "damping_ratio")
IMPULSE_POINTS = {"ratio_71": 0.71, "ratio_86": 0.86}  # [P] shares of the length


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """How the two experiments are done in simulation."""

    at: float = 10.0
    """Distance of the forceps from the fixation [mm] [P]."""
    deflection: float = 1.0
    """How far the forceps hold that point aside [mm] [C]; frequency and damping change by < 0.5 % up to 3 mm."""
    step_duration: float = 150.0
    """[ms]"""
    speed: float = 0.2
    """Of the cylinder [mm/ms] [C]."""
    lever: float | None = None
    """Lever arm [mm] of the cylinder, None for a straight path [C]."""
    sample_interval: float = 0.5
    timestep: float = TIMESTEP
    engine: str = DEFAULT_ENGINE

    def measure(self, antenna: Antenna, names: Sequence[str]) -> "Measured":
        """The named quantities of one antenna."""
        outcome = self.measure_many([antenna], names)[0]
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def measure_many(self, antennas: Sequence[Antenna], names: Sequence[str]) -> "list[Measured | FeelerError]":
        """The named quantities of many antennas; those that could not be simulated give their error instead."""
        names = tuple(names)
        outcomes = [dict() for _ in antennas]
        if any(name in STEP_QUANTITIES for name in names):
            self._add(outcomes, antennas, self._step_scene, self.step_duration, self._read_step)
        if any(name in IMPULSE_POINTS for name in names):
            duration = 0.5 * max(antenna.length for antenna in antennas) / self.speed + 20.0 + LEAD
            self._add(outcomes, antennas, self._impulse_scene, duration, self._read_impulse)
        return [_collect(outcome, names) for outcome in outcomes]

    def simulate_steps(self, antennas: Sequence[Antenna]) -> list[tuple[np.ndarray, np.ndarray] | FeelerError]:
        """Time [ms] from release and tip displacement (sample,) [mm] of each antenna after a step."""
        outcomes: list[dict] = [{} for _ in antennas]
        self._add(outcomes, antennas, self._step_scene, self.step_duration, lambda *found: {"tip": _follow_tip(*found)})
        return [outcome.get("error") or outcome["tip"] for outcome in outcomes]

    def _add(self, outcomes: list[dict], antennas: Sequence[Antenna], make, duration: float, read) -> None:
        """Simulate a scene per antenna and put what ``read`` finds into ``outcomes``."""
        scenes: dict[int, Scene] = {}
        for k, antenna in enumerate(antennas):
            try:
                scenes[k] = make(antenna)
            except FeelerError as error:
                outcomes[k]["error"] = error
        for k, motion in zip(scenes, self._run(list(scenes.values()), duration), strict=True):
            if isinstance(motion, Exception):
                outcomes[k]["error"] = motion
                continue
            try:
                outcomes[k] |= read(antennas[k], scenes[k], motion)
            except InvalidInput as error:
                outcomes[k]["error"] = error

    def _run(self, scenes: list[Scene], duration: float) -> list[Motion | SimulationDiverged]:
        engine = get_engine(self.engine)
        clock = Clock(duration=duration, sample_interval=self.sample_interval, timestep=self.timestep)
        motions: list = [None] * len(scenes)
        for group in engine.make_groups(scenes):
            for index, motion in zip(group, engine.run_group([scenes[i] for i in group], clock), strict=True):
                motions[index] = motion
        return motions

    def _step_scene(self, antenna: Antenna) -> Scene:
        return Scene(antenna=antenna, angle=hold(antenna, self.at, self.deflection), label=f"step of {antenna.name}")

    def _impulse_scene(self, antenna: Antenna) -> Scene:
        return make_impulse_scene(antenna, speed=self.speed, lever=self.lever)

    def _read_step(self, antenna: Antenna, scene: Scene, motion: Motion) -> dict[str, object]:
        free = measure_free_response(*_follow_tip(antenna, scene, motion), floor=1e-6, fit=False)
        if free.overdamped:
            ratio = float(compute_modes(antenna, 1).damping_ratio[0])
            return {"overdamped": True, "frequency": 0.0, "damping_ratio": max(1.0, ratio)}
        return {"overdamped": False, "frequency": free.frequency, "damping_ratio": free.damping_ratio}

    def _read_impulse(self, antenna: Antenna, scene: Scene, motion: Motion) -> dict[str, float]:
        impulse: Impulse = measure_impulse(scene, motion, tuple(IMPULSE_POINTS.values()))
        ratios = measure_deflection_ratios(impulse.time, impulse.deflection, impulse.tip)
        return dict(zip(IMPULSE_POINTS, map(float, ratios), strict=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """Quantities of one simulated antenna.

    An over-damped antenna has no damped frequency, which ``overdamped`` says. Its entries in ``values`` are then 0 kHz
    and the modal damping ratio of its first mode, at least 1: so a cost stays a number, and a search is led back
    towards an oscillation.
    """

    names: tuple[str, ...]
    values: np.ndarray
    overdamped: bool = False


def _follow_tip(antenna: Antenna, scene: Scene, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    return motion.time, antenna.shape(motion.angle)[:, -1, 0] - antenna.shape()[-1, 0]


def _collect(outcome: dict[str, object], names: tuple[str, ...]) -> "Measured | FeelerError":
    if "error" in outcome:
        return outcome["error"]
    unknown = [name for name in names if name not in outcome]
    if unknown:
        valid = (*STEP_QUANTITIES, *IMPULSE_POINTS)
        return InvalidInput(f"unknown quantity {unknown[0]!r}; valid: {', '.join(valid)}.")
    values = np.array([outcome[name] for name in names], dtype=float)
    return Measured(names=names, values=values, overdamped=bool(outcome.get("overdamped", False)))
