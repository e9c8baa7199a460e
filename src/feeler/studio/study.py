"""A study of one antenna at one speed: the paper's thirty touches, how far they spread, bases, and
a decoder that is trained on touches at random locations.
"""

import json
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from threading import Event, Lock
from typing import Any

import numpy as np

from feeler.analysis import INDICES, compute_nmi, compute_pearson, compute_ssim, find_closest
from feeler.antenna.segments import Antenna
from feeler.encoding import ConvolutiveNMF
from feeler.objects.trials import Trial, trials
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep, get_engine
from feeler.physics.run import make_groups, run_group
from feeler.physics.scene import Clock, make_scene
from feeler.presets import make_preset
from feeler.provenance import PHYSICS
from feeler.studio.decoder import N_HELD_OUT, N_TEMPLATES, Range, TouchDecoder
from feeler.tensors.transforms import rectify, scale_common

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
_ONSET = 0.02  # [C] share of the greatest training angle at which contact is noticed
UNSURE = 0.02
_KEPT = 6  # studies

_Label = tuple[str, float, float]
Trained = tuple[TouchDecoder, Range, dict[str, float]]
"""A decoder, what it was trained on, and its scores on held-out touches."""
_Tell = Callable[[str, float], None]


class Cancelled(Exception):
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
    for done, group in enumerate(groups := make_groups(scenes, get_engine(DEFAULT_ENGINE))):
        tell("touching", 0.6 * done / len(groups))
        try:
            results = run_group([scenes[i] for i in group], clock, stop=stop)
        except KeyboardInterrupt:
            raise Cancelled from None
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
        raise Cancelled
