"""A robot's touch while it happens: readings become angles, and angles an answer."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from feeler.antenna import Antenna
from feeler.decoding.observers import StudentTClassifier
from feeler.decoding.streams import StreamDecoder, StreamState
from feeler.decoding.transfer import AFTER
from feeler.errors import InvalidInput
from feeler.robot.classify import Answer, _count_after_peak, judge_recording
from feeler.robot.recordings import Recording, find_unit
from feeler.robot.repair import repair
from feeler.robot.sensors import SensorCalibration
from feeler.robot.surrogate import subtract_rest

_IN_A_ROW = 20  # [C] samples outside what is possible, from which on the unit must be wrong
_KEPT = 2000  # [C] samples kept while nothing touches; the touch and they are judged as a whole
_EVERY = 100  # [C] samples between two judgements of the whole touch


class Readings:
    """Angles [rad] of readings that arrive one sample at a time.

    Parameters
    ----------
    calibration
        Lines that turn readings into angles; not used where the readings are angles.
    unit
        Unit of the readings; default: the calibration's, or rad.
    outside
        What becomes of readings outside the calibrated range, as in
        :meth:`feeler.robot.SensorCalibration.apply`. Under ``refuse`` they are left out (NaN), and
        refused after 20 samples in a row in which half of the sensors or more are outside: not one
        wire but the unit is wrong.
    missing
        Numbers of sensors, from 1 at the base, whose readings are not looked at.

    Attributes
    ----------
    outside : int
        How many samples held a reading outside the calibrated range, or an angle of more than half
        a turn.
    unit : str
        In which readings are taken.
    fate : str
        What became of those outside.
    """

    def __init__(
        self,
        calibration: SensorCalibration | None = None,
        unit: str | None = None,
        outside: str = "refuse",
        missing: Sequence[int] = (),
    ) -> None:
        self._gone = np.array(missing, dtype=int) - 1
        default = "rad" if calibration is None else calibration.unit
        kept, self._factor = find_unit(unit or default)
        self._lines = None if kept == "rad" else calibration
        if kept != "rad" and calibration is None:
            raise InvalidInput(
                f"readings in {kept} need a calibration, made by `feeler robot calibrate`."
            )
        if self._lines is not None and self._lines.unit != kept:
            raise InvalidInput(
                f"the calibration is of readings in {self._lines.unit}, the readings are in {kept}."
                " Calibrate these channels, or state the unit that they have."
            )
        self.unit = unit or default
        self._how, self.outside, self._run = outside, 0, 0
        if self._lines is None:
            self.fate = "of more than half a turn, left out"
        else:
            self._lines.apply(self._lines.low[:, None], outside=outside)  # refused now
            done = {"clip": "clipped", "extend": "taken along the line"}
            self.fate = f"outside the calibrated range, {done.get(outside, 'left out')}"

    def convert(self, values: np.ndarray) -> np.ndarray:
        """Angles (hinge,) of readings (hinge,).

        Raises
        ------
        InvalidInput
            The twentieth sample in a row outside what is possible.
        """
        values = self._factor * values
        values[self._gone] = np.nan
        lines, known = self._lines, int(np.isfinite(values).sum())
        beyond = (
            np.abs(values) > np.pi if lines is None else lines.find_outside(values[:, None])
        )
        count = int(beyond.sum())
        self.outside += count > 0
        self._run = self._run + 1 if count >= (1 if lines is None else max(known / 2, 1)) else 0
        if self._run >= _IN_A_ROW and (lines is None or self._how == "refuse"):
            most = np.fmax.reduce(np.abs(values), initial=0.0)
            raise InvalidInput(
                f"{_IN_A_ROW} samples in a row are not possible: "
                + (
                    f"a hinge turns by {most:.4g} rad, more than half a turn."
                    if lines is None
                    else lines.describe_outside(values[:, None])
                )
                + " Is the unit right? State it with unit=."
            )
        if self._lines is None:
            return np.where(np.abs(values) > np.pi, np.nan, values)
        how = "missing" if self._how == "refuse" else self._how
        return self._lines.apply(values[:, None], outside=how)[:, 0]


class _LiveTouch:
    """One touch while it happens.

    At first the answer is the decoder's; from 400 ms after the tip's first peak on it is that of
    the classifier of whole touches, which learned the same touches. So what is said last while the
    touch goes on is what is said of it at the end.

    Parameters
    ----------
    decoder, classifier
        What :meth:`feeler.robot.TrainingSet.watch` and :func:`feeler.robot.make_classifier`
        give for the same training.
    before
        Samples before the peak, as in :func:`the training has them`.
    labels
        What is known of the touch, ``Recording.labels``.
    missing
        Numbers of sensors, from 1 at the base, whose values are not used.

    Attributes
    ----------
    answer : Answer | None
        The latest judgement of the whole touch.
    kept : deque
        (time [ms] or None, angles (sensor,), state) of the touch, and of the 2000 samples before.
    """

    def __init__(
        self,
        decoder: StreamDecoder,
        classifier: StudentTClassifier,
        antenna: Antenna,
        before: int,
        labels: Mapping[str, str | float] | None = None,
        missing: Sequence[int] = (),
    ) -> None:
        self._gone = np.array([number - 1 for number in missing], dtype=int)
        self.stream = decoder.start()
        self._classifier, self._antenna, self._before = classifier, antenna, before
        self._labels = dict(labels or {})
        self.kept: deque[tuple[float | None, np.ndarray, StreamState]] = deque()
        self.begin()

    def begin(self) -> None:
        """Forget the touch so far: its board began anew."""
        self.stream.reset()
        self.kept.clear()
        self.answer: Answer | None = None
        self._due = AFTER

    def update(self, angle: np.ndarray, time: float | None = None) -> StreamState:
        """Take one sample (sensor,) [rad] and its time [ms], as ``Stream.update`` does."""
        if self._gone.size:
            angle = np.array(angle, dtype=float)
            angle[self._gone] = np.nan
        state = self.stream.update(angle, time)
        self.kept.append((time, angle, state))
        while state.since_contact < 0 and len(self.kept) > _KEPT:
            self.kept.popleft()
        if state.since_contact >= self._due:
            self._due = state.since_contact + _EVERY
            found = self._judge(untruncated=True)
            if found is not None and found.probabilities and not found.missing:
                self.answer = found
        return self._show(state)

    def end(self) -> StreamState | None:
        """The last state, once ``answer`` is the judgement of all that was felt; None where nothing
        came.
        """
        if not self.kept:
            return None
        state = self.kept[-1][2]
        if state.since_contact >= 0:
            self.answer = self._judge() or self.answer
        return self._show(state)

    def _show(self, state: StreamState) -> StreamState:
        """A state with the judgement of the whole touch, once there is one."""
        decoder, answer = self.stream.decoder, self.answer
        if answer is not None:
            chances = [answer.probabilities.get(label, 0.0) for label in decoder.classes_]
            state = replace(
                state,
                label=answer.label,
                probability=answer.probability,
                posterior=np.array(chances),
                strangeness=answer.strangeness,
                mirrored=answer.mirrored,
            )
        if state.since_contact >= 0:  # a slow touch is judged once its peak has come
            sure = "decided" if state.probability >= decoder.threshold else "unsure"
            over = state.since_contact >= decoder.window + AFTER
            state = replace(state, state="over" if over else sure)
        self.kept[-1] = *self.kept[-1][:2], state
        return state

    def _judge(self, untruncated: bool = False) -> Answer | None:
        """The answer to all that was felt; None where it is too short to be judged, or, if asked,
        where it is truncated, as each truncation needs a classifier of its own.
        """
        times = [at for at, *_ in self.kept]
        clock = (
            np.arange(len(times), dtype=float)
            if None in times
            else np.array(times, dtype=float)
        )
        values = np.array([angle for _, angle, _ in self.kept]).T
        try:
            felt = Recording(time=clock, values=values, labels=self._labels)
            felt = subtract_rest(repair(felt, gaps="bridge", bad_channels="missing"))
            if untruncated and _count_after_peak(felt, self._antenna) < AFTER:
                return None
            return judge_recording(self._classifier, felt, self._antenna, self._before)[0]
        except InvalidInput:  # a stream may hold what a recording must not
            return None
