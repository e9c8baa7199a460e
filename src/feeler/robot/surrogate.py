"""A surrogate robot: an independent model in the place of hardware that published no recordings.

Nothing that comes out of it is a measurement of the real robot; every recording carries
source="surrogate".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.robot.gap import Gap, draw_antenna, draw_trial
from feeler.robot.hinge import ROBOT_FACTS
from feeler.robot.mending import repair
from feeler.robot.preset import MOUNT, make_robot
from feeler.robot.recording import Recording
from feeler.robot.sensing import Sensing, draw_sensing
from feeler.robot.sensor import SensorCalibration
from feeler.robot.touches import (
    INTERVAL,
    ROBOT_LEAD,
    ROBOT_LOCATIONS,
    ROBOT_SPEEDS,
    make_touches,
    simulate_pairs,
)
from feeler.stimulus import Trial

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
    sensing: Sensing
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
        return [
            (self.antenna, self._shift(draw_trial(trial, self.gap, self.rng)))
            for trial in trials
        ]

    def _shift(self, trial: Trial) -> Trial:
        """The same touch with its location counted from the mount's base instead of hinge 1."""
        free = self.antenna.length - self.mount
        return replace(
            trial, location=min((self.mount + trial.location * free) / self.antenna.length, 1.0)
        )

    def record(self, motion: np.ndarray, trial: Trial | None = None) -> Recording:
        """What the electronics write of true angles (segment, sample) at 1 kHz."""
        sensed = motion[np.asarray(self.antenna.sensors) - 1]
        values = self.sensing.read(sensed, self.rng)
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
    sensing = draw_sensing(gap, antenna.sensors.size, rng)
    return Surrogate(
        antenna=_add_mount(antenna, gap).replace(name=name),
        sensing=sensing,
        calibration=sensing.calibrate(rng, name),
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

    The history says so.
    """
    resting = recording.time < before
    if not np.isfinite(recording.values[:, resting]).any(axis=1).all():
        raise InvalidInput(
            f"a channel has no value in the first {before:g} ms: there is no resting level to"
            " subtract."
        )
    level = np.nanmean(recording.values[:, resting], axis=1, keepdims=True)
    return recording.replace(values=recording.values - level).noted(
        f"mean of the first {before:g} ms subtracted"
    )


@checked
def make_tip_touches(repeats: Annotated[int, "> 0"] = 1) -> list[Trial]:
    """The paper's hardware contacts: ball and box at the tip at three speeds, ``repeats`` times."""
    return make_touches(locations=ROBOT_LOCATIONS[-1:], speeds=ROBOT_SPEEDS) * repeats
