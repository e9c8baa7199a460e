"""What the page does with a message of the server, for tests that listen in its place."""

import json
import struct
import time

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


def talk(*messages):
    """What a session answers to all of these, one after the other."""
    from feeler.studio.session import Session

    said = []
    one = Session(lambda packed: said.append(unpack(packed)))
    for message in messages:
        one.take(json.dumps(message))
        end = time.monotonic() + 60
        while one.busy and time.monotonic() < end:
            time.sleep(0.001)
    return said
