"""What a page asks for is in all that is made of it, and what is kept is the newest."""

import threading

import numpy as np
import pytest
from awkward_touches import make_antenna

import feeler
from feeler.studio import export as leaving
from feeler.studio import session as running
from feeler.studio import study
from feeler.studio.export import _write_objects, read_shown
from feeler.studio.requests import ObjectRequest, TouchRequest, describe_antenna

BALL = {"kind": "ball", "size": 2.2, "x": -3.1, "y": 17.0, "heading": 40.0, "speed": 0.2}


def test_objects_of_a_script_are_those_of_the_page():
    wishes = (
        ObjectRequest(**BALL, friction=0.37),
        ObjectRequest(kind="box", size=1.3, x=6.0, y=9.0, heading=-70.0, friction=0.81),
    )
    told = {"feeler": feeler}
    exec("\n".join(_write_objects(wishes)), told)
    assert told["objects"] == [wish.make(number) for number, wish in enumerate(wishes)]


def test_an_antenna_is_drawn_as_thick_as_it_is_in_the_mean():
    antenna = make_antenna()
    told = describe_antenna(antenna)
    assert told["radius"] == pytest.approx(antenna.radius.mean()) != antenna.radius[0]
    assert told["sensors"] == antenna.sensors.tolist()
    np.testing.assert_array_equal(told["segments"], antenna.segment_length)


def test_a_page_that_leaves_knows_what_the_one_knew_that_it_left(monkeypatch):
    told = {}
    monkeypatch.setattr(
        leaving,
        "write_touch_page",
        lambda *given, **named: told.update(named, given=given) or "",
    )
    wish = {"antenna": {"preset": "linear"}, "speed": 0.37, "location": 0.61, "objects": [BALL]}
    other = {**wish, "antenna": {"preset": "constant"}}
    commands = [[3, 0, 0.1, 0.2, 0.0]]
    asked = {"what": "html", "wish": wish, "other": other, "unsure": 0.1}
    leaving.make_file({**asked, "commands": commands, "samples": 31})
    made = TouchRequest.from_plain(wish), TouchRequest.from_plain(other).antenna
    assert told == {
        "given": made,
        "unsure": 0.1,
        "commands": [(3, 0, 0.1, 0.2, 0.0)],
        "samples": 31,
    }


def test_of_many_studies_the_newest_are_kept(monkeypatch):
    made = []
    monkeypatch.setattr(study, "_kept", type(study._kept)())
    monkeypatch.setattr(study, "_make", lambda *asked: made.append(asked[1]) or asked[1])
    antenna, speeds = make_antenna(), [0.1 + 0.01 * k for k in range(study._KEPT + 2)]
    for speed in speeds:
        study.make_study(antenna, speed, lambda *_: None, threading.Event())
    kept = [study.find_study(antenna, speed) for speed in speeds]
    assert kept == [None, None, *speeds[2:]] and made == speeds
    assert study.find_study(antenna, speeds[-1], unsure=0.3) is None


def test_a_wall_s_map_is_that_of_its_own_antenna_and_speed(monkeypatch):
    """Without friction the maps of two speeds are one map, so no number on the page tells them
    apart.
    """
    made = []
    monkeypatch.setattr(running, "_maps", {})
    monkeypatch.setattr(
        running,
        "calibrate",
        lambda antenna, *, speed, watch: made.append(speed) or (antenna, speed),
    )
    asked = [(make_antenna(), 0.7), (make_antenna(), 0.2), (feeler.presets.robot(), 0.2)]
    for antenna, speed in 2 * asked:
        assert running._find_map(antenna, speed, threading.Event()) == (antenna, speed)
    assert made == [0.7, 0.2, 0.2]


@pytest.mark.parametrize(
    ("count", "by_hand", "title"),
    [
        (0, False, "linear: ball 2.2 mm at 0.61 L, 0.37 m/s"),
        (1, False, "linear: ball 2.2 mm at 0.61 L, 0.37 m/s, and 1 more"),
        (3, False, "linear: ball 2.2 mm at 0.61 L, 0.37 m/s, and 3 more"),
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
