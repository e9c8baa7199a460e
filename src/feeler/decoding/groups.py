"""Two comparisons: one antenna at several speeds, several antennas at the slowest speed."""

import warnings
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np

from feeler.decoding.codes import JointFit, configure, fit_null, make_codes
from feeler.decoding.curves import Group
from feeler.decoding.labels import make_labels
from feeler.decoding.plan import Plan
from feeler.errors import Doubtful, InvalidInput
from feeler.records.checked import checked
from feeler.tensors.scaling import MUCH, fold_planes, fold_signs, measure_negative, rectify
from feeler.tensors.sides import find_right, measure_peak, mirror_to_left
from feeler.tensors.unit import need


@checked
def group_tensors(
    tensors: Mapping[str, Any],
    encoder: Any,
    plan: Plan,
    *,
    quantity: str = "angle",
    reference: str = "exponential",
    random_state: Annotated[int, "≥ 0"] = 0,
) -> dict[str, dict[str, Group]]:
    """Both comparisons of ``list_groups``, encoded, with a null of jointly fitted codes."""
    settings = {"n_restarts": plan.n_restarts, "random_state": random_state}
    listed = list_groups(tensors, quantity=quantity, reference=reference)
    groups: dict[str, dict[str, Group]] = {}
    nulls: dict[
        bytes, JointFit
    ] = {}  # the slow touches of the reference stand in both comparisons

    def find_null(array: np.ndarray) -> JointFit:
        if (key := array.tobytes()) not in nulls:
            nulls[key] = fit_null(array, configure(encoder, settings), plan.null_iter)
        return nulls[key]

    if "speed" in listed:
        fitted = configure(encoder, settings)
        ends = np.cumsum([len(array) for array, _ in listed["speed"].values()])[:-1]
        codes = make_codes(
            np.concatenate([array for array, _ in listed["speed"].values()]), fitted
        )
        parts = {kind: np.split(code, ends) for kind, code in codes.items()}
        groups["speed"] = {
            name: Group(
                tensors=a,
                labels=y,
                encoder=fitted,
                codes={kind: parts[kind][k] for kind in parts},
                null=find_null(a),
            )
            for k, (name, (a, y)) in enumerate(listed["speed"].items())
        }
    if "profile" in listed:
        groups["profile"] = {}
        for name, (array, labels) in listed["profile"].items():
            fitted = configure(encoder, settings)
            codes = make_codes(array, fitted)
            fields = {"encoder": fitted, "codes": codes, "null": find_null(array)}
            groups["profile"][name] = Group(tensors=array, labels=labels, **fields)
    return groups


@checked
def list_groups(
    tensors: Mapping[str, Any], *, quantity: str = "angle", reference: str = "exponential"
) -> dict[str, dict[str, tuple[np.ndarray, np.ndarray]]]:
    """Tensors and labels of every group, rectified, on one scale, in one order of stimuli.

    ``speed``: the reference antenna at each speed, slowest first; ``profile``: all antennas at the
    slowest speed. A comparison with one group only is left out.

    Touches from the right are mirrored first (:func:`feeler.tensors.mirror_to_left`). Trials that
    do not say their side, as of antennas touched on both, or in space of an azimuth other than 0,
    may bend both ways: where more than a quarter of such a trial's sum of squares is negative,
    bending both ways is kept in all groups, as further sensors
    (:func:`feeler.tensors.fold_signs`), with a ``Doubtful`` warning.
    """
    if reference not in tensors:
        raise InvalidInput(
            f"no tensors of the reference antenna {reference!r}; given: {', '.join(tensors)}."
        )
    for data in tensors.values():
        need(data, quantity, "speed")
    arrays = _rectify_all({name: data[quantity] for name, data in tensors.items()})
    peak = measure_peak(*arrays.values())
    if not peak > 0:
        raise InvalidInput(
            f"no tensor has a {quantity} other than 0: did any contact take place?"
        )
    speed = np.asarray(tensors[reference]["speed"])

    def pick(name: str, wanted: float) -> tuple[np.ndarray, np.ndarray]:
        every = make_labels(tensors[name])
        trials = np.flatnonzero(np.asarray(tensors[name]["speed"]) == wanted)
        trials = trials[np.argsort(every[trials], kind="stable")]
        return arrays[name][trials] / peak, every[trials]

    listed = {
        "speed": {f"{v:g} m/s": pick(reference, v) for v in np.unique(speed)},
        "profile": {name: pick(name, speed.min()) for name in tensors},
    }
    return {comparison: groups for comparison, groups in listed.items() if len(groups) > 1}


def _rectify_all(given: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Tensors (trial, sensor, time) ≥ 0 of all sets, made in one way."""
    sets = {name: fold_planes(mirror_to_left(tensors)) for name, tensors in given.items()}
    lost = max(_measure_other_way(tensors) for tensors in sets.values())
    if lost > MUCH:
        warnings.warn(
            f"up to {lost:.0%} of a touch's signal (sum of squares) is bending the other way, which"
            " rectifying would remove: bending both ways is kept, as twice the sensors.",
            Doubtful,
            stacklevel=4,
        )
    keep = fold_signs if lost > MUCH else rectify
    return {name: keep(tensors).values for name, tensors in sets.items()}


def _measure_other_way(tensors: Any) -> float:
    """The greatest negative share of those trials whose direction no label says."""
    share = measure_negative(tensors)
    if find_right(tensors) is not None:
        known = np.isin(tensors["side"], ("left", "right"))
        share = share[~(known & (np.asarray(tensors.coords.get("azimuth", 0.0)) == 0))]
    return float(share.max(initial=0.0))
