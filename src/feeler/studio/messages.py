"""Messages between page and server: the page sends JSON, the server answers a JSON header and
float32 numbers.

A packed message is four bytes (length of the header, little-endian), the header as JSON padded with
blanks to a multiple of four, and after it the arrays one after the other; ``arrays`` in the header
lists their names and shapes.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from feeler.errors import InvalidInput

MAX_MESSAGE = 8 * 2**20  # [C] of one message from the page: a recording dropped on it


def pack(header: Mapping[str, Any], **arrays: np.ndarray) -> bytes:
    """One message as bytes."""
    numbers = {
        name: np.ascontiguousarray(values, dtype="<f4") for name, values in arrays.items()
    }
    plan = [[name, list(values.shape)] for name, values in numbers.items()]
    text = json.dumps({**header, "arrays": plan}, ensure_ascii=True, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join(
        [struct.pack("<I", len(text)), text, *(values.tobytes() for values in numbers.values())]
    )


def read_message(text: str | bytes) -> dict[str, Any]:
    """A message of the page.

    Raises
    ------
    InvalidInput
        No JSON object with a ``type``, or too long.
    """
    if len(text) > MAX_MESSAGE:
        raise InvalidInput(
            f"a message may have at most {MAX_MESSAGE:,} bytes, got {len(text):,}."
        )
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"a message must be JSON ({str(error)[:80]}).") from None
    if not isinstance(content, dict) or not isinstance(content.get("type"), str):
        raise InvalidInput("a message must be a JSON object with a type.")
    return content
