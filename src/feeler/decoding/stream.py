"""One touch as it happens: a sample in, what is known so far out."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput

_MAX_READING = 1e6  # [C] rad; the squares of absurd readings overflow
_SURPLUS = 50  # samples too many before a faster sender is refused
_RECENT = 101  # [C] intervals between samples whose median is what a sender usually leaves
_SLOW = 1.25  # [C] usual interval over the trained one, from which on the sender is slower
_SLOWEST = 10.0  # [C] ms between samples, over which the time between is not filled in


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
        before that, and where the decoder learned no ``watch``.
    """

    sample: int
    state: str
    label: tuple | None
    probability: float
    since_contact: int
    posterior: np.ndarray
    strangeness: float = float("nan")

    @property
    def strange(self) -> bool:
        """Whether the touch is so far unlike all that were learned."""
        return self.strangeness > 1


class Stream:
    """One stream of samples: keeps the tensor so far and the evidence for each class."""

    def __init__(self, decoder: Any) -> None:
        self.decoder = decoder
        self.n_classes = len(decoder.classes_)
        self.tensor = np.full((decoder.n_sensors_, decoder.window), np.nan)
        """Samples (sensor, window) since contact, relative to rest; NaN where missing."""
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
                    " for. Thin them out, or train with another interval."
                )
            return []
        usual = float(np.median(self._steps))
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
        self.tensor[:, since], self.felt = away, since
        self._ask_watch(before)
        if self._watched:
            return
        if self.decoder.model is not None:
            self.posterior = self._ask(self.decoder.model)
            return
        error = self.decoder.expected_at_[since] - away
        error *= error
        error *= self.decoder.weight_at_[since]
        if np.isnan(away).any():
            np.nan_to_num(error, copy=False)
        self.evidence += self.decoder.constant_at_[since] - error.sum(axis=1)
        likelihood = (
            np.exp(self.evidence - self.evidence.max()).reshape(self.n_classes, -1).sum(axis=1)
        )
        self.posterior = likelihood / likelihood.sum()

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
        sure = "decided" if probability >= self.decoder.threshold else "unsure"
        return StreamState(
            sample=self.slot,
            state="over" if since >= self.decoder.window else sure,
            label=self.decoder.classes_[best],
            probability=probability,
            since_contact=since,
            posterior=self.posterior,
            strangeness=self.strangeness,
        )


def measure_early_accuracy(
    decoder: Any, X: Sequence[np.ndarray], y: Sequence[tuple], moments: Sequence[int]
) -> xr.Dataset:
    """Replay touches and score the answers at moments after contact.

    Parameters
    ----------
    decoder
        A fitted ``StreamDecoder``.
    X, y
        Touches (sensor, time) of any durations, with one label each.
    moments
        Samples since contact was noticed.

    Returns
    -------
    xarray.Dataset
        By moment (since_contact): ``accuracy``, the share of touches whose most probable class is
        right; ``decided``, the share that is decided; ``decided_right``, the share right among
        those, NaN where none is. And ``noticed``, the share of touches in which contact was noticed
        at all; the others count as wrong.
    """
    at = np.asarray(moments, dtype=int)
    right, decided = np.zeros((2, len(X), at.size), dtype=bool)
    noticed = 0
    for k, (touch, label) in enumerate(zip(X, y, strict=True)):
        states = [state for state in decoder.replay(touch) if state.since_contact >= 0]
        noticed += bool(states)
        for j, moment in enumerate(at):
            if states:
                state = states[min(moment, len(states) - 1)]
                right[k, j] = state.label == label
                decided[k, j] = state.probability >= decoder.threshold
    count = decided.sum(axis=0)
    with np.errstate(invalid="ignore"):
        decided_right = np.where(count > 0, (right & decided).sum(axis=0) / count, np.nan)
    found = {
        "accuracy": right.mean(axis=0),
        "decided": decided.mean(axis=0),
        "decided_right": decided_right,
    }
    return xr.Dataset(
        {name: ("since_contact", values) for name, values in found.items()}
        | {"noticed": noticed / len(X)},
        {"since_contact": at},
    )
