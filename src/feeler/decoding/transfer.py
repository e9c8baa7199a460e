"""Transfer from simulation to hardware: learn noisy simulations, name recordings.

The recipe of the paper (Methods, tactile feature classification from simulation to reality): align
on the first positive peak of the tip trace, copy each simulated tensor ten times with Gaussian
noise of 20 % of its maximum, train a one-versus-one support vector machine over all classes, test
on recordings.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks
from scipy.special import log_softmax, softmax
from scipy.stats import binomtest
from sklearn.svm import SVC

from feeler.analysis.indices import check_tensors
from feeler.decoding.classifiers import (
    NO_CONTACT,
    Classifier,
    Labels,
    compute_decision_scores,
    number_labels,
    read_labels,
    sort_classes,
)
from feeler.errors import InvalidInput
from feeler.tensors.transforms import find_scale

# [C] samples kept before and after the peak; a slow touch of the tip lasts about 1400 ms
BEFORE, AFTER = 1500, 400
# [C] share of the trace's maximum that a peak must rise; ripples while sliding are smaller
_PROMINENCE = 0.2
MIN_DEFLECTION = 1.0  # [C] mm; below it the tip has not been moved by a touch
_N_COPIES = 10  # [P]
_NOISE = 0.2  # [P] sd as a share of each tensor's maximum
TEMPERATURES = np.geomspace(0.01, 10.0, 121)
LABEL_PARTS = ("feature", "location", "speed")


def find_first_peak(
    tip: np.ndarray, *, prominence: float = _PROMINENCE, min_deflection: float = MIN_DEFLECTION
) -> int:
    """Sample of the first positive peak of a tip trace (time,) [mm] from rest; −1 for none."""
    top = np.max(tip, initial=-np.inf, where=np.isfinite(tip))
    if not top >= min_deflection:
        return -1
    peaks, _ = find_peaks(tip, height=min_deflection, prominence=prominence * top)
    return int(peaks[0]) if peaks.size else -1


def find_direction(tip: np.ndarray) -> int:
    """The way that a touch pushes the tip, given its trace (time,) [mm] from rest: 1, or −1 for an
    object from the other side than at the training touches; 0 for no motion.

    The sign of the first deflection that is more than half of the greatest: an antenna swings back
    by up to as much, but later.
    """
    size = np.abs(np.nan_to_num(tip))
    first = int(np.argmax(size > 0.5 * size.max(initial=0.0))) if size.any() else None
    return 0 if first is None else int(np.sign(tip[first]))


def align(
    angle: Sequence[np.ndarray],
    tip: Sequence[np.ndarray],
    *,
    before: int = BEFORE,
    after: int = AFTER,
    prominence: float = _PROMINENCE,
    min_deflection: float = MIN_DEFLECTION,
    peaks: Sequence[int] | None = None,
) -> np.ndarray:
    """Cut touches of any durations to one window around their tips' first peaks.

    Beyond a recording's ends its first and last samples go on: before contact the antenna is at
    rest.

    Parameters
    ----------
    angle, tip
        Angles (sensor, time) [rad] of each touch, and the trace (time,) [mm] of its tip from rest.
    before, after
        Samples kept before and after the peak.
    prominence, min_deflection
        A peak is at least ``min_deflection`` [mm] high, and its prominence is at least that share
        of the trace's maximum.
    peaks
        Sample of each touch to align on, −1 for no contact; default: the peaks that are found.

    Returns
    -------
    np.ndarray
        (trial, sensor, before + after) [rad]; NaN in trials without contact.
    """
    if len(angle) != len(tip) or not len(angle):
        raise InvalidInput(
            f"align needs one tip trace per touch, got {len(angle)} touches and {len(tip)} traces."
        )
    if before < 0 or after < 1:
        raise InvalidInput(
            f"the window needs before ≥ 0 and after ≥ 1 samples, got {before} and {after}."
        )
    values = np.full((len(angle), np.shape(angle[0])[0], before + after), np.nan)
    for k, (touch, trace) in enumerate(zip(angle, tip, strict=True)):
        touch, trace = np.asarray(touch, dtype=float), np.asarray(trace, dtype=float)
        if (
            touch.ndim != 2
            or touch.shape[0] != values.shape[1]
            or trace.shape != touch.shape[1:]
        ):
            raise InvalidInput(
                f"touch {k} has shape {touch.shape} and its tip trace {trace.shape}; expected "
                f"({values.shape[1]} sensors, time) and (time,)."
            )
        peak = find_first_peak(trace, prominence=prominence, min_deflection=min_deflection)
        peak = peak if peaks is None else peaks[k]
        if peak >= 0:
            index = np.arange(peak - before, peak + after)
            values[k] = touch[:, np.clip(index, 0, touch.shape[1] - 1)]
    return values


class TransferClassifier(Classifier):
    """One-versus-one linear support vector machine on noisy copies of aligned tensors.

    Parameters
    ----------
    n_copies, noise
        Copies of each training tensor and their noise as a share of its maximum (10 and 20 % in the
        paper).
    C
        Penalty of the support vector machine; the kernel is linear. Neither is stated in the paper
        [C].
    random_state
        Seed of the noise.

    Attributes
    ----------
    classes_
        Labels (feature, location, speed), sorted.
    temperature_
        T of the probabilities: 1, or what ``temper`` found.
    """

    def __init__(
        self,
        n_copies: int = _N_COPIES,
        noise: float = _NOISE,
        C: float = 1.0,
        random_state: int = 0,
    ) -> None:
        self.n_copies = n_copies
        self.noise = noise
        self.C = C
        self.random_state = random_state

    def fit(self, X: np.ndarray, y: Labels) -> "TransferClassifier":
        """Train on tensors (trial, sensor, time); several of them may share a label."""
        self._keep(X, y)
        X = check_tensors(X, least=1)
        labels = read_labels(y)
        self.classes_ = sort_classes(labels)
        number = number_labels(labels, self.classes_)
        unit = find_scale(X)  # single precision spans fewer decades
        # copies (trial · n_copies, sensor, time) in Gaussian noise, and whose copy each is
        if self.n_copies < 1 or not (np.isfinite(self.noise) and self.noise >= 0):
            raise InvalidInput(
                f"noisy copies need n_copies ≥ 1 and noise ≥ 0, got {self.n_copies} and"
                f" {self.noise}."
            )
        index = np.repeat(np.arange(len(X)), self.n_copies)
        scale = self.noise * np.abs(X / unit).max(axis=(1, 2))
        # single precision: the noise is a fifth of the signal, and this is half of the time
        rng = np.random.default_rng(self.random_state)
        copies = rng.standard_normal((index.size, *X.shape[1:]), dtype=np.float32)
        copies *= scale[index, None, None].astype(np.float32)
        copies += (X / unit)[index].astype(np.float32)
        self.scale_ = float(np.abs(X).max()) or 1.0
        self.copies_ = copies.reshape(len(copies), -1) / (self.scale_ / unit)
        self.svm_ = SVC(kernel="precomputed", C=self.C, decision_function_shape="ovr")
        self.svm_.fit(self.copies_ @ self.copies_.T, number[index])
        self.temperature_ = 1.0
        return self

    def temper(self, X: np.ndarray, y: Sequence[tuple]) -> "TransferClassifier":
        """Set the temperature of ``predict_proba`` on unseen tensors (arXiv:1706.04599).

        Chooses the T with the greatest mean log probability of the true classes; ones without
        contact are left out.
        """
        votes, known = self.decide(X), self.classes_.tolist()
        seen = [
            k for k, label in enumerate(y) if label in known and np.isfinite(votes[k]).all()
        ]
        if len(y) != len(votes) or not seen:
            raise InvalidInput(
                "temper needs touches with contact and labels that the classifier knows; got none."
            )
        true = number_labels([y[k] for k in seen], self.classes_)
        self.temperature_ = find_temperature(votes[seen], true)
        return self

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        """``softmax(votes / T)``: call ``temper`` first, T is 1 else."""
        return softmax(scores / self.temperature_, axis=1)

    def _decide(self, X: np.ndarray) -> np.ndarray:
        """Votes (trial, class) of all pairs, ties broken by their margins; NaN without contact."""
        X = np.asarray(X, dtype=float)
        votes = np.full((len(X), len(self.classes_)), np.nan)
        touched = np.isfinite(X).all(axis=(1, 2))
        if touched.any():
            kernel = X[touched].reshape(touched.sum(), -1) / self.scale_ @ self.copies_.T
            votes[touched] = compute_decision_scores(self.svm_.decision_function(kernel))
        return votes

    def predict_top(self, X: np.ndarray, k: int = 2) -> list[list[tuple]]:
        """The ``k`` best labels of each tensor, best first; else ``NO_CONTACT`` alone."""
        ranked = []
        for votes in self.decide(X):
            order = np.argsort(-votes, kind="stable")[:k]
            ranked.append(
                [NO_CONTACT] if np.isnan(votes).any() else [self.classes_[i] for i in order]
            )
        return ranked


def find_temperature(scores: np.ndarray, true: np.ndarray) -> float:
    """The T with the greatest mean log probability of the true classes."""
    chosen = np.arange(true.size), true
    fits = [log_softmax(scores / t, axis=1)[chosen].mean() for t in TEMPERATURES]
    return float(TEMPERATURES[int(np.argmax(fits))])


@dataclass(frozen=True, kw_only=True, eq=False)
class TransferScore:
    """How well recordings were read; every share comes with its 95 % Wilson interval.

    Attributes
    ----------
    correct : dict[str, int]
        Right answers: ``all`` parts of a label together, each part by itself, and ``top2``.
    """

    correct: dict[str, int]
    total: int
    predicted: list[tuple]
    true: list[tuple]

    def share(self, what: str = "all") -> tuple[float, float, float]:
        """Share right, and the ends of its interval."""
        if what not in self.correct:
            raise InvalidInput(f"unknown score {what!r}; valid: {', '.join(self.correct)}.")
        found = binomtest(self.correct[what], self.total)
        return (found.statistic, *found.proportion_ci(0.95, method="wilson"))

    def confusion(self, classes: Sequence[tuple]) -> np.ndarray:
        """Counts (true class, predicted class), with one more column for no contact."""
        place = {label: i for i, label in enumerate(classes)}
        counts = np.zeros((len(classes), len(classes) + 1), dtype=int)
        for true, predicted in zip(self.true, self.predicted, strict=True):
            counts[place[true], place.get(predicted, len(classes))] += 1
        return counts


def score_transfer(
    classifier: TransferClassifier, X: np.ndarray, true: Sequence[tuple]
) -> TransferScore:
    """Score predictions for tensors: all parts together, each by itself, and top-2."""
    if len(X) != len(true) or not len(true):
        raise InvalidInput(
            f"one true label per tensor is needed, got {len(X)} tensors and {len(true)} labels."
        )
    ranked = classifier.predict_top(X, 2)
    predicted = [best[0] for best in ranked]
    pairs = list(zip(true, predicted, strict=True))
    correct = {"all": sum(t == p for t, p in pairs)}
    correct |= {part: sum(t[i] == p[i] for t, p in pairs) for i, part in enumerate(LABEL_PARTS)}
    correct["top2"] = sum(t in best for t, best in zip(true, ranked, strict=True))
    return TransferScore(correct=correct, total=len(true), predicted=predicted, true=list(true))
