"""Samples of a real antenna in, what a page is shown out."""

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.robot import SensorCalibration
from feeler.studio.study import AntennaStudy
from feeler.tensors.posture import spread_angles

# [C] samples; a longer gap is a pause, and a clock that steps back is one that began anew
_PAUSE = 2000
_REST = 100  # [C] samples at rest after which the next touch may begin


class Judge:
    """A study's decoder on a stream without end: when a touch is over and the antenna rests, it
    waits for the next.
    """

    def __init__(self, study: AntennaStudy, interval: float) -> None:
        self.study, self._stream = study, study.decoder.start()
        self._every = max(1, round(study.decoder.interval / interval))
        self._seen = self._rest = 0
        self._touched = False

    def restart(self) -> None:
        """Forget what was felt."""
        self._stream.reset()
        self._rest, self._touched = 0, False

    def update(self, angle: np.ndarray, time: float) -> tuple[np.ndarray, bool]:
        """Posterior (answer,) after a sample (sensor,) [rad], and whether contact is noticed with
        it.
        """
        self._seen += 1
        noticed = False
        if self._seen % self._every == 0:
            state = self._stream.update(angle, time)
            noticed = state.since_contact >= 0 and not self._touched
            self._touched |= noticed
            away = np.abs(angle - self._stream.finder.level)
            rests = state.state == "over" and not (away > self._stream.finder.onset).any()
            self._rest = self._rest + 1 if rests else 0
            if self._rest >= _REST:
                self.restart()
        return self._stream.posterior, noticed


class Listener:
    """Turns samples into angles of all hinges and, once there is a study, into the decoder's
    posterior.

    Parameters
    ----------
    calibration
        From readings to angles; None where they are angles [rad].
    interval
        Usual time between samples [ms].
    """

    def __init__(
        self, antenna: Antenna, calibration: SensorCalibration | None, interval: float
    ) -> None:
        self._antenna, self._calibration, self._interval = antenna, calibration, interval
        self._sensed = antenna.sensors - 1
        self._last, self._time = np.zeros(self._sensed.size), float("nan")
        self._rows: list[np.ndarray] = []
        self._beliefs: list[np.ndarray] = []
        self._judge: Judge | None = None
        self.count, self.missing, self.contact = 0, 0, -1

    def learn(self, study: AntennaStudy | None) -> None:
        """Judge by a study from now on."""
        if study is not None and (self._judge is None or self._judge.study is not study):
            self._judge = Judge(study, self._interval)

    def take(self, time: float | None, values: np.ndarray) -> None:
        """One sample and its time [ms]; what is missing is shown as it was last, counted, and no
        evidence.

        Raises
        ------
        InvalidInput
            Readings that are no angles, without a calibration.
        """
        angle, first = self._convert(values), np.isnan(self._time)
        time = (0.0 if first else self._time + self._interval) if time is None else time
        gap = 0 if first else round((time - self._time) / self._interval) - 1
        anew = not -1 <= gap < _PAUSE
        if not anew:
            self.missing += max(gap, 0)
            self._rows += [self._last] * gap
            self._beliefs += self._beliefs[-1:] * gap
        elif self._judge is not None:
            self._judge.restart()
        self.missing += bool(
            np.isnan(angle).all()
        )  # a sample that its board numbered, and that never came
        self._time, self._last = time, np.where(np.isnan(angle), self._last, angle)
        self._rows.append(self._last)
        if self._judge is not None:
            belief, noticed = self._judge.update(angle, time)
            self._beliefs.append(belief)
            self.contact = self.count + len(self._rows) - 1 if noticed else self.contact

    def give(self) -> tuple[int, dict[str, np.ndarray]]:
        """The samples since the last call: number of the first, and arrays (sample, …)."""
        first, angle = self.count, np.array(self._rows).reshape(-1, self._last.size)
        arrays = {
            "angle": spread_angles(angle, self._antenna, self._sensed),
            "base": np.zeros((len(angle), 3)),
        }
        if self._beliefs:
            unknown = np.zeros((len(angle) - len(self._beliefs), self._beliefs[0].size))
            arrays["posterior"] = np.concatenate([unknown, self._beliefs])
        self.count += len(angle)
        self._rows, self._beliefs = [], []
        return first, arrays

    def _convert(self, values: np.ndarray) -> np.ndarray:
        if self._calibration is not None:
            angle = self._calibration.slope * values + self._calibration.offset
            return np.where(np.isfinite(angle), angle, np.nan)
        if (np.abs(values) > np.pi).any():
            raise InvalidInput(
                f"{values[np.nanargmax(np.abs(values))]:.4g} is no angle of a hinge in rad. Open"
                " the sensors' calibration first (.json, made by feeler robot calibrate), or start"
                " with --calibration."
            )
        return values
