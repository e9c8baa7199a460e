"""MATLAB files, version 5, by SciPy.

In MATLAB each variable has its Dataset's name; ``angle`` is (trial, sensor, time), vectors are
rows, texts are char matrices with one row per entry, and ``feeler_description`` is JSON with dims,
units, types and all attributes.
"""

import io
import os
from pathlib import Path

import xarray as xr
from scipy.io import savemat

from feeler.errors import InvalidInput
from feeler.tensors.disk import write_atomic
from feeler.tensors.plain import complete, describe
from feeler.tensors.readers import DESCRIPTION

_MAX_VARIABLE = 2**31 - 1  # bytes; the format's own limit


def save_mat(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a Dataset as a MATLAB version 5 file."""
    dataset = complete(dataset)
    content: dict[str, object] = {}
    for name, variable in dataset.variables.items():
        if variable.nbytes > _MAX_VARIABLE:
            raise InvalidInput(
                f"{name} takes {variable.nbytes:,} bytes; a version 5 file holds 2 GiB. Use NetCDF."
            )
        text = variable.dtype.kind in "UOT"
        content[str(name)] = variable.values.astype(str).ravel() if text else variable.values
    content[DESCRIPTION] = describe(dataset)
    buffer = io.BytesIO()
    savemat(buffer, content, format="5", long_field_names=True, oned_as="row")
    write_atomic(Path(path), buffer.getvalue())
