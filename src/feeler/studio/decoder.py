"""The studio's decoder: which kind of object touches, wherever within a stated range it does so.

It learns touches at random locations, of random sizes and at random speeds within a
:class:`Range`. A touch is compared with each of them; one from the right is read as the mirror
image of one from the left. With σ the noise of a reading that the decoder allows for and τ ≥ 1 set
on held-out touches::

    log p_n(t) = −Σ_{s, t' ≤ t} (x_s(t') − μ_ns(t'))² / (2 σ² τ)

and a kind's posterior is its share of Σ p_n. A touch whose closest template is further away than
held-out touches are from theirs is outside what the decoder was trained on.
"""

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.fft import dct, idct
from scipy.stats import qmc

from feeler.decoding.streams import OnsetFinder, Stream
from feeler.errors import InvalidInput
from feeler.objects.trials import Trial
from feeler.studio.requests import TouchRequest, make_shape

KINDS = ("ball", "box", "triangle")
OUTSIDE = "outside"
ANSWERS = (*KINDS, OUTSIDE)
"""What a posterior is over: the kinds, and "outside what this decoder was trained on"."""
NOISE = 0.03  # [C] rad, sd of white noise on each reading; the same for all antennas and speeds
N_TEMPLATES, N_HELD_OUT = 288, 96  # [C] touches; two sets are held out
_ONSET, _CONFIRM = 0.02, 3  # [C] share of the set's peak at which contact is noticed, in a row
_SURE = 0.9
_MOST_CONFIDENTLY_WRONG = 0.02  # [C] share of held-out touches
_SLACK = 1.5  # [C] how much further than held-out touches one may be from its closest template
_UNFELT = 0.1  # [C] share of training touches that no sensor may notice
_CLOSE = 1e-9  # of rounding at the ends of a range


@dataclass(frozen=True, kw_only=True)
class Range:
    """What a decoder is trained on: steady touches of one object, from either side.

    Attributes
    ----------
    location, size, speed : tuple[float, float]
        Least and greatest: fraction of length, radius or half-width [mm], speed [m/s].
    approach, friction : float
        [degrees], and the coefficient of friction.
    """

    location: tuple[float, float] = (0.45, 0.95)
    size: tuple[float, float] = (1.2, 3.5)
    speed: tuple[float, float]
    approach: float = 90.0
    friction: float = 1.0

    @classmethod
    def around(cls, speed: float, unsure: float) -> "Range":
        """The range of a speed that is known to the share ``unsure``."""
        return cls(speed=(speed * (1 - unsure), speed * (1 + unsure)))

    def draw(
        self, n: int, seed: int, both_sides: bool = False
    ) -> tuple[list[Trial], list[str]]:
        """``n`` touches that fill the range evenly, and their kinds in turn."""
        # each kind has a sequence of its own: its turn would otherwise go with a digit of one
        many, each = len(KINDS), -(-n // len(KINDS))
        share = np.stack(
            [qmc.Halton(3, seed=many * seed + k).random(each) for k in range(many)], axis=1
        ).reshape(-1, 3)[:n]
        kinds = [KINDS[k % many] for k in range(n)]
        location, speed = (
            low + (high - low) * share[:, k]
            for k, (low, high) in enumerate((self.location, self.speed))
        )
        size = self.size[0] * (self.size[1] / self.size[0]) ** share[:, 2]
        touches = [
            Trial(
                feature=make_shape(kind, float(size[k])),
                location=float(location[k]),
                speed=float(speed[k]),
                approach=self.approach,
                friction=self.friction,
                side="right" if both_sides and k // many % 2 else "left",
            )
            for k, kind in enumerate(kinds)
        ]
        return touches, kinds

    def find_outside(self, wish: TouchRequest) -> list[str]:
        """What of a touch lies outside the range, in words; none: it lies within."""
        found = []
        if wish.kind not in KINDS:
            found.append(f"a {wish.kind} (trained: {', '.join(KINDS)})")
        for name, unit in (("location", ""), ("size", " mm"), ("speed", " m/s")):
            (low, high), value = getattr(self, name), getattr(wish, name)
            if not low * (1 - _CLOSE) <= value <= high * (1 + _CLOSE):
                trained = f"{low:g}" if low == high else f"{low:.3g} to {high:.3g}"
                found.append(f"{name} {value:.3g}{unit} (trained: {trained})")
        for name, unit in (("approach", "°"), ("friction", "")):
            if getattr(wish, name) != getattr(self, name):
                trained = f"{getattr(self, name):g}{unit}"
                found.append(f"{name} {getattr(wish, name):.3g}{unit} (trained: {trained})")
        if wish.objects:
            found.append(f"{1 + len(wish.objects)} objects (trained: one)")
        return found

    def to_plain(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self)


class TouchDecoder:
    """Posterior over the kinds of object while a touch happens.

    Parameters
    ----------
    onset
        Contact is noticed when any sensor leaves its resting level by this [rad] for three samples
        running.
    noise
        σ [rad].

    Attributes
    ----------
    templates_
        Training touches from contact on, less the resting level, all from one side
        (template, sensor, time) [rad].
    kinds_
        Number of the kind of each template (template,).
    tempering_
        τ.
    limit_
        Greatest distance to the closest template (time,), as a share of the touch's own size, of
        what counts as known.
    """

    threshold, confirm, interval, model = _SURE, _CONFIRM, 1.0, None
    classes_ = ANSWERS

    def __init__(self, onset: float, noise: float = NOISE) -> None:
        self.onset, self.noise, self.tempering_ = onset, noise, 1.0

    def fit(self, touches: np.ndarray, kinds: Sequence[str]) -> "TouchDecoder":
        """Learn touches (touch, sensor, time) [rad]; those without contact are left out.

        Raises
        ------
        InvalidInput
            One in ten, or more, is noticed by no sensor.
        """
        cuts = [self._cut(touch) for touch in touches]
        felt = [(cut, kind) for cut, kind in zip(cuts, kinds, strict=True) if cut is not None]
        missing = len(cuts) - len(felt)
        if missing > _UNFELT * len(cuts) or {kind for _, kind in felt} != set(KINDS):
            raise InvalidInput(
                f"{missing} of {len(cuts)} training touches are not noticed by any sensor, so"
                " nothing can be learned of them. Add sensors, or spread them along the antenna."
            )
        window = min(cut.shape[1] for cut, _ in felt)
        templates = np.array([cut[:, :window] for cut, _ in felt], dtype=np.float32)
        return self.adopt(templates, np.array([KINDS.index(kind) for _, kind in felt]))

    def adopt(self, templates: np.ndarray, kinds: np.ndarray) -> "TouchDecoder":
        """Take over templates; ``calibrate`` then sets doubt and limit anew."""
        self.templates_, self.kinds_ = templates, kinds
        _, self.n_sensors_, self.window = templates.shape
        self.size_ = np.cumsum(np.square(templates, dtype=float).sum(axis=1), axis=1)
        self.constant_at_ = np.zeros((self.window, len(templates)))
        self.tempering_, self.limit_ = 1.0, np.full(self.window, np.inf)
        return self

    def coarsen(self, step: float) -> "TouchDecoder":
        """Round the templates to what :meth:`to_plain` keeps of them."""
        self._packed = _pack_templates(self.templates_, step)
        return self.adopt(_unpack_templates(self._packed), self.kinds_)

    def to_plain(self) -> dict[str, Any]:
        """A coarsened decoder as JSON has it."""
        return {
            "templates": self._packed,
            "kinds": self.kinds_.tolist(),
            "onset": self.onset,
            "noise": self.noise,
            "tempering": self.tempering_,
            "limit": [float(f"{value:.4g}") for value in self.limit_],
        }

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> "TouchDecoder":
        """What :meth:`to_plain` gave."""
        made = cls(plain["onset"], plain["noise"])
        made.adopt(_unpack_templates(plain["templates"]), np.array(plain["kinds"]))
        made.tempering_, made.limit_ = plain["tempering"], np.array(plain["limit"])
        return made

    def calibrate(self, touches: np.ndarray, kinds: Sequence[str]) -> "TouchDecoder":
        """Set τ and the limit of what is known on held-out touches.

        τ is the least with the greatest mean log posterior of the right kinds at the touches' ends
        of those τ ≥ 1 with which at most 2 % are ever confidently wrong.
        """
        held = [
            (cut, KINDS.index(kind))
            for cut, kind in zip(map(self._cut, touches), kinds, strict=True)
            if cut is not None
        ]
        true = np.array([kind for _, kind in held])
        distance = [self._measure(cut) for cut, _ in held]
        ratio = np.full((len(held), self.window), np.nan)
        for k, (cut, _) in enumerate(held):
            near = distance[k].min(axis=0) / self._measure_size(cut)
            ratio[k, : near.size] = near[: self.window]
        self.limit_ = _SLACK * np.maximum.accumulate(np.nanmax(ratio, axis=0)[::-1])[::-1]
        best = -np.inf
        for tempering in np.geomspace(1.0, 1e6, 61):
            kind = [self._weigh_kinds(one / tempering) for one in distance]
            wrong = [
                np.delete(one, label, axis=0).max() >= _SURE
                for one, label in zip(kind, true, strict=True)
            ]
            score = float(
                np.mean([np.log(one[k, -1] + 1e-9) for one, k in zip(kind, true, strict=True)])
            )
            allowed = np.mean(wrong) <= _MOST_CONFIDENTLY_WRONG
            if allowed and score > best:
                best, self.tempering_ = score, float(tempering)
        return self

    def score(
        self, touches: np.ndarray, kinds: Sequence[str], n_draws: int = 4
    ) -> dict[str, float]:
        """Shares of touches (touch, sensor, time) that are classified correctly at their ends, with
        the noise σ on each reading after contact (``noisy``) and without it (``clean``), that are
        ``confidently_wrong`` then, without noise, and that are named ``outside``.
        """
        rng, ends, noisy = np.random.default_rng(0), [], []
        for touch, kind in zip(touches, kinds, strict=True):
            (posterior, noticed), cut = self.decode(touch), self._cut(touch)
            last, label = posterior[-1], KINDS.index(kind)
            right = noticed >= 0 and int(last.argmax()) == label
            ends.append(
                (right, last.max() >= _SURE and not right and last[-1] == 0, last[-1] > 0)
            )
            if cut is None:
                continue
            for _ in range(n_draws):
                felt = cut + self.noise * rng.standard_normal(cut.shape)
                share = self._weigh_kinds(self._measure(felt)[:, -1:] / self.tempering_)
                noisy.append(int(share[:, -1].argmax()) == label)
        clean, wrong, outside = np.mean(ends, axis=0).tolist()
        return {
            "clean": clean,
            "noisy": float(np.mean(noisy)),
            "confidently_wrong": wrong,
            "outside": outside,
            "n": len(ends),
        }

    def decode(self, angle: np.ndarray) -> tuple[np.ndarray, int]:
        """Posterior (time, answer) after each sample of a touch (sensor, time) [rad], and the
        sample at which contact was noticed, or −1.

        The answers are :data:`ANSWERS`; once a touch is outside, it stays so.
        """
        stream, since, rows = self.start(), [], []
        for sample in angle.T:
            since.append(stream.update(sample).since_contact)
            rows.append(stream.posterior)
        return np.array(rows), next((k for k, n in enumerate(since) if n >= 0), -1)

    def start(self) -> "_TouchStream":
        """A stream that takes a sample at a time."""
        return _TouchStream(self)

    def _notice(self, angle: np.ndarray) -> tuple[int, np.ndarray]:
        finder = OnsetFinder(self.onset, _CONFIRM, angle.shape[0])
        for k, sample in enumerate(np.asarray(angle, dtype=float).T):
            if finder.see(sample):
                return k, finder.level
        return -1, finder.level

    def _cut(self, angle: np.ndarray) -> np.ndarray | None:
        """A touch from its noticed contact on, less the resting level, from the left."""
        noticed, level = self._notice(angle)
        return None if noticed < 0 else _face(angle[:, noticed:] - level[:, None])

    def _measure(self, cut: np.ndarray) -> np.ndarray:
        """Squared distance (template, time) to each template so far [rad²]."""
        cut = cut[:, : self.window]
        n = cut.shape[1]
        both = np.einsum("st,nst->nt", cut, self.templates_[:, :, :n], dtype=float)
        own = np.cumsum(np.square(cut).sum(axis=0))
        return np.maximum(self.size_[:, :n] - 2 * np.cumsum(both, axis=1) + own, 0)

    def _measure_size(self, cut: np.ndarray) -> np.ndarray:
        """Squared size (time,) of a touch so far, and of what at rest is no contact [rad²]."""
        own = np.cumsum(np.square(cut[:, : self.window]).sum(axis=0))
        return own + self._measure_rest(np.arange(own.size), len(cut))

    def _measure_rest(self, since: Any, n_sensors: int) -> Any:
        return (since + 1.0) * n_sensors * (self.onset / 3) ** 2

    def _weigh_kinds(self, distance: np.ndarray) -> np.ndarray:
        """Posterior of the kinds (kind, time) from squared distances (template, time) over τ."""
        evidence = -distance / (2 * self.noise**2)
        likelihood = np.exp(evidence - evidence.max(axis=0))
        kinds = np.array([likelihood[self.kinds_ == k].mean(axis=0) for k in range(len(KINDS))])
        return kinds / kinds.sum(axis=0)


class _TouchStream(Stream):
    """One stream of samples for a :class:`TouchDecoder`; missing channels carry no evidence."""

    def reset(self) -> None:
        """Forget the touch and wait for the next contact."""
        super().reset()
        self.side = 0.0
        self.posterior = np.append(np.full(len(KINDS), 1 / len(KINDS)), 0.0)  # outside, last
        self.size, self.outside = 0.0, False

    def _weigh(self, away: np.ndarray, since: int) -> None:
        decoder, known = self.decoder, np.isfinite(away)
        if not known.any():
            return
        self.side = self.side or _find_side(away)
        apart = decoder.templates_[:, known, since] - self.side * away[known]
        self.evidence += np.square(apart, dtype=float).sum(axis=1)  # squared distance
        self.size += float(np.square(away[known]).sum())
        rest = decoder._measure_rest(since, decoder.n_sensors_)
        near = self.evidence.min() / (self.size + rest)
        self.outside = self.outside or bool(near > decoder.limit_[since])
        shares = decoder._weigh_kinds(self.evidence[:, None] / decoder.tempering_)[:, 0]
        self.posterior = np.append(shares * (not self.outside), float(self.outside))


def _pack_templates(expected: np.ndarray, step: float) -> dict[str, Any]:
    """What a decoder expects (template, sensor, time) in few bytes: cosines in time of few patterns
    over the sensors, rounded to multiples of ``step``.

    The patterns are principal components and both transforms keep lengths, so
    an expected value is off by less than ``step / 3`` (root mean square).
    """
    n_templates, n_sensors, n_samples = expected.shape
    flat = np.moveaxis(expected, 1, 0).reshape(n_sensors, -1).astype(float)
    shares = np.linalg.eigh(flat @ flat.T)[1][:, ::-1]
    cosines = dct((shares.T @ flat).reshape(-1, n_templates, n_samples), norm="ortho", axis=2)
    step = max(step, float(np.abs(cosines).max()) / 32767)  # whole numbers of 16 bits
    rounded = np.rint(cosines / step)
    rank = int(np.flatnonzero(rounded.any(axis=(1, 2))).max(initial=0)) + 1
    whole = [np.rint(32767 * shares.T[:rank]), rounded[:rank]]
    raw = np.concatenate([part.ravel() for part in whole]).astype("<i2").tobytes()
    data = base64.b64encode(zlib.compress(raw, 9)).decode()
    return {"shape": [n_templates, n_sensors, n_samples, rank], "step": step, "data": data}


def _unpack_templates(packed: Mapping[str, Any]) -> np.ndarray:
    """Templates (template, sensor, time) that were packed."""
    n_templates, n_sensors, n_samples, rank = packed["shape"]
    raw = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), "<i2")
    shares, rounded = np.split(raw.astype(float), [rank * n_sensors])
    cosines = packed["step"] * rounded.reshape(rank, n_templates, n_samples)
    series = idct(cosines, norm="ortho", axis=2)
    patterns = shares.reshape(rank, n_sensors) / 32767
    return np.einsum("ms,mnt->nst", patterns, series, optimize=True).astype(np.float32)


def _find_side(away: np.ndarray) -> float:
    """−1 where the sensor that bends most bends the other way, else 1."""
    return -1.0 if away[np.nanargmax(np.abs(away))] < 0 else 1.0


def _face(away: np.ndarray) -> np.ndarray:
    """A touch from contact on (sensor, time) as one from the left."""
    return _find_side(away[:, 0]) * away
