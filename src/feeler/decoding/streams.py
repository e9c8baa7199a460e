"""Touches as they happen: onset, posterior after each sample, novelty."""

import os
import warnings
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import logsumexp
from sklearn.utils.validation import check_is_fitted

from feeler.decoding.classifiers import (
    Classifier,
    Labels,
    list_classes,
    read_labels,
    sort_classes,
)
from feeler.decoding.observers import Others, StudentTClassifier
from feeler.decoding.transfer import find_direction
from feeler.errors import FeelerError, InvalidInput, ModelValidityWarning
from feeler.sandbox import find_limits
from feeler.tensors.formats import Model, load_model, save_model
from feeler.tensors.transforms import check_squares

# One touch as it happens: a sample in, what is known so far out.

_MAX_READING = 1e6  # [C] rad; the squares of absurd readings overflow
_BEYOND = 3.0  # [C] times the largest angle that was learned: no such touch
_SURPLUS = 50  # samples too many before a faster sender is refused
_RECENT = 101  # [C] intervals between samples whose median is what a sender usually leaves
_SLOW = 1.25  # [C] usual interval over the trained one, from which on the sender is slower
_SLOWEST = 10.0  # [C] ms between samples, over which the time between is not filled in
# [C] ms between so many samples, from which on times are not in ms
_NO_TIME, _ENOUGH = 100.0, 20


# [C] samples over which the resting level is followed while nothing touches
_BASELINE = 300.0


class OnsetFinder:
    """Follows the resting level and notices when a sensor leaves it."""

    def __init__(self, onset: float, confirm: int, n_sensors: int) -> None:
        self.onset, self.confirm = onset, confirm
        self.level = np.full(n_sensors, np.nan)
        self.running, self.seen = 0, 0

    def see(self, sample: np.ndarray) -> bool:
        """Take one sample; whether contact is noticed with it."""
        known = np.isfinite(sample)
        fresh = known & np.isnan(self.level)
        self.level[fresh] = sample[fresh]
        away = sample - self.level
        beyond = np.abs(away[known]).max(initial=0.0) > self.onset
        self.running = self.running + 1 if beyond else 0
        if not beyond:
            self.seen += 1
            self.level[known] += away[known] / min(self.seen, _BASELINE)
        return self.running >= self.confirm


@dataclass(frozen=True, kw_only=True, eq=False)
class StreamState:
    """What is known after one sample.

    Attributes
    ----------
    sample : int
        Number of the sample's slot on the trained time base.
    state : str
        ``waiting`` for contact, ``unsure``, ``decided``, or ``over`` (the window is full).
    label : tuple | None
        The most probable class; None before contact.
    probability : float
        Its posterior; NaN before contact.
    since_contact : int
        Samples since contact was noticed; −1 before.
    posterior : np.ndarray
        (class,).
    strangeness : float
        At the last moment that was asked about, > 1: so far unlike any touch that was learned; NaN
        before that, and where the decoder learned no ``watch``. From an angle on of more than three
        times the largest that was learned it is at least that angle over this limit, and the state
        is no longer ``decided``.
    mirrored : bool
        Whether the tip first went to the negative side, so that the answer is to the mirror image.
    """

    sample: int
    state: str
    label: tuple | None
    probability: float
    since_contact: int
    posterior: np.ndarray
    strangeness: float = float("nan")
    mirrored: bool = False

    @property
    def strange(self) -> bool:
        """Whether the touch is so far unlike all that were learned."""
        return self.strangeness > 1


class Stream:
    """One stream of samples: keeps the tensor so far and the evidence for each class."""

    def __init__(self, decoder: Any) -> None:
        self.decoder = decoder
        self.n_classes = len(decoder.classes_)
        self._reach = getattr(decoder, "reach_", np.inf)  # what a model learned is not known
        self.tensor = np.full((decoder.n_sensors_, decoder.window), np.nan)
        """Samples (sensor, window) since contact, relative to rest; NaN where missing. Those of a
        touch whose tip first goes to the negative side are times −1.
        """
        self.missed = 0
        """Samples that did not come, of those that the sender's usual interval lets expect."""
        self.reset()

    def reset(self) -> None:
        """Forget the touch and wait for the next contact."""
        self.finder = OnsetFinder(
            self.decoder.onset, self.decoder.confirm, self.decoder.n_sensors_
        )
        self.evidence = np.zeros(
            self.decoder.constant_at_.shape[1] if self.decoder.model is None else 0
        )
        self.posterior = np.full(self.n_classes, 1 / self.n_classes)
        self.tensor[:] = np.nan
        self.mirrored = False
        self._known = np.zeros(
            self.decoder.n_sensors_
        )  # latest sample, its gaps as they were last
        self._tip = np.full(self.decoder.window, np.nan)
        self._felt: list[int] = []
        self._most = 0.0
        self.strangeness, self._watched = float("nan"), False
        self.slot, self.contact, self.surplus, self.felt = -1, -1, 0, -1
        self.first_time: float | None = None
        self._last: tuple[float, np.ndarray] | None = None
        self._steps: deque[float] = deque(maxlen=_RECENT)

    def update(self, sample: np.ndarray, time: float | None = None) -> StreamState:
        """Take one sample (sensor,) [rad], NaN for a missing channel, and its time [ms] if known.

        With times, a sender slower than the trained time base (at least every 10 ms) has its
        samples joined by straight lines, as :func:`feeler.robot.repair` does; samples that it lost
        are counted in ``missed``, and their slots stay empty and carry no evidence.

        Raises
        ------
        InvalidInput
            The wrong number of channels, infinite values, time running backwards, or a sender
            faster than the model.
        """
        sample = np.asarray(sample, dtype=float)
        if sample.shape != (self.decoder.n_sensors_,) or (np.abs(sample) > _MAX_READING).any():
            raise InvalidInput(
                f"a sample is {self.decoder.n_sensors_} finite numbers of at most {_MAX_READING:g},"
                f" got shape {sample.shape}: {np.array2string(sample.ravel()[:10], precision=3)}."
            )
        for slot, values in self._fill(sample, time):
            self.slot = slot
            if self.contact < 0 and self.finder.see(values):
                self.contact = slot
            since = slot - self.contact
            if self.contact >= 0 and since < self.decoder.window:
                self._weigh(values - self.finder.level, since)
        return self._state()

    def _fill(self, sample: np.ndarray, time: float | None) -> list[tuple[int, np.ndarray]]:
        """Slots that are known with this sample, and what they hold: none if its own is taken."""
        if time is None:
            return [(self.slot + 1, sample)]
        if not np.isfinite(time):
            raise InvalidInput(f"a sample's time must be finite, got {time}.")
        last, self._last = self._last, (time, sample)
        if self.first_time is None or last is None:
            self.first_time = time
            return [(0, sample)]
        interval, before = self.decoder.interval, self.slot
        slot = round((time - self.first_time) / interval)
        if slot < before - 1:
            raise InvalidInput(
                f"time runs backwards: slot {before} was followed by a sample at {time:g} ms."
            )
        step = time - last[0]
        if step > 0:
            self._steps.append(step)
        if slot <= before:
            self.surplus += 1
            if self.surplus > _SURPLUS and self.surplus > 0.25 * (before + 1):
                raise InvalidInput(
                    f"samples come faster than every {interval:g} ms, which the decoder was trained"
                    " for. Thin them out, or state the unit of their times with time_unit=."
                )
            return []
        self.surplus -= slot - before - 1  # a pause, after which as many may come at once
        usual = float(np.median(self._steps))
        if usual > _NO_TIME and len(self._steps) >= _ENOUGH:
            raise InvalidInput(
                f"samples come every {usual:.4g} ms, by their times, where a touch needs one every"
                f" {_SLOWEST:g} ms at least. Are the times in ms? State their unit with time_unit=."
            )
        if not _SLOW * interval < usual <= _SLOWEST:
            self.missed += slot - before - 1
            return [(slot, sample)]
        self.missed += (lost := max(round(step / usual) - 1, 0))
        if lost:
            return [(slot, sample)]
        share = (self.first_time + interval * np.arange(before + 1, slot + 1) - last[0]) / step
        between = last[1] + np.minimum(share, 1.0)[:, None] * (sample - last[1])
        return [*zip(range(before + 1, slot), between, strict=False), (slot, between[-1])]

    def _weigh(self, away: np.ndarray, since: int) -> None:
        before = self.felt
        most, reach = np.fmax.reduce(np.abs(away), initial=self._most), self._reach
        if most > reach >= self._most:
            warning = ModelValidityWarning(
                f"angles of a touch are more than {_BEYOND:g} times the largest that the decoder"
                " learned: are they in rad? What it says of such a touch means nothing.",
                f"{most:.3g} rad, learned {reach / _BEYOND:.3g} rad at most.",
            )
            warnings.warn(warning, stacklevel=3)
        self._most = float(most)
        self.tensor[:, since], self.felt = -away if self.mirrored else away, since
        self._felt.append(since)
        if self._turns(away, since):
            self.mirrored = not self.mirrored
            self.tensor *= -1
            self.strangeness, self._watched, before = float("nan"), False, -1
            self.evidence[:] = 0
            for earlier in self._felt[:-1] if self.decoder.model is None else ():
                self._add(earlier)
        self._ask_watch(before)
        if self._watched:
            return
        if self.decoder.model is not None:
            self.posterior = self._ask(self.decoder.model)
            return
        self._add(since)
        likelihood = (
            np.exp(self.evidence - self.evidence.max()).reshape(self.n_classes, -1).sum(axis=1)
        )
        self.posterior = likelihood / likelihood.sum()

    def _turns(self, away: np.ndarray, since: int) -> bool:
        """Whether this sample makes the tip's first deflection one to the other side."""
        lengths = getattr(self.decoder, "lengths", None)
        if lengths is None:
            return False
        self._known = np.where(np.isnan(away), self._known, away)
        self._tip[since] = np.dot(lengths, np.sin(np.cumsum(self._known)))
        return (find_direction(self._tip[: since + 1]) < 0) != self.mirrored

    def _add(self, since: int) -> None:
        """The evidence of one sample."""
        seen = self.tensor[:, since]
        error = self.decoder.expected_at_[since] - seen
        error *= error
        error *= self.decoder.weight_at_[since]
        if np.isnan(seen).any():
            np.nan_to_num(error, copy=False)
        self.evidence += self.decoder.constant_at_[since] - error.sum(axis=1)

    def _ask_watch(self, before: int) -> None:
        """Ask about the moments that came after sample ``before``; a late sample asks for those
        that it skipped.

        From the first moment on the watch's probabilities are the answer: what is said of a touch
        and whether it is like any that was learned come from the same clouds.
        """
        watch: Any = getattr(self.decoder, "watch_", None)
        for since in () if watch is None else range(before + 1, self.felt + 1):
            found = watch.judge(self.tensor[:, : self.felt + 1], since, self.decoder.classes_)
            if found is not None:
                self.strangeness, posterior = found
                if np.isfinite(posterior).all():
                    self.posterior, self._watched = posterior, True

    def _ask(self, model: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """The model's probabilities for what has been felt so far."""
        found = np.asarray(model(self.tensor.copy()), dtype=float).reshape(-1)
        if (
            found.shape != (self.n_classes,)
            or not (found >= 0).all()
            or abs(found.sum() - 1) > 1e-3
        ):
            raise InvalidInput(
                f"the model must give {self.n_classes} probabilities, one for each class, that add"
                f" up to 1; got {found.size} of sum {found.sum():.3g}. A network's scores need a"
                " softmax."
            )
        return found

    def _state(self) -> StreamState:
        if self.contact < 0:
            return StreamState(
                sample=self.slot,
                state="waiting",
                label=None,
                probability=float("nan"),
                since_contact=-1,
                posterior=self.posterior,
            )
        best = int(self.posterior.argmax())
        probability, since = float(self.posterior[best]), self.slot - self.contact
        beyond = self._most / self._reach
        sure = "decided" if probability >= self.decoder.threshold and beyond <= 1 else "unsure"
        return StreamState(
            sample=self.slot,
            state="over" if since >= self.decoder.window else sure,
            label=self.decoder.classes_[best],
            probability=probability,
            since_contact=since,
            posterior=self.posterior,
            strangeness=float(np.fmax(self.strangeness, beyond))
            if beyond > 1
            else self.strangeness,
            mirrored=self.mirrored,
        )


# Online novelty detection: whether it is, so far, unlike any touch that was learned.

_MOMENTS_WATCH = (
    50,
    100,
    200,
    400,
    800,
    1600,
)  # [C] samples after contact at which it is asked


class OnlineNoveltyDetector:
    """Clouds of touches up to several moments, with one limit for all of these moments together.

    Of the known touches that were held out, ``alarm`` are called strange at any moment.

    Parameters
    ----------
    alarm
        Share of the known touches that may be called strange before they are over.

    Attributes
    ----------
    classifiers_ : dict[int, StudentTClassifier]
        Samples after contact → the clouds of touches up to then.
    limit_ : float
        What the strangeness at one moment may be.
    """

    def __init__(self, alarm: float = 0.05) -> None:
        self.alarm = alarm

    def fit(
        self,
        X: np.ndarray,
        y: Labels,
        groups: Sequence[int],
        unknown: Others | None = None,
        most: int = _MOMENTS_WATCH[-1],
    ) -> "OnlineNoveltyDetector":
        """Learn from tensors (trial, sensor, window) that begin with contact. No moment lies later
        than ``most`` samples after contact, because the shortest recording ends there.
        """
        moments = [moment for moment in _MOMENTS_WATCH if moment <= min(most, X.shape[2])]
        if not moments:
            raise InvalidInput(
                f"a watch needs touches of {_MOMENTS_WATCH[0]} samples after contact, got"
                f" {min(most, X.shape[2])}."
            )
        self.classifiers_ = {}
        for moment in moments:
            classifier = StudentTClassifier(alarm=self.alarm)
            self.classifiers_[moment] = classifier.fit(X[:, :, :moment], y, groups, unknown)
        held = np.array(
            [classifier.held_out_ for classifier in self.classifiers_.values()]
        ).max(axis=0)
        self.limit_ = float(np.nanquantile(held, 1 - self.alarm))
        return self

    def judge(
        self, tensor: np.ndarray, since: int, classes: Sequence
    ) -> tuple[float, np.ndarray] | None:
        """Strangeness of samples (sensor, time) up to ``since``, > 1: unlike any that was learned;
        and the probability of each of ``classes``.

        None between moments, NaN where a channel has no sample. Missing samples are bridged, also
        from those of ``tensor`` that came after ``since``.
        """
        if since + 1 not in self.classifiers_:
            return None
        # Each gap as a straight line; a channel without samples stays NaN.
        bridged, time = tensor.copy(), np.arange(tensor.shape[1])
        for row in bridged:
            known = np.isfinite(row)
            if known.any():
                row[~known] = np.interp(time[~known], time[known], row[known])
        classifier, seen = self.classifiers_[since + 1], bridged[None, :, : since + 1]
        probability = dict(
            zip(classifier.classes_, classifier.predict_proba(seen)[0], strict=True)
        )
        strange = float(classifier.measure_strangeness(seen)[0]) / self.limit_
        return strange, np.array([probability.get(label, 0.0) for label in classes])

    def pack(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Arrays and settings (as JSON) of all that was learned, for :meth:`unpack`."""
        last = max(self.classifiers_)
        arrays: dict[str, np.ndarray] = {}
        moments: dict[str, Any] = {}
        for moment, classifier in self.classifiers_.items():
            found, moments[str(moment)] = classifier.pack(training=moment == last)
            arrays |= {f"{moment}/{name}": values for name, values in found.items()}
        return arrays, {"alarm": self.alarm, "limit": self.limit_, "moments": moments}

    @classmethod
    def unpack(
        cls, arrays: dict[str, np.ndarray], settings: dict[str, Any]
    ) -> "OnlineNoveltyDetector":
        """What :meth:`pack` gave."""
        made, taught = cls(settings["alarm"]), None
        made.limit_, made.classifiers_ = settings["limit"], {}
        moments = sorted(map(int, settings["moments"]), reverse=True)
        for moment in moments:  # the last one holds the training set of all
            own = {
                name.partition("/")[2]: values
                for name, values in arrays.items()
                if name.startswith(f"{moment}/")
            }
            classifier = StudentTClassifier.unpack(
                own, settings["moments"][str(moment)], taught
            )
            made.classifiers_[moment] = classifier
            means, y, groups, others = classifier._training
            taught = taught or classifier._training
            count = moment // classifier.step
            cut = others and (others[0][:, :, :count], others[1])
            classifier._training = means[:, :, :count], y, groups, cut
        made.classifiers_ = dict(sorted(made.classifiers_.items()))
        return made


# Streaming decoder: after each sample, a posterior over classes or a "not sure yet".
#
# Evidence adds up in time: after contact, each sample is compared with every class's expected
# sample at that moment, ``log p_c ← log p_c − Σ_s (x_s − μ_cs(t))² / (2 σ_cs(t)² τ)``. The
# moment of contact is uncertain by a few samples, so each class is held at several lags at once
# and the lags are summed out. τ, the correlation time in samples, keeps neighbouring samples,
# whose errors go together, from counting as independent witnesses.

_FLOOR = 0.004  # [C] rad; least sd of a reading
_KIND, _VERSION = "StreamDecoder", 1
_WHOLE = ("window", "confirm", "max_lag", "lag_step")  # numbers of samples
_LEARNED = ("expected", "weight", "constant")
_MOMENTS = (20, 50, 100, 200, 400, 800, 1500)
_SHARPNESS = (0.01, 10.0)  # range of 1/τ that temper searches, relative to the given τ

_AT_LEAST_1, _ABOVE_0 = ("≥ 1", lambda value: value >= 1), ("> 0", lambda value: value > 0)
_AT_LEAST_0 = ("≥ 0", lambda value: value >= 0)
_MOST = 2**31  # [C] of any setting: NumPy has no indices for what a damaged file may say
_RULES: dict[str, tuple[str, Callable[[float], bool]]] = {
    "window": _AT_LEAST_1,
    "threshold": ("in (0, 1]", lambda value: 0 < value <= 1),
    "onset": _ABOVE_0,
    "confirm": _AT_LEAST_1,
    "noise": _AT_LEAST_0,
    "correlation": _AT_LEAST_1,
    "max_lag": _AT_LEAST_0,
    "lag_step": _AT_LEAST_1,
    "interval": _ABOVE_0,
}


class StreamDecoder(Classifier):
    """Posterior over touches while they happen.

    Parameters
    ----------
    window
        Samples after contact that are used.
    threshold
        Posterior at which the answer counts as decided.
    onset, confirm
        Contact is noticed when any sensor leaves its resting level by ``onset`` [rad] for
        ``confirm`` samples running.
    noise
        Expected mismatch as a share of each class's largest absolute value, beside the spread of
        the training touches.
    correlation
        τ, samples over which the mismatch stays correlated.
    max_lag, lag_step
        The moment of contact is tried from −max_lag to +max_lag samples.
    interval
        Time between samples [ms].
    model
        Something else that says what is felt, such as a trained network: ``model(tensor)`` takes
        the samples since contact (sensor, window) [rad], relative to rest and NaN where missing or
        still to come, and gives the probabilities of the classes (class,). ``adopt`` then takes the
        place of ``fit``.
    lengths
        Of the antenna [mm], from each sensor to the next. With them a touch that first bends the
        tip to the negative side is decoded as its mirror image, all channels times −1.

    Attributes
    ----------
    classes_
        Labels, sorted.
    correlation_
        τ in use: ``correlation``, or what ``temper`` found.
    expected_
        (class, sensor, max_lag + window + max_lag) expected samples from ``max_lag`` before contact
        on.
    reach_
        Three times the largest of them [rad]; a touch with a larger angle is like none that was
        learned.
    """

    def __init__(
        self,
        window: int = 1600,
        threshold: float = 0.9,
        onset: float = 0.025,
        confirm: int = 3,
        noise: float = 0.05,
        correlation: float = 50.0,
        max_lag: int = 12,
        lag_step: int = 3,
        interval: float = 1.0,
        model: Callable[[np.ndarray], np.ndarray] | None = None,
        lengths: Sequence[float] | None = None,
    ) -> None:
        self.window = window
        self.threshold = threshold
        self.onset = onset
        self.confirm = confirm
        self.noise = noise
        self.correlation = correlation
        self.max_lag = max_lag
        self.lag_step = lag_step
        self.interval = interval
        self.model = model
        self.lengths = lengths

    def adopt(self, classes: Sequence[Any], n_sensors: int) -> "StreamDecoder":
        """Get ready to stream with ``model``, whose classes are these in this order."""
        self._check()
        if not callable(self.model):
            raise InvalidInput(
                "adopt needs model=, a function of the tensor so far (sensor, window); or use fit."
            )
        if len(classes) < 2 or n_sensors < 1:
            raise InvalidInput(
                f"a decoder needs at least 2 classes and 1 sensor, got {len(classes)} and"
                f" {n_sensors}."
            )
        self._check_lengths(n_sensors)
        self.classes_, self.n_sensors_ = list_classes(classes), int(n_sensors)
        return self

    @property
    def n_features_in_(self) -> int:
        """Sensors of the touches that it learned."""
        check_is_fitted(self)
        return self.n_sensors_

    def fit(self, X: Sequence[np.ndarray], y: Labels) -> "StreamDecoder":
        """Learn from touches (sensor, time) of any durations that start at rest.

        Touches without contact are left out; several touches of one class give its spread.
        """
        self._check()
        if self.model is not None:
            raise InvalidInput(
                "a decoder with model= is not fitted; give it its classes with adopt."
            )
        if len(X) != len(y) or not len(X):
            raise InvalidInput(
                f"fit needs one label per touch, got {len(X)} touches and {len(y)} labels."
            )
        found = [
            (self._cut(np.asarray(touch, dtype=float)), label)
            for touch, label in zip(X, read_labels(y), strict=True)
        ]
        cut = [(touch, label) for touch, label in found if touch is not None]
        self.classes_ = sort_classes(label for _, label in cut)
        for touch, _ in cut:
            check_squares(touch, "touches")
        if len(self.classes_) < 2:
            raise InvalidInput(
                "a decoder needs touches of at least 2 classes with contact, got"
                f" {len(self.classes_)}."
            )
        groups = [
            np.stack([touch for touch, label in cut if label == name])
            for name in self.classes_.tolist()
        ]
        self.expected_ = np.stack([group.mean(axis=0) for group in groups])
        spread = np.stack([group.var(axis=0) for group in groups])
        scale = self.noise * np.abs(self.expected_).max(axis=(1, 2), keepdims=True)
        variance = spread + scale**2 + _FLOOR**2
        self.weight_ = 1 / (2 * variance * self.correlation)
        self.constant_ = -0.5 * np.log(variance).sum(axis=1) / self.correlation
        self.n_sensors_ = self.expected_.shape[1]
        self.correlation_ = float(self.correlation)
        self._pack()
        return self

    def temper(
        self, X: Sequence[np.ndarray], y: Sequence[tuple], moments: Sequence[int] = _MOMENTS
    ) -> "StreamDecoder":
        """Set τ so that the posterior is as sure as it is right on other touches.

        Chooses the τ with the greatest mean log posterior of the true classes over ``moments``
        (samples after contact). Use simulations with drawn mechanics: a decoder tempered on its own
        training touches would trust itself fully.
        """
        self._require()
        chosen = np.unique(np.clip(moments, 0, self.window - 1))
        evidence, true, known = [], [], self.classes_.tolist()
        for touch, label in zip(X, y, strict=True):
            cut = self._cut(np.asarray(touch, dtype=float))
            if cut is not None and label in known:
                # Evidence (window, class · lag) after each sample of a cut touch.
                seen = cut[:, self.max_lag : self.max_lag + self.window].T
                error = np.einsum(
                    "tks,tks->tk", (self.expected_at_ - seen[:, None]) ** 2, self.weight_at_
                )
                evidence.append(np.cumsum(self.constant_at_ - error, axis=0)[chosen])
                true.append(known.index(label))
        if not evidence:
            raise InvalidInput(
                "temper needs touches with contact and with labels that the decoder knows; got"
                " none."
            )
        sharpness = np.geomspace(_SHARPNESS[0], _SHARPNESS[1], 61)
        scores = [
            _score_log(np.stack(evidence) * s, np.array(true), len(self.classes_))
            for s in sharpness
        ]
        best = sharpness[int(np.argmax(scores))]
        self.correlation_ /= best
        self.weight_ *= best
        self.constant_ *= best
        self._pack()
        return self

    def watch(
        self,
        X: Sequence[np.ndarray],
        y: Labels,
        groups: Sequence[int],
        unknown: tuple[Sequence[np.ndarray], Sequence[Hashable]] | None = None,
        alarm: float = 0.05,
    ) -> "StreamDecoder":
        """Learn to say while a touch goes on that it is unlike any of these, as
        ``StreamState.strangeness``; of known touches ``alarm`` are called so. From the first moment
        that is asked about (50 samples after contact) the posterior comes from these touches, too.
        A model file does not hold it.

        Parameters
        ----------
        X, y, groups
            Touches (sensor, time), their labels, and whose touches they are (a robot's, say).
        unknown
            Touches that are not to be known, and what each shares with others.
        """
        self._require()
        values, kept, most = self._cut_all(X)
        shown = None
        if unknown is not None:
            others, felt, _ = self._cut_all(unknown[0])
            shown = others, [unknown[1][k] for k in felt]
        labels, owners = [y[k] for k in kept], [groups[k] for k in kept]
        self.watch_ = OnlineNoveltyDetector(alarm).fit(values, labels, owners, shown, most)
        return self

    def _cut_all(self, X: Sequence[np.ndarray]) -> tuple[np.ndarray, list[int], int]:
        """Touches from contact on, which they are, and how long the shortest lasts after it."""
        cuts, kept, most = [], [], self.window
        for k, touch in enumerate(X):
            cut = self._cut(np.asarray(touch, dtype=float))
            if cut is not None:
                cuts.append(cut[:, self.max_lag : self.max_lag + self.window])
                kept.append(k)
                still = np.all(cut[:, ::-1] == cut[:, -1:], axis=0)
                most = min(most, self.window + self.max_lag - int(np.argmin(still)))
        return np.array(cuts), kept, most

    def save(self, path: str | os.PathLike) -> None:
        """Write all that was learned and all settings as a model file; never pickle."""
        arrays, settings = self.pack()
        save_model(Model(kind=_KIND, version=_VERSION, arrays=arrays, settings=settings), path)

    def pack(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Arrays and settings (as JSON) of all but the watch, for :meth:`unpack`."""
        self._require()
        if self.model is not None:
            raise InvalidInput(
                "a decoder with model= holds a function, which no file can. Save the network by"
                " itself."
            )
        parameters = {
            name: value for name, value in self.get_params().items() if name != "model"
        }
        if self.lengths is not None:
            parameters["lengths"] = np.asarray(self.lengths, dtype=float).tolist()
        settings = {
            "parameters": parameters,
            "classes": self.classes_.tolist(),
            "correlation": self.correlation_,
        }
        return {name: getattr(self, f"{name}_") for name in _LEARNED}, settings

    @classmethod
    def load(cls, path: str | os.PathLike, *, trusted: bool = False) -> "StreamDecoder":
        """A decoder that :meth:`save` wrote, ready to stream.

        ``trusted=True`` skips the guard, for a file of your own.

        Raises
        ------
        InvalidInput
            No such file, damaged, of another kind or version, or with parts that do not fit
            together.
        """
        file = load_model(path, kind=_KIND, version=_VERSION, trusted=trusted)
        try:
            return cls.unpack(file.arrays, file.settings)
        except (
            KeyError,
            TypeError,
            ValueError,
            AttributeError,
            OverflowError,
            FeelerError,
        ) as error:
            raise InvalidInput(
                f"{path} is no complete StreamDecoder ({str(error)[:150]}). Save it again."
            ) from error

    @classmethod
    def unpack(cls, arrays: dict[str, np.ndarray], settings: dict[str, Any]) -> "StreamDecoder":
        """What :meth:`pack` gave."""
        given: dict[str, Any] = dict(settings["parameters"])
        lengths = given.pop("lengths", None)
        options: dict[str, Any] = {
            name: int(x) if name in _WHOLE else float(x) for name, x in given.items()
        }
        options["lengths"] = None if lengths is None else tuple(map(float, lengths))
        decoder = cls(**options)
        decoder._check()
        decoder._restore(arrays, settings)
        return decoder

    def _restore(self, arrays: dict[str, np.ndarray], settings: dict[str, Any]) -> None:
        """Take over what a file holds, once it is known to fit."""
        labels = [
            tuple(label) if isinstance(label, list) else label for label in settings["classes"]
        ]
        expected, weight, constant = (
            np.asarray(arrays[name], dtype=float) for name in _LEARNED
        )
        n_classes, n_sensors, n_samples = expected.shape
        whole = weight.shape == expected.shape and constant.shape == (n_classes, n_samples)
        if (
            not whole
            or (n_classes, n_samples) != (len(labels), self.window + 2 * self.max_lag)
            or n_sensors < 1
        ):
            raise ValueError(
                f"{len(labels)} classes and window {self.window} do not fit arrays of"
                f" {expected.shape}"
            )
        if (
            not all(np.isfinite(values).all() for values in (expected, weight, constant))
            or (weight <= 0).any()
        ):
            raise ValueError("its numbers are finite and its weights > 0")
        self._check_lengths(n_sensors)
        lags = 2 * self.max_lag // self.lag_step + 1
        find_limits(None).check_bytes(
            2 * self.window * lags * expected[:, :, 0].nbytes, "what it unpacks to"
        )
        self.classes_ = list_classes(labels)
        self.expected_, self.weight_, self.constant_ = expected, weight, constant
        self.n_sensors_, self.correlation_ = int(n_sensors), float(settings["correlation"])
        self._pack()

    def _pack(self) -> None:
        """Views over lags (slot, class · lag, sensor), so that a sample costs a few operations."""
        self.reach_ = _BEYOND * float(np.abs(self.expected_).max())
        lags = np.arange(0, 2 * self.max_lag + 1, self.lag_step)
        at = np.arange(self.window)[:, None] + lags
        shape = (self.window, len(self.classes_) * lags.size, self.n_sensors_)
        self.expected_at_ = self.expected_[:, :, at].transpose(2, 0, 3, 1).reshape(shape)
        self.weight_at_ = self.weight_[:, :, at].transpose(2, 0, 3, 1).reshape(shape)
        self.constant_at_ = self.constant_[:, at].transpose(1, 0, 2).reshape(shape[:2])

    def _check(self) -> None:
        for name, (rule, holds) in _RULES.items():
            if not holds(value := getattr(self, name)) or value == np.inf:
                raise InvalidInput(f"StreamDecoder needs {name} {rule}, got {value}.")
            if value >= _MOST:
                raise InvalidInput(f"StreamDecoder needs {name} below {_MOST:,}, got {value}.")

    def _check_lengths(self, n_sensors: int) -> None:
        """Refuse lengths that are not those of an antenna with so many sensors."""
        if self.lengths is None:
            return
        lengths = np.asarray(self.lengths, dtype=float)
        if lengths.shape != (n_sensors,) or not ((lengths > 0) & (lengths < np.inf)).all():
            raise InvalidInput(
                f"lengths must be {n_sensors} finite numbers > 0 [mm], one for each sensor; got"
                f" {np.array2string(lengths.ravel()[:10], precision=3)}."
            )

    def _cut(self, touch: np.ndarray) -> np.ndarray | None:
        """A touch from ``max_lag`` before its noticed contact, less its resting level.

        None where no contact is noticed.
        """
        if touch.ndim != 2 or not np.isfinite(touch).all():
            raise InvalidInput(
                f"training touches must be (sensor, time) without NaN, got shape {touch.shape}"
                f" with {np.count_nonzero(~np.isfinite(touch))} entries that are not finite."
            )
        finder = OnsetFinder(self.onset, self.confirm, touch.shape[0])
        found = next((k for k in range(touch.shape[1]) if finder.see(touch[:, k])), None)
        if found is None:
            return None
        index = found + np.arange(-self.max_lag, self.window + self.max_lag)
        cut = touch[:, np.clip(index, 0, touch.shape[1] - 1)] - finder.level[:, None]
        if self.lengths is None:
            return cut
        self._check_lengths(len(cut))
        felt = cut[:, self.max_lag : self.max_lag + self.window]
        tip = np.dot(self.lengths, np.sin(np.cumsum(felt, axis=0)))
        return -cut if find_direction(tip) < 0 else cut

    def start(self) -> Stream:
        """A fresh stream of samples to be decoded."""
        self._require()
        return Stream(self)

    def replay(self, values: np.ndarray, time: np.ndarray | None = None) -> list[StreamState]:
        """States after each sample of a recording (sensor, sample); its times are in ms."""
        stream = self.start()
        values = np.asarray(values, dtype=float)
        return [
            stream.update(values[:, k], None if time is None else time[k])
            for k in range(values.shape[1])
        ]

    def decide(self, X: Sequence[np.ndarray], until: float | None = None) -> np.ndarray:
        """Posterior (touch, class) when each touch (sensor, time) has ended, NaN without contact.

        ``until`` ends each touch earlier, and counts from the contact that was noticed [ms].
        """
        self._require()
        last = -1 if until is None else round(until / self.interval)
        found = np.full((len(X), len(self.classes_)), np.nan)
        for row, touch in zip(found, X, strict=True):
            if len(touch) != self.n_sensors_:
                raise InvalidInput(
                    f"the classifier learned touches of {self.n_sensors_} sensors, got"
                    f" {len(touch)}."
                )
            felt = [one for one in self.replay(np.asarray(touch)) if one.since_contact >= 0]
            if felt:
                row[:] = felt[min(last, len(felt) - 1)].posterior
        return found


def _score_log(evidence: np.ndarray, true: np.ndarray, n_classes: int) -> float:
    """Mean log posterior of the true classes of evidence (touch, moment, class · lag)."""
    by_class = logsumexp(evidence.reshape(*evidence.shape[:2], n_classes, -1), axis=3)
    log_posterior = by_class - logsumexp(by_class, axis=2, keepdims=True)
    return float(log_posterior[np.arange(true.size), :, true].mean())
