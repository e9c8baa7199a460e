"""On the way to an encoder: non-negative, scaled tensors. Never baked into what is stored."""

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput


def rectify(tensors: xr.DataArray | np.ndarray) -> xr.DataArray | np.ndarray:
    """The tensors with negative values set to 0, as in the published video [D]."""
    return tensors.clip(min=0) if isinstance(tensors, xr.DataArray) else np.clip(tensors, 0, None)


def scale_common(tensors: xr.DataArray | np.ndarray) -> xr.DataArray | np.ndarray:
    """The tensors divided by one common factor, the largest value of the set, so that amplitudes stay comparable."""
    largest = float(np.max(tensors))
    if not (np.isfinite(largest) and largest > 0):
        raise InvalidInput(f"cannot scale tensors whose largest value is {largest}; is there any contact in them?")
    return tensors / largest
