"""Streaming decoder: samples in, a posterior over classes out after each one, with a "not sure yet".

Evidence adds up in time: after contact, each sample is compared with every class's expected sample at that moment,
``log p_c ← log p_c − Σ_s (x_s − μ_cs(t))² / (2 σ_cs(t)² τ)``. The moment of contact is uncertain by a few samples, so
each class is held at several lags at once and the lags are summed out. τ, the correlation time in samples, keeps
neighbouring samples, whose errors go together, from counting as independent witnesses.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from sklearn.base import BaseEstimator
from sklearn.utils.validation import check_is_fitted

from feeler.decoding.samples import open_serial, parse_sample, read_samples
from feeler.errors import InvalidInput

__all__ = [
    "EarlyAccuracy",
    "Stream",
    "StreamDecoder",
    "StreamState",
    "measure_early_accuracy",
    "open_serial",
    "parse_sample",
    "read_samples",
]

STATES = ("waiting", "unsure", "decided", "over")
BASELINE = 300.0  # [C] samples over which the resting level is followed while nothing touches
FLOOR = 0.004  # [C] rad; least sd of a reading
MOMENTS = (20, 50, 100, 200, 400, 800, 1500)
SHARPNESS = (0.01, 10.0)  # range of 1/τ that temper searches, relative to the given τ
MAX_READING = 1e6  # [C] rad; the squares of absurd readings overflow
SURPLUS = 50  # samples too many before a faster sender is refused


@dataclass(frozen=True, kw_only=True, eq=False)
class StreamState:
    """What is known after one sample."""

    sample: int
    """Number of the sample's slot on the trained time base."""
    state: str
    """``waiting`` for contact, ``unsure``, ``decided`` (posterior ≥ threshold), or ``over`` (the window is full)."""
    label: tuple | None
    """The most probable class; None before contact."""
    probability: float
    """Its posterior; NaN before contact."""
    since_contact: int
    """Samples since contact was noticed; −1 before."""
    posterior: np.ndarray
    """(class,)."""


class StreamDecoder(BaseEstimator):
    """Posterior over touches while they happen.

    Parameters
    ----------
    window
        Samples after contact that are used.
    threshold
        Posterior at which the answer counts as decided.
    onset, confirm
        Contact is noticed when any sensor leaves its resting level by ``onset`` [rad] for ``confirm`` samples running.
    noise
        Expected mismatch as a share of each class's largest absolute value, beside the spread of the training touches.
    correlation
        τ, samples over which the mismatch stays correlated.
    max_lag, lag_step
        The moment of contact is tried from −max_lag to +max_lag samples.
    interval
        Time between samples [ms].

    Attributes
    ----------
    classes_
        Labels, sorted.
    correlation_
        τ in use: ``correlation``, or what ``temper`` found.
    expected_
        (class, sensor, max_lag + window + max_lag) expected samples from ``max_lag`` before contact on.
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

    def fit(self, X: Sequence[np.ndarray], y: Sequence[tuple]) -> "StreamDecoder":
        """Learn from touches (sensor, time) of any durations that start at rest, with one label each.

        Touches without contact are left out; several touches of one class give its spread.
        """
        self._check()
        if len(X) != len(y) or not len(X):
            raise InvalidInput(f"fit needs one label per touch, got {len(X)} touches and {len(y)} labels.")
        cut = [(self._cut(np.asarray(touch, dtype=float)), label) for touch, label in zip(X, y, strict=True)]
        cut = [(touch, label) for touch, label in cut if touch is not None]
        self.classes_ = sorted({label for _, label in cut})
        if len(self.classes_) < 2:
            raise InvalidInput(f"a decoder needs touches of at least 2 classes with contact, got {len(self.classes_)}.")
        groups = [np.stack([touch for touch, label in cut if label == name]) for name in self.classes_]
        self.expected_ = np.stack([group.mean(axis=0) for group in groups])
        spread = np.stack([group.var(axis=0) for group in groups])
        scale = self.noise * np.abs(self.expected_).max(axis=(1, 2), keepdims=True)
        variance = spread + scale**2 + FLOOR**2
        self.weight_ = 1 / (2 * variance * self.correlation)
        self.constant_ = -0.5 * np.log(variance).sum(axis=1) / self.correlation
        self.n_sensors_ = self.expected_.shape[1]
        self.correlation_ = float(self.correlation)
        self._pack()
        return self

    def temper(self, X: Sequence[np.ndarray], y: Sequence[tuple], moments: Sequence[int] = MOMENTS) -> "StreamDecoder":
        """Set τ so that the posterior is as sure as it is right on other touches, which the fit has not seen.

        Chooses the τ with the greatest mean log posterior of the true classes over ``moments`` (samples after contact).
        Use simulations with drawn mechanics: a decoder tempered on its own training touches would trust itself fully.
        """
        check_is_fitted(self, "expected_at_")
        moments = np.unique(np.clip(moments, 0, self.window - 1))
        evidence, true = [], []
        for touch, label in zip(X, y, strict=True):
            cut = self._cut(np.asarray(touch, dtype=float))
            if cut is not None and label in self.classes_:
                evidence.append(self._accumulate(cut)[moments])
                true.append(self.classes_.index(label))
        if not evidence:
            raise InvalidInput("temper needs touches with contact and with labels that the decoder knows; got none.")
        sharpness = np.geomspace(SHARPNESS[0], SHARPNESS[1], 61)
        scores = [_score_log(np.stack(evidence) * s, np.array(true), len(self.classes_)) for s in sharpness]
        best = sharpness[int(np.argmax(scores))]
        self.correlation_ /= best
        self.weight_at_ *= best
        self.constant_at_ *= best
        return self

    def _accumulate(self, cut: np.ndarray) -> np.ndarray:
        """Evidence (window, class · lag) after each sample of a cut touch."""
        seen = cut[:, self.max_lag : self.max_lag + self.window].T
        error = np.einsum("tks,tks->tk", (self.expected_at_ - seen[:, None]) ** 2, self.weight_at_)
        return np.cumsum(self.constant_at_ - error, axis=0)

    def _pack(self) -> None:
        """Views over lags, so that one sample costs a few array operations: (slot, class · lag, sensor)."""
        lags = np.arange(0, 2 * self.max_lag + 1, self.lag_step)
        at = np.arange(self.window)[:, None] + lags
        shape = (self.window, len(self.classes_) * lags.size, self.n_sensors_)
        self.expected_at_ = self.expected_[:, :, at].transpose(2, 0, 3, 1).reshape(shape)
        self.weight_at_ = self.weight_[:, :, at].transpose(2, 0, 3, 1).reshape(shape)
        self.constant_at_ = self.constant_[:, at].transpose(1, 0, 2).reshape(shape[:2])

    def _check(self) -> None:
        checks = {
            "window ≥ 1": self.window >= 1,
            "0 < threshold ≤ 1": 0 < self.threshold <= 1,
            "onset > 0": self.onset > 0,
            "confirm ≥ 1": self.confirm >= 1,
            "noise ≥ 0": self.noise >= 0,
            "correlation ≥ 1": self.correlation >= 1,
            "0 ≤ max_lag": self.max_lag >= 0,
            "lag_step ≥ 1": self.lag_step >= 1,
            "interval > 0": self.interval > 0,
        }
        wrong = [rule for rule, holds in checks.items() if not holds]
        if wrong:
            raise InvalidInput(f"StreamDecoder needs {wrong[0]}, got {getattr(self, _name(wrong[0]))}.")

    def _cut(self, touch: np.ndarray) -> np.ndarray | None:
        """A touch from ``max_lag`` before its noticed contact, relative to its resting level; None without contact."""
        if touch.ndim != 2 or not np.isfinite(touch).all():
            raise InvalidInput(f"training touches are finite (sensor, time), got shape {touch.shape} or NaN in it.")
        finder = _OnsetFinder(self.onset, self.confirm, touch.shape[0])
        found = next((k for k in range(touch.shape[1]) if finder.see(touch[:, k])), None)
        if found is None:
            return None
        index = found + np.arange(-self.max_lag, self.window + self.max_lag)
        return touch[:, np.clip(index, 0, touch.shape[1] - 1)] - finder.level[:, None]

    def start(self) -> "Stream":
        """A fresh stream of samples to be decoded."""
        check_is_fitted(self, "expected_at_")
        return Stream(self)

    def replay(self, values: np.ndarray, time: np.ndarray | None = None) -> list[StreamState]:
        """States after each sample of a recording (sensor, sample), with its times [ms] if it has any."""
        stream = self.start()
        values = np.asarray(values, dtype=float)
        return [stream.update(values[:, k], None if time is None else time[k]) for k in range(values.shape[1])]


def _score_log(evidence: np.ndarray, true: np.ndarray, n_classes: int) -> float:
    """Mean log posterior of the true classes of evidence (touch, moment, class · lag)."""
    by_class = logsumexp(evidence.reshape(*evidence.shape[:2], n_classes, -1), axis=3)
    log_posterior = by_class - logsumexp(by_class, axis=2, keepdims=True)
    return float(log_posterior[np.arange(true.size), :, true].mean())


def _name(rule: str) -> str:
    return next(word for word in rule.split() if word.replace("_", "").isalpha())


class _OnsetFinder:
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
            self.level[known] += away[known] / min(self.seen, BASELINE)
        return self.running >= self.confirm


class Stream:
    """One stream of samples: keeps the tensor so far and the evidence for each class."""

    def __init__(self, decoder: StreamDecoder) -> None:
        self.decoder = decoder
        self.n_classes = len(decoder.classes_)
        self.tensor = np.full((decoder.n_sensors_, decoder.window), np.nan)
        """(sensor, window) samples since contact, relative to rest; NaN where missing or still to come."""
        self.missed = 0
        """Slots without a sample so far."""
        self.reset()

    def reset(self) -> None:
        """Forget the touch and wait for the next contact."""
        self.finder = _OnsetFinder(self.decoder.onset, self.decoder.confirm, self.decoder.n_sensors_)
        self.evidence = np.zeros(self.decoder.constant_at_.shape[1])
        self.posterior = np.full(self.n_classes, 1 / self.n_classes)
        self.tensor[:] = np.nan
        self.slot, self.contact, self.surplus = -1, -1, 0
        self.first_time: float | None = None

    def update(self, sample: np.ndarray, time: float | None = None) -> StreamState:
        """Take one sample (sensor,) [rad], NaN for a missing channel, and its time [ms] if known.

        With times, late samples leave empty slots (counted in ``missed``) and carry no evidence.

        Raises
        ------
        InvalidInput
            The wrong number of channels, infinite values, time running backwards, or a sender faster than the model.
        """
        sample = np.asarray(sample, dtype=float)
        if sample.shape != (self.decoder.n_sensors_,) or (np.abs(sample) > MAX_READING).any():
            raise InvalidInput(
                f"a sample is {self.decoder.n_sensors_} finite numbers of at most {MAX_READING:g}, got shape {sample.shape}: "
                f"{np.array2string(sample.ravel()[:10], precision=3)}."
            )
        if not self._take_slot(time):
            return self._state()
        if self.contact < 0:
            if not self.finder.see(sample):
                return self._state()
            self.contact = self.slot
        since = self.slot - self.contact
        if since < self.decoder.window:
            self._weigh(sample - self.finder.level, since)
        return self._state()

    def _take_slot(self, time: float | None) -> bool:
        """Move to the slot of this sample; False if the slot is already taken."""
        if time is None:
            self.slot += 1
            return True
        if not np.isfinite(time):
            raise InvalidInput(f"a sample's time must be finite, got {time}.")
        if self.first_time is None:
            self.first_time, self.slot = time, 0
            return True
        slot = round((time - self.first_time) / self.decoder.interval)
        if slot < self.slot - 1:
            raise InvalidInput(f"time runs backwards: slot {self.slot} was followed by a sample at {time:g} ms.")
        if slot <= self.slot:
            self.surplus += 1
            if self.surplus > SURPLUS and self.surplus > 0.25 * (self.slot + 1):
                raise InvalidInput(
                    f"samples come faster than every {self.decoder.interval:g} ms, which the decoder was trained for. "
                    "Thin them out, or train with another interval."
                )
            return False
        self.missed += slot - self.slot - 1
        self.slot = slot
        return True

    def _weigh(self, away: np.ndarray, since: int) -> None:
        self.tensor[:, since] = away
        error = self.decoder.expected_at_[since] - away
        error *= error
        error *= self.decoder.weight_at_[since]
        if np.isnan(away).any():
            np.nan_to_num(error, copy=False)
        self.evidence += self.decoder.constant_at_[since] - error.sum(axis=1)
        likelihood = np.exp(self.evidence - self.evidence.max()).reshape(self.n_classes, -1).sum(axis=1)
        self.posterior = likelihood / likelihood.sum()

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
        sure = "decided" if probability >= self.decoder.threshold else "unsure"
        return StreamState(
            sample=self.slot,
            state="over" if since >= self.decoder.window else sure,
            label=self.decoder.classes_[best],
            probability=probability,
            since_contact=since,
            posterior=self.posterior,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class EarlyAccuracy:
    """Accuracy against time since contact; arrays (moment,)."""

    since_contact: np.ndarray
    """Samples since contact was noticed."""
    accuracy: np.ndarray
    """Share of touches whose most probable class is right."""
    decided: np.ndarray
    """Share of touches that are decided."""
    decided_right: np.ndarray
    """Share right among the decided; NaN where none is."""
    noticed: float
    """Share of touches in which contact was noticed at all."""


def measure_early_accuracy(
    decoder: StreamDecoder, X: Sequence[np.ndarray], y: Sequence[tuple], moments: Sequence[int]
) -> EarlyAccuracy:
    """Replay touches (sensor, time), score the answers at moments after contact; unnoticed touches count as wrong."""
    moments = np.asarray(moments, dtype=int)
    right, decided = np.zeros((len(X), moments.size), bool), np.zeros((len(X), moments.size), bool)
    noticed = 0
    for k, (touch, label) in enumerate(zip(X, y, strict=True)):
        states = [state for state in decoder.replay(touch) if state.since_contact >= 0]
        noticed += bool(states)
        for j, moment in enumerate(moments):
            if states:
                state = states[min(moment, len(states) - 1)]
                right[k, j] = state.label == label
                decided[k, j] = state.probability >= decoder.threshold
    count = decided.sum(axis=0)
    with np.errstate(invalid="ignore"):
        decided_right = np.where(count > 0, (right & decided).sum(axis=0) / count, np.nan)
    return EarlyAccuracy(
        since_contact=moments,
        accuracy=right.mean(axis=0),
        decided=decided.mean(axis=0),
        decided_right=decided_right,
        noticed=noticed / len(X),
    )
