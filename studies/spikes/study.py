"""The study of spikes: who discriminates thirty touches from the trains of how many sensilla, by
when.
"""

from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr

from feeler.antenna.segments import Antenna
from feeler.decoding.classifiers import make_lda, measure_classifier
from feeler.errors import InvalidInput
from feeler.objects import Common, Task
from feeler.presets import cockroach
from feeler.records import Ge, Gt, Record, Unit
from feeler.spikes import (
    CAMPANIFORM,
    HAIR,
    SPIKE_CODES,
    Firing,
    PoissonObserver,
    Population,
    count_spikes,
    draw_spikes,
    find_gain,
    place_sensilla,
    thin_spikes,
)
from feeler.study import Study
from studies.stored import read_declared

_WHOLE = "whole touch"
_IDEAL_OBSERVER = "ideal"
_PARTS = {
    "whole": CAMPANIFORM,
    "phasic": CAMPANIFORM.phasic,
    "tonic": CAMPANIFORM.tonic,
    "hair": HAIR,
}
_N_COMPONENTS = 30
_LEAST = 4  # touches of a class, half of which are learned
_FIELDS = ("accuracy", "bits", "place", "spikes")


class Variant(Record):
    """What is changed of Poisson trains at the own gain.

    Attributes
    ----------
    gain : Literal[own, shared]
        The antenna's own, or that of the cockroach's antenna.
    keep : float
        Spikes kept of a touch, in the mean; 0: all.
    order : int
        Of the gamma distribution of intervals.
    refractory : float
        [ms]
    spread : float
        Of the latency [ms].
    receptor : float
        White noise on what each sensillum feels [rad].
    part : Literal[whole, phasic, tonic, hair]
        Of the sensillum.
    places : int
        Places that are kept, evenly.
    repeated : bool
        Whether one touch stands in the place of all.
    by_deadline : bool
        Whether it is read in every window.
    """

    gain: Literal["own", "shared"] = "own"
    keep: Annotated[float, Ge(0)] = 0.0
    order: Annotated[int, Ge(1)] = 1
    refractory: Annotated[float, Ge(0), Unit("ms")] = 0.0
    spread: Annotated[float, Ge(0), Unit("ms")] = 0.0
    receptor: Annotated[float, Ge(0), Unit("rad")] = 0.0
    part: Literal["whole", "phasic", "tonic", "hair"] = "whole"
    places: Annotated[int, Gt(0)] = 56
    repeated: bool = False
    by_deadline: bool = False

    @property
    def firing(self) -> Firing:
        """How its spikes are drawn."""
        return Firing(order=self.order, refractory=self.refractory, spread=self.spread)

    @property
    def is_poisson(self) -> bool:
        """Whether its rates say all about its trains."""
        return self.firing == Firing() and not self.receptor

    def is_asked(self, code: str) -> bool:
        """Whether a code reads it: all of them by deadline, counts and first spikes else."""
        if code == _IDEAL_OBSERVER:
            return self.is_poisson and not self.repeated
        return self.by_deadline or code in ("counts", "first")


class SpikeStudy(Study):
    """What is asked of spikes; :func:`load_spiking` reads what was declared.

    ``classifiers`` are codes; ``levels`` are the variants, by name.

    Attributes
    ----------
    each : int
        Touches of each class in a set.
    sensilla : dict[str, float]
        ``rate`` [Hz], ``speed`` [m/s], ``width`` [samples], ``trains``, ``ideal``.
    """

    levels: dict[str, Variant]  # type: ignore[assignment]
    classifiers: tuple[str, ...] = (_IDEAL_OBSERVER, "counts")
    each: Annotated[int, Ge(1)] = 8
    sensilla: dict[str, float]

    def _check(self) -> None:
        super()._check()
        if self.each < _LEAST and {*self.classifiers} != {_IDEAL_OBSERVER}:
            raise InvalidInput(
                f"classifiers that learn need at least {_LEAST} touches of each class, got"
                f" {self.each}."
            )

    @property
    def noises(self) -> dict[str, Any]:
        """The variants by name."""
        return dict(self.levels)

    def list_windows(self) -> list[tuple[str, float, str]]:
        """Kind, value [ms] and name of every window since contact."""
        times = sorted(float(t) for t in self.windows["deadlines"])
        return [*(("time", t, f"{t:g} ms") for t in times), (_WHOLE, np.nan, _WHOLE)]

    def choose_population(
        self, antenna: Antenna, places: np.ndarray, variant: Variant, **options: Any
    ) -> Population:
        """The sensilla of a variant on an antenna whose sensors stand at these places."""
        tuned = antenna if variant.gain == "own" else cockroach()
        part = "hair" if variant.part == "hair" else "whole"
        known = vars(self).setdefault("_gains", {})  # finding one takes two seconds
        if (tuned, part) not in known:
            known[tuned, part] = self._find_gain(tuned, part, options)
        return place_sensilla(places, known[tuned, part], sensillum=_PARTS[variant.part])

    def _find_gain(self, antenna: Antenna, part: str, options: dict[str, Any]) -> float:
        """Gain [1/rad] with which an antenna's median touch has the declared greatest rate."""
        trials, _ = self.task.draw(antenna, "train", set=0, speed=self.sensilla["speed"])
        touches = self.touch(antenna, trials, ("angle",), **options)
        population = place_sensilla(touches["position"].values, 30.0, sensillum=_PARTS[part])
        return float(find_gain(touches, population, self.sensilla["rate"]).gain[0])

    def measure_set(
        self, antenna: Antenna, number: int, speed: float, options: dict[str, Any]
    ) -> dict[str, Any]:
        """One set of touches of an antenna at a speed, by field; ``options`` as ``run`` takes."""
        trials, labels = self.task.draw(
            antenna, "test", set=number, speed=speed, each=self.each
        )
        touches = self.touch(antenna, trials, ("angle",), **options)
        felt = _Felt(self, antenna, touches, np.asarray(labels), number, options)
        shape = (
            len(_FIELDS),
            len(self.classifiers),
            len(self.levels),
            len(self.list_windows()),
        )
        found = np.full(shape, np.nan)
        for k, variant in enumerate(self.levels.values()):
            asked = [j for j, name in enumerate(self.classifiers) if variant.is_asked(name)]
            if not asked:
                continue
            trains = felt.fire(variant)
            for j in asked:
                found[:, j, k] = self._ask_variant(trains, self.classifiers[j], variant)
        return dict(zip(_FIELDS, found, strict=True))

    def _ask_variant(self, trains: "_Trains", name: str, variant: Variant) -> np.ndarray:
        """What a code says of a variant's trains (field, window), NaN where it is not asked."""
        found = np.full((len(_FIELDS), len(self.list_windows())), np.nan)
        if not trains.enough:
            return found
        ends = [
            None if kind == _WHOLE else round(until / self.sample_interval)
            for kind, until, _ in self.list_windows()
        ]
        asked = [k for k, end in enumerate(ends) if variant.by_deadline or end is None]
        told = trains.ask(name, [ends[k] for k in asked])
        found[:, asked] = np.transpose(told)
        return found


class _Felt:
    """One set's touches, and the trains they give by each variant."""

    def __init__(
        self,
        study: SpikeStudy,
        antenna: Antenna,
        touches: xr.Dataset,
        labels: np.ndarray,
        number: int,
        options: dict[str, Any],
    ) -> None:
        self.study, self.antenna, self.touches, self.labels = study, antenna, touches, labels
        self.number, self.options = number, options
        self._rates: dict[Any, xr.Dataset] = {}
        self._rasters: dict[Variant, list[np.ndarray]] = {}
        self._known: dict[Variant, list[np.ndarray]] = {}
        self.first = round(float(touches["lead"][0]) / study.sample_interval) + 1

    def fire(self, variant: Variant) -> "_Trains":
        """The trains that classifiers learn from and are asked about."""
        rated = self._rate(variant)
        plain = _strip(variant)
        if plain not in self._rasters:  # fewer places, or fewer spikes, of trains drawn once
            trains = int(self.study.sensilla["trains"])
            self._rasters[plain] = [self.draw(rated, variant, k) for k in range(trains)]
        return _Trains(self, rated, variant, self._rasters[plain])

    def _rate(self, variant: Variant) -> xr.Dataset:
        """Rates of all places; of these 56 a variant may keep fewer."""
        name = variant.gain, variant.part, variant.receptor, variant.repeated
        if name not in self._rates:
            touches = self.touches.isel(trial=[0]) if variant.repeated else self.touches
            if variant.receptor:
                rng = np.random.default_rng([self.study.seed, self.number, 1])
                noisy = Common(variant.receptor).add(touches["angle"].values, rng)
                touches = touches.assign(angle=touches["angle"].copy(data=noisy))
            population = self.study.choose_population(
                self.antenna, touches["position"].values, variant, **self.options
            )
            rated = population.encode(touches, limit=np.inf)[["rate"]]
            if variant.repeated:
                same = np.zeros(len(self.labels), dtype=int)
                rated = rated.isel(trial=same).assign_coords(trial=self.touches["trial"])
            self._rates[name] = rated
        return self._rates[name]

    def draw_known(self, rates: xr.Dataset, variant: Variant) -> list[np.ndarray]:
        """Trains of known touches, for an observer who knows their rates."""
        plain = _strip(variant)
        if plain not in self._known:
            draws = range(100, 100 + int(self.study.sensilla["ideal"]))
            self._known[plain] = [self.draw(rates, variant, k) for k in draws]
        return self._known[plain]

    def draw(self, rated: xr.Dataset, variant: Variant, number: int) -> np.ndarray:
        """Counts (trial, unit, time) since contact."""
        entropy = [self.study.seed, self.number, number]
        seed = int(np.random.SeedSequence(entropy).generate_state(1)[0])
        raster = count_spikes(draw_spikes(rated, variant.firing, seed=seed))
        return raster.values[:, :, self.first :].astype(np.uint8)


def _strip(variant: Variant) -> Variant:
    """What of a variant its trains depend on before spikes or places are taken from them."""
    return variant.replace(keep=0.0, places=Variant().places, by_deadline=False)


class _Trains:
    """Trains of one variant, and what each code says of them."""

    def __init__(
        self, felt: _Felt, rated: xr.Dataset, variant: Variant, rasters: list[np.ndarray]
    ) -> None:
        self.felt, self.study, self.variant, self.rated = felt, felt.study, variant, rated
        places = rasters[0].shape[1] // 2
        kept = np.round(np.linspace(0, places - 1, min(variant.places, places))).astype(int)
        self.units = np.concatenate([kept, kept + places])
        self.enough = rasters[0].sum() >= 0.95 * variant.keep * len(felt.labels)
        self.rasters = [self._reduce(raster) for raster in rasters]

    def _reduce(self, raster: np.ndarray) -> np.ndarray:
        """Of a raster the units and spikes that the variant keeps."""
        found = raster[:, self.units]
        if self.variant.keep:
            found = thin_spikes(found, self.variant.keep, seed=self.felt.number)
        return found.astype(np.uint8)

    def ask(self, name: str, ends: list[int | None]) -> list[tuple[float, ...]]:
        """Accuracy, bits, share of places right, and spikes of a touch, by each end."""
        told: Any = (
            self._ask_ideal(ends) if name == _IDEAL_OBSERVER else self._ask_code(name, ends)
        )
        each = len(self.rasters) * len(self.felt.labels)
        spikes = [sum(int(r[:, :, :end].sum()) for r in self.rasters) / each for end in ends]
        return [(*map(float, one), count) for one, count in zip(told, spikes, strict=True)]

    def _ask_ideal(self, ends: list[int | None]) -> list[tuple[float, float, float]]:
        """Of one known touch of each class, by an observer who knows their rates."""
        known = np.arange(0, len(self.felt.labels), self.study.each)
        rates = self.rated.isel(trial=known)
        expected = rates["rate"].values[:, self.units, self.felt.first :]
        step, keep = self.study.sample_interval, self.variant.keep
        if keep:
            mean = expected.sum() * step * 1e-3 / len(known)
            expected = expected * min(1.0, keep / mean)
        classifier = PoissonObserver(step).fit(expected, self.felt.labels[known])
        drawn = self.felt.draw_known(rates, self.variant)
        met = np.concatenate([self._reduce(raster) for raster in drawn])
        labels = np.tile(self.felt.labels[known], len(drawn))
        untils = [None if end is None else end * step for end in ends]
        return [_measure(classifier, met, labels, until, expected=True) for until in untils]

    def _ask_code(self, name: str, ends: list[int | None]) -> list[np.ndarray]:
        """Of classifiers that learn one half of the touches and read the other, both ways."""
        width = int(self.study.sensilla["width"]) if name == "counts" else 1
        labels = np.tile(self.felt.labels, len(self.rasters))
        half = np.arange(len(self.felt.labels)) % self.study.each < self.study.each // 2
        half = np.tile(half, len(self.rasters))
        told = []
        for end in ends:
            rasters = [SPIKE_CODES[name](raster[:, :, :end], width) for raster in self.rasters]
            codes = np.concatenate(rasters).astype(float)
            folds = [_learn_and_ask(codes, labels, taught) for taught in (half, ~half)]
            told.append(np.mean(folds, axis=0))
        return told


def _learn_and_ask(
    codes: np.ndarray, labels: np.ndarray, taught: np.ndarray
) -> tuple[float, ...]:
    """Accuracy, bits and share of places right, of an LDA that learns the trials ``taught``."""
    used = codes[:, np.ptp(codes[taught], axis=0) > 0]
    if not used.shape[1]:  # nobody has fired: a guess
        places = {_name_place(one) for one in labels}
        return 1 / len(np.unique(labels)), 0.0, 1 / len(places)
    fewest = min(_N_COMPONENTS, used.shape[1], int(taught.sum()) - 1)
    classifier = make_lda(fewest).fit(used[taught], labels[taught])
    return _measure(classifier, used[~taught], labels[~taught])


def _measure(
    classifier: Any,
    met: np.ndarray,
    labels: np.ndarray,
    until: float | None = None,
    *,
    expected: bool = False,
) -> tuple[float, float, float]:
    """Accuracy, bits, and the share of places that are right.

    ``expected``: accuracy is the mean of the greatest posterior, which an ideal observer expects of
    itself; it is unbiased and varies less than hits.
    """
    accuracy, bits = measure_classifier(classifier, met, labels, until)
    chance = np.nan_to_num(np.asarray(classifier.predict_proba(met, until), dtype=float))
    places = np.array([_name_place(label) for label in classifier.classes_])
    names = np.unique(places)
    by_place = np.stack([chance[:, places == name].sum(axis=1) for name in names], axis=1)
    true = np.array([_name_place(label) for label in labels])
    right = float(np.mean(names[by_place.argmax(axis=1)] == true))
    return float(chance.max(axis=1).mean()) if expected else accuracy, bits, right


def _name_place(label: str) -> str:
    return str(label).rpartition(" at ")[2]


def load_spiking(**changes: Any) -> SpikeStudy:
    """The study of declared.toml, less what ``changes`` replace: its fields, its task's, ``seed``,
    ``codes`` and ``variants`` (names of those kept).
    """
    asked = dict(read_declared("spikes"))
    asked.pop("profiles")
    kept = changes.pop("variants", None)
    variants = asked.pop("variants")
    if kept is not None and (unknown := [name for name in kept if name not in variants]):
        raise InvalidInput(
            f"unknown variant {unknown[0]!r}; declared are {', '.join(variants)}."
        )
    codes = changes.pop("codes", asked.pop("codes")["names"])
    asked |= changes
    task = {
        name: asked.pop(name) for name in ("speeds", "nuisances", "objects") if name in asked
    }
    seed = asked.pop("seed")
    seeds = {"test": seed, "train": seed + 1_000_000}
    return SpikeStudy(
        task=Task(**task, seeds=seeds),
        levels={name: Variant(**variants[name]) for name in kept or variants},
        classifiers=tuple(codes),
        headline={},
        draws=1,
        **asked,
    )
