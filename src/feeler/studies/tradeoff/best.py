"""Best speeds: which speed an ideal observer would choose for each window, with intervals over the
sets.
"""

import numpy as np
import xarray as xr
from scipy.special import stdtrit

from feeler.errors import InvalidInput
from feeler.tensors.transforms import need
from feeler.validation import checked, show

_LEVEL = 0.95


@checked
def average_sets(values: xr.DataArray) -> xr.Dataset:
    """``mean`` over sets and ``half``, half the width of its 95 % interval (Student's t; NaN for
    one set).
    """
    if "set" not in values.dims:
        raise InvalidInput(f"values need the dimension 'set', got {show(values.dims)}.")
    count = values.sizes["set"]
    half = (
        values.std("set", ddof=1) * stdtrit(count - 1, (1 + _LEVEL) / 2) / np.sqrt(count)
        if count > 1
        else np.nan
    )
    mean = values.mean("set")
    return xr.Dataset({"mean": mean, "half": half + 0 * mean})


@checked
def find_best(measured: xr.Dataset, level: str, field: str = "accuracy") -> xr.Dataset:
    """For each window the speed with the greatest mean, and how sure that is.

    Returns
    -------
    xarray.Dataset
        By window: ``best`` and ``second`` speed [m/s], ``mean`` and ``half`` of the best, and the
        paired difference to the second over the same sets, ``gain`` ± ``gain_half``. ``least`` and
        ``most``: range of speeds that the sets do not tell from the best.
    """
    need(measured, field, "speed", "level")
    if level not in measured["level"]:
        raise InvalidInput(
            f"there is no level {level!r}; there are: {measured['level'].values}."
        )
    values = measured[field].sel(level=level)
    mean = values.mean("set")
    order = np.argsort(-mean.values, axis=0, kind="stable")
    speeds, windows = measured["speed"].values, np.arange(measured.sizes["window"])
    best, second = order[0], order[min(1, len(order) - 1)]
    difference = values.isel(speed=xr.DataArray(best, dims="window")) - values
    found = average_sets(difference.transpose("set", "speed", "window"))
    tied = found["mean"].values <= np.nan_to_num(found["half"].values)
    own, gain = average_sets(values), found.isel(speed=xr.DataArray(second, dims="window"))
    place = speeds[:, None] + 0 * mean.values
    columns = {
        "best": speeds[best],
        "second": speeds[second],
        "mean": own["mean"].values[best, windows],
        "half": own["half"].values[best, windows],
        "gain": gain["mean"].values,
        "gain_half": gain["half"].values,
        "least": np.where(tied, place, np.inf).min(axis=0),
        "most": np.where(tied, place, -np.inf).max(axis=0),
    }
    coords = {name: measured[name] for name in ("window", "kind", "value")}
    return xr.Dataset({name: ("window", value) for name, value in columns.items()}, coords)
