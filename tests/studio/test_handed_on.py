"""What a page asks for is in all that is made of it, and what is kept is the newest."""

import numpy as np
import pytest
from awkward_touches import make_antenna

import feeler
from feeler.studio import session as running
from feeler.studio.export import read_shown
from feeler.studio.requests import TouchRequest, describe_antenna

BALL = {"kind": "ball", "size": 2.2, "x": -3.1, "y": 17.0, "heading": 40.0, "speed": 0.2}


def test_an_antenna_is_drawn_as_thick_as_it_is_in_the_mean():
    antenna = make_antenna()
    told = describe_antenna(antenna)
    assert told["radius"] == pytest.approx(antenna.radius.mean()) != antenna.radius[0]
    assert told["sensors"] == antenna.sensors.tolist()
    np.testing.assert_array_equal(told["segments"], antenna.segment_length)


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


@pytest.mark.parametrize(
    ("count", "by_hand", "title"),
    [
        (0, False, "linear: ball (radius 2.2 mm) at 0.61 L, 0.37 m/s"),
        (1, False, "linear: ball (radius 2.2 mm) at 0.61 L, 0.37 m/s, and 1 more"),
        (3, False, "linear: ball (radius 2.2 mm) at 0.61 L, 0.37 m/s, and 3 more"),
        (2, True, "linear: ball moved by hand, and 2 more"),
    ],
)
def test_a_picture_s_title_names_the_first_object_and_counts_the_others(count, by_hand, title):
    wish = TouchRequest.from_plain(
        {
            "antenna": {"preset": "linear"},
            "kind": "ball",
            "size": 2.2,
            "location": 0.61,
            "speed": 0.37,
            "objects": count * [BALL],
        }
    )
    readings = {"angle": np.zeros((2, wish.antenna.make().n_segments))}
    shown = read_shown(wish, readings, "angle", by_hand=by_hand)
    assert shown.title == title and len(shown.features) == count + 1
