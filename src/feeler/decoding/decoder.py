"""Streaming decoder: after each sample, a posterior over classes or a "not sure yet".

Evidence adds up in time: after contact, each sample is compared with every class's expected sample
at that moment, ``log p_c ← log p_c − Σ_s (x_s − μ_cs(t))² / (2 σ_cs(t)² τ)``. The moment of contact
is uncertain by a few samples, so each class is held at several lags at once and the lags are summed
out. τ, the correlation time in samples, keeps neighbouring samples, whose errors go together, from
counting as independent witnesses.
"""

import os
from collections.abc import Callable, Hashable, Sequence
from typing import Any

import numpy as np
from scipy.special import logsumexp

from feeler.decoding.labels import Labels
from feeler.decoding.reader import Reader
from feeler.decoding.stream import OnsetFinder, Stream, StreamState
from feeler.decoding.watch import Watch
from feeler.disk.guard import find_limits
from feeler.errors import FeelerError, InvalidInput
from feeler.tensors.models import Model, load_model, save_model
from feeler.tensors.scaling import check_squares

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


class StreamDecoder(Reader):
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

    Attributes
    ----------
    classes_
        Labels, sorted.
    correlation_
        τ in use: ``correlation``, or what ``temper`` found.
    expected_
        (class, sensor, max_lag + window + max_lag) expected samples from ``max_lag`` before contact
        on.
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
        self.classes_, self.n_sensors_ = list(classes), int(n_sensors)
        return self

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
            for touch, label in zip(X, y, strict=True)
        ]
        cut = [(touch, label) for touch, label in found if touch is not None]
        self.classes_ = sorted({label for _, label in cut})
        for touch, _ in cut:
            check_squares(touch, "touches")
        if len(self.classes_) < 2:
            raise InvalidInput(
                "a decoder needs touches of at least 2 classes with contact, got"
                f" {len(self.classes_)}."
            )
        groups = [
            np.stack([touch for touch, label in cut if label == name]) for name in self.classes_
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
        evidence, true = [], []
        for touch, label in zip(X, y, strict=True):
            cut = self._cut(np.asarray(touch, dtype=float))
            if cut is not None and label in self.classes_:
                evidence.append(self._accumulate(cut)[chosen])
                true.append(self.classes_.index(label))
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
        strangers: tuple[Sequence[np.ndarray], Sequence[Hashable]] | None = None,
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
        strangers
            Touches that are not to be known, and what each shares with others.
        """
        self._require()
        values, kept, most = self._cut_all(X)
        shown = None
        if strangers is not None:
            others, felt, _ = self._cut_all(strangers[0])
            shown = others, [strangers[1][k] for k in felt]
        labels, owners = [y[k] for k in kept], [groups[k] for k in kept]
        self.watch_ = Watch(alarm).fit(values, labels, owners, shown, most)
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
        self._require()
        if self.model is not None:
            raise InvalidInput(
                "a decoder with model= holds a function, which no file can. Save the network by"
                " itself."
            )
        parameters = {
            name: value for name, value in self.get_params().items() if name != "model"
        }
        settings = {
            "parameters": parameters,
            "classes": self.classes_,
            "correlation": self.correlation_,
        }
        arrays = {name: getattr(self, f"{name}_") for name in _LEARNED}
        save_model(Model(kind=_KIND, version=_VERSION, arrays=arrays, settings=settings), path)

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
            given: dict[str, Any] = file.settings["parameters"]
            options: dict[str, Any] = {
                name: int(x) if name in _WHOLE else float(x) for name, x in given.items()
            }
            decoder = cls(**options)
            decoder._check()
            decoder._restore(file)
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
        return decoder

    def _restore(self, file: Model) -> None:
        """Take over what a file holds, once it is known to fit."""
        labels = [
            tuple(label) if isinstance(label, list) else label
            for label in file.settings["classes"]
        ]
        expected, weight, constant = (
            np.asarray(file.arrays[name], dtype=float) for name in _LEARNED
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
        lags = 2 * self.max_lag // self.lag_step + 1
        find_limits(None).check_bytes(
            2 * self.window * lags * expected[:, :, 0].nbytes, "what it unpacks to"
        )
        self.classes_ = labels
        self.expected_, self.weight_, self.constant_ = expected, weight, constant
        self.n_sensors_, self.correlation_ = int(n_sensors), float(file.settings["correlation"])
        self._pack()

    def _accumulate(self, cut: np.ndarray) -> np.ndarray:
        """Evidence (window, class · lag) after each sample of a cut touch."""
        seen = cut[:, self.max_lag : self.max_lag + self.window].T
        error = np.einsum(
            "tks,tks->tk", (self.expected_at_ - seen[:, None]) ** 2, self.weight_at_
        )
        return np.cumsum(self.constant_at_ - error, axis=0)

    def _pack(self) -> None:
        """Views over lags (slot, class · lag, sensor), so that a sample costs a few operations."""
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

    def _cut(self, touch: np.ndarray) -> np.ndarray | None:
        """A touch from ``max_lag`` before its noticed contact, less its resting level.

        None where no contact is noticed.
        """
        if touch.ndim != 2 or not np.isfinite(touch).all():
            raise InvalidInput(
                f"training touches are finite (sensor, time), got shape {touch.shape} or NaN in it."
            )
        finder = OnsetFinder(self.onset, self.confirm, touch.shape[0])
        found = next((k for k in range(touch.shape[1]) if finder.see(touch[:, k])), None)
        if found is None:
            return None
        index = found + np.arange(-self.max_lag, self.window + self.max_lag)
        return touch[:, np.clip(index, 0, touch.shape[1] - 1)] - finder.level[:, None]

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
                    f"the reader learned touches of {self.n_sensors_} sensors, got {len(touch)}."
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
