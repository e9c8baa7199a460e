"""The wall: a wide-field feature, plain or textured."""

from typing import Annotated, ClassVar

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.record import Ge, freeze
from feeler.stimulus.feature import Feature, digest_numbers

_REACH = 1e3  # mm; half extent of the box that stands for a face without end
# mm [C]; body of a textured wall below its lowest place; far more than contact sinks in
DEPTH = 10.0
_MAX_PLACES = 1000  # [C]


class Wall(Feature):
    """A wide-field feature: a straight face without end, or a textured one of the heights in
    ``profile``.

    Seen in its own frame, the textured face stands at first coordinate *height* − (greatest height)
    and second coordinate *place*, straight lines between the places; it ends with the profile.
    Parts: one for each stretch between two valleys.

    Attributes
    ----------
    profile : np.ndarray | None
        Pairs (place along the wall [mm], height towards the antenna [mm]), or two arrays of three
        or more values: places and heights; default: flat and without end. Place 0 is where the
        wall's axis runs.
    repeat : int
        How many times the profile is laid end to end, centred; more than 1 needs equal heights at
        its ends.
    rounding : float
        Distance [mm] by which the textured face is grown, ≥ 0.

    Raises
    ------
    InvalidInput
        A profile that is no function (places that do not rise), is not finite, or cannot be
        repeated.
    """

    profile: np.ndarray | None = None
    repeat: Annotated[int, Ge(1)] = 1
    rounding: float = 0.0
    kind: ClassVar[str] = "wall"
    wide: ClassVar[bool] = True

    def _check(self) -> None:
        if self.profile is not None:
            vars(self)["profile"] = freeze(_read_profile(self.profile, self.repeat))
        super()._check()
        if self.profile is None and (self.repeat > 1 or self.rounding > 0):
            raise InvalidInput(
                "Wall.repeat and Wall.rounding need a profile; a flat face without end has neither."
            )

    @property
    def unbounded(self) -> bool:
        """Whether the face is flat and goes on without end."""
        return self.profile is None

    symmetric = unbounded  # a flat face is its own mirror image

    def make_name(self) -> str:
        """``wall``, and for a textured one six digits that stand for its face."""
        if self.profile is None:
            return self.kind
        return f"wall {digest_numbers(self.profile, self.repeat, self.rounding)}"

    def make_parts(self) -> list:
        """A box so large that its other faces are never met, or the stretches of the profile with
        the body below.
        """
        if self.profile is None:
            return [
                [(0.0, -_REACH), (0.0, _REACH), (-2 * _REACH, _REACH), (-2 * _REACH, -_REACH)]
            ]
        place, height = self._lay_out()
        bottom = height.min() - DEPTH
        slope = np.diff(height) / np.diff(place)
        valleys = np.flatnonzero(np.diff(slope) > 0) + 1
        parts = []
        for first, last in zip([0, *valleys], [*valleys, len(place) - 1], strict=True):
            face = np.stack([height, place], axis=1)[first : last + 1]
            parts.append([*face, (bottom, place[last]), (bottom, place[first])])
        return parts

    def _lay_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Places and heights of all repetitions."""
        place, height = np.asarray(self.profile).T
        shift = np.ptp(place) * (np.arange(self.repeat) - (self.repeat - 1) / 2)
        places = (shift[:, None] + place[1:]).ravel()
        return np.append(shift[0] + place[0], places), np.append(
            height[0], np.tile(height[1:], self.repeat)
        )


def _read_profile(pairs: np.ndarray, repeat: int) -> np.ndarray:
    if pairs.ndim == 2 and pairs.shape[0] == 2 and pairs.shape[1] > 2:
        pairs = pairs.T
    if (
        pairs.ndim != 2
        or pairs.shape[1] != 2
        or len(pairs) < 2
        or len(pairs) * repeat > _MAX_PLACES
    ):
        raise InvalidInput(
            f"Wall.profile must be 2 to {_MAX_PLACES} pairs (place, height), repetitions counted,"
            f" or two such arrays; got shape {pairs.shape}, repeated {repeat} times."
        )
    if (falling := np.flatnonzero(np.diff(pairs[:, 0]) <= 0)).size:
        where = falling[0]
        raise InvalidInput(
            f"Wall.profile is no function: its places must rise, but place {where + 2}"
            f" ({pairs[where + 1, 0]:g} mm) does not lie beyond place {where + 1}"
            f" ({pairs[where, 0]:g} mm). For an overhang use an Outline."
        )
    if repeat > 1 and pairs[0, 1] != pairs[-1, 1]:
        raise InvalidInput(
            f"Wall.profile is repeated, so it must end as high as it begins; got {pairs[0, 1]:g}"
            f" and {pairs[-1, 1]:g} mm."
        )
    return pairs + 0.0  # no −0: equal walls have equal names
