"""NumPy archives (.npz) with limits: sizes are checked before anything is unpacked, and pickled content is refused."""

import ast
import io
import math
import os
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np

from feeler.errors import InvalidInput
from feeler.tensors.limits import Limits, find_limits, read_bytes

MAX_HEADER = 10_000


def read_npz(path: str | os.PathLike, limits: Limits | None = None) -> dict[str, np.ndarray]:
    """Arrays by name of an .npz file.

    Raises
    ------
    InvalidInput
        No such archive, damaged, over the limits, or with anything but plain numbers and texts of fixed length.
    """
    limits, source = find_limits(limits), Path(path).name
    raw = read_bytes(path, limits.max_bytes)
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            members = archive.infolist()
            if len(members) > limits.max_arrays:
                raise InvalidInput(f"{source} holds {len(members)} arrays; the limit is {limits.max_arrays}.")
            limits.check_bytes(sum(member.file_size for member in members), source)
            return {member.filename.removesuffix(".npy"): _read(archive, member, source) for member in members}
    except (
        zipfile.BadZipFile,
        zlib.error,
        OSError,
        EOFError,
        RuntimeError,
        NotImplementedError,
        struct.error,
    ) as error:
        raise InvalidInput(f"{source} is no .npz archive, or is damaged ({str(error)[:100]}).") from error
    except (
        ValueError,
        TypeError,
        KeyError,
        IndexError,
        SyntaxError,
        MemoryError,
        RecursionError,
        OverflowError,
    ) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{source} is damaged ({str(error)[:100]}).") from error


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo, source: str) -> np.ndarray:
    with archive.open(member) as file:
        data = file.read(member.file_size + 1)
    name = member.filename[:60]
    if len(data) != member.file_size or data[:6] != b"\x93NUMPY" or data[6] not in (1, 2, 3):
        raise InvalidInput(f"{source}: {name!r} is no NumPy array, or is damaged.")
    width = 2 if data[6] == 1 else 4
    start = 8 + width + int.from_bytes(data[8 : 8 + width], "little")
    if not 8 + width < start <= min(len(data), MAX_HEADER):
        raise InvalidInput(f"{source}: the header of {name!r} is damaged.")
    header = ast.literal_eval(data[8 + width : start].decode("latin-1"))
    kind, shape = np.dtype(header["descr"]), header["shape"]
    if kind.kind not in "biufSU" or not all(isinstance(n, int) and n >= 0 for n in shape):
        raise InvalidInput(f"{source}: {name!r} has the type {kind} and the shape {str(shape)[:60]}; refused.")
    if math.prod(shape) * kind.itemsize != len(data) - start:
        raise InvalidInput(
            f"{source}: {name!r} has {len(data) - start:,} bytes, which do not fit the shape {str(shape)[:60]}."
        )
    order = "F" if header["fortran_order"] else "C"
    return np.frombuffer(data, kind, offset=start).reshape(shape, order=order).copy(order="K")
