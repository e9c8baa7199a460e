"""A study of one antenna at one speed: the paper's thirty touches, how far they spread, bases, and
a decoder.
"""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event, Lock
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.decoding.decoder import StreamDecoder
from feeler.dispersion import INDICES, compute_nmi, compute_pearson, compute_ssim, find_closest
from feeler.encoding import ConvolutiveNMF
from feeler.errors import InvalidInput
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep, get_engine
from feeler.physics.run import make_groups, run_group
from feeler.physics.scene import make_scene
from feeler.stimulus.ninety import trials
from feeler.stimulus.trial import Trial
from feeler.task.nuisances import Nuisances
from feeler.tensors.scaling import rectify, scale_common

_DURATION, _INTERVAL = 380.0, 1.0  # ms [P]
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
# the decoder reads angles scaled so that the set's peak is this; its floor of 0.004 then is 2 % of
# it [C]
LOUDNESS = 0.2
_CORRELATION = 500.0  # samples; tempering searches from a tenth to a hundred times this
_ONSET = 0.02  # [C] share of the set's peak at which contact is noticed
# [C] half-widths by which place and speed of other touches differ, relative to length and speed
_SHIFT = 0.02
UNSURE = 0.02
_KEPT = 6  # studies

_Label = tuple[str, float, float]
_Tell = Callable[[str, float], None]


class Stopped(Exception):
    """The study was asked to end."""


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
        Greatest angle of the set [rad]; the decoder takes readings to be off by 2 % of it, for all
        classes alike.
    """

    antenna: Antenna
    speed: float
    labels: tuple[_Label, ...]
    tensors: np.ndarray
    similarity: dict[str, np.ndarray]
    encoder: ConvolutiveNMF
    decoder: StreamDecoder
    peak: float

    @property
    def loudness(self) -> float:
        """What the decoder's readings are multiplied by."""
        return LOUDNESS / self.peak

    def average(self, index: str) -> float:
        """Mean over the tensors of the index with their closest match."""
        return float(
            find_closest(
                self.similarity[index], greatest=INDICES[index].is_similarity
            ).value.mean()
        )

    def encode(self, angle: np.ndarray) -> np.ndarray:
        """Activations (component, time) of a touch (sensor, time) on the bases of the set."""
        return self.encoder.transform(rectify(angle)[None], code="ridge")[0]

    def decode(self, angle: np.ndarray, stop: Event) -> tuple[np.ndarray, int]:
        """Posterior (time, class) after each sample of a touch, and the sample at which contact was
        noticed, or −1.
        """
        stream, posterior, noticed = self.decoder.start(), [], -1
        order = [self.decoder.classes_.index(label) for label in self.labels]
        for k, sample in enumerate(self.loudness * np.asarray(angle, dtype=float).T):
            heed(stop)
            state = stream.update(sample)
            if noticed < 0 and state.since_contact >= 0:
                noticed = k
            posterior.append(state.posterior[order])
        return np.array(posterior), noticed


_kept: OrderedDict[tuple[Antenna, float, float], AntennaStudy] = OrderedDict()
_lock = Lock()


def find_study(antenna: Antenna, speed: float, unsure: float = UNSURE) -> AntennaStudy | None:
    """The study of an antenna at a speed, if it was made."""
    with _lock:
        return _kept.get((antenna, speed, unsure))


def make_study(
    antenna: Antenna, speed: float, tell: _Tell, stop: Event, unsure: float = UNSURE
) -> AntennaStudy:
    """Make a study, or hand out the one that was made; ``tell`` hears what is done and how far it
    is.

    The decoder knows the touches at their places and at this speed; how sure it may be it learns on
    other touches, whose places differ by up to 2 % of the length and whose speeds by up to the
    share ``unsure``.

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
    labels, angle, decoder, peak = teach(antenna, speed, tell, stop, unsure)
    tell("comparing", 0.65)
    scaled = scale_common(rectify(angle))
    similarity = {name: np.asarray(compute(scaled)) for name, compute in INDEX_NAMES.items()}
    heed(stop)
    return AntennaStudy(
        antenna=antenna,
        speed=speed,
        labels=labels,
        tensors=angle,
        similarity=similarity,
        encoder=_learn(np.asarray(rectify(angle)), tell, stop),
        decoder=decoder,
        peak=peak,
    )


def teach(
    antenna: Antenna, speed: float, tell: _Tell, stop: Event, unsure: float
) -> tuple[tuple[_Label, ...], np.ndarray, StreamDecoder, float]:
    """Labels and angles (trial, sensor, time) of the thirty touches, the decoder that they taught,
    and their greatest angle [rad].

    Raises
    ------
    InvalidInput
        Some of the touches are noticed by no sensor.
    SimulationDiverged
        One of the touches cannot be computed.
    """
    nominal = trials([speed])
    jittered = Nuisances.only(location=_SHIFT, speed=unsure).jitter(
        nominal, np.random.default_rng(0)
    )
    motions = _simulate(antenna, [*nominal, *jittered], tell, stop)
    angle, others = motions[: len(nominal)], motions[len(nominal) :]
    labels = tuple(
        (trial.feature.kind, trial.feature.size, trial.location) for trial in nominal
    )
    tell("teaching the decoder", 0.6)
    peak = float(np.abs(angle).max())
    options = {
        "window": angle.shape[2],
        "onset": LOUDNESS * _ONSET,
        "max_lag": 4,
        "lag_step": 2,
        "interval": _INTERVAL,
    }
    decoder = StreamDecoder(**options, noise=0.0, correlation=_CORRELATION).fit(
        list(LOUDNESS / peak * angle), labels
    )
    if missing := len(labels) - len(decoder.classes_):
        raise InvalidInput(
            f"{missing} of the thirty touches are not noticed by any sensor, so nothing can be"
            " learned of them. Add sensors, or spread them along the antenna."
        )
    heed(stop)
    decoder.temper(list(LOUDNESS / peak * others), labels)
    return labels, angle, decoder, peak


def _simulate(antenna: Antenna, touches: list[Trial], tell: _Tell, stop: Event) -> np.ndarray:
    """Angles (trial, sensor, time) of all touches, in lanes, with looks at ``stop`` in between."""
    scenes = [make_scene(antenna, touch) for touch in touches]
    clock = Clock(
        duration=_DURATION,
        sample_interval=_INTERVAL,
        timestep=choose_timestep(None, DEFAULT_ENGINE, scenes[0].contact),
    )
    angle = np.empty((len(scenes), antenna.sensors.size, clock.n_samples))
    for done, group in enumerate(groups := make_groups(scenes, get_engine(DEFAULT_ENGINE))):
        tell("touching", 0.6 * done / len(groups))
        try:
            results = run_group([scenes[i] for i in group], clock, stop=stop)
        except KeyboardInterrupt:
            raise Stopped from None
        for i, motion in zip(group, results, strict=True):
            if isinstance(motion, Exception):
                raise motion
            angle[i] = motion.angle[:, antenna.sensors - 1].T
    return angle


def _learn(tensors: np.ndarray, tell: _Tell, stop: Event) -> ConvolutiveNMF:
    encoder = ConvolutiveNMF(**_ENCODER, max_iter=_ITERATIONS)
    starts: dict[str, np.ndarray] = {}
    for done in range(_ROUNDS):
        heed(stop)
        tell("learning bases", 0.7 + 0.3 * done / _ROUNDS)
        encoder.fit(tensors, **starts)
        starts = {"components": encoder.components_, "activations": encoder.activations_}
    return encoder


def heed(stop: Event) -> None:
    """Raise where the work is to end."""
    if stop.is_set():
        raise Stopped
