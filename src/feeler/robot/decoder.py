"""A robot's decoder in one file: trained once, then loaded at once by ``classify``, ``stream``,
Python and a ROS 2 node.
"""

import hashlib
import json
import os
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.model_selection import PredefinedSplit, cross_val_predict

from feeler.antenna import Antenna
from feeler.decoding.classifiers import number_labels
from feeler.decoding.observers import StudentTClassifier
from feeler.decoding.streams import OnlineNoveltyDetector, StreamDecoder, StreamState
from feeler.decoding.transfer import AFTER
from feeler.errors import FeelerError, InvalidInput
from feeler.objects import Trial
from feeler.progress import Advance
from feeler.provenance import PHYSICS, find_version, to_jsonable
from feeler.records import Gt, Unit
from feeler.robot.classify import (
    Answer,
    choose_before,
    count_after_peak,
    draw_training_set,
    judge_recording,
    make_classifier,
    make_decoder,
    name_touch,
)
from feeler.robot.description import Joints, RobotFile, list_lengths, make_robot, make_touches
from feeler.robot.recordings import Recording, find_unit
from feeler.robot.repair import repair
from feeler.robot.sensors import (
    SensorCalibration,
    load_calibration,
    parse_calibration,
    write_calibration,
)
from feeler.robot.surrogate import Gap, subtract_rest
from feeler.tensors.formats import Model, load_model, save_model
from feeler.validation import Count, Seed, checked

# A robot's touch while it happens: readings become angles, and angles an answer.

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
            if untruncated and count_after_peak(felt, self._antenna) < AFTER:
                return None
            return judge_recording(self._classifier, felt, self._antenna, self._before)[0]
        except InvalidInput:  # a stream may hold what a recording must not
            return None


_KIND, _VERSION = "RobotDecoder", 1
_PARTS = "whole", "live", "watch"
_DROPPED, _DRAWS = 3, 6  # [C] sensors left out at random, at most, and how often
_MOST_KEPT = 8  # [C] decoders in the cache


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotDecoder:
    """Says which touch a robot felt, and knows how it was trained.

    Attributes
    ----------
    robot : str
        Name of the robot; recordings of another are refused.
    antenna : Antenna
        Its model.
    recipe : dict
        How it was trained: the touches, number of surrogate robots, seed, noise [rad], friction,
        engine, versions.
    classifier : StudentTClassifier
        Of untruncated touches; ``confusion_`` is held out, robot by robot.
    stream : StreamDecoder
        Of touches while they happen.
    before : int
        Samples kept before the tip's first peak.
    tolerance : dict[str, float]
        Sensors left out at random → held-out accuracy without them.
    calibration : SensorCalibration | None
        From readings to angles; None where recordings hold angles.
    joints : tuple[str, ...]
        Names or patterns of the robot's channels, base to tip, in a topic or table that has others.
    """

    robot: str
    antenna: Antenna
    recipe: dict[str, Any]
    classifier: StudentTClassifier
    stream: StreamDecoder
    before: int
    tolerance: dict[str, float] = field(default_factory=dict)
    calibration: SensorCalibration | None = None
    joints: Joints = ()

    @property
    def classes(self) -> list[tuple]:
        """The touches that it discriminates: feature, location, speed."""
        return list(self.classifier.classes_)

    @property
    def accuracy(self) -> float:
        """Share of held-out touches of surrogate robots that were classified correctly."""
        return _share_right(self.classifier)

    def check_robot(self, name: str, what: str = "the recording") -> None:
        """Refuse what is of another robot, by name; "" is of no known one.

        Raises
        ------
        InvalidInput
            Another robot.
        """
        known = {self.robot, self.calibration.robot if self.calibration else ""} - {""}
        if name and known and name not in known:
            raise InvalidInput(
                f"the decoder belongs to robot {self.robot!r}, {what} to {name!r}. Train one for"
                " that robot: feeler robot train."
            )

    def check_antenna(self, antenna: Antenna, name: str) -> None:
        """Refuse another antenna than the one it was trained on."""
        if antenna.replace(name="") != self.antenna.replace(name=""):
            n, own = antenna.sensors.size, self.antenna.sensors.size
            how = f"{own} sensors there, {n} here" if n != own else "other numbers of that name"
            raise InvalidInput(
                f"the decoder was trained for robot {self.robot!r}, not for {name!r} ({how})."
                " Train one for it: feeler robot train."
            )

    def classify(
        self,
        recording: Recording,
        *,
        outside: str = "refuse",
        gaps: str = "bridge",
        bad_channels: str = "missing",
    ) -> Answer:
        """The answer to a recording of one touch; its readings become angles by ``calibration``.

        Channels that are empty, dead or saturated are left out, and the answer says which.

        Raises
        ------
        InvalidInput
            Another robot's recording, other channels, no calibration where one is needed, or what
            :func:`feeler.robot.repair` refuses.
        """
        self.check_robot(recording.robot)
        if recording.quantity != "angle":
            if self.calibration is None:
                raise InvalidInput(
                    f"the recording holds {recording.quantity}, and the decoder no calibration."
                )
            recording = recording.to_angles(
                self.calibration, outside=outside, bad_channels=bad_channels
            )
        felt = subtract_rest(repair(recording, gaps=gaps, bad_channels=bad_channels))
        return judge_recording(self.classifier, felt, self.antenna, self.before)[0]

    def start(
        self,
        *,
        missing: Sequence[int] = (),
        labels: dict[str, str | float] | None = None,
    ) -> _LiveTouch:
        """A touch to be decoded sample by sample: ``update(angles, time)`` with angles (sensor,)
        [rad] and the time [ms].

        ``missing`` are the numbers of sensors without values, counted from 1 at the base; for these
        it gets ready now, which takes some seconds, instead of during the touch.
        """
        n = self.antenna.sensors.size
        wrong = [number for number in missing if not 1 <= number <= n]
        if wrong or len(set(missing)) >= n:
            raise InvalidInput(
                f"missing= holds numbers of sensors from 1 to {n}, not all of them; got"
                f" {', '.join(map(str, missing))}."
            )
        if missing:
            off = np.array(missing) - 1
            touch = np.zeros((1, *self.classifier.shape_))
            touch[:, off] = np.nan
            self.classifier.predict_proba(touch)
            tensor = np.zeros((n, self.stream.window))
            tensor[off] = np.nan
            for moment in self.stream.watch_.classifiers_:
                self.stream.watch_.judge(tensor, moment - 1, list(self.stream.classes_))
        return _LiveTouch(
            self.stream, self.classifier, self.antenna, self.before, labels, missing
        )

    def save(self, path: str | os.PathLike) -> None:
        """Write all of it as one model file (safetensors with a JSON header; never pickle)."""
        packed = (self.classifier.pack(), self.stream.pack(), self.stream.watch_.pack())
        arrays: dict[str, np.ndarray] = {}
        settings: dict[str, Any] = {
            "robot": self.robot,
            "antenna": self.antenna.to_plain(),
            "recipe": self.recipe,
            "before": self.before,
            "tolerance": self.tolerance,
            "accuracy": self.accuracy,
            "calibration": None
            if self.calibration is None
            else write_calibration(self.calibration),
            "joints": list(self.joints),
        }
        for part, (found, said) in zip(_PARTS, packed, strict=True):
            arrays |= {f"{part}/{name}": values for name, values in found.items()}
            settings[part] = said
        save_model(Model(kind=_KIND, version=_VERSION, arrays=arrays, settings=settings), path)

    @classmethod
    def load(cls, path: str | os.PathLike) -> "RobotDecoder":
        """What :meth:`save` wrote, ready to answer.

        Raises
        ------
        InvalidInput
            No such file, damaged, or of another kind or version.
        """
        try:  # without the guard's process, which takes longer than all the rest
            file = load_model(path, kind=_KIND, version=_VERSION, trusted=True)
        except InvalidInput:
            raise
        except Exception as error:  # whatever the file's library stumbles over
            raise InvalidInput(
                f"{path} is no decoder of a robot, or damaged ({str(error)[:100]}). Train it again."
            ) from error
        arrays: dict[str, dict[str, np.ndarray]] = {part: {} for part in _PARTS}
        try:
            for name, values in file.arrays.items():
                part, _, rest = name.partition("/")
                arrays[part][rest] = values
            said = file.settings
            stream = StreamDecoder.unpack(arrays["live"], said["live"])
            stream.watch_ = OnlineNoveltyDetector.unpack(arrays["watch"], said["watch"])
            lines = said["calibration"]
            return cls(
                robot=str(said["robot"]),
                antenna=Antenna(**said["antenna"]),
                recipe=dict(said["recipe"]),
                classifier=StudentTClassifier.unpack(arrays["whole"], said["whole"]),
                stream=stream,
                before=int(said["before"]),
                tolerance=dict(said["tolerance"]),
                calibration=None if lines is None else parse_calibration(lines, str(path)),
                joints=tuple(map(str, said["joints"])),
            )
        except (
            KeyError,
            TypeError,
            ValueError,
            IndexError,
            AttributeError,
            FeelerError,
        ) as error:
            raise InvalidInput(
                f"{path} is no complete decoder of a robot ({str(error)[:150]}). Train it again."
            ) from error

    def describe(self) -> list[str]:
        """Lines on what it was trained on, and how accurate it is on held-out robots."""
        recipe = self.recipe
        touches = f"{len(self.classes)} touches, {recipe['robots']} surrogate robots"
        lines = [
            f"robot       {self.robot}, {self.antenna.sensors.size} sensors",
            f"training    {touches}, seed {recipe['seed']}; noise {recipe['noise']:g} rad,"
            f" friction {', '.join(f'{mu:g}' for mu in recipe['friction'])}",
            f"held out    {self.accuracy:.1%} classified correctly (robots left out in turn)",
        ]
        without = ", ".join(f"{n}: {value:.1%}" for n, value in self.tolerance.items())
        lines += [f"without n   {without} (sensors left out at random)"] if without else []
        lines += [
            f"calibration {'of ' + repr(self.calibration.robot) if self.calibration else 'none'}"
        ]
        lines += [f"joints      {', '.join(self.joints)}"] if self.joints else []
        confused = self.list_confused()
        return lines + [f"confused    {words}" for words in confused]

    def list_confused(self, most: int = 3) -> list[str]:
        """The pairs of touches that were most often taken for each other, in words."""
        off = self.classifier.confusion_.copy()
        np.fill_diagonal(off, 0)
        share = off / np.maximum(self.classifier.confusion_.sum(axis=1, keepdims=True), 1)
        order = np.argsort(-share, axis=None, kind="stable")[:most]
        pairs = [np.unravel_index(k, share.shape) for k in order if share.flat[k] > 0]
        return [
            f"{name_touch(self.classes[i])} as {name_touch(self.classes[j])}: {share[i, j]:.0%}"
            for i, j in pairs
        ]


@checked
def train_decoder(
    robot: RobotFile | Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    robots: Count = 24,
    seed: Seed = 0,
    noise: Annotated[float, Gt(0), Unit("rad")] | None = None,
    calibration: SensorCalibration | None = None,
    joints: Joints = (),
    name: str = "",
    progress: Advance | None = None,
    **how: Any,
) -> RobotDecoder:
    """A decoder of a robot's touches, trained on simulated touches of surrogate robots around it.

    Parameters
    ----------
    robot
        What :func:`feeler.robot.load_robot` gives, or an antenna; default: the paper's robot.
    trials
        The touches to be discriminated, as :func:`feeler.robot.make_touches` gives them.
    robots
        Surrogate robots; half as many others touch unknown objects.
    noise
        Standard deviation of each reading [rad]; default: that of :class:`feeler.robot.Gap`.
    calibration, joints, name
        Kept in the decoder; default: those of the robot's file.
    progress
        Called with (done, total) surrogate robots; default: a bar that appears after 5 s.
    how
        ``engine``, ``timestep`` and ``workers``, as for :func:`feeler.touch`.

    Raises
    ------
    InvalidInput
        Touches of which fewer than two can be discriminated, or a noise that is not > 0.
    """
    antenna = robot.antenna if isinstance(robot, RobotFile) else robot or make_robot()
    trials = make_touches() if trials is None else list(trials)
    if isinstance(robot, RobotFile):
        if calibration is None and robot.calibration is not None:
            calibration = load_calibration(robot.calibration)
        joints = joints or robot.sensors.joints
    gap = Gap() if noise is None else Gap(noise=noise)
    training = draw_training_set(
        antenna, trials, robots=robots, seed=seed, gap=gap, progress=progress, **how
    )
    classifier = make_classifier(training=training)
    return RobotDecoder(
        robot=name or antenna.name,
        antenna=antenna,
        recipe=_describe_recipe(trials, robots, seed, gap, how),
        classifier=classifier,
        stream=training.watch(make_decoder(antenna, trials, seed=seed, **how)),
        before=choose_before(antenna, trials),
        tolerance=_measure_tolerance(classifier, seed),
        calibration=calibration,
        joints=joints,
    )


def _describe_recipe(
    trials: Sequence[Trial], robots: int, seed: int, gap: Gap, how: dict[str, Any]
) -> dict[str, Any]:
    return {
        "touches": [trial.to_plain() for trial in trials],
        "robots": robots,
        "seed": seed,
        "noise": gap.noise,
        "gap": gap.to_plain(),
        "friction": sorted({trial.friction for trial in trials}),
        "how": {key: value for key, value in how.items() if key in ("engine", "timestep")},
        "feeler": find_version("feeler"),
        "physics": PHYSICS,
    }


def _measure_tolerance(classifier: StudentTClassifier, seed: int) -> dict[str, float]:
    """Held-out accuracy without sensors that are drawn at random."""
    rng, found = np.random.default_rng([seed, 2]), {}
    n_sensors, n_samples = classifier.shape_
    for count in range(1, min(_DROPPED, n_sensors - 1) + 1):
        shares = []
        for _ in range(min(_DRAWS, n_sensors)):
            touch = np.zeros((1, n_sensors, n_samples))
            touch[:, rng.choice(n_sensors, count, replace=False)] = np.nan
            shares.append(_share_right(classifier._look(touch, None)[0]))
        found[str(count)] = float(np.mean(shares))
    classifier._without.clear()
    return found


def _share_right(classifier: StudentTClassifier) -> float:
    """Share of held-out touches that were classified correctly."""
    return float(np.trace(classifier.confusion_) / classifier.confusion_.sum())


# Decoders that were trained without a file's name are kept in the user's cache.


def find_cache() -> Path:
    """The folder in which decoders are kept: ``FEELER_CACHE``, else ``feeler`` in
    ``XDG_CACHE_HOME`` or ``~/.cache``.
    """
    if chosen := os.environ.get("FEELER_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "feeler"


def find_cached(
    antenna: Antenna,
    trials: Sequence[Trial],
    *,
    robots: int = 24,
    seed: int = 0,
    **how: Any,
) -> Path:
    """Where a decoder of this recipe is kept, whether it is there or not."""
    recipe = _describe_recipe(trials, robots, seed, Gap(), how)
    content = json.dumps(to_jsonable([antenna.to_plain(), recipe, _VERSION]), sort_keys=True)
    return find_cache() / f"{hashlib.sha256(content.encode()).hexdigest()[:16]}.decoder"


def keep_cached(decoder: RobotDecoder, path: Path) -> bool:
    """Write a decoder to the cache, of which the eight latest stay; False where it cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        decoder.save(path)
        kept = sorted(path.parent.glob("*.decoder"), key=lambda file: -file.stat().st_mtime)
        for old in kept[_MOST_KEPT:]:
            old.unlink(missing_ok=True)
    except (OSError, InvalidInput):
        return False
    return True


# A linear decoder for the board itself, as a C header.

_WINDOWS = (200, 400, 800)  # [C] ms after contact, of which the most accurate is taken
_BIN = 20  # [C] ms that are averaged to one number
_FOLDS = 4  # [C] as of the classifier of untruncated touches


def _list(values: np.ndarray) -> str:
    return ", ".join(f"{value:.8e}f" for value in values)


def make_board_decoder(decoder: RobotDecoder) -> tuple[str, float, int]:
    """A linear discriminant of the decoder's own training set, from contact on.

    It learns the samples after contact alone, at which a board needs no peak to be found. Scores =
    weights · means + bias, of the means of 20 ms of every sensor since contact.

    Returns
    -------
    header : str
        Weights, and ``feeler_push``, which takes a sample each ms and gives the number of the class
        once the window is over.
    accuracy : float
        Share of held-out touches of surrogate robots that were classified correctly.
    window : int
        Samples of 1 ms after contact that are used.
    """
    watch: Any = decoder.stream.watch_
    means, y, groups, _ = watch.classifiers_[max(watch.classifiers_)]._training
    classes = decoder.stream.classes_
    labels = number_labels(y, classes)
    folds = np.unique(groups, return_inverse=True)[1] % _FOLDS
    pair = _BIN // decoder.classifier.step
    longest = means.shape[2] * decoder.classifier.step
    found = []
    for window in (w for w in _WINDOWS if w <= longest):
        count = window // _BIN
        binned = means[:, :, : count * pair].reshape(len(means), means.shape[1], count, pair)
        flat = binned.mean(axis=3).transpose(0, 2, 1).reshape(len(means), -1)
        guessed = cross_val_predict(_make_lda(), flat, labels, cv=PredefinedSplit(folds))
        found.append((float(np.mean(guessed == labels)), window, flat))
    share, window, flat = max(found, key=itemgetter(0))
    fitted = _make_lda().fit(flat, labels)
    weights, bias = fitted.coef_, fitted.intercept_
    if len(fitted.classes_) == 2:  # scikit-learn gives two classes one row
        weights, bias = np.vstack([-weights, weights]) / 2, np.hstack([-bias, bias]) / 2
    lengths = list_lengths(decoder.antenna)
    names = (classes[k] for k in fitted.classes_)
    header = _HEADER.format(
        sensors=lengths.size,
        classes=len(fitted.classes_),
        window=window,
        bin=_BIN,
        bins=window // _BIN,
        onset=f"{decoder.stream.onset:.9g}f",
        reach=f"{decoder.stream.reach_:.9g}f",
        confirm=decoder.stream.confirm,
        names=", ".join(json.dumps(f"{feature} {x:g} {v:g}") for feature, x, v in names),
        lengths=_list(lengths),
        weights=",\n".join("{" + _list(row) + "}" for row in weights),
        bias=_list(bias),
        accuracy=f"{share:.1%}",
    )
    return header, share, window


def _make_lda() -> LinearDiscriminantAnalysis:
    return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")


_HEADER = """\
/* Linear decoder of touches, written by feeler; {accuracy} of held-out touches of simulated robots
   are classified correctly. Angles are in rad, one sample each ms, base to tip.

   static feeler_touch touch;                     all zero at the start
   int which = feeler_push(&touch, angle);        -1: not yet; -2: not known, as an angle of the
                                                  touch was no number, or three times as large as
                                                  any that was learned; else feeler_names[which]
   feeler_reset(&touch);                          before the next touch                       */
#ifndef FEELER_DECODER_H
#define FEELER_DECODER_H
#include <math.h>
#include <string.h>

#define FEELER_SENSORS {sensors}
#define FEELER_CLASSES {classes}
#define FEELER_WINDOW {window} /* samples after contact */
#define FEELER_BIN {bin}
#define FEELER_BINS {bins}

static const char *const feeler_names[FEELER_CLASSES] = {{{names}}};
static const float feeler_lengths[FEELER_SENSORS] = {{{lengths}}}; /* mm */
static const float feeler_bias[FEELER_CLASSES] = {{{bias}}};
static const float feeler_weights[FEELER_CLASSES][FEELER_BINS * FEELER_SENSORS] = {{
{weights}}};

typedef struct {{
  float level[FEELER_SENSORS]; /* resting angles */
  float mean[FEELER_BINS * FEELER_SENSORS];
  float tip[FEELER_WINDOW];
  int seen, running, since, begun;
}} feeler_touch;

static inline void feeler_reset(feeler_touch *touch) {{ memset(touch, 0, sizeof *touch); }}

/* Whether contact is noticed with this sample; else the resting level is followed. */
static int feeler_notice(feeler_touch *touch, const float *angle) {{
  float away, most = 0;
  int n;
  for (n = 0; n < FEELER_SENSORS; n++) if (isnan(angle[n])) return 0;
  if (!touch->begun) memcpy(touch->level, angle, sizeof touch->level);
  touch->begun = 1;
  for (n = 0; n < FEELER_SENSORS; n++) most = fmaxf(most, fabsf(angle[n] - touch->level[n]));
  touch->running = most > {onset} ? touch->running + 1 : 0;
  if (most <= {onset}) {{
    touch->seen++;
    for (n = 0; n < FEELER_SENSORS; n++) {{
      away = angle[n] - touch->level[n];
      touch->level[n] += away / fminf((float)touch->seen, 300.0f);
    }}
  }}
  return touch->running >= {confirm};
}}

static inline int feeler_push(feeler_touch *touch, const float angle[FEELER_SENSORS]) {{
  int n, k, c, best = 0, past = touch->since >= FEELER_WINDOW;
  float turn = 0, tip = 0, most = 0, score, top = 0, sign = 1;
  if (past || (touch->running < {confirm} && !feeler_notice(touch, angle))) return -1;
  for (n = 0; n < FEELER_SENSORS; n++) {{
    float away = angle[n] - touch->level[n];
    turn += away;
    tip += feeler_lengths[n] * sinf(turn);
    if (fabsf(away) > {reach}) away = NAN;
    touch->mean[touch->since / FEELER_BIN * FEELER_SENSORS + n] += away / FEELER_BIN;
  }}
  touch->tip[touch->since++] = tip;
  if (touch->since < FEELER_WINDOW) return -1;
  for (k = 0; k < FEELER_WINDOW; k++) most = fmaxf(most, fabsf(touch->tip[k]));
  for (k = 0; k < FEELER_WINDOW && fabsf(touch->tip[k]) <= most / 2; k++) {{}}
  if (k < FEELER_WINDOW && touch->tip[k] < 0) sign = -1; /* from the other side: its mirror image */
  for (c = 0; c < FEELER_CLASSES; c++) {{
    score = feeler_bias[c];
    for (k = 0; k < FEELER_BINS * FEELER_SENSORS; k++)
      score += sign * feeler_weights[c][k] * touch->mean[k];
    if (isnan(score)) return -2;
    if (c == 0 || score > top) {{ top = score; best = c; }}
  }}
  return best;
}}
#endif
"""
