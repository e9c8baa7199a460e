"""Readers of spikes: by counts, by first spikes, and the ideal observer of Poisson trains."""

from typing import Any

import numpy as np
from scipy.special import logsumexp, softmax

from feeler.decoding.classifiers import make_lda
from feeler.decoding.labels import Labels
from feeler.decoding.reader import Reader, count_until
from feeler.decoding.told import warn_of_copies
from feeler.dispersion.index import check_tensors
from feeler.errors import InvalidInput
from feeler.records.registry import Registry

SPIKE_CODES: Registry[Any] = Registry("code of spikes")
"""What a brain might look at: ``code(raster, width)`` turns counts (trial, unit, time) into a table
(trial, entry); ``SPIKE_CODES.register(name, code)`` adds one.
"""


@SPIKE_CODES.register("counts")
def _sum_windows(raster: np.ndarray, width: int) -> np.ndarray:
    """Spikes of each unit in windows of ``width`` samples, the last one as long as it is."""
    starts = np.arange(0, raster.shape[2], width)
    return np.add.reduceat(raster, starts, axis=2).reshape(len(raster), -1)


@SPIKE_CODES.register("first")
def _find_first(raster: np.ndarray, width: int = 1) -> np.ndarray:
    """Sample of each unit's first spike, in steps of ``width``; a silent unit's is the end."""
    fired = raster > 0
    first = np.where(fired.any(axis=2), fired.argmax(axis=2), raster.shape[2])
    return first // width


@SPIKE_CODES.register("latency")
def _find_latency(raster: np.ndarray, width: int = 1) -> np.ndarray:
    """The same since the first spike of all units, for who is not told when contact began."""
    first = _find_first(raster)
    return (first - first.min(axis=1, keepdims=True)) // width


@SPIKE_CODES.register("onset")
def _find_onset(raster: np.ndarray, width: int = 1) -> np.ndarray:
    """The first spike of all units alone (trial, 1)."""
    return _find_first(raster, width).min(axis=1, keepdims=True)


class SpikeReader(Reader):
    """Reads one code of a raster by principal components and linear discriminant analysis.

    Parameters
    ----------
    code
        ``counts``, ``first``, ``latency``, ``onset``, or another of :data:`SPIKE_CODES`.
    width
        Samples taken together.
    n_components
        Principal components of the code that are kept.

    Attributes
    ----------
    classes_
        Labels, sorted.
    reader_
        The fitted classifier of codes.
    """

    def __init__(self, code: str = "counts", width: int = 10, n_components: int = 30) -> None:
        self.code = code
        self.width = width
        self.n_components = n_components

    def fit(self, X: Any, y: Labels) -> "SpikeReader":
        """Learn from rasters (trial, unit, time), as :func:`count_spikes` gives them."""
        if self.width < 1:
            raise InvalidInput(f"width must be at least 1 sample, got {self.width}.")
        codes = SPIKE_CODES[self.code](_check_rasters(X), self.width).astype(float)
        if not np.ptp(codes, axis=0).any():
            raise InvalidInput(
                f"all training trials have the same code {self.code!r}, as where no unit fires:"
                " nothing to learn. Raise the gain, or give a later deadline."
            )
        self._keep(X, y)
        fewest = min(self.n_components, len(codes) - 1, codes.shape[1])
        self.reader_ = make_lda(fewest).fit(codes, y)
        self.classes_ = self.reader_.classes_
        return self

    def _decide(self, X: Any) -> np.ndarray:
        codes = SPIKE_CODES[self.code](_check_rasters(X), self.width).astype(float)
        return self.reader_.predict_proba(codes)


class PoissonReader(Reader):
    """Knows the rates of every touch: no reader of the same Poisson trains does better.

    The touches r_c(unit, t) that it was fitted on are equally likely. Of counts n in steps Δt,
    ln p(n | c) = Σ n ln(r_c Δt) − Σ r_c Δt, up to what all touches share; a spike where r_c = 0
    excludes that touch. A class's probability is the sum over its touches. Of trains that are more
    regular than Poisson it is a reader like others.

    Parameters
    ----------
    step
        Δt [ms].
    floor
        Rate [Hz] added to all known rates, as of spontaneous spikes; above 0 where other touches
        than the known ones will be met.

    Attributes
    ----------
    classes_
        Labels, sorted.
    known_
        Expected spikes of the known touches (touch, unit, time).
    """

    def __init__(self, step: float = 1.0, floor: float = 0.0) -> None:
        self.step = step
        self.floor = floor

    def fit(self, X: Any, y: Labels) -> "PoissonReader":
        """Know rates (trial, unit, time) [Hz], one label each.

        Warns where several of one label look like drawn spikes: of these it is not ideal.
        """
        rates = _check_rasters(X)
        if len(rates) != len(y) or len({*y}) < 2:
            raise InvalidInput(f"{len(rates)} touches, {len(y)} labels; give one each, of two.")
        if not (self.step > 0 and self.floor >= 0):
            raise InvalidInput(
                f"step must be > 0 ms and floor ≥ 0, got {self.step}, {self.floor}."
            )
        warn_of_copies(self, rates, y, everywhere=False)
        self.known_ = (rates + self.floor) * self.step * 1e-3
        self.shape_ = rates.shape[1:]
        self.classes_ = sorted({*y})
        self.members_ = np.array([[label == name for name in self.classes_] for label in y])
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Log-likelihoods (trial, class), up to what all share; −inf where a class is excluded."""
        self._require(X)
        end = None if until is None else count_until(X, until)
        found = _weigh_rates(_check_rasters(X)[:, :, :end], self.known_[:, :, :end])
        with np.errstate(divide="ignore"):
            weights = np.log(self.members_.T.astype(float))
            return logsumexp(found[:, None, :] + weights, axis=2)

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        """Probabilities; NaN for a train that no known touch can give."""
        excluded = np.isneginf(scores).all(axis=1, keepdims=True)
        return np.where(excluded, np.nan, softmax(np.nan_to_num(scores), axis=1))


def _weigh_rates(counts: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Log-likelihoods (trial, touch) of counts (trial, …), given what each touch is expected to
    give (touch, …), up to what all touches share.
    """
    met = counts.reshape(len(counts), -1).astype(float)
    known = expected.reshape(len(expected), -1)
    used = met.any(axis=0)
    silent = known[:, used] == 0
    logs = np.log(np.where(silent, 1.0, known[:, used]))
    found = met[:, used] @ logs.T - known.sum(axis=1)
    found[met[:, used] @ silent.T.astype(float) > 0] = -np.inf
    return found


def _check_rasters(X: Any) -> np.ndarray:
    """Counts or rates (trial, unit, time), none negative."""
    values = check_tensors(X, least=1)
    if np.any(values < 0):
        raise InvalidInput("counts and rates of spikes must be ≥ 0.")
    return values
