"""Harder splits than copies of the same tensor: unseen sizes, shifted places, other speeds."""

from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any

import numpy as np

from feeler.decoding.labels import Labels, read_labels
from feeler.decoding.sweep import Sweep, compute_sweep
from feeler.dispersion.index import check_tensors
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.stimulus.trial import Trial
from feeler.task.nuisances import Nuisances


@checked
def iterate_left_out(groups: Labels) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """Each group's name with the trials outside it (train) and inside it (test)."""
    group = read_labels(groups, "groups")
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
    """One sweep per group, which is tested after training on the others.

    So a size or a place can be tested that was never touched before.

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
    codes, named = check_tensors(codes, least=1), read_labels(labels)
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
def compute_jittered(
    codes: Any,
    labels: Labels,
    trials: Sequence[Trial],
    simulate: Callable[[list[Any]], Any],
    *,
    location: float = 0.0,
    speed: float = 0.0,
    n_each: int = 1,
    random_state: Annotated[int, "≥ 0"] = 0,
    **options: Any,
) -> Sweep:
    """A sweep trained on nominal trials and tested on jittered ones of the same labels.

    Parameters
    ----------
    codes, labels, trials
        The nominal trials' codes, classes and descriptions, in the same order.
    simulate
        Turns a list of trials into codes in the same order and form as ``codes`` (engine, window,
        scaling, encoder: whatever made ``codes``).
    location, speed
        Half-widths of a uniform shift, as a fraction of the antenna's length, and of a uniform
        change of speed, as a share of it [C]; 0.02 of the length is a fifth of the grid's step.
    n_each
        Jittered trials per trial.
    **options
        Of ``compute_sweep``.
    """
    named = read_labels(labels)
    if len(trials) != len(named):
        raise InvalidInput(
            f"{len(trials)} trials but {len(named)} labels; give one label per trial."
        )
    rng = np.random.default_rng(random_state)
    jittered = Nuisances.only(location=location, speed=speed).jitter(trials, rng, n_each)
    held_out = (simulate(jittered), np.tile(named, n_each))
    return compute_sweep(codes, labels, held_out=held_out, random_state=random_state, **options)
