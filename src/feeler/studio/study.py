"""What touches of an antenna at one speed teach, and a decoder that says what is felt meanwhile."""

import base64
import json
import zlib
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib.resources import files
from threading import Event, Lock
from typing import Any

import numpy as np
from scipy.fft import dct, idct
from scipy.stats import qmc

from feeler.analysis import INDICES, compute_nmi, compute_pearson, compute_ssim, find_closest
from feeler.antenna.segments import Antenna
from feeler.decoding.streams import OnsetFinder, Stream
from feeler.encoding import ConvolutiveNMF
from feeler.errors import InvalidInput
from feeler.objects.trials import Trial, trials
from feeler.physics.engine import DEFAULT_ENGINE, ENGINES, choose_timestep
from feeler.physics.run import make_groups, run_group
from feeler.physics.scene import Clock, make_scene
from feeler.presets import make_preset
from feeler.provenance import PHYSICS
from feeler.studio.requests import TouchRequest, make_shape
from feeler.tensors.transforms import rectify, scale_common

# The studio's decoder: which kind of object touches, wherever within a stated range it does
# so.

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
        self.posterior, self.side = np.append(np.full(len(KINDS), 1 / len(KINDS)), 0.0), 0.0
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
    return {
        "shape": [n_templates, n_sensors, n_samples, rank],
        "step": step,
        "data": base64.b64encode(zlib.compress(raw, 9)).decode(),
    }


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


# A study of one antenna at one speed: the paper's thirty touches, how far they spread, bases,
# and a decoder that is trained on touches at random locations.

DURATION, _INTERVAL = 380.0, 1.0  # ms [P]
INDEX_NAMES = {"nmi": compute_nmi, "pearson": compute_pearson, "ssim": compute_ssim}
_ENCODER: dict[str, Any] = {
    "n_components": 3,
    "n_lags": 40,
    "sparseness": 0.8,
    "n_restarts": 1,
    "warn": False,
    "random_state": 0,
}
_ROUNDS, _ITERATIONS = (
    8,
    3,
)  # [C] bases are learned in short stretches, so that learning can be stopped
UNSURE = 0.02
_KEPT = 6  # studies

_Label = tuple[str, float, float]
Trained = tuple[TouchDecoder, Range, dict[str, float]]
"""A decoder, what it was trained on, and its scores on held-out touches."""
_Tell = Callable[[str, float], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class AntennaStudy:
    """What one antenna's touches at one speed have taught.

    Attributes
    ----------
    labels : tuple[Label, ...]
        Kind, size [mm] and location of each touch.
    tensors : np.ndarray
        Angles (trial, sensor, time) [rad].
    similarity : dict[str, np.ndarray]
        By index, (trial, trial).
    peak : float
        Greatest angle of the set [rad].
    decoder : TouchDecoder
        Trained within ``range`` on other touches than these thirty.
    scores : dict[str, float]
        Of the decoder on held-out touches, as :meth:`TouchDecoder.score` gives them.
    """

    antenna: Antenna
    speed: float
    labels: tuple[_Label, ...]
    tensors: np.ndarray
    similarity: dict[str, np.ndarray]
    encoder: ConvolutiveNMF
    peak: float
    decoder: TouchDecoder
    range: Range
    scores: dict[str, float]

    def average(self, index: str) -> float:
        """Mean over the tensors of the index with their closest match."""
        return float(
            find_closest(
                self.similarity[index], greatest=INDICES[index].is_similarity
            ).value.mean()
        )

    def encode(self, angle: np.ndarray) -> np.ndarray:
        """Activations (component, time) of a touch (sensor, time) on the bases of the set, which
        are of touches from the left; one from the right is read as its mirror image.
        """
        side = -1.0 if -angle.min() > angle.max() else 1.0
        return self.encoder.transform(rectify(side * angle)[None], code="ridge")[0]


_kept: OrderedDict[tuple[Antenna, float, float], AntennaStudy] = OrderedDict()
_lock = Lock()


def find_study(antenna: Antenna, speed: float, unsure: float = UNSURE) -> AntennaStudy | None:
    """The study of an antenna at a speed, if it was made."""
    with _lock:
        return _kept.get((antenna, speed, unsure))


def find_trained(antenna: Antenna, speed: float, unsure: float = UNSURE) -> Trained | None:
    """The decoder of an antenna at a speed, if a study has trained it or it comes with feeler."""
    known = find_study(antenna, speed, unsure)
    if known is not None:
        return known.decoder, known.range, known.scores
    return _load_shipped(antenna, speed, unsure)


@lru_cache(maxsize=8)
def _load_shipped(antenna: Antenna, speed: float, unsure: float) -> Trained | None:
    """The decoder that comes with feeler, unless its physics has changed since."""
    text = files("feeler.studio").joinpath("trained.json").read_text(encoding="utf-8")
    for one in json.loads(text):
        about = (make_preset(one["preset"]), one["speed"], one["unsure"], one["physics"])
        if about == (antenna, speed, unsure, PHYSICS):
            return TouchDecoder.from_plain(one), Range.around(speed, unsure), one["scores"]
    return None


def make_study(
    antenna: Antenna, speed: float, tell: _Tell, stop: Event, unsure: float = UNSURE
) -> AntennaStudy:
    """Make a study, or hand out the one that was made; ``tell`` hears what is done and how far it
    is.

    The decoder is trained on touches at random locations, of random sizes and of speeds that differ
    by up to the share ``unsure``; how sure it may be it learns on others of that kind.

    Raises
    ------
    Stopped
        ``stop`` was set.
    """
    found = find_study(antenna, speed, unsure)
    if found is None:
        found = _make(antenna, speed, tell, stop, unsure)
        with _lock:
            _kept[antenna, speed, unsure] = found
            while len(_kept) > _KEPT:
                _kept.popitem(last=False)
    return found


def _make(
    antenna: Antenna, speed: float, tell: _Tell, stop: Event, unsure: float
) -> AntennaStudy:
    thirty = trials([speed])
    labels = tuple((trial.feature.kind, trial.feature.size, trial.location) for trial in thirty)
    angle = _simulate(antenna, thirty, lambda doing, share: tell(doing, 0.05 * share), stop)
    ready = find_trained(antenna, speed, unsure)
    decoder, trained, scores = ready or train(antenna, speed, tell, stop, unsure)
    tell("comparing", 0.65)
    scaled = scale_common(rectify(angle))
    similarity = {name: np.asarray(compute(scaled)) for name, compute in INDEX_NAMES.items()}
    check_cancelled(stop)
    return AntennaStudy(
        antenna=antenna,
        speed=speed,
        labels=labels,
        tensors=angle,
        similarity=similarity,
        encoder=_learn(np.asarray(rectify(angle)), tell, stop),
        peak=float(np.abs(angle).max()),
        decoder=decoder,
        range=trained,
        scores=scores,
    )


def train(
    antenna: Antenna,
    speed: float,
    tell: _Tell,
    stop: Event,
    unsure: float,
    step: float = 0.0,
) -> Trained:
    """A decoder, the range on which it was trained, and its scores on held-out touches.

    ``step`` rounds what it learned before it is calibrated (:meth:`TouchDecoder.coarsen`).

    Raises
    ------
    InvalidInput
        Many of the touches are noticed by no sensor.
    SimulationDivergedError
        One of the touches cannot be computed.
    """
    trained = Range.around(speed, unsure)
    curved = bool(np.any(antenna.rest_angle))  # then left and right are no mirror images
    touches, kinds = trained.draw(N_TEMPLATES + 2 * N_HELD_OUT, 0, both_sides=curved)
    angle = _simulate(antenna, touches, tell, stop)
    tell("training the decoder", 0.6)
    known, held, tested = np.split(
        np.arange(len(kinds)), [N_TEMPLATES, N_TEMPLATES + N_HELD_OUT]
    )
    decoder = TouchDecoder(onset=_ONSET * float(np.abs(angle[known]).max()))
    decoder.fit(angle[known], [kinds[k] for k in known])
    if step:
        decoder.coarsen(step)
    check_cancelled(stop)
    decoder.calibrate(angle[held], [kinds[k] for k in held])
    check_cancelled(stop)
    return decoder, trained, decoder.score(angle[tested], [kinds[k] for k in tested])


def _simulate(antenna: Antenna, touches: list[Trial], tell: _Tell, stop: Event) -> np.ndarray:
    """Angles (trial, sensor, time) of all touches, in lanes, with looks at ``stop`` in between."""
    scenes = [make_scene(antenna, touch) for touch in touches]
    clock = Clock(
        duration=DURATION,
        sample_interval=_INTERVAL,
        timestep=choose_timestep(None, DEFAULT_ENGINE, scenes[0].contact),
    )
    angle = np.empty((len(scenes), antenna.sensors.size, clock.n_samples))
    for done, group in enumerate(groups := make_groups(scenes, ENGINES[DEFAULT_ENGINE])):
        tell("touching", 0.6 * done / len(groups))
        try:
            results = run_group([scenes[i] for i in group], clock, stop=stop)
        except KeyboardInterrupt:
            raise CancelledError from None
        for i, motion in zip(group, results, strict=True):
            if isinstance(motion, Exception):
                raise motion
            angle[i] = motion.angle[:, antenna.sensors - 1].T
    return angle


def _learn(tensors: np.ndarray, tell: _Tell, stop: Event) -> ConvolutiveNMF:
    encoder = ConvolutiveNMF(**_ENCODER, max_iter=_ITERATIONS, n_jobs=-1)
    starts: dict[str, np.ndarray] = {}
    for done in range(_ROUNDS):
        check_cancelled(stop)
        tell("learning bases", 0.7 + 0.3 * done / _ROUNDS)
        encoder.fit(tensors, **starts)
        starts = {"components": encoder.components_, "activations": encoder.activations_}
    return encoder


def check_cancelled(stop: Event) -> None:
    """Raise if cancelled."""
    if stop.is_set():
        raise CancelledError
