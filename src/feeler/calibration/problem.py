"""A calibration problem: targets, the protocol that measures them in simulation, and the
residuals.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import CubicSpline

from feeler.analysis import measure_deflection_ratios, measure_free_response
from feeler.antenna import Antenna, compute_modes
from feeler.antenna.files import SourceTag
from feeler.calibration.hinges import Hinges
from feeler.errors import FeelerError, InvalidInput, SimulationDivergedError
from feeler.execute.workers import ThreadExecutor, count_cores
from feeler.experiments.mechanics import (
    IMPULSE_LEAD,
    hold,
    make_impulse_scene,
    measure_impulse,
)
from feeler.files import make_record, read_toml
from feeler.physics.engine import DEFAULT_ENGINE, ENGINES
from feeler.physics.run import make_groups, run_group
from feeler.physics.scene import Clock, Motion, Scene
from feeler.provenance import Journal, make_key
from feeler.records import Choice, Ge, Gt, Len, Record, Unit
from feeler.validation import checked

# Targets: measured quantities that a model should reproduce, as data with spread and source.

_QUANTITIES = ("frequency", "damping_ratio", "ratio_71", "ratio_86")
_SHIPPED = ("cockroach",)


class Target(Record):
    """One quantity: its value, its spread between animals, and where they come from.

    Attributes
    ----------
    value : float
        In ``unit``.
    spread : float
        Standard deviation between animals, in ``unit``.
    """

    name: Annotated[str, Choice(_QUANTITIES)]
    value: Annotated[float, Gt(0)]
    spread: Annotated[float, Ge(0)]
    unit: str
    tag: SourceTag
    note: str = ""


class Targets(Record):
    """A set of targets.

    Attributes
    ----------
    status : str
        How far to trust them: measured, reconstructed or synthetic.
    """

    name: str
    status: str
    targets: Annotated[tuple[Target, ...], Len(1)]
    reference: str = ""

    def _check(self) -> None:
        if len(set(self.names)) != len(self.names):
            raise InvalidInput(f"a set of targets holds each quantity once, got {self.names}.")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities, in order."""
        return tuple(target.name for target in self.targets)

    @property
    def values(self) -> np.ndarray:
        """Values (target,)."""
        return np.array([target.value for target in self.targets])

    @property
    def spreads(self) -> np.ndarray:
        """Standard deviations between animals (target,)."""
        return np.array([target.spread for target in self.targets])

    def with_values(self, values: np.ndarray) -> "Targets":
        """The same set with other values, as a bootstrap draws them."""
        pairs = zip(self.targets, values, strict=True)
        return self.replace(targets=[one.replace(value=float(value)) for one, value in pairs])


@checked
def make_targets(
    name: str = "custom", status: str = "measured", **values: float | tuple[float, float]
) -> Targets:
    """Targets from numbers: ``frequency=0.0175`` [kHz], or ``frequency=(value, spread)``."""
    targets = []
    for key, given in values.items():
        value, spread = given if isinstance(given, tuple) else (given, 0.0)
        unit = "kHz" if key == "frequency" else "1"
        targets.append(Target(name=key, value=value, spread=spread, unit=unit, tag="C"))
    return Targets(name=name, status=status, targets=tuple(targets))


@checked
def load_targets(source: str | Path = "cockroach") -> Targets:
    """Targets that ship with feeler, by name, or your own from a TOML file.

    The file holds ``name``, ``status`` and per quantity a table ``[targets.QUANTITY]``: value,
    spread, unit, tag, note.
    """
    path = Path(source)
    if source in _SHIPPED:
        path = Path(str(files("feeler.calibration") / "data" / f"{source}.toml"))
    if not path.is_file():
        shipped = ", ".join(_SHIPPED)
        raise InvalidInput(
            f"no targets named {str(source)!r}; shipped: {shipped}; or give a TOML file."
        )
    content = read_toml(path)
    tables = content.get("targets")
    if isinstance(tables, dict):
        content["targets"] = [
            {**table, "name": name} if isinstance(table, dict) else table
            for name, table in tables.items()
        ]
    return make_record(Targets, content, path.name)


# Protocols: the animal experiments in simulation, and the quantities that are measured on them.

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

    def simulate_ratios(
        self, antennas: Sequence[Antenna], places: Sequence[float] | np.ndarray
    ) -> np.ndarray:
        """Deflections (antenna, place) over the tip's after an impulse, when the tip is farthest
        out; ``places`` are fractions of the length.
        """
        outcomes: list[dict] = [{} for _ in antennas]
        longest = max(antenna.length for antenna in antennas) / self.speed
        durations = [IMPULSE_LEAD + share * longest + 5.0 for share in _IMPULSE_TRAVEL]

        def read(*asked: Any) -> dict[str, Any] | None:
            ratios = self._read_ratios(tuple(map(float, places)), *asked)
            return None if ratios is None else {"ratios": ratios}

        self._add(outcomes, antennas, self._impulse_scene, durations, read)
        for outcome in outcomes:
            if "error" in outcome:
                raise outcome["error"]
        return np.array([outcome["ratios"] for outcome in outcomes])

    def simulate_postures(self, antenna: Antenna, time: np.ndarray) -> np.ndarray:
        """Base, hinges and tip (sample, joint, 2) [mm] at times [ms] after a step."""
        (motion,) = self._run([self._step_scene(antenna)], self.step_duration)
        if isinstance(motion, Exception):
            raise motion
        held = np.clip(time, motion.time[0], motion.time[-1])
        return antenna.shape(CubicSpline(motion.time, motion.angle)(held))

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

    def _run(
        self, scenes: list[Scene], duration: float
    ) -> list[Motion | SimulationDivergedError]:
        steps = [scene.contact.scale_timestep(self.timestep) for scene in scenes]
        clock = Clock(
            duration=duration,
            sample_interval=self.sample_interval,
            timestep=min(steps, default=self.timestep),
        )
        motions: list = [None] * len(scenes)
        for group in make_groups(scenes, ENGINES[self.engine]):
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
        free = measure_free_response(motion.time, tip, floor=1e-6)
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

    def _read_impulse(self, *asked: Any) -> dict[str, float] | None:
        ratios = self._read_ratios(tuple(_IMPULSE_POINTS.values()), *asked)
        if ratios is None:
            return None
        return dict(zip(_IMPULSE_POINTS, map(float, ratios), strict=True))

    def _read_ratios(
        self,
        places: tuple[float, ...],
        antenna: Antenna,
        scene: Scene,
        motion: Motion,
        last: bool,
    ) -> np.ndarray | None:
        impulse = measure_impulse(scene, motion, places)
        if not last and np.any(impulse["force"].values[-1] != 0):
            return None  # the cylinder still pushes: the tip may go on
        parts = [impulse[name].values for name in ("time", "deflection", "tip")]
        return measure_deflection_ratios(*parts)


def _read(
    read, antenna: Antenna, scene: Scene, motion: "Motion | SimulationDivergedError", last: bool
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


# A calibration problem: hinges to search, targets to meet, the protocol between them, and how
# far simulated quantities are from their targets.

# [C] residual of every target of an antenna that could not be simulated or measured; larger than
# any real one
FAILED = 10.0


@dataclass(kw_only=True, eq=False)
class Problem:
    """Residuals of hinges against targets, counted.

    ``best_x`` and ``best_error`` remember the best ever seen.

    What stands in the ``journal`` is taken from there, and counts as if it had been simulated.

    Attributes
    ----------
    seconds : float
        Processor time of the simulations.
    watch : Callable[[int, float], None] | None
        Called after each group of simulations with ``evaluations`` and ``best_error``.
    """

    hinges: Hinges
    targets: Targets
    protocol: Protocol = field(default_factory=Protocol)
    evaluations: int = 0
    failures: int = 0
    best_x: np.ndarray = field(init=False, repr=False)
    best_error: float = field(init=False, default=np.inf)
    seconds: float = 0.0
    journal: Journal = field(default_factory=Journal, repr=False)
    watch: Callable[[int, float], None] | None = None

    def __post_init__(self) -> None:
        for name, kind in (("hinges", Hinges), ("targets", Targets)):
            if not isinstance(given := getattr(self, name), kind):
                raise InvalidInput(
                    f"Problem.{name} must be {kind.__name__}, got {type(given).__name__}."
                )

    def measure(self, p: Sequence[float] | np.ndarray) -> Measured:
        """Quantities of the antenna with parameters ``p``."""
        return self.protocol.measure(
            self.hinges.build(np.asarray(p, dtype=float)), self.targets.names
        )

    def compute_residuals(self, x: np.ndarray) -> np.ndarray:
        """Residuals (target,) at the searched vector ``x``."""
        return self.compute_many(np.asarray(x, dtype=float)[None])[0]

    def compute_many(self, xs: np.ndarray) -> np.ndarray:
        """Residuals (vector, target), simulated together; ``FAILED`` where none is measured."""
        new = [k for k, x in enumerate(xs) if self.journal.find(x) is None]
        for k, entry in zip(new, self._simulate(xs[new]) if new else (), strict=True):
            self.journal.add(entry, xs[k])
        entries = [self.journal.find(x) for x in xs]
        residuals = np.array([residuals for residuals, _ in entries], dtype=float)
        self.evaluations += len(xs)
        self.seconds += sum(entry[1] for entry in entries)
        self.failures += int(np.all(residuals == FAILED, axis=1).sum())
        errors = np.linalg.norm(residuals, axis=1)
        if errors.min() < self.best_error:
            self.best_x, self.best_error = np.array(xs[np.argmin(errors)]), float(errors.min())
        if self.watch:
            self.watch(self.evaluations, self.best_error)
        return residuals

    def _simulate(self, xs: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """Residuals (target,) of each, and the processor time [s] that they took."""
        antennas = [self.hinges.build(self.hinges.to_p(x)) for x in xs]
        began = time.process_time()
        outcomes = self.protocol.measure_many(antennas, self.targets.names)
        share = (time.process_time() - began) / len(xs)
        return [(self._compare(outcome), share) for outcome in outcomes]

    def _compare(self, outcome: Measured | FeelerError) -> np.ndarray:
        if isinstance(outcome, Exception):
            return np.full(len(self.targets.names), FAILED)
        return compute_residuals(outcome.values, self.targets.values)

    def compute_error(self, x: np.ndarray) -> float:
        """The paper's cost at ``x``: normalised Euclidean distance."""
        return float(np.linalg.norm(self.compute_residuals(x)))

    def compute_jacobian(self, x: np.ndarray, step: float = 0.01) -> np.ndarray:
        """Central differences (target, parameter) of the residuals, all 2·n simulations together.

        ``step`` is a share of a parameter's typical change; steps that leave the bounds are cut at
        them.
        """
        low, high = self.hinges.bounds
        change = np.diag(step * self.hinges.scale)
        points = np.clip(np.concatenate([x + change, x - change]), low, high)
        residuals = self.compute_many(points)
        n = len(x)
        distance = np.diag(points[:n] - points[n:])
        return ((residuals[:n] - residuals[n:]) / distance[:, None]).T

    def describe(self) -> str:
        """A short text that changes with anything that changes a residual."""
        made_with = {
            "hinges": self.hinges.name,
            "bounds": self.hinges.bounds,
            "antenna": self.hinges.build(self.hinges.start),
            "protocol": self.protocol,
            "targets": self.targets,
        }
        return make_key(made_with)

    def score(self, p: Sequence[float] | np.ndarray) -> tuple[Measured, float, float]:
        """Measured quantities, normalised distance and median symmetric accuracy of ``p``."""
        measured = self.measure(p)
        values = self.targets.values
        return (
            measured,
            compute_distance(measured.values, values),
            compute_symmetric_accuracy(measured.values, values),
        )


@checked
def compute_residuals(simulated: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Relative deviations (target,) = (target − simulated) / target, of the paper's cost."""
    simulated, target = np.asarray(simulated, dtype=float), np.asarray(target, dtype=float)
    if simulated.shape != target.shape:
        raise InvalidInput(
            f"one simulated value per target is needed, got {simulated.shape} and {target.shape}."
        )
    if not (np.isfinite(simulated).all() and np.isfinite(target).all()):
        raise InvalidInput(
            f"a cost of missing numbers is no number: simulated {simulated}, targets {target}."
        )
    if np.any(target == 0):
        raise InvalidInput(
            "a target of 0 has no relative deviation; choose a quantity that is not 0."
        )
    return (target - simulated) / target


@checked
def compute_distance(simulated: np.ndarray, target: np.ndarray) -> float:
    """Normalised Euclidean distance ``√ Σ ((target − simulated) / target)²`` (Methods)."""
    return float(np.linalg.norm(compute_residuals(simulated, target)))


@checked
def compute_symmetric_accuracy(simulated: np.ndarray, target: np.ndarray) -> float:
    """Median symmetric accuracy ``exp(median |ln(simulated / target)|) − 1``, as a fraction.

    Morley et al. 2018, doi:10.1002/2017SW001669; infinite where half the simulated quantities or
    more have no logarithm.
    """
    compute_residuals(simulated, target)
    ratio = np.asarray(simulated, dtype=float) / np.asarray(target, dtype=float)
    size = np.where(ratio > 0, np.abs(np.log(np.where(ratio > 0, ratio, 1.0))), np.inf)
    return float(np.expm1(np.median(size)))
