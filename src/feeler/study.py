"""The record of a study: which touches are discriminated, by whom, in which noise and by when."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import xarray as xr

from feeler.analysis import compute_energies, compute_energy, measure_information
from feeler.antenna.segments import Antenna
from feeler.decoding.classifiers import CLASSIFIERS, describe_classifier, measure_classifier
from feeler.errors import InvalidInput
from feeler.execute import ThreadExecutor, run_batch
from feeler.execute.workers import hold_blas
from feeler.experiments.tactile import touch
from feeler.objects import NOISES, Noise, Task
from feeler.objects.trials import Trial
from feeler.progress import show_progress
from feeler.provenance import Journal, compute_digest, make_key
from feeler.records import Choice, Ge, Gt, Record, Unit
from feeler.tensors.transforms import in_unit, stack_planes
from feeler.validation import checked

_WHOLE = "whole touch"
_MATCHED = "distance and samples"
_IDEAL = "ideal"
"""The classifier that knows every touch; its accuracy and bits are expectations over the noise."""


class Study(Record):
    """What is asked, and how much of it is computed: a task, its classifiers and sets of touches.

    A change of a field that is its task's is made there: ``study.replace(speeds=(0.3,))``.

    Attributes
    ----------
    task : Task
        Objects, places, speeds and nuisances; the seeds of the purposes ``train`` and ``test``.
    levels : dict[Annotated[str, OneOf(NOISES)], tuple[float, ...]]
        Sizes of each kind of noise, by its name in :data:`feeler.objects.NOISES`.
    headline : dict[str, float]
        The size of each kind that figures show.
    windows : dict[str, Any]
        ``deadlines`` and ``matched_times`` [ms], ``distances`` and ``matched_distance`` [mm],
        ``matched_samples``: what may be used since contact.
    sets : int
        Number of times all touches are resampled.
    draws : int
        Drawn noise per set, window and level: pairs of draws of each touch for the ideal observer,
        noisy copies of each touch for the others.
    classifiers : tuple[Annotated[str, OneOf(CLASSIFIERS)], ...]
        By their names in :data:`feeler.decoding.CLASSIFIERS`.
    train : int
        Training touches of each class; the ideal observer knows those of its set.
    reach : float
        How far the object moves on after first contact, as a share of the antenna's length.
    tail : float
        Time recorded beyond that [ms].
    sample_interval : float
        [ms]
    """

    task: Task
    levels: dict[Annotated[str, Choice(NOISES)], tuple[float, ...]]
    headline: dict[str, float]
    windows: dict[str, Any]
    sets: Annotated[int, Ge(1)]
    draws: Annotated[int, Ge(1)]
    classifiers: tuple[Annotated[str, Choice(CLASSIFIERS)], ...] = (_IDEAL,)
    train: Annotated[int, Ge(1)] = 4
    reach: Annotated[float, Ge(0)] = 1.0
    tail: Annotated[float, Ge(0), Unit("ms")] = 100.0
    sample_interval: Annotated[float, Gt(0), Unit("ms")] = 1.0

    def _check(self) -> None:
        if not self.classifiers or not self.levels:
            raise InvalidInput("a study needs at least one classifier and one level of noise.")

    def replace(self, **changes: Any) -> Self:
        """The same study with some fields changed, its own or its task's."""
        names = {field.name for field in fields(self)}
        own = {name: value for name, value in changes.items() if name in names}
        task = {name: value for name, value in changes.items() if name not in names}
        return super().replace(**({"task": self.task.replace(**task)} | own if task else own))

    @property
    def seed(self) -> int:
        """The seed of the touches that are discriminated."""
        return dict(self.task.seeds)["test"]

    @property
    def noises(self) -> dict[str, Noise]:
        """Every level of noise by what it is called, such as ``"relative 0.3"``."""
        return {
            f"{kind} {size:g}": NOISES[kind](float(size))
            for kind, sizes in self.levels.items()
            for size in sizes
        }

    @property
    def shown(self) -> dict[str, str]:
        """What the level that figures show is called, by kind."""
        return {kind: f"{kind} {size:g}" for kind, size in self.headline.items()}

    def list_windows(self) -> list[tuple[str, float, str]]:
        """Kind, value [ms or mm] and name of every window since contact, longest last of a kind."""
        ask = self.windows
        far = float(ask["matched_distance"])
        times = sorted({float(t) for t in (*ask["deadlines"], *ask["matched_times"])})
        distances = sorted({far, *(float(d) for d in ask["distances"])})
        return [
            *(("time", t, f"{t:g} ms") for t in times),
            *(("distance", d, f"{d:g} mm") for d in distances),
            (_MATCHED, far, f"{far:g} mm, {ask['matched_samples']} samples"),
            (_WHOLE, np.nan, _WHOLE),
        ]

    def touch(
        self, antenna: Antenna, trials: Sequence[Trial], save: Sequence[str], **options: Any
    ) -> xr.Dataset:
        """Complete touches of one speed: recorded until the object has gone by, and beyond."""
        first, step = trials[0], self.sample_interval
        duration = first.lead + self.reach * antenna.length / first.speed + self.tail
        return touch(
            antenna,
            trials,
            duration=step * np.ceil(duration / step),
            sample_interval=step,
            save=tuple(save),
            **options,
        )

    @checked
    def run(
        self,
        antennas: Mapping[str, Antenna],
        *,
        journal: Path | None = None,
        workers: int | None = None,
        progress: Callable[[int, int], None] | None = None,
        **options: Any,
    ) -> xr.Dataset:
        """What every classifier tells, by when, in which noise; and what the touches cost.

        Parameters
        ----------
        antennas
            Antennas by name; all of them, and all speeds, meet the same touches.
        journal
            File that keeps each set as it is found, and from which an interrupted study goes on.
        workers
            Threads, each with a set at a speed of its own; default one per core. The numbers do not
            depend on it.
        progress
            Called with (sets and speeds done, in all); default: a bar that appears after 5 s.
        options
            What :func:`feeler.touch` takes beside: engine, timestep …

        Returns
        -------
        xarray.Dataset
            ``accuracy`` and ``bits`` (antenna, classifier, set, speed, level, window); ``work`` of
            the object on the antenna [µJ], peak ``force`` [mN] and time of last contact ``release``
            [ms since contact] (antenna, set, speed), means over the touches of a set.
        """
        jobs = [*product(antennas, range(self.sets), self.task.speeds)]
        names = [(compute_digest(antennas[name])[:16], *rest) for name, *rest in jobs]
        made_with: dict[str, Any] = {"study": self, "options": options}
        if texts := [describe_classifier(one) for one in self.classifiers if ".py" in one]:
            made_with["classifiers"] = texts
        key = make_key(made_with) if journal else "0"

        def measure(job: tuple[str, int, float]) -> dict[str, Any]:
            name, number, speed = job
            return self.measure_set(antennas[name], number, speed, {"workers": 1} | options)

        # Small matrices: waking other threads takes longer than the work.
        with (
            hold_blas(),
            ThreadExecutor(workers) as own,
            Journal(journal, key, of="study") as kept,
            show_progress(progress, "sets and speeds") as advance,
        ):
            todo = [(k, job) for k, job in enumerate(jobs) if kept.find(*names[k]) is None]
            done = len(jobs) - len(todo)
            for outcome in run_batch(measure, todo, executor=own, window=own.workers):
                if outcome.error is not None:
                    raise outcome.error
                kept.add(outcome.value, *names[outcome.index])
                done += 1
                advance(done, len(jobs))
            return self._collect([*antennas], [kept.find(*name) for name in names])

    def _collect(self, antennas: list[str], rows: list[dict[str, Any]]) -> xr.Dataset:
        shape = (len(antennas), self.sets, len(self.task.speeds))
        fields: dict[str, Any] = {}
        for name in rows[0]:
            values = np.array([row[name] for row in rows], dtype=float)
            values = values.reshape(*shape, *values.shape[1:])
            dims = ("antenna", "set", "speed", "classifier", "level", "window")[: values.ndim]
            fields[name] = xr.DataArray(values, dims=dims)
            if values.ndim > len(shape):
                fields[name] = fields[name].transpose("antenna", "classifier", ...)
        kinds, lengths, names = zip(*self.list_windows(), strict=True)
        return xr.Dataset(
            fields,
            {
                "antenna": antennas,
                "classifier": list(self.classifiers),
                "speed": list(self.task.speeds),
                "level": list(self.noises),
                "window": list(names),
                "kind": ("window", list(kinds)),
                "value": ("window", list(lengths)),
            },
            {"touches": self.task.n_classes},
        )

    def measure_set(
        self, antenna: Antenna, number: int, speed: float, options: dict[str, Any]
    ) -> dict[str, Any]:
        """One set of touches of an antenna at a speed, by field; ``options`` as ``run`` takes."""
        trials, labels = self.task.draw(antenna, "test", set=number, speed=speed)
        tensors = self.touch(antenna, trials, ("angle", "force", "work"), **options)
        angle = _read_angle(tensors)
        if not np.abs(angle).reshape(len(angle), -1).max(axis=1).all():
            raise InvalidInput(
                f"an object does not bend the antenna {antenna.name!r} at all; choose others."
            )
        # The sample at the lead itself is the last without contact.
        first = round(trials[0].lead / self.sample_interval) + 1
        windows = self._list_samples(first, angle.shape[2], speed)
        known: tuple[np.ndarray, np.ndarray] | None = None
        told = []
        for name in self.classifiers:
            if name == _IDEAL:
                told.append(self._ask_ideal(angle, windows, first, number))
                continue
            if known is None:
                training, training_labels = self.task.draw(
                    antenna, "train", set=number, speed=speed, each=self.train
                )
                again = self.touch(antenna, training, ("angle",), **options)
                known = _read_angle(again), training_labels
            told.append(self._ask(name, known, (angle, labels), windows, number))
        values = np.array(told)  # (classifier, level, window, field)
        force = np.linalg.norm(in_unit(tensors["force"], "mN").values, axis=2)
        time = in_unit(tensors["time"], "ms").values
        last = [time[np.flatnonzero(one)[-1]] if one.any() else np.nan for one in force]
        return {
            "accuracy": values[..., 0],
            "bits": values[..., 1],
            **{
                "work": float(in_unit(tensors["work"], "uJ").values[:, -1, 1].mean()),
                "force": float(force.max(axis=1).mean()),
                "release": float(np.nanmean(last) - time[first - 1]),
            },
        }

    def _list_samples(self, first: int, count: int, speed: float) -> list[np.ndarray]:
        """The samples of each window; one that outlasts the record, when all is at rest, ends."""
        step, found = self.sample_interval, []
        for kind, value, _ in self.list_windows():
            if kind == _MATCHED:
                n = self.windows["matched_samples"]
                at = np.round(value * np.arange(1, n + 1) / n / speed / step).astype(int)
                found.append(np.minimum(first - 1 + at, count - 1))
                continue
            long = {"time": value, "distance": value / speed}.get(kind, np.inf)
            end = int(min(first + np.floor(long / step + 1e-9), count))
            found.append(np.arange(first, end))
        return found

    def _ask_ideal(
        self, angle: np.ndarray, windows: list[np.ndarray], first: int, number: int
    ) -> np.ndarray:
        """Accuracy and bits (level, window, field) of who knows the touches and the noise."""
        # Windows that end together share their numbers.
        kinds = [kind for kind, _, _ in self.list_windows()]
        names = [
            _MATCHED if kind == _MATCHED else first + len(samples)
            for kind, samples in zip(kinds, windows, strict=True)
        ]
        ends: Any = sorted({name for name in names if name != _MATCHED})
        energies: dict[bytes, dict[Any, np.ndarray]] = {}
        found = np.empty((len(self.noises), len(windows), 2))
        for row, noise in zip(found, self.noises.values(), strict=True):
            key = np.round(noise.find_level(angle) / noise.size, 12).tobytes()
            if (
                key not in energies
            ):  # of noise whose level is in proportion to its size, only once
                white = noise.whiten(angle)
                picked = white[:, :, windows[kinds.index(_MATCHED)]]
                energies[key] = dict(
                    zip(ends, compute_energies(white, ends, start=first), strict=True)
                )
                energies[key][_MATCHED] = compute_energy(picked)
            known = {
                name: measure_information(
                    energy, noise.size, n_draws=self.draws, random_state=number
                )
                for name, energy in energies[key].items()
            }
            row[:] = [(known[name].accuracy, known[name].bits) for name in names]
        return found

    def _ask(
        self,
        name: str,
        known: tuple[np.ndarray, np.ndarray],
        asked: tuple[np.ndarray, np.ndarray],
        windows: list[np.ndarray],
        number: int,
    ) -> np.ndarray:
        """Accuracy and bits (level, window, field) of a classifier that learns noisy touches."""
        found = np.empty((len(self.noises), len(windows), 2))
        rng = np.random.default_rng([self.seed, number])
        for row, noise in zip(found, self.noises.values(), strict=True):
            training, met = (
                noise.add(tensors, rng, self.draws) for tensors, _ in (known, asked)
            )
            training_labels, true = (
                np.tile(labels, self.draws) for _, labels in (known, asked)
            )
            for k, samples in enumerate(windows):
                classifier = CLASSIFIERS[name]()
                if "noise" in classifier.get_params():
                    classifier = classifier.set_params(noise=noise)
                classifier.fit(training[:, :, samples], training_labels)
                row[k] = measure_classifier(classifier, met[:, :, samples], true)
        return found


def _read_angle(tensors: xr.Dataset) -> np.ndarray:
    """Angles (trial, sensor, time) [rad], those of one plane after those of the other."""
    return stack_planes(in_unit(tensors["angle"], "rad")).values
