"""Export: a Dataset as a file, whose ending says which kind."""

import os
from collections.abc import Callable
from pathlib import Path

import xarray as xr

from feeler.errors import InvalidInput
from feeler.tensors.mat import save_mat
from feeler.tensors.netcdf import save_netcdf
from feeler.tensors.store import open_store
from feeler.tensors.table import save_csv


def save(dataset: xr.Dataset, path: str | os.PathLike, **options: object) -> None:
    """Write a Dataset; the ending chooses ``.zarr``, ``.nc``, ``.mat``, ``.csv`` or ``.nwb``.

    CSV holds one tensor (``variable=``, ``trial=``), NWB asks for ``session_start=`` and ``identifier=``. Every
    kind carries configuration, units, versions and licence.

    Raises
    ------
    InvalidInput
        Another ending, or a Dataset that the kind cannot hold.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise InvalidInput(f"unknown ending {suffix!r} of {path}; valid: {', '.join(WRITERS)}.")
    WRITERS[suffix](dataset, path, **options)


def save_zarr(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a Dataset as a store, all trials at once; the folder must be new or empty."""
    if dataset.sizes.get("trial", 0) < 1:
        raise InvalidInput(f"a store holds trials; the Dataset has the sizes {dict(dataset.sizes)}.")
    configuration = {"configuration": dataset.attrs.get("configuration", "")}
    with open_store(path, configuration, dataset.sizes["trial"]) as store:
        if store.finished:
            raise InvalidInput(f"{path} already holds trials. Choose a new folder.")
        for index in range(dataset.sizes["trial"]):
            store.append(index, dataset.isel(trial=[index]))


def _save_nwb(dataset: xr.Dataset, path: str | os.PathLike, **options: object) -> None:
    from feeler.tensors.nwb import save_nwb

    save_nwb(dataset, path, **options)


WRITERS: dict[str, Callable[..., None]] = {
    ".zarr": save_zarr,
    ".nc": save_netcdf,
    ".mat": save_mat,
    ".csv": save_csv,
    ".nwb": _save_nwb,
}
