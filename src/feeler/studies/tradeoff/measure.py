"""Measure: the touches of a task at every speed, and what an ideal observer knows of them in every
window.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.execute import ThreadExecutor, run_batch
from feeler.execute.threads import hold_blas
from feeler.experiment.touch import touch
from feeler.information import compute_energies, compute_energy, measure_information, scale_peaks
from feeler.stimulus.feature import Feature
from feeler.stimulus.ninety import LOCATIONS, make_features
from feeler.stimulus.trial import Trial
from feeler.studies.tradeoff.declared import Declared
from feeler.tensors.unit import in_unit

WHOLE = "whole touch"
FIELDS = ("accuracy", "bits")
COSTS = ("work", "force", "release")


@dataclass(frozen=True, kw_only=True)
class Window:
    """Samples since contact that an observer may use."""

    kind: str
    """``time``, ``distance``, ``distance and samples`` or ``whole touch``."""
    value: float
    """Of its kind, [ms] or [mm]."""
    label: str


def list_windows(declared: Declared) -> list[Window]:
    """Every window, longest last of each kind."""
    ask = declared.windows
    times, far = sorted({*ask["deadlines"], *ask["matched_times"]}), ask["matched_distance"]
    distances = sorted({*ask["distances"], far})
    matched = Window(
        kind="distance and samples",
        value=far,
        label=f"{far:g} mm, {ask['matched_samples']} samples",
    )
    return [
        *(Window(kind="time", value=float(t), label=f"{t:g} ms") for t in times),
        *(Window(kind="distance", value=float(d), label=f"{d:g} mm") for d in distances),
        matched,
        Window(kind=WHOLE, value=np.nan, label=WHOLE),
    ]


@checked
def draw_touches(
    declared: Declared,
    number: int,
    features: Sequence[Feature] | None = None,
    locations: Sequence[float] = LOCATIONS,
    speed: float = 1.0,
) -> list[Trial]:
    """Set ``number`` of the task: every feature at every location, drawn within the declared
    ranges.

    The draws depend on the seed and the number alone, so that all speeds and antennas meet the same
    touches.
    """
    rng, jitter = np.random.default_rng([declared.seed, number]), declared.jitter
    drawn = []
    for location in locations:
        for feature in features or make_features():
            by = rng.uniform(-1.0, 1.0, 3)
            kept = feature.scale(1 + jitter["size"] * by[1])
            drawn.append(
                Trial(
                    feature=replace(kept, name=feature.name),
                    location=min(location + jitter["location"] * by[0], 1.0),
                    speed=speed,
                    approach=90.0 + jitter["approach"] * by[2],
                    friction=rng.uniform(*jitter["friction"]),
                )
            )
    return drawn


@checked
def measure_tradeoff(
    antenna: Antenna,
    declared: Declared,
    features: Sequence[Feature] | None = None,
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> xr.Dataset:
    """What an ideal observer of exactly known touches knows by when, at every speed, and what it
    costs.

    Parameters
    ----------
    declared
        Speeds, task, noise and windows; see :func:`feeler.studies.tradeoff.load_declared`.
    features
        What touches; default the paper's six.
    workers
        Threads, each with a set at a speed of its own; default one per core. The numbers do not
        depend on it.
    progress
        Called with (sets and speeds done, in all).
    options
        What :func:`feeler.touch` takes beside: engine, timestep …

    Returns
    -------
    xarray.Dataset
        ``accuracy`` and ``bits`` (set, speed, level, window), ``work`` of the object on the antenna
        [µJ], peak ``force`` [mN] and time of last contact ``release`` [ms since contact] (set,
        speed), means over the touches of a set.
    """
    windows, jobs = list_windows(declared), [*product(range(declared.sets), declared.speeds)]
    found: dict[int, dict[str, Any]] = {}

    def measure(job: tuple[int, float]) -> dict[str, Any]:
        return _measure_set(antenna, declared, windows, *job, features, {"workers": 1} | options)

    with (
        hold_blas(),
        ThreadExecutor(workers) as own,
    ):  # small matrices: waking other threads takes longer than the work
        for outcome in run_batch(measure, enumerate(jobs), executor=own, window=own.workers):
            if outcome.error is not None:
                raise outcome.error
            found[outcome.index] = outcome.value
            if progress:
                progress(len(found), len(jobs))
    rows = [found[index] for index in range(len(jobs))]
    shape = (declared.sets, len(declared.speeds))
    values = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    dims = {name: ("set", "speed", "level", "window") for name in FIELDS} | {
        name: ("set", "speed") for name in COSTS
    }
    return xr.Dataset(
        {
            name: (dims[name], value.reshape(*shape, *value.shape[1:]))
            for name, value in values.items()
        },
        {
            "speed": list(declared.speeds),
            "level": [f"{kind} {size:g}" for kind, size in declared.noises],
            "window": [window.label for window in windows],
            "kind": ("window", [window.kind for window in windows]),
            "value": ("window", [window.value for window in windows]),
        },
        attrs={
            "antenna": antenna.name,
            "touches": len(features or make_features()) * len(LOCATIONS),
        },
    )


def _measure_set(
    antenna: Antenna,
    declared: Declared,
    windows: list[Window],
    number: int,
    speed: float,
    features: Sequence[Feature] | None,
    options: dict[str, Any],
) -> dict[str, Any]:
    trials, step = draw_touches(declared, number, features, speed=speed), declared.sample_interval
    duration = trials[0].lead + declared.reach * antenna.length / speed + declared.tail
    duration = step * np.ceil(duration / step)
    tensors = touch(
        antenna,
        trials,
        duration=duration,
        sample_interval=step,
        save=("angle", "force", "work"),
        **options,
    )
    first = (
        round(trials[0].lead / step) + 1
    )  # the sample at the lead itself is the last without contact
    angle = in_unit(tensors["angle"], "rad").values
    if not np.abs(angle).reshape(len(angle), -1).max(axis=1).all():
        raise InvalidInput(
            f"an object does not bend the antenna {antenna.name!r} at all; choose others."
        )
    found = {name: np.empty((len(declared.noises), len(windows))) for name in FIELDS}
    scaled = {"common": angle, "relative": scale_peaks(angle)}
    energies = {
        kind: _list_energies(values, declared, windows, first, speed)
        for kind, values in scaled.items()
    }
    for i, (kind, size) in enumerate(declared.noises):
        different, which = energies[kind]
        known = [
            measure_information(one, size, n_draws=declared.draws, random_state=number)
            for one in different
        ]
        for field in FIELDS:
            found[field][i] = [getattr(known[k], field) for k in which]
    return found | _measure_costs(tensors, first)


def _list_energies(
    angle: np.ndarray, declared: Declared, windows: list[Window], first: int, speed: float
) -> tuple[list[np.ndarray], list[int]]:
    """Inner products, and which of them each window has: those that outlast the record, when all is
    at rest, share theirs.
    """
    count, step = angle.shape[2], declared.sample_interval
    ends = []
    for window in windows:
        long = {"time": window.value, "distance": window.value / speed}.get(window.kind, np.inf)
        ends.append(int(min(first + np.floor(long / step + 1e-9), count)))
    different = sorted(set(ends))
    energies, which = (
        [*compute_energies(angle, different, start=first)],
        [different.index(end) for end in ends],
    )
    far, n = declared.windows["matched_distance"], declared.windows["matched_samples"]
    picks = first - 1 + np.round(far * np.arange(1, n + 1) / n / speed / step).astype(int)
    for j, window in enumerate(windows):
        if window.kind == "distance and samples":
            which[j] = len(energies)
            energies.append(compute_energy(angle[:, :, np.minimum(picks, count - 1)]))
    return energies, which


def _measure_costs(tensors: xr.Dataset, first: int) -> dict[str, float]:
    force = np.linalg.norm(in_unit(tensors["force"], "mN").values, axis=2)
    time = in_unit(tensors["time"], "ms").values
    last = (
        np.array([time[np.flatnonzero(one)[-1]] if one.any() else np.nan for one in force])
        - time[first - 1]
    )
    return {
        "work": float(in_unit(tensors["work"], "uJ").values[:, -1, 1].mean()),
        "force": float(force.max(axis=1).mean()),
        "release": float(np.nanmean(last)),
    }
