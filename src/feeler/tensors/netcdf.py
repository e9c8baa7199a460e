"""NetCDF-4 files, as xarray, MATLAB's ncread and Panoply open them."""

import errno
import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.disk.provenance import make_plain
from feeler.errors import InvalidInput
from feeler.tensors.plain import complete, describe
from feeler.tensors.readers import DESCRIPTION


def save_netcdf(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a Dataset as NetCDF-4; its attribute ``feeler_description`` restores it exactly."""
    path, dataset = Path(path), complete(dataset)
    description = describe(dataset)
    plain = dataset.copy(deep=False)
    plain.attrs = {
        **_attributes(dataset.attrs),
        DESCRIPTION: description,
        "Conventions": "CF-1.8",
    }
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in plain.variables.items():
        variable.attrs = _attributes(variable.attrs)
        variable.encoding = {}
        encoding[str(name)] = {"_FillValue": None} if variable.dtype.kind == "f" else {}
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        free = shutil.disk_usage(path.parent).free
        if (
            free < dataset.nbytes
        ):  # HDF5 may crash the process where the room ends while it writes
            raise OSError(errno.ENOSPC, "")
        plain.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)
        os.replace(temporary, path)
    except OSError as error:
        raise InvalidInput(
            f"cannot write {path}: {_explain(error)}. Check the folder and the room left."
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def _explain(error: OSError) -> str:
    """The system's words for an error; HDF5 hides its number in lines about its own inside."""
    hidden = re.search(r"errno = (\d+)", str(error))
    number = error.errno or (int(hidden[1]) if hidden else 0)
    return os.strerror(number) if number else str(error).split("\n")[0][:100]


def _attributes(attributes: dict[str, Any]) -> dict[str, Any]:
    """NetCDF has texts, numbers and lists of numbers; anything else becomes JSON."""
    found = {}
    for name, value in attributes.items():
        simple = isinstance(value, str | int | float | np.number) and not isinstance(
            value, bool
        )
        found[name] = value if simple else json.dumps(make_plain(value), ensure_ascii=False)
    return found
