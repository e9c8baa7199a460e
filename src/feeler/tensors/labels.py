"""Labels that travel along: who hands in a labelled array gets one back."""

from typing import Any

import numpy as np
import xarray as xr


def label_like(
    values: np.ndarray, given: Any, dims: tuple[str, ...], name: str, **attrs: object
) -> Any:
    """``values`` with these dims and the coordinates of ``given`` along them; plain where ``given``
    is plain.
    """
    if not isinstance(given, xr.DataArray):
        return values
    sizes = dict(zip(dims, values.shape, strict=True))
    coords = {
        key: item
        for key, item in given.coords.items()
        if item.dims and all(sizes.get(str(dim)) == given.sizes[dim] for dim in item.dims)
    }
    return xr.DataArray(values, dims=dims, coords=coords, name=name, attrs=attrs)
