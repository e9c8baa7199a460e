"""Protocols: the animal experiments in simulation, and the quantities that are measured on them."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna, compute_modes
from feeler.errors import FeelerError, InvalidInput, SimulationDiverged
from feeler.execute.threads import ThreadExecutor, count_cores
from feeler.experiment.impulse import IMPULSE_LEAD, Impulse, make_impulse_scene, measure_impulse
from feeler.experiment.release import hold
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, get_engine
from feeler.physics.run import make_groups, run_group
from feeler.physics.scene import Motion, Scene
from feeler.records.record import Gt, Record, Unit
from feeler.response import measure_deflection_ratios, measure_free_response

_STEP_QUANTITIES = ("frequency", "damping_ratio")
# ms; enough for peak and trough of a cockroach's antenna, others are run for longer
_SHORT_STEP = 80.0
# shares of the length that the cylinder travels: enough for most, enough for all
_IMPULSE_TRAVEL = (0.35, 0.6)
# ms [C]; with the default engine the four quantities are within 0.13 % of those at 0.005 ms
_TIMESTEP = 0.05
_IMPULSE_POINTS = {"ratio_71": 0.71, "ratio_86": 0.86}  # [P] shares of the length


class Protocol(Record):
    """How the two experiments are done in simulation.

    Attributes
    ----------
    at : float
        Distance of the forceps from the fixation [mm], [P].
    deflection : float
        How far the forceps hold that point aside [mm], [C]; frequency and damping change by < 0.5 %
        up to 3 mm.
    step_duration : float
        [ms]
    speed : float
        Of the cylinder [mm/ms], [C].
    lever : float | None
        Lever arm [mm] of the cylinder, None for a straight path [C].
    timestep : float
        [ms]; the engines ``chain`` and ``mujoco`` need a tenth of it for the same accuracy.
    """

    at: float = 10.0
    deflection: float = 1.0
    step_duration: Annotated[float, Gt(0), Unit("ms")] = 150.0
    speed: Annotated[float, Gt(0), Unit("mm/ms")] = 0.2
    lever: float | None = None
    sample_interval: Annotated[float, Gt(0), Unit("ms")] = 0.5
    timestep: Annotated[float, Gt(0), Unit("ms")] = _TIMESTEP
    engine: str = DEFAULT_ENGINE

    def measure(self, antenna: Antenna, names: Sequence[str]) -> "Measured":
        """The named quantities of one antenna."""
        outcome = self.measure_many([antenna], names)[0]
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def measure_many(
        self, antennas: Sequence[Antenna], names: Sequence[str]
    ) -> "list[Measured | FeelerError]":
        """The named quantities of many antennas.

        Those that could not be simulated give their error instead.
        """
        names = tuple(names)
        outcomes: list[dict] = [{} for _ in antennas]
        experiments: list[tuple] = []
        if any(name in _STEP_QUANTITIES for name in names):
            durations = sorted({min(_SHORT_STEP, self.step_duration), self.step_duration})
            experiments.append((self._step_scene, durations, self._read_step))
        if any(name in _IMPULSE_POINTS for name in names):
            length = max(antenna.length for antenna in antennas)
            durations = [
                IMPULSE_LEAD + share * length / self.speed + 5.0 for share in _IMPULSE_TRAVEL
            ]
            experiments.append((self._impulse_scene, durations, self._read_impulse))
        with ThreadExecutor(
            min(len(experiments), count_cores()) or 1
        ) as pool:  # step and impulse at the same time
            list(pool.map(lambda asked: self._add(outcomes, antennas, *asked), experiments))
        return [_collect(outcome, names) for outcome in outcomes]

    def simulate_steps(
        self, antennas: Sequence[Antenna], places: Sequence[float] | np.ndarray = (1.0,)
    ) -> list[tuple[np.ndarray, np.ndarray] | FeelerError]:
        """Time [ms] from release and sideways displacement (place, sample) [mm] after a step.

        ``places`` are fractions of the length; 1 is the tip.
        """
        outcomes: list[dict] = [{} for _ in antennas]

        def read(
            antenna: Antenna, scene: Scene, motion: Motion, last: bool
        ) -> dict[str, object]:
            return {"moved": (motion.time, _follow(antenna, motion, places))}

        self._add(outcomes, antennas, self._step_scene, [self.step_duration], read)
        return [outcome.get("error") or outcome["moved"] for outcome in outcomes]

    def _add(
        self,
        outcomes: list[dict],
        antennas: Sequence[Antenna],
        make,
        durations: list[float],
        read,
    ) -> None:
        """Simulate a scene per antenna and put what ``read`` finds into ``outcomes``.

        Those that tell nothing within the first of ``durations`` (``read`` gives None) are run for
        the next one.
        """
        scenes: dict[int, Scene] = {}
        for k, antenna in enumerate(antennas):
            try:
                scenes[k] = make(antenna)
            except FeelerError as error:
                outcomes[k]["error"] = error
        for duration in durations:
            last = duration == durations[-1]
            motions = self._run(list(scenes.values()), duration)
            for k, motion in zip(list(scenes), motions, strict=True):
                found = _read(read, antennas[k], scenes[k], motion, last)
                if found is not None:
                    outcomes[k] |= found
                    del scenes[k]

    def _run(self, scenes: list[Scene], duration: float) -> list[Motion | SimulationDiverged]:
        steps = [scene.contact.scale_timestep(self.timestep) for scene in scenes]
        clock = Clock(
            duration=duration,
            sample_interval=self.sample_interval,
            timestep=min(steps, default=self.timestep),
        )
        motions: list = [None] * len(scenes)
        for group in make_groups(scenes, get_engine(self.engine)):
            found = run_group([scenes[i] for i in group], clock, self.engine)
            for index, motion in zip(group, found, strict=True):
                motions[index] = motion
        return motions

    def _step_scene(self, antenna: Antenna) -> Scene:
        return Scene(
            antenna=antenna,
            angle=hold(antenna, self.at, self.deflection),
            label=f"step of {antenna.name}",
        )

    def _impulse_scene(self, antenna: Antenna) -> Scene:
        return make_impulse_scene(antenna, speed=self.speed, lever=self.lever)

    def _read_step(
        self, antenna: Antenna, scene: Scene, motion: Motion, last: bool
    ) -> dict[str, object] | None:
        tip = antenna.tip(motion.angle)[:, 0] - antenna.tip()[0]
        free = measure_free_response(motion.time, tip, floor=1e-6, fit=False)
        if not free.overdamped:
            return {
                "overdamped": False,
                "frequency": free.frequency,
                "damping_ratio": free.damping_ratio,
            }
        if not last:
            return None
        ratio = float(compute_modes(antenna, 1).damping_ratio[0])
        return {"overdamped": True, "frequency": 0.0, "damping_ratio": max(1.0, ratio)}

    def _read_impulse(
        self, antenna: Antenna, scene: Scene, motion: Motion, last: bool
    ) -> dict[str, float] | None:
        impulse: Impulse = measure_impulse(scene, motion, tuple(_IMPULSE_POINTS.values()))
        if not last and np.any(impulse.force[-1] != 0):
            return None  # the cylinder still pushes: the tip may go on
        ratios = measure_deflection_ratios(impulse.time, impulse.deflection, impulse.tip)
        return dict(zip(_IMPULSE_POINTS, map(float, ratios), strict=True))


def _read(
    read, antenna: Antenna, scene: Scene, motion: "Motion | SimulationDiverged", last: bool
) -> dict | None:
    """What ``read`` finds; an error where there is nothing to find even in the longest run."""
    if isinstance(motion, Exception):
        return {"error": motion}
    try:
        return read(antenna, scene, motion, last)
    except InvalidInput as error:
        return {"error": error} if last else None


class Measured(Record):
    """Quantities of one simulated antenna.

    An over-damped antenna has no damped frequency, which ``overdamped`` says. Its entries in
    ``values`` are then 0 kHz and the modal damping ratio of its first mode, at least 1: so a cost
    stays a number, and a search is led back towards an oscillation.
    """

    names: tuple[str, ...]
    values: Annotated[np.ndarray, "quantity"]
    overdamped: bool = False


def _follow(
    antenna: Antenna, motion: Motion, places: Sequence[float] | np.ndarray
) -> np.ndarray:
    """Sideways displacement from rest (place, sample) of points at fractions of the length.

    Segments are straight.
    """
    moved = (antenna.shape(motion.angle) - antenna.shape())[..., 0]
    ends = np.append(antenna.hinge_position, antenna.length) / antenna.length
    return np.array([[np.interp(place, ends, row) for row in moved] for place in places])


def _collect(outcome: dict[str, Any], names: tuple[str, ...]) -> "Measured | FeelerError":
    if "error" in outcome:
        return outcome["error"]
    unknown = [name for name in names if name not in outcome]
    if unknown:
        valid = (*_STEP_QUANTITIES, *_IMPULSE_POINTS)
        return InvalidInput(f"unknown quantity {unknown[0]!r}; valid: {', '.join(valid)}.")
    values = np.array([outcome[name] for name in names], dtype=float)
    return Measured(
        names=names, values=values, overdamped=bool(outcome.get("overdamped", False))
    )
