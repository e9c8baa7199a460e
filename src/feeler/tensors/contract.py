"""The one door: every Dataset of tactile tensors passes here, whoever made it."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from feeler.antenna.space import SPACE_PLANES
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.dataset import SOURCES
from feeler.tensors.quantities import DIMS, QUANTITIES, find_dims

BLOCK = 64 * 2**20  # bytes looked at together, so that a lazy Dataset of any size can pass


@checked
def validate(dataset: xr.Dataset) -> xr.Dataset:
    """The same Dataset if it keeps the data contract.

    Raises
    ------
    InvalidInput
        With every breach found, one a line.
    """
    return refuse(find_breaches(dataset), dataset)


def refuse(breaches: list[str], dataset: xr.Dataset) -> xr.Dataset:
    """The Dataset, or one InvalidInput with all its breaches."""
    if breaches:
        raise InvalidInput(
            "not a valid set of tactile tensors:\n"
            + "\n".join(f"  - {breach}" for breach in breaches)
        )
    return dataset


@checked
def find_breaches(
    dataset: xr.Dataset, *, whole: bool = True, numbers: bool = True
) -> list[str]:
    """What is wrong with a Dataset, in words; empty where nothing is.

    With ``whole=False`` what is missing is no breach, as in a file of a single variable; with
    ``numbers=False`` the numbers of variables, which a store reads when they are used, are left
    unread: labels, dims, types and units are looked at.
    """
    if whole and "angle" not in dataset:
        return [
            f"variable 'angle' {DIMS} is missing; found {list(dataset.data_vars) or 'no variables'}"
        ]
    breaches = _find_missing(dataset) if whole else []
    known = [name for name in map(str, dataset.variables) if name in QUANTITIES]
    spatial = "plane" in dataset.dims
    axes, where = (3, " in space") if spatial else (2, "")
    for name in known:
        wanted, dims = find_dims(name, spatial), dataset[name].dims
        if dims != wanted:
            breaches.append(f"'{name}' must have dims {wanted}{where}, got {dims}")
        elif "axis" in dims and dataset.sizes["axis"] != axes:
            breaches.append(
                f"'{name}' must have {axes} axes{where}, got {dataset.sizes['axis']}"
            )
    if spatial and dataset.sizes["plane"] not in (2, len(SPACE_PLANES)):
        breaches.append(
            f"'plane' must be {', '.join(SPACE_PLANES)} or the first two of them, got"
            f" {dataset.sizes['plane']}"
        )
    unread = set() if numbers else set(map(str, dataset.data_vars))
    return breaches or [
        words for name in known for words in _find_value_breaches(dataset, name, name in unread)
    ]


def _find_missing(dataset: xr.Dataset) -> list[str]:
    return [
        f"coordinate '{name}' along {quantity.dims[0]} is missing"
        for name, quantity in QUANTITIES.items()
        if quantity.coordinate and quantity.required and name not in dataset.coords
    ]


def _find_value_breaches(dataset: xr.Dataset, name: str, unread: bool) -> Iterator[str]:
    quantity, item = QUANTITIES[name], dataset[name]
    if item.attrs.get("units", quantity.unit) != quantity.unit:
        yield f"'{name}' must be in {quantity.unit}, says {item.attrs['units']!r}"
    if name == "source":
        unknown = sorted(set(map(str, np.unique(item.values))) - set(SOURCES))
        if unknown:
            yield f"'source' must be one of {', '.join(SOURCES)}, got {unknown}"
    elif quantity.unit and not (
        item.dtype.kind in "fiu" and (unread or quantity.gaps or _is_finite(item))
    ):
        yield f"'{name}' has values that are not finite numbers"
    elif name in ("time", "position") and np.any(np.diff(item.values) <= 0):
        order = "" if name == "time" else "sensors must run from base to tip: "
        yield f"{order}'{name}' must rise strictly"


def _is_finite(item: xr.DataArray) -> bool:
    """Whether every value is finite, looked at block by block."""
    rows = max(1, BLOCK * item.shape[0] // max(item.nbytes, 1)) if item.ndim else 1
    blocks = (
        (item[start : start + rows] for start in range(0, item.shape[0], rows))
        if item.ndim
        else (item,)
    )
    return all(bool(np.isfinite(block.values).all()) for block in blocks)
