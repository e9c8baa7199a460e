"""One decoder of the robot for all files that ask one; they go to one worker."""

from threading import Event

import pytest


@pytest.fixture(scope="session")
def studied():
    """What 480 touches of the robot at 0.3 m/s, give or take a fiftieth, have taught."""
    from feeler.presets import make_preset
    from feeler.studio import study

    return study.make_study(make_preset("robot"), 0.3, lambda doing, share: None, Event())
