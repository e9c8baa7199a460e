"""Beside Fig. 2E: how far slow tensors depend on the softness of contact, which the paper does not
state.
"""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from feeler import touch
from feeler.analysis import INDICES, compute_dispersion
from feeler.experiments.tactile import DURATION
from feeler.objects.trials import SPEEDS
from feeler.physics.contact import CONTACTS, DEFAULT_CONTACT
from feeler.report.page import Section, make_spread
from feeler.tensors.transforms import rectify
from paper.context import Context
from paper.data import list_profiles, list_touches, load_tensors, select_speed


def compute_change(reference: xr.Dataset, other: xr.Dataset) -> np.ndarray:
    """Greatest difference of any angle of each touch (trial,), as a share of its peak."""
    one, two = (data["angle"].transpose("trial", ...).values for data in (reference, other))
    axes = tuple(range(1, one.ndim))
    return np.abs(two - one).max(axis=axes) / np.abs(one).max(axis=axes)


def compute(context: Context) -> dict[str, xr.Dataset]:
    """Slow touches of the first profile by contact, the default first."""
    name = list_profiles(context)[0]
    slow = SPEEDS["slow"]
    touches = [trial for trial in list_touches(context, name) if trial.speed == slow]
    found = {DEFAULT_CONTACT: select_speed(load_tensors(context, name), slow)}
    for contact in CONTACTS:
        if contact != DEFAULT_CONTACT:
            found[contact] = touch(
                context.profiles[name],
                touches,
                contact=contact,
                engine=context.engine,
                workers=context.workers,
                duration=DURATION,
                seed=context.seed,
            )
    return found


def show(context: Context, section: Section) -> None:
    """By how much slow tensors and their dispersion change with the contact."""
    found = compute(context)
    arrays = {name: rectify(data["angle"].values) for name, data in found.items()}
    dispersion = compute_dispersion(arrays, random_state=context.seed)
    reference = found[DEFAULT_CONTACT]
    changes = {name: 100 * compute_change(reference, data) for name, data in found.items()}
    section.values |= _list_values(changes, dispersion.average)
    section.heading("Softness of contact")
    section.table(
        [
            "contact",
            "median change [% of the peak]",
            "greatest",
            *(known.label for known in INDICES.values()),
        ],
        [
            [
                name,
                float(np.median(change)),
                float(change.max()),
                *(dispersion.average[index][name].estimate for index in INDICES),
            ]
            for name, change in changes.items()
        ],
        "Slow touches of the exponential profile with other softness of contact, which the paper"
        " does not state: greatest change of any angle of a touch, and mean index of the closest"
        " match. Tensors of single slow touches depend on it; their dispersion hardly does.",
    )


def _list_values(changes: Mapping[str, np.ndarray], average: Mapping) -> dict[str, object]:
    values: dict[str, object] = {}
    for name, change in changes.items():
        if name != DEFAULT_CONTACT:
            values[f"contact.{name}.slow"] = make_spread(
                np.median(change), change.min(), change.max(), n=len(change)
            )
        for index in INDICES:
            one = average[index][name]
            values[f"contact.{name}.{index}"] = make_spread(
                one.estimate, one.low, one.high, n=len(change)
            )
    return values
