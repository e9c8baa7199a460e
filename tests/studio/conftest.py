"""One decoder of the robot for all files that ask one; they go to one worker."""

from threading import Event

import pytest


@pytest.fixture(scope="session")
def studied():
    """What 336 touches of the robot at 0.3 m/s, give or take a fiftieth, have taught."""
    from feeler.presets import make_preset
    from feeler.studio import study

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "N_HELD_OUT", 24)  # of two sets
        return study.make_study(make_preset("robot"), 0.3, lambda doing, share: None, Event())
