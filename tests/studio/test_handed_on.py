"""What a page asks for is in all that is made of it, and what is kept is the newest."""

from awkward_touches import make_antenna

import feeler
from feeler.studio import session as running


def test_a_wall_s_map_is_that_of_its_own_antenna_and_speed(monkeypatch):
    """Without friction the maps of two speeds are one map, so no number on the page tells them
    apart.
    """
    made = []
    running._find_map.cache_clear()
    monkeypatch.setattr(
        running, "calibrate", lambda antenna, *, speed: made.append(speed) or (antenna, speed)
    )
    asked = [(make_antenna(), 0.7), (make_antenna(), 0.2), (feeler.presets.robot(), 0.2)]
    for antenna, speed in 2 * asked:
        assert running._find_map(antenna, speed) == (antenna, speed)
    assert made == [0.7, 0.2, 0.2]
    running._find_map.cache_clear()
