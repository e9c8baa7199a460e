"""Surrogate robots: an independent model, its electronics, and how far it may differ."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.compiled import compiled
from feeler.errors import InvalidInput
from feeler.objects import Trial
from feeler.objects.task import NAMES as NUISANCES
from feeler.objects.task import Nuisances
from feeler.records import Ge, Lt, Record
from feeler.robot.description import (
    INTERVAL,
    MOUNT,
    ROBOT_FACTS,
    ROBOT_LEAD,
    ROBOT_LOCATIONS,
    ROBOT_SPEEDS,
    make_robot,
    make_touches,
    simulate_pairs,
)
from feeler.robot.recordings import Recording
from feeler.robot.repair import repair
from feeler.robot.sensors import SensorCalibration, fit_sensors
from feeler.validation import Count, checked

# The reality gap as numbers: how far a surrogate robot may differ from the model.

_Size = Annotated[float, Ge(0)]


class Gap(Record):
    """Standard deviations and sizes of every difference.

    All are choices [C]; none was measured on the real robot.

    ``Gap()`` is one reality gap; ``Gap().scaled(2)`` doubles every entry and ``Gap().scaled(0)``
    removes them all.

    Attributes
    ----------
    stiffness : float
        sd of the stiffness of all hinges together, as a share.
    stiffness_each : float
        sd of each hinge's own stiffness, as a share.
    damping : float
        sd of the damping of all hinges together, as a share.
    mass : float
        sd of each link's mass, as a share.
    length : float
        sd of each link's length, as a share.
    rest_angle : float
        sd of each hinge's rest angle [rad].
    play : float
        Compliance of the mount at the base, as a share of hinge 1's; its angle is not sensed.
    location : float
        sd of the place of contact, as a fraction of the length.
    speed : float
        sd of the feature's speed, as a share.
    size : float
        sd of the feature's size, as a share.
    approach : float
        sd of the feature's direction [degrees].
    friction : float
        sd of the logarithm of friction.
    noise : float
        sd of each reading [rad]; the paper's device resolves less than 1° = 0.017 rad.
    quantum : float
        Step of the converter [rad].
    gain : float
        sd of each channel's change of gain since its calibration, as a share.
    drift : float
        sd of each channel's wander over one second [rad].
    crosstalk : float
        Share of each neighbour's signal in a channel.
    bend : float
        Departure of the capacitance's characteristic from a straight line at 0.35 rad, as a share.
    hysteresis : float
        Half-width of the sensing hysteresis [rad].
    jitter : float
        sd of each sample's time [ms].
    dropped : float
        Share of samples lost.
    """

    stiffness: _Size = 0.10
    stiffness_each: _Size = 0.08
    damping: _Size = 0.25
    mass: _Size = 0.08
    length: _Size = 0.01
    rest_angle: _Size = 0.015
    play: _Size = 0.10
    location: _Size = 0.01
    speed: _Size = 0.02
    size: _Size = 0.03
    approach: _Size = 2.0
    friction: _Size = 0.3
    noise: _Size = 0.004
    quantum: _Size = 0.002
    gain: _Size = 0.03
    drift: _Size = 0.010
    crosstalk: _Size = 0.02
    bend: _Size = 0.03
    hysteresis: _Size = 0.006
    jitter: _Size = 0.05
    dropped: Annotated[float, Ge(0), Lt(0.5)] = 0.01

    def scaled(self, factor: float) -> "Gap":
        """Every entry times ``factor``; the share of dropped samples stays below 0.4."""
        if not (np.isfinite(factor) and factor >= 0):
            raise InvalidInput(f"the size of a gap must be finite and ≥ 0, got {factor}.")
        values = {entry.name: factor * getattr(self, entry.name) for entry in fields(self)}
        return Gap(**{**values, "dropped": min(values["dropped"], 0.4)})


def draw_antenna(antenna: Antenna, gap: Gap, rng: np.random.Generator) -> Antenna:
    """The same antenna with its mechanics drawn around the nominal.

    Shares are log-normal, so all stay positive.
    """
    n = antenna.n_segments
    shares = {
        "stiffness": np.exp(
            gap.stiffness * rng.standard_normal() + gap.stiffness_each * rng.standard_normal(n)
        ),
        "damping": np.exp(gap.damping * rng.standard_normal()),
        "segment_mass": np.exp(gap.mass * rng.standard_normal(n)),
        "segment_length": np.exp(gap.length * rng.standard_normal(n)),
    }
    changes = {name: getattr(antenna, name) * share for name, share in shares.items()}
    return antenna.replace(
        **changes, rest_angle=antenna.rest_angle + gap.rest_angle * rng.standard_normal(n)
    )


def draw_trial(trial: Trial, gap: Gap, rng: np.random.Generator) -> Trial:
    """The same touch as an experimenter would carry it out.

    Place, speed, size, direction and friction are drawn.
    """
    named = {name: getattr(gap, name) for name in NUISANCES}
    return Nuisances(kind="normal", **named).jitter([trial], rng)[0]


# The surrogate's electronics: from true hinge angles to the capacitances of a real device.

_BASE = 5.0  # [C] pF of a straight hinge
_SENSITIVITY = 1.2  # [C] pF/rad
_SPREAD = 0.15  # [C] sd of base and sensitivity between hinges, as a share
_BEND_ANGLE = 0.35  # rad at which Gap.bend is stated
_BENCH_RANGE = np.deg2rad(40.0)  # [C] rad
_BENCH_LEVELS, _BENCH_REPEATS = 17, 6  # [C]
_BENCH_INTERVAL = 500.0  # [C] ms between readings


@dataclass(frozen=True, kw_only=True, eq=False)
class _Sensing:
    """Eight capacitive channels with their faults; arrays are (hinge,).

    Attributes
    ----------
    base : np.ndarray
        Capacitance of the straight hinge [pF].
    sensitivity : np.ndarray
        Capacitance per angle [pF/rad].
    gain : np.ndarray
        Gain during recordings relative to the calibration bench [1].
    """

    base: np.ndarray
    sensitivity: np.ndarray
    gain: np.ndarray
    gap: Gap

    def read(
        self, angle: np.ndarray, rng: np.random.Generator, *, on_bench: bool = False
    ) -> np.ndarray:
        """Capacitances (hinge, sample) [pF] of true angles (hinge, sample) [rad] at 1 kHz.

        In order: hysteresis (a play operator), cross-talk from neighbours, bent characteristic,
        gain, wander, noise, quantisation. On the bench the gain is 1 and nothing wanders.
        """
        gap = self.gap
        if len(angle) != len(self.base):
            raise InvalidInput(
                f"the robot senses {len(self.base)} hinges, got angles of {len(angle)}."
            )
        seen = play(np.ascontiguousarray(angle, dtype=float), gap.hysteresis)
        total = np.zeros_like(seen)
        total[1:] += seen[:-1]
        total[:-1] += seen[1:]
        seen = seen + gap.crosstalk * total
        signal = seen * (1 + gap.bend * seen / _BEND_ANGLE)
        if not on_bench:
            signal = signal * self.gain[:, None]
            signal = signal + np.cumsum(
                gap.drift / np.sqrt(1000) * rng.standard_normal(signal.shape), axis=1
            )
        signal = signal + gap.noise * rng.standard_normal(signal.shape)
        capacitance = self.base[:, None] + self.sensitivity[:, None] * signal
        step = gap.quantum * _SENSITIVITY
        return np.round(capacitance / step) * step if step > 0 else capacitance

    def bench(self, rng: np.random.Generator) -> dict[str, Any]:
        """A calibration table (reading,).

        Each hinge is bent by itself through known angles, up and down, several times.

        Keys ``hinge``, ``angle`` [rad], ``capacitance`` [pF], ``time`` [ms].
        """
        up = np.linspace(-_BENCH_RANGE, _BENCH_RANGE, _BENCH_LEVELS)
        angles = np.tile(np.concatenate([up, up[::-1]]), _BENCH_REPEATS)
        n = self.base.size
        readings = []
        for hinge in range(n):
            bent = np.zeros((n, angles.size))
            bent[hinge] = angles
            readings.append(self.read(bent, rng, on_bench=True)[hinge])
        return {
            "hinge": np.repeat(np.arange(1, n + 1), angles.size),
            "angle": np.tile(angles, n),
            "capacitance": np.concatenate(readings),
            "time": np.arange(n * angles.size) * _BENCH_INTERVAL,
        }


def _draw_sensing(gap: Gap, n_hinges: int, rng: np.random.Generator) -> _Sensing:
    """Channels drawn at random."""
    return _Sensing(
        base=_BASE * np.exp(_SPREAD * rng.standard_normal(n_hinges)),
        sensitivity=_SENSITIVITY * np.exp(_SPREAD * rng.standard_normal(n_hinges)),
        gain=np.exp(gap.gain * rng.standard_normal(n_hinges)),
        gap=gap,
    )


@compiled
def play(signal: np.ndarray, half_width: float) -> np.ndarray:
    """Play (backlash) operator on each row: the output moves only when an end of the gap pushes it.

    ``y_t = min(max(y_{t−1}, x_t − r), x_t + r)`` from y_0 = x_0, r = ``half_width``.
    """
    moved = np.empty_like(signal)
    for row in range(signal.shape[0]):
        y = signal[row, 0]
        for t in range(signal.shape[1]):
            x = signal[row, t]
            y = min(max(y, x - half_width), x + half_width)
            moved[row, t] = y
    return moved


# A surrogate robot: an independent model in the place of hardware that published no recordings.
#
# Nothing that comes out of it is a measurement of the real robot; every recording carries
# source="surrogate".

_RESTING = 0.75 * ROBOT_LEAD  # ms before contact whose mean is taken as the resting angle


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Surrogate:
    """One surrogate robot: its mechanics, its channels and its own calibration.

    Attributes
    ----------
    antenna : Antenna
        With the compliant mount as segment 1 where the gap has play; its sensors are the eight
        hinges.
    """

    antenna: Antenna
    sensing: _Sensing
    calibration: SensorCalibration
    gap: Gap
    name: str
    rng: np.random.Generator

    @property
    def mount(self) -> float:
        """Length of the moving mount, segment 1 [mm]; 0 where the base is rigid."""
        return float(self.antenna.segment_length[0]) if self.gap.play > 0 else 0.0

    def touch(self, trials: Sequence[Trial], **how: Any) -> list[Recording]:
        """Raw recordings of touches carried out with human precision.

        They hold capacitance at uneven times and lack dropped samples.
        """
        motions = simulate_pairs(self.carry_out(trials), **how)
        return [
            self.record(motion, trial) for motion, trial in zip(motions, trials, strict=True)
        ]

    def carry_out(self, trials: Sequence[Trial]) -> list[tuple[Antenna, Trial]]:
        """The touches as they really happen to this robot, ready to be simulated."""
        # locations count from hinge 1, behind the mount
        free, pairs = self.antenna.length - self.mount, []
        for trial in trials:
            moved = draw_trial(trial, self.gap, self.rng)
            share = (self.mount + moved.location * free) / self.antenna.length
            pairs.append((self.antenna, replace(moved, location=min(share, 1.0))))
        return pairs

    def record(self, motion: np.ndarray, trial: Trial | None = None) -> Recording:
        """What the electronics write of true angles (segment, sample) at 1 kHz."""
        values = self.sensing.read(motion[np.asarray(self.antenna.sensors) - 1], self.rng)
        time = np.arange(values.shape[1]) * INTERVAL
        jitter = (
            np.clip(self.gap.jitter * self.rng.standard_normal(time.size), -0.45, 0.45)
            * INTERVAL
        )
        kept = self.rng.random(time.size) >= self.gap.dropped
        kept[[0, -1]] = True
        labels: dict[str, str | float] = (
            {}
            if trial is None
            else {
                "feature": trial.name,
                "size": trial.feature.size,
                "location": trial.location,
                "speed": trial.speed,
            }
        )
        return Recording(
            time=(time + jitter)[kept],
            values=values[:, kept],
            quantity="capacitance",
            robot=self.name,
            source="surrogate",
            labels=labels,
            history=(f"made by the surrogate {self.name}",),
        )

    def read_angles(self, recording: Recording) -> Recording:
        """From raw to angles as a user does it: calibrate, mend, subtract the resting level."""
        angles = recording.to_angles(self.calibration, outside="extend")
        return subtract_rest(repair(angles, gaps="bridge"))


@checked
def make_surrogate(
    rng: np.random.Generator,
    *,
    gap: Gap | None = None,
    nominal: Antenna | None = None,
    name: str = "surrogate",
) -> Surrogate:
    """Draw a surrogate robot around ``nominal`` with differences of size ``gap``.

    Defaults are :func:`make_robot` and one :class:`Gap`.
    """
    gap = Gap() if gap is None else gap
    antenna = draw_antenna(make_robot() if nominal is None else nominal, gap, rng)
    sensing = _draw_sensing(gap, antenna.sensors.size, rng)
    return Surrogate(
        antenna=_add_mount(antenna, gap).replace(name=name),
        sensing=sensing,
        calibration=fit_sensors(**sensing.bench(rng), robot=name),
        gap=gap,
        name=name,
        rng=rng,
    )


def _add_mount(antenna: Antenna, gap: Gap) -> Antenna:
    """A compliant mount before hinge 1: a spring of stiffness k_1 / gap.play."""
    if gap.play == 0:
        return antenna
    spring = antenna.stiffness[0] / gap.play
    mass = ROBOT_FACTS["mass"].number - antenna.segment_mass.sum()
    return Antenna(
        segment_length=np.append(MOUNT, antenna.segment_length),
        segment_mass=np.append(max(mass, antenna.segment_mass[0]), antenna.segment_mass),
        radius=np.append(antenna.radius[0], antenna.radius),
        stiffness=np.append(spring, antenna.stiffness),
        damping=np.append(spring * antenna.damping[0] / antenna.stiffness[0], antenna.damping),
        rest_angle=np.append(0.0, antenna.rest_angle),
        sensors=np.asarray(antenna.sensors) + 1,
        name=antenna.name,
    )


@checked
def subtract_rest(recording: Recording, before: float = _RESTING) -> Recording:
    """Angles relative to their mean over the first ``before`` ms, when nothing touches yet.

    The history says so. A channel without any value stays so.
    """
    resting = recording.time < before
    known = np.isfinite(recording.values)
    silent = ~known.any(axis=1)
    if not known[:, resting].any(axis=1)[~silent].all():
        raise InvalidInput(
            f"a channel has no value in the first {before:g} ms: there is no resting level to"
            " subtract."
        )
    level = np.full((recording.n_sensors, 1), np.nan)
    level[~silent, 0] = np.nanmean(recording.values[~silent][:, resting], axis=1)
    return recording.replace(values=recording.values - level).noted(
        f"mean of the first {before:g} ms subtracted"
    )


@checked
def make_tip_touches(repeats: Count = 1) -> list[Trial]:
    """The paper's hardware contacts: ball and box at the tip at three speeds, ``repeats`` times."""
    return make_touches(locations=ROBOT_LOCATIONS[-1:], speeds=ROBOT_SPEEDS) * repeats
