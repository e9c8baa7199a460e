"""Sampled trials: random touches by the thousand or million, the k-th the same however many are
drawn.
"""

from collections.abc import Mapping, Sequence
from typing import Any, overload

import numpy as np

from feeler.antenna.animals import cockroach
from feeler.antenna.segments import Antenna
from feeler.draw import Drawn, LogRange, Spread, describe_spread, draw_shares, spread_out
from feeler.errors import InvalidInput
from feeler.objects.motion import BaseMotion
from feeler.objects.shapes import Feature, make_feature
from feeler.objects.trials import LEAD, Trial, place
from feeler.provenance import compute_digest, to_jsonable
from feeler.validation import Seed, checked

_ATTEMPTS = 20  # [C] draws of one touch before its ranges are said not to fit
_HOPELESS = 0.9  # [C] share of touches that do not fit from which no other draw is tried
_FIELDS = ("location", "speed", "approach", "friction", "lead")
TURNED = "azimuth"  # a field of trials in space, a column only where it is asked for
_BASE = ("x", "y", "turn")


@checked
class SampledTrials(Sequence[Trial]):
    """Random trials as columns; a Trial is made when it is asked for, so that a million take little
    memory.

    Attributes
    ----------
    columns
        Values (trial,) by name: ``feature`` (its number among ``features``), ``size``,
        ``location``, ``speed``, ``approach``, ``friction``, ``lead``, ``right`` and, where they are
        asked for, ``azimuth``, and ``x``, ``y`` and ``turn`` of the base.
    features
        What touches, at any size.
    antenna
        The antenna that each of them is known to fit.
    recipe
        Plain data that draw the same again.
    """

    def __init__(
        self,
        columns: dict[str, np.ndarray],
        features: tuple[Feature, ...],
        antenna: Antenna | None,
        recipe: dict[str, Any],
    ) -> None:
        self.columns, self.features, self.antenna, self.recipe = (
            columns,
            features,
            antenna,
            recipe,
        )

    def __len__(self) -> int:
        return len(self.columns["feature"])

    @overload
    def __getitem__(self, index: int) -> Trial: ...
    @overload
    def __getitem__(self, index: slice) -> "SampledTrials": ...
    def __getitem__(self, index: int | slice) -> "Trial | SampledTrials":
        if isinstance(index, slice):
            rows = range(len(self))[index]
            columns = {name: values[index] for name, values in self.columns.items()}
            chosen = {
                "first": self.recipe.get("first", 0) + rows.start * self.recipe.get("step", 1)
            }
            chosen["step"] = rows.step * self.recipe.get("step", 1)
            return SampledTrials(
                columns, self.features, self.antenna, {**self.recipe, **chosen}
            )
        row = {name: values[index].item() for name, values in self.columns.items()}
        feature = self.features[row["feature"]]
        if not np.isnan(row["size"]) and feature.size != row["size"]:
            feature = feature.scale(row["size"] / feature.size)
        base = (
            BaseMotion(velocity=(row["x"], row["y"]), turn=row["turn"]) if "x" in row else None
        )
        fields = {name: row[name] for name in (*_FIELDS, TURNED) if name in row}
        return Trial(
            feature=feature, side="right" if row["right"] else "left", base=base, **fields
        )

    def __repr__(self) -> str:
        spans = [
            f"{name} {self.columns[name].min():.3g} … {self.columns[name].max():.3g}"
            for name in ("size", *_FIELDS[:2])
        ]
        return (
            f"{len(self):,} sampled trials"
            f" ({', '.join(feature.name for feature in self.features)}): {', '.join(spans)}"
        )


@checked
def sample_trials(
    n: Drawn,
    *,
    features: Sequence[Any] = ("ball", "box", "triangle"),
    sizes: Spread | None = LogRange(1.0, 4.0),
    locations: Spread = (0.4, 0.95),
    speeds: Spread = LogRange(0.06, 0.6),
    approach: Spread = (70.0, 110.0),
    friction: Spread = (0.5, 1.0),
    lead: Spread = LEAD,
    azimuth: Spread = 0.0,
    sides: Sequence[str] = ("left", "right"),
    base: Mapping[str, Any] | None = None,
    antenna: Antenna | None = None,
    seed: Seed = 0,
) -> SampledTrials:
    """Random touches by ranges or distributions; the k-th is the same however many are drawn.

    Each of ``sizes``, ``locations``, ``speeds``, ``approach``, ``friction``, ``lead`` and
    ``azimuth`` is a number, a range (low, high), a list of choices, a ``LogRange``, or a frozen
    distribution of scipy.stats. Every parameter has a random stream of its own, so that another
    range for one leaves the others as they were. A touch that cannot be placed is drawn again. The
    defaults are choices [C] around the paper's ninety touches.

    Parameters
    ----------
    features
        Kinds, or features, all equally likely.
    sizes
        Half-widths [mm]; None leaves features as large as they were given.
    locations, speeds, approach, friction, lead, azimuth
        As in :class:`feeler.Trial`.
    sides
        ``("left",)`` for one side only.
    base
        Spreads of the base's constant velocity, ``{"x": (-0.1, 0.1), "y": 0.0, "turn": 0.0}``
        [mm/ms, rad/ms]; default: it is clamped.
    antenna
        What must be touched; default: the cockroach's.

    Raises
    ------
    InvalidInput
        A value that no trial may have, or ranges in which touches cannot be placed; the message
        says why.
    """
    antenna = antenna or cockroach()
    known = _make_features(features)
    if not sides or not {*sides} <= {"left", "right"}:
        raise InvalidInput(f"sides must be left, right or both, got {[*sides]}.")
    fields = (locations, speeds, approach, friction, lead)
    spreads: dict[str, Spread] = dict(zip(_FIELDS, fields, strict=True))
    spreads |= {"size": sizes} if sizes is not None else {}
    flat = isinstance(azimuth, int | float | np.number) and azimuth == 0
    spreads |= {} if flat else {TURNED: azimuth}
    if base is not None:
        if not {*base} <= {*_BASE}:
            raise InvalidInput(
                f"base has spreads of {', '.join(_BASE)}, got {', '.join(map(str, base))}."
            )
        spreads |= {name: base.get(name, 0.0) for name in _BASE}
    columns = _draw(n, spreads, len(known), [*sides], seed)
    _check_ends(columns, known)
    recipe = {
        "features": [to_jsonable(feature) for feature in known],
        **{name: describe_spread(spread) for name, spread in spreads.items()},
        "sides": [*sides],
        "antenna": compute_digest(antenna)[:16],
        "seed": int(seed),
    }
    trials = SampledTrials(columns, known, antenna, recipe)
    _redraw(trials, antenna, lambda again: _draw(n, spreads, len(known), [*sides], seed, again))
    return trials


def _make_features(features: Sequence[Any]) -> tuple[Feature, ...]:
    if isinstance(features, str) or not len(features):
        raise InvalidInput(f"features must be a list of kinds or features, got {features!r}.")
    made = tuple(f if isinstance(f, Feature) else make_feature(f, 1.0) for f in features)
    if endless := [f.name for f in made if not np.isfinite(f.size)]:
        raise InvalidInput(
            f"{endless[0]} has no size to be drawn; list bounded shapes, or make its trials one by"
            " one."
        )
    return made


def _draw(
    n: Drawn,
    spreads: dict[str, Spread],
    n_features: int,
    sides: list[str],
    seed: Seed,
    again: int = 0,
) -> dict:
    columns = {
        name: spread_out(s, name, draw_shares(seed, name, n, again))
        for name, s in spreads.items()
    }
    columns.setdefault("size", np.full(n, np.nan))
    columns["feature"] = (draw_shares(seed, "feature", n, again) * n_features).astype(np.int32)
    side = (draw_shares(seed, "side", n, again) * len(sides)).astype(int)
    return columns | {"right": np.array([name == "right" for name in sides])[side]}


def _check_ends(columns: dict[str, np.ndarray], features: tuple[Feature, ...]) -> None:
    """Refuse values that no trial may have; these are intervals, so that the ends tell."""
    for pick in (np.min, np.max):
        names = [name for name in (*_FIELDS, TURNED) if name in columns]
        fields: dict[str, Any] = {name: float(pick(columns[name])) for name in names}
        Trial(feature=features[0], **fields)
        if not np.isnan(columns["size"][0]) and not pick(columns["size"]) > 0:
            raise InvalidInput(f"sizes must be > 0 mm, got {pick(columns['size']):.3g}.")


def _redraw(trials: SampledTrials, antenna: Antenna, draw: Any) -> None:
    """Draw again what cannot be placed."""
    left, reason = np.flatnonzero(~_fits_surely(trials, antenna)), ""
    for again in range(1, _ATTEMPTS + 1):
        bad = []
        for index in left:
            try:
                place(antenna, trials[int(index)])
            except InvalidInput as error:
                bad.append(index)
                reason = str(error)
        left = np.array(bad, dtype=int)
        if not left.size:
            return
        if left.size > _HOPELESS * len(trials) > _HOPELESS * _ATTEMPTS:
            break
        fresh = draw(again)
        for name, values in fresh.items():
            trials.columns[name][left] = values[left]
    raise InvalidInput(
        f"{left.size:,} of {len(trials):,} touches cannot be placed in these ranges. The last"
        f" reason: {reason} Narrow the ranges."
    )


def _fits_surely(trials: SampledTrials, antenna: Antenna) -> np.ndarray:
    """Touches (trial,) known to fit without looking: a convex thing no wider than a straight,
    clamped antenna of one radius.

    Drawn back from it along a line, one convex body leaves another and does not meet it again.
    """
    straight = not antenna.rest_angle.any() and np.all(antenna.radius == antenna.radius[0])
    if not straight or antenna.spatial or {"x", TURNED} & trials.columns.keys():
        return np.zeros(len(trials), bool)
    convex = np.array([len(feature.parts) == 1 for feature in trials.features])
    own = np.array([feature.size for feature in trials.features])
    code, size = trials.columns["feature"], trials.columns["size"]
    size = np.where(np.isnan(size), own[code], size)
    return convex[code] & (2 * size <= antenna.length)
