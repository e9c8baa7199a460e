"""Ready antennas: ``cockroach(profile)`` and ``robot()``; every number with its source in ``FACTS`` of its room."""

from collections.abc import Callable
from functools import partial
from typing import Any

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import FACTS, PROFILE_NAMES, cockroach
from feeler.checked import checked
from feeler.errors import InvalidInput


@checked
def robot(**changes: Any) -> Antenna:
    """The eight-hinge robotic antenna; see :func:`feeler.robot.make_robot` for what can be changed."""
    from feeler.robot import make_robot

    return make_robot(**changes)


PRESETS: dict[str, Callable[[], Antenna]] = {
    **{name: partial(cockroach, name) for name in PROFILE_NAMES},
    "cockroach": cockroach,
    "robot": robot,
}


@checked
def make_preset(name: str) -> Antenna:
    """The preset called ``name``; the error lists the valid names."""
    if name not in PRESETS:
        raise InvalidInput(f"unknown preset {name!r}; valid: {', '.join(PRESETS)}.")
    return PRESETS[name]()


__all__ = ["FACTS", "PRESETS", "cockroach", "make_preset", "robot"]
