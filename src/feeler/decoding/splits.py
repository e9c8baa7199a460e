"""Harder splits than copies of the same tensor: unseen sizes, shifted places, other speeds."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from feeler.checked import checked
from feeler.decoding.labels import Labels
from feeler.decoding.sweep import Sweep, compute_sweep
from feeler.dispersion.blocks import check_tensors
from feeler.errors import InvalidInput


@checked
def iterate_left_out(groups: Labels) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """Each group's name with the trials outside it (train) and inside it (test)."""
    group = np.asarray(groups)
    names = np.unique(group)
    if names.size < 2:
        raise InvalidInput(
            f"all trials belong to one group ({names[0]!r}); leaving it out leaves nothing to"
            " train on."
        )
    for name in names:
        yield name, np.flatnonzero(group != name), np.flatnonzero(group == name)


@checked
def compute_left_out(
    codes: Any, labels: Labels, groups: Labels, **options: Any
) -> dict[Any, Sweep]:
    """One sweep per group: trained on the other groups, tested on this one, e.g. on a size never
    touched before.

    Parameters
    ----------
    codes, labels
        As in ``compute_sweep``; labels must not contain what ``groups`` leaves out (feature and
        location when sizes are left out).
    groups
        Group of each trial, e.g. the object's size.
    **options
        Of ``compute_sweep``.
    """
    codes, named = check_tensors(codes, least=1), np.asarray(labels)
    if len(labels) != len(codes) or len(groups) != len(codes):
        raise InvalidInput(
            f"{len(codes)} trials, {len(labels)} labels, {len(groups)} groups; they must match."
        )
    return {
        name: compute_sweep(
            codes[train], named[train], held_out=(codes[test], named[test]), **options
        )
        for name, train, test in iterate_left_out(groups)
    }


@checked
def jitter_trials(
    trials: Sequence[Any],
    rng: np.random.Generator,
    *,
    location: float = 0.0,
    speed: float = 0.0,
    n_each: int = 1,
) -> list[Any]:
    """Trials that miss their nominal place or speed a little, to test what a classifier makes of
    touches it never saw.

    Parameters
    ----------
    trials
        Frozen ``feeler.stimulus.Trial`` objects (or any dataclass with ``location`` and ``speed``).
    location
        Half-width of a uniform shift, as a fraction of the antenna's length [C]; 0.02 is a fifth of
        the grid's step.
    speed
        Half-width of a uniform relative change of speed [C]; 0.1 is ±10 %.
    n_each
        Jittered trials per trial, the set in turn.
    """
    if not 0 <= location < 1 or not 0 <= speed < 1:
        raise InvalidInput(f"jitter must lie in [0, 1), got location {location}, speed {speed}.")
    if n_each < 1:
        raise InvalidInput(f"n_each must be ≥ 1, got {n_each}.")
    jittered = []
    for _ in range(n_each):
        for trial in trials:
            place = min(trial.location + rng.uniform(-location, location), 1.0)
            jittered.append(
                replace(trial, location=place, speed=trial.speed * (1 + rng.uniform(-speed, speed)))
            )
    return jittered


@checked
def compute_jittered(
    codes: Any,
    labels: Labels,
    trials: Sequence[Any],
    simulate: Callable[[list[Any]], Any],
    *,
    location: float = 0.0,
    speed: float = 0.0,
    n_each: int = 1,
    random_state: int = 0,
    **options: Any,
) -> Sweep:
    """A sweep trained on the nominal trials and tested on jittered ones that keep the nominal
    labels.

    Parameters
    ----------
    codes, labels, trials
        The nominal trials' codes, classes and descriptions, in the same order.
    simulate
        Turns a list of trials into codes in the same order and form as ``codes`` (engine, window,
        scaling, encoder: whatever made ``codes``).
    location, speed, n_each
        See ``jitter_trials``.
    **options
        Of ``compute_sweep``.
    """
    if len(trials) != len(labels):
        raise InvalidInput(
            f"{len(trials)} trials but {len(labels)} labels; give one label per trial."
        )
    rng = np.random.default_rng(random_state)
    jittered = jitter_trials(trials, rng, location=location, speed=speed, n_each=n_each)
    held_out = (simulate(jittered), np.tile(np.asarray(labels), n_each))
    return compute_sweep(codes, labels, held_out=held_out, random_state=random_state, **options)
