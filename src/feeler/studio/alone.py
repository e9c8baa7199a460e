"""A page that computes by itself: one file of HTML with the engine in it, which asks no server and
no other host for anything.
"""

import base64
import zlib
from collections.abc import Sequence
from functools import lru_cache, partial
from importlib.metadata import version
from threading import Event
from typing import Annotated, Any

import numpy as np
from scipy.fft import dct

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import match_damping
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.execute.threads import ThreadExecutor, hold_blas
from feeler.physics.chain import fields as f
from feeler.physics.chain.model import make_model, stack_shapes
from feeler.physics.contact import get_contact
from feeler.physics.scene import Scene
from feeler.records.checked import checked
from feeler.stimulus.feature import Feature
from feeler.stimulus.ninety import SPEEDS, trials
from feeler.stimulus.object import Object
from feeler.studio.exporting import fill_page
from feeler.studio.hand import Command
from feeler.studio.study import LOUDNESS, UNSURE, find_study, teach
from feeler.studio.touching import describe_antenna, draw_feature
from feeler.studio.wish import AntennaWish, TouchWish, make_shape

_PAPER = (
    "Meng, McDonnell, Jayaram & Mongeau 2025, Physically intelligent soft antennae enhance tactile"
    " perception by active touch"
)
_DOI = "https://doi.org/10.1101/2025.10.20.683587"
_NAME_LENGTH = 40  # letters of an antenna's name on a switch
_NEARLY_LEVEL = 1.05  # [C] stiffest over softest hinge, up to which an antenna counts as level
_SURE = 0.9  # as the verdict's panel has it
# [C] of what is expected, in the decoder's units, of which its floor is 0.004; the finest with
# which a page stays small
_STEPS = (0.002, 0.004, 0.008)
_LARGEST = 390_000  # characters
_Choice = tuple[str, AntennaWish]
"""An antenna that a page offers: its name and what it is."""
_KINDS = {f.KIND_BALL: "ball", f.KIND_BOX: "box", f.KIND_POLYGON: "polygon"}


@checked
def write_touch_page(
    wish: TouchWish | None = None,
    other: AntennaWish | None = None,
    *,
    unsure: Annotated[float, "≥ 0"] = UNSURE,
    commands: Sequence[Command] | None = None,
    samples: int = 0,
) -> str:
    """The page that computes touches in a browser, as text of HTML.

    It holds two antennas, ``slow`` and ``fast``, ball, box and triangle, and what thirty touches
    taught a decoder for each antenna and speed.

    Parameters
    ----------
    wish
        What it shows first; default: a ball of 1.5 mm meets the cockroach's antenna slowly.
    other
        The second antenna; default: the first one with all hinges equally stiff, or the cockroach's
        where the first is so already.
    unsure
        How well the decoder knows the speed, as a share of it.
    commands, samples
        A run by hand to be shown first, and its length.
    """
    wish = TouchWish() if wish is None else wish.replace(preview=False)
    choices = _choose(wish.antenna, other)
    speeds = sorted({SPEEDS["slow"], wish.speed, SPEEDS["fast"]})
    names = {value: name for name, value in SPEEDS.items()}
    state = {
        "mode": "touch" if commands is None else "hand",
        "A": wish.antenna.to_plain(),
        "B": None,
        "touch": {k: v for k, v in wish.to_plain().items() if k not in ("antenna", "preview")},
        "unsure": unsure,
        "wall": {},
    }
    config = {
        "version": version("feeler"),
        "state": state,
        "contact": _pack_contact(),
        "antennas": [_pack(*choice) for choice in choices],
        "speeds": [{"name": names.get(v, f"{v:g} m/s"), "value": v} for v in speeds],
        "shapes": _pack_shapes(wish.antenna.make()),
        "commands": None if commands is None else list(commands),
        "samples": samples,
        "paper": _PAPER,
        "doi": _DOI,
    }
    for step in _STEPS:
        page = fill_page({**config, "taught": _teach_all(choices, speeds, unsure, step)})
        if len(page) <= _LARGEST:
            break
    return page


def _choose(first: AntennaWish, other: AntennaWish | None) -> list[_Choice]:
    """The two antennas of a page."""
    antenna = first.make()
    if other is not None:
        return [
            (f"A: {antenna.name}"[:_NAME_LENGTH], first),
            (f"B: {other.make().name}"[:_NAME_LENGTH], other),
        ]
    if np.max(antenna.stiffness) <= _NEARLY_LEVEL * np.min(antenna.stiffness):
        return [("graded", AntennaWish()), ("level", first)]
    level = AntennaWish(preset="matched") if first == AntennaWish() else _level(first, antenna)
    return [("graded", first), ("level", level)]


def _level(wish: AntennaWish, antenna: Antenna) -> AntennaWish:
    """The same antenna with equal hinges: of the same total compliance, and of the same damping
    ratio of the first mode.
    """
    even = np.full(antenna.n_segments, antenna.n_segments / np.sum(1 / antenna.stiffness))
    damping = float(match_damping(antenna.replace(stiffness=even), antenna).damping[0])
    stiffness = float(even[0])
    return wish.replace(
        stiffness=((0.0, stiffness), (1.0, stiffness)),
        damping=((0.0, damping), (1.0, damping)),
        matched=False,
        name=f"{antenna.name[:70]}, level",
    )


def _pack(name: str, wish: AntennaWish) -> dict[str, Any]:
    antenna = wish.make()
    return {
        "name": name,
        "wish": wish.to_plain(),
        "constants": _pack_antenna(antenna),
        "finer": round(1 / get_contact(None, antenna).scale_timestep(1.0)),
        "drawn": describe_antenna(antenna),
    }


def _pack_shapes(antenna: Antenna) -> dict[str, Any]:
    """Every kind of shape at a half-width of 1 mm, from which the page makes the others."""
    found = {}
    for kind in ("ball", "box", "triangle", "wall"):
        feature = make_shape(kind, 1.0)
        found[kind] = {**_pack_shape(feature, antenna), "rims": draw_feature(feature)}
    return found


def _teach_all(
    choices: Sequence[_Choice], speeds: Sequence[float], unsure: float, step: float
) -> dict[str, Any]:
    """The thirty touches, and what they taught (antenna, speed)."""
    labels = [
        (trial.feature.kind, trial.feature.size, trial.location) for trial in trials([1.0])
    ]
    wishes = [wish for _, wish in choices for _ in speeds]
    keep = partial(_keep, unsure=unsure, step=step)
    with hold_blas(), ThreadExecutor() as pool:
        kept = list(pool.map(keep, wishes, [*speeds] * len(choices)))
    n = len(speeds)
    return {"labels": labels, "kept": [kept[k : k + n] for k in range(0, len(kept), n)]}


def _keep(wish: AntennaWish, speed: float, unsure: float, step: float) -> dict[str, Any] | None:
    """What a decoder learned; None where this antenna's thirty touches teach nothing."""
    try:
        expected, learned = _teach(wish, speed, unsure)
    except (InvalidInput, SimulationDiverged):
        return None
    return {**learned, **_pack_expected(expected, step)}


@lru_cache(maxsize=12)
def _teach(
    wish: AntennaWish, speed: float, unsure: float
) -> tuple[np.ndarray, dict[str, float | int]]:
    """What the thirty touches of an antenna taught its decoder at a speed: what it expects (class,
    sensor, time), and the peak [rad], the correlation [samples], and of how many touches it names
    the kind surely at their ends.
    """
    known = find_study(wish.make(), speed, unsure)
    if known is not None:
        labels, angle, decoder, peak = known.labels, known.tensors, known.decoder, known.peak
    else:
        labels, angle, decoder, peak = teach(
            wish.make(), speed, lambda doing, share: None, Event(), unsure
        )
    order = [decoder.classes_.index(label) for label in labels]
    kinds = np.array([label[0] for label in labels])
    posterior = decoder.decide(list(LOUDNESS / peak * angle))[:, order]
    right = np.sum(posterior, axis=1, where=kinds[:, None] == kinds)
    sure = int(np.sum(right >= _SURE))
    learned = {"peak": peak, "correlation": decoder.correlation_, "sure": sure}
    return decoder.expected_[order].astype(np.float32), learned


def _pack_antenna(antenna: Antenna) -> str:
    """The engine's constants (field, segment) of an antenna, to the last bit, as base64."""
    contact = get_contact(None, antenna)
    constants = make_model(Scene(antenna=antenna, contact=contact)).constants
    return base64.b64encode(constants.astype("<f8").tobytes()).decode()


def _pack_contact() -> dict[str, float]:
    """What of the default contact does not depend on the antenna."""
    contact = get_contact()
    least, _, _, midpoint, power = contact.solimp
    rates = {"lingering": contact.lingering, "crossing": contact.crossing}
    return {"least": least, "midpoint": midpoint, "power": power, **rates}


def _pack_shape(feature: Feature, antenna: Antenna) -> dict[str, Any]:
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


def _pack_expected(expected: np.ndarray, step: float) -> dict[str, Any]:
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
