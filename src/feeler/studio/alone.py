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
from scipy.fft import dct, idct

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
from feeler.stimulus.ninety import SPEEDS
from feeler.stimulus.object import Object
from feeler.studio.decoder import ANSWERS, NOISE
from feeler.studio.exporting import fill_page
from feeler.studio.hand import Command
from feeler.studio.study import UNSURE, train
from feeler.studio.touching import describe_antenna, draw_feature
from feeler.studio.wish import AntennaWish, TouchWish, make_shape

_PAPER = (
    "Meng, McDonnell, Jayaram & Mongeau 2025, Physically intelligent soft antennae enhance tactile"
    " perception by active touch"
)
_DOI = "https://doi.org/10.1101/2025.10.20.683587"
_NAME_LENGTH = 40  # letters of an antenna's name on a switch
_NEARLY_LEVEL = (
    1.05  # [C] stiffest over softest hinge, up to which an antenna counts as uniform
)
# [C] of what a decoder was trained on, in rad; the finest with which a page stays small
_STEPS = (0.008, 0.016)
_LARGEST = 480_000  # characters
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

    It holds two antennas, ``slow`` and ``fast``, ball, box and triangle, and a decoder for each
    antenna and speed, trained on touches at random locations and of random sizes.

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
        return [("graded", AntennaWish()), ("uniform", first)]
    level = AntennaWish(preset="matched") if first == AntennaWish() else _level(first, antenna)
    return [("graded", first), ("uniform", level)]


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
        name=f"{antenna.name[:70]}, uniform",
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
    """The decoders of a page (antenna, speed), and what they answer."""
    wishes = [wish for _, wish in choices for _ in speeds]
    keep = partial(_keep, unsure=unsure, step=step)
    with hold_blas(), ThreadExecutor() as pool:
        kept = list(pool.map(keep, wishes, [*speeds] * len(choices)))
    n = len(speeds)
    return {
        "answers": ANSWERS,
        "noise": NOISE,
        "kept": [kept[k : k + n] for k in range(0, len(kept), n)],
    }


@lru_cache(maxsize=24)
def _keep(wish: AntennaWish, speed: float, unsure: float, step: float) -> dict[str, Any] | None:
    """A decoder as the page reads it; None where this antenna's touches teach nothing."""
    packed: dict[str, Any] = {}

    def coarsen(templates: np.ndarray) -> np.ndarray:
        found, packed["templates"] = _pack_expected(templates, step)
        return found

    try:
        decoder, trained, scores = train(
            wish.make(), speed, lambda doing, share: None, Event(), unsure, coarsen
        )
    except (InvalidInput, SimulationDiverged):
        return None
    antenna, most = wish.make(), np.abs(decoder.templates_).max(axis=(0, 2))
    return {
        **packed,
        "peak": float(most.max()),
        "curvature": float((most / antenna.segment_length[antenna.sensors - 1]).max()),
        "kinds": decoder.kinds_.tolist(),
        "onset": decoder.onset,
        "noise": decoder.noise,
        "tempering": decoder.tempering_,
        "limit": [float(f"{value:.4g}") for value in decoder.limit_],
        "range": trained.to_plain(),
        "scores": scores,
    }


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


def _pack_expected(expected: np.ndarray, step: float) -> tuple[np.ndarray, dict[str, Any]]:
    """What a decoder expects (template, sensor, time), rounded, and the same in few bytes: cosines
    in time of few patterns over the sensors, rounded to multiples of ``step``.

    The patterns are principal components and both transforms keep lengths, so
    an expected value is off by less than ``step / 3`` (root mean square).
    """
    n_templates, n_sensors, n_samples = expected.shape
    flat = np.moveaxis(expected, 1, 0).reshape(n_sensors, -1).astype(float)
    shares = np.linalg.eigh(flat @ flat.T)[1][:, ::-1]
    cosines = dct((shares.T @ flat).reshape(-1, n_templates, n_samples), norm="ortho", axis=2)
    step = max(step, float(np.abs(cosines).max()) / 32767)  # whole numbers of 16 bits
    rounded = np.rint(cosines / step)
    rank = int(np.flatnonzero(rounded.any(axis=(1, 2))).max(initial=0)) + 1
    whole = [np.rint(32767 * shares.T[:rank]), rounded[:rank]]
    raw = np.concatenate([part.ravel() for part in whole]).astype("<i2").tobytes()
    data = base64.b64encode(zlib.compress(raw, 9)).decode()
    series = step * idct(whole[1], norm="ortho", axis=2)
    found = np.einsum("ms,mnt->nst", whole[0] / 32767, series, optimize=True)
    packed = {"shape": [n_templates, n_sensors, n_samples, rank], "step": step, "data": data}
    return found.astype(np.float32), packed
