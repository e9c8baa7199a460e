"""What the page does with a message of the server, for tests that listen in its place."""

import json
import struct

import numpy as np


def unpack(data):
    """Header and arrays of a packed message."""
    (length,) = struct.unpack_from("<I", data)
    header = json.loads(data[4 : 4 + length])
    arrays, place = {}, 4 + length
    for name, shape in header.pop("arrays"):
        count = int(np.prod(shape))
        arrays[name] = np.frombuffer(data, "<f4", count, place).reshape(shape)
        place += 4 * count
    return header, arrays
