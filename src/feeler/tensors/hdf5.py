"""HDF5 files (NetCDF, NWB) read in a process of their own, where a hostile file can crash or stall the C library.

That process may take no more memory and time than the limits say, loads no filter plug-ins, and follows no link out of
the file.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.tensors.arrays import unpack_arrays
from feeler.tensors.limits import Limits, find_limits, parse_json
from feeler.tensors.plain import restore
from feeler.tensors.table import restore_numbers

MAGIC = b"\x89HDF\r\n\x1a\n"
GRACE = 10.0  # s for starting the process
_ERROR = "error"


def load_hdf5(path: str | os.PathLike, limits: Limits | None = None) -> xr.Dataset:
    """The Dataset in a NetCDF-4 or NWB file.

    Raises
    ------
    InvalidInput
        Not HDF5, damaged (also where the HDF5 library crashes or hangs over it), over the limits, or with links out of
        the file.
    """
    limits, source = find_limits(limits), Path(path).name
    arrays, notes = unpack_arrays(_ask(os.fspath(path), limits, source), source, _doubled(limits))
    return build_dataset(arrays, notes, source)


def build_dataset(arrays: dict[str, np.ndarray], notes: dict[str, str], source: str) -> xr.Dataset:
    """The Dataset from what the reading process sent."""
    if _ERROR in notes:
        raise InvalidInput(f"{source}: {notes[_ERROR]}")
    content = parse_json(notes.get("description", "").encode("utf-8", "replace"), f"the description in {source}")
    return _build_series(content, arrays, source) if "nwb" in notes else restore(content, arrays, source)


def _build_series(content: dict[str, Any], arrays: dict[str, np.ndarray], source: str) -> xr.Dataset:
    """The Dataset of an NWB file: one series per variable and trial, (time, …)."""
    try:
        dataset = restore(content["rest"], restore_numbers(content["numbers"]), source)
        for name, kind in content["series"].items():
            titles = sorted(title for title in arrays if title.rpartition("_")[0] == name)
            values = np.stack([arrays[title] for title in titles])
            order = ["trial", "time", *(dim for dim in kind["dims"] if dim not in ("trial", "time"))]
            variable = xr.Variable(order, values, dict(kind["attributes"])).transpose(*kind["dims"])
            dataset = dataset.assign({name: variable})
        return dataset
    except InvalidInput:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InvalidInput(f"{source} is damaged: its notes do not fit its series ({str(error)[:100]}).") from error


def _doubled(limits: Limits) -> Limits:
    """Room for the answer, which holds texts and numbers."""
    return Limits(max_bytes=2 * limits.max_bytes, max_arrays=limits.max_arrays, max_text=2 * limits.max_text)


def _ask(path: str, limits: Limits, source: str) -> bytes:
    command = [sys.executable, "-P", "-m", "feeler.tensors.hdf5_child", path]
    command += [str(limits.max_bytes), str(limits.max_arrays), str(limits.max_text), str(limits.max_seconds)]
    environment = {**os.environ, "HDF5_PLUGIN_PRELOAD": "::", "HDF5_USE_FILE_LOCKING": "FALSE"}
    try:
        answer = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=limits.max_seconds + GRACE, env=environment
        )
    except subprocess.TimeoutExpired:
        raise InvalidInput(f"{source} was not read within {limits.max_seconds:g} s (Limits.max_seconds).") from None
    except (OSError, ValueError) as error:
        raise InvalidInput(f"cannot read {source}: {error}.") from error
    if answer.returncode:
        raise InvalidInput(f"{source} is damaged or hostile: the HDF5 library {_describe(answer.returncode)} over it.")
    return answer.stdout


def _describe(code: int) -> str:
    if code == -signal.SIGXCPU:
        return "took too long"
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"gave up (exit code {code})"
