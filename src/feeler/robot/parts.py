"""Which part of the reality gap costs what: surrogate robots that differ in one way only."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from typing import Annotated

from feeler.antenna import Antenna
from feeler.decoding.transfer import TransferClassifier, TransferScore
from feeler.errors import InvalidInput
from feeler.progress import Advance, show_progress
from feeler.records.checked import checked
from feeler.robot.gap import Gap
from feeler.robot.preset import make_robot
from feeler.robot.reality import draw_robots, make_training, measure_transfer, touch_robots
from feeler.robot.surrogate import make_tip_touches
from feeler.stimulus import Trial

# rad [C], a hundredth of a gap's noise: a channel that repeats one value to the last bit counts as
# broken
_QUIET = 4e-5
_ENTRIES = tuple(entry.name for entry in fields(Gap))
_MECHANICS = ("stiffness", "stiffness_each", "damping", "mass", "length", "rest_angle", "play")
_TOUCH = ("location", "speed", "size", "approach", "friction")
_SENSING = tuple(name for name in _ENTRIES if name not in _MECHANICS + _TOUCH)
PARTS: dict[str, tuple[str, ...]] = {
    "nothing": (),
    "everything": _ENTRIES,
    "all mechanics": _MECHANICS,
    "all of the touch": _TOUCH,
    "all sensing": _SENSING,
    **{
        name: (name,)
        for name in (
            "play",
            "noise",
            "drift",
            "gain",
            "crosstalk",
            "hysteresis",
            "bend",
            "dropped",
        )
    },
}
"""Parts of the gap by name, and the entries of :class:`Gap` that each keeps."""


@checked
def keep_parts(names: Collection[str], gap: Gap | None = None) -> Gap:
    """One reality gap with only these entries, the others 0."""
    whole = Gap() if gap is None else gap
    if unknown := [name for name in names if name not in _ENTRIES]:
        raise InvalidInput(f"a gap has no entry {unknown[0]!r}; valid: {', '.join(_ENTRIES)}.")
    return Gap(**{name: getattr(whole, name) if name in names else 0.0 for name in _ENTRIES})


@checked
def measure_parts(
    antenna: Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    parts: Mapping[str, Collection[str]] | None = None,
    n_robots: Annotated[int, "> 0"] = 20,
    seed: Annotated[int, "≥ 0"] = 0,
    progress: Advance | None = None,
) -> dict[str, TransferScore]:
    """Train on simulated touches, test on surrogate robots with one part of the gap each.

    Parameters
    ----------
    parts
        Entries of :class:`Gap` to keep, by a name; default :data:`PARTS`.
    trials
        What is told apart; by default the paper's thirty touches, tested on its six tip contacts.
        Own touches are all tested.
    progress
        Called with (done, total) parts; default: a bar that appears after 5 s.
    """
    training = make_training(antenna, trials)
    classifier = TransferClassifier().fit(training.values, training.labels)
    tested, nominal = (
        (make_tip_touches() if trials is None else list(trials)),
        antenna or make_robot(),
    )
    parts, scores = PARTS if parts is None else parts, {}
    with show_progress(progress, "parts of the gap") as advance:
        for done, (name, entries) in enumerate(parts.items(), 1):
            gap = keep_parts(
                {"noise", *entries}, Gap() if "noise" in entries else Gap(noise=_QUIET)
            )
            robots = draw_robots(1.0, n_robots, seed, gap=gap, nominal=nominal)
            scores[name] = measure_transfer(
                classifier, touch_robots(robots, trials=tested, antenna=nominal)
            )
            advance(done, len(parts))
    return scores
