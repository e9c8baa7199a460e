"""Two comparisons: one antenna at several speeds, several antennas at the slowest speed."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np

from feeler.decoding.codes import JointFit, configure, fit_null, make_codes
from feeler.decoding.curves import Group
from feeler.decoding.labels import make_labels
from feeler.decoding.plan import Plan
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.scaling import fold_planes, rectify
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
    """
    if reference not in tensors:
        raise InvalidInput(
            f"no tensors of the reference antenna {reference!r}; given: {', '.join(tensors)}."
        )
    for data in tensors.values():
        need(data, quantity, "speed")
    peak = max(float(data[quantity].max()) for data in tensors.values())
    if not peak > 0:
        raise InvalidInput(f"no tensor has a positive {quantity}: did any contact take place?")
    speed = np.asarray(tensors[reference]["speed"])

    def pick(data: Any, wanted: float) -> tuple[np.ndarray, np.ndarray]:
        every = make_labels(data)
        trials = np.flatnonzero(np.asarray(data["speed"]) == wanted)
        trials = trials[np.argsort(every[trials], kind="stable")]
        return rectify(fold_planes(data[quantity]).values[trials]) / peak, every[trials]

    listed = {
        "speed": {f"{v:g} m/s": pick(tensors[reference], v) for v in np.unique(speed)},
        "profile": {name: pick(data, speed.min()) for name, data in tensors.items()},
    }
    return {comparison: groups for comparison, groups in listed.items() if len(groups) > 1}
