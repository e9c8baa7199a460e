"""A page that computes by itself: one file of HTML with the engine in it, which asks no server and
no other host for anything.
"""

from collections.abc import Sequence
from functools import lru_cache, partial
from importlib.metadata import version
from threading import Event
from typing import Any, NamedTuple

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import match_damping
from feeler.checked import checked
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.execute.threads import ThreadExecutor, hold_blas
from feeler.stimulus.ninety import SPEEDS, trials
from feeler.studio.exporting import fill_page
from feeler.studio.hand import Command
from feeler.studio.packing import pack_antenna, pack_contact, pack_expected, pack_shape
from feeler.studio.study import LOUDNESS, UNSURE, find_study, teach
from feeler.studio.touching import describe_antenna, draw_feature
from feeler.studio.wish import AntennaWish, TouchWish, make_shape

_PAPER = (
    "Meng, McDonnell, Jayaram & Mongeau 2025, Physically intelligent soft antennae enhance tactile"
    " perception by active touch"
)
DOI = "https://doi.org/10.1101/2025.10.20.683587"
NAME_LENGTH = 40  # letters of an antenna's name on a switch
NEARLY_LEVEL = 1.05  # [C] stiffest over softest hinge, up to which an antenna counts as level
_SURE = 0.9  # as the verdict's panel has it
# [C] of what is expected, in the decoder's units, of which its floor is 0.004; the finest with
# which a page stays small
_STEPS = (0.002, 0.004, 0.008)
_LARGEST = 390_000  # characters


class Choice(NamedTuple):
    """An antenna that a page offers."""

    name: str
    wish: AntennaWish


@checked
def write_touch_page(
    wish: TouchWish | None = None,
    other: AntennaWish | None = None,
    *,
    unsure: float = UNSURE,
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
    state = {
        "mode": "touch" if commands is None else "hand",
        "A": wish.antenna.to_plain(),
        "B": None,
        "touch": _describe_touch(wish),
        "unsure": unsure,
        "wall": {},
    }
    config = {
        "version": version("feeler"),
        "state": state,
        "contact": pack_contact(),
        "antennas": [_pack(choice) for choice in choices],
        "speeds": [{"name": _name_speed(speed), "value": speed} for speed in speeds],
        "shapes": _pack_shapes(wish.antenna.make()),
        "commands": None if commands is None else list(commands),
        "samples": samples,
        "paper": _PAPER,
        "doi": DOI,
    }
    for step in _STEPS:
        page = fill_page({**config, "taught": _teach_all(choices, speeds, unsure, step)})
        if len(page) <= _LARGEST:
            break
    return page


def _choose(first: AntennaWish, other: AntennaWish | None) -> list[Choice]:
    """The two antennas of a page."""
    antenna = first.make()
    if other is not None:
        return [
            Choice(f"A: {antenna.name}"[:NAME_LENGTH], first),
            Choice(f"B: {other.make().name}"[:NAME_LENGTH], other),
        ]
    if np.max(antenna.stiffness) <= NEARLY_LEVEL * np.min(antenna.stiffness):
        return [Choice("graded", AntennaWish()), Choice("level", first)]
    level = AntennaWish(preset="matched") if first == AntennaWish() else _level(first, antenna)
    return [Choice("graded", first), Choice("level", level)]


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


def _name_speed(speed: float) -> str:
    names = {value: name for name, value in SPEEDS.items()}
    return names.get(speed, f"{speed:g} m/s")


def _describe_touch(wish: TouchWish) -> dict[str, Any]:
    plain = wish.to_plain()
    return {name: value for name, value in plain.items() if name not in ("antenna", "preview")}


def _pack(choice: Choice) -> dict[str, Any]:
    antenna = choice.wish.make()
    return {
        "name": choice.name,
        "wish": choice.wish.to_plain(),
        "constants": pack_antenna(antenna),
        "drawn": describe_antenna(antenna),
    }


def _pack_shapes(antenna: Antenna) -> dict[str, Any]:
    """Every kind of shape at a half-width of 1 mm, from which the page makes the others."""
    found = {}
    for kind in ("ball", "box", "triangle", "wall"):
        feature = make_shape(kind, 1.0)
        found[kind] = {**pack_shape(feature, antenna), "rims": draw_feature(feature)}
    return found


def _teach_all(
    choices: Sequence[Choice], speeds: Sequence[float], unsure: float, step: float
) -> dict[str, Any]:
    """The thirty touches, and what they taught (antenna, speed)."""
    labels = [(trial.feature.kind, trial.feature.size, trial.location) for trial in trials([1.0])]
    wishes = [choice.wish for choice in choices for _ in speeds]
    keep = partial(_keep, unsure=unsure, step=step)
    with hold_blas(), ThreadExecutor() as pool:
        kept = list(pool.map(keep, wishes, [*speeds] * len(choices)))
    n = len(speeds)
    return {"labels": labels, "kept": [kept[k : k + n] for k in range(0, len(kept), n)]}


def _keep(wish: AntennaWish, speed: float, unsure: float, step: float) -> dict[str, Any] | None:
    """What a decoder learned; None where this antenna's thirty touches teach nothing."""
    try:
        learned = _teach(wish, speed, unsure)
    except (InvalidInput, SimulationDiverged):
        return None
    about = {"peak": learned.peak, "correlation": learned.correlation, "sure": learned.sure}
    return {**about, **pack_expected(learned.expected, step)}


class Learned(NamedTuple):
    """What the thirty touches of an antenna taught its decoder at a speed."""

    expected: np.ndarray  # (class, sensor, time)
    peak: float  # rad
    correlation: float  # samples
    sure: int  # touches whose kind it names surely at their ends


@lru_cache(maxsize=12)
def _teach(wish: AntennaWish, speed: float, unsure: float) -> Learned:
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
    expected = decoder.expected_[order].astype(np.float32)
    return Learned(expected, peak, decoder.correlation_, int(np.sum(right >= _SURE)))
