"""What a page needs to compute touches by itself: an antenna's constants, shapes, the contact law,
and what a decoder has learned, as plain data. Nothing is derived twice.
"""

import base64
import zlib
from typing import Any

import numpy as np
from scipy.fft import dct

from feeler.antenna.antenna import Antenna
from feeler.physics.chain import fields as f
from feeler.physics.chain.model import make_model, stack_shapes
from feeler.physics.contact import get_contact
from feeler.physics.scene import Scene
from feeler.stimulus.feature import Feature
from feeler.stimulus.object import Object

_KINDS = {f.KIND_BALL: "ball", f.KIND_BOX: "box", f.KIND_POLYGON: "polygon"}


def pack_antenna(antenna: Antenna) -> str:
    """The engine's constants (field, segment) of an antenna, to the last bit, as base64."""
    constants = make_model(Scene(antenna=antenna)).constants
    return base64.b64encode(constants.astype("<f8").tobytes()).decode()


def pack_contact() -> dict[str, float]:
    """What of the default contact does not depend on the antenna."""
    contact = get_contact()
    least, _, _, midpoint, power = contact.solimp
    rates = {"lingering": contact.lingering, "crossing": contact.crossing}
    return {"least": least, "midpoint": midpoint, "power": power, **rates}


def pack_shape(feature: Feature, antenna: Antenna) -> dict[str, Any]:
    """A feature as the engine's search for contacts sees it: convex parts, half planes, rounding.

    ``antenna`` is any antenna: a scene has one.
    """
    model = make_model(Scene(antenna=antenna, objects=(Object(feature=feature),)))
    kinds, corners, starts, bounds, _, _ = (table[0] for table in stack_shapes([model]))
    parts = [
        {
            "kind": _KINDS[int(kinds[k])],
            "corners": corners[starts[k] : starts[k + 1]].ravel().tolist(),
            "box": bounds[k].tolist(),
        }
        for k in range(len(model.parts))
    ]
    planes = model.obj[0, f.O_PLANES :].reshape(f.N_PLANES, 3)
    rounding, unbounded = float(feature.rounding), bool(feature.unbounded)
    return {
        "parts": parts,
        "planes": np.asarray(planes).tolist(),
        "rounding": rounding,
        "unbounded": unbounded,
    }


def pack_expected(expected: np.ndarray, step: float) -> dict[str, Any]:
    """What a decoder expects of each class (class, sensor, time), in few bytes: cosines in time of
    few patterns over the sensors, rounded to multiples of ``step``.

    The patterns are principal components and both transforms keep lengths, so
    an expected value is off by less than ``step / 3`` (root mean square).
    """
    n_classes, n_sensors, n_samples = expected.shape
    flat = np.moveaxis(expected, 1, 0).reshape(n_sensors, -1).astype(float)
    shares = np.linalg.eigh(flat @ flat.T)[1][:, ::-1]
    cosines = dct((shares.T @ flat).reshape(-1, n_classes, n_samples), norm="ortho", axis=2)
    step = max(step, float(np.abs(cosines).max()) / 32767)  # whole numbers of 16 bits
    rounded = np.rint(cosines / step)
    rank = int(np.flatnonzero(rounded.any(axis=(1, 2))).max(initial=0)) + 1
    whole = [np.rint(32767 * shares.T[:rank]), rounded[:rank]]
    raw = np.concatenate([part.ravel() for part in whole]).astype("<i2").tobytes()
    data = base64.b64encode(zlib.compress(raw, 9)).decode()
    return {"shape": [n_classes, n_sensors, n_samples, rank], "step": step, "data": data}
