"""Ready antennas by name."""

from collections.abc import Callable

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import PROFILE_NAMES, cockroach
from feeler.errors import InvalidInput

PRESETS: dict[str, Callable[[], Antenna]] = {
    **{name: (lambda name=name: cockroach(name)) for name in PROFILE_NAMES},
    "cockroach": cockroach,
}


def make_preset(name: str) -> Antenna:
    """The preset called ``name``; the error lists the valid names."""
    if name not in PRESETS:
        raise InvalidInput(f"unknown preset {name!r}; valid: {', '.join(PRESETS)}.")
    return PRESETS[name]()


__all__ = ["PRESETS", "cockroach", "make_preset"]
