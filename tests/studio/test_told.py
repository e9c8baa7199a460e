"""What a page asks for is what is done, with every number of it, and what it is told is of what was
asked: each option on its way, without a browser and without a touch where none is needed.
"""

import ast
import re
from types import SimpleNamespace

import numpy as np
import pytest
from awkward_touches import make_antenna
from hypothesis import given, settings
from hypothesis import strategies as st

import feeler
from feeler.antenna.files import write_antenna
from feeler.errors import InvalidInput
from feeler.studio import live as hand
from feeler.studio import live as opening
from feeler.studio.export import _write_script
from feeler.studio.live import Listener
from feeler.studio.requests import (
    AntennaRequest,
    ObjectRequest,
    TouchRequest,
    _compute_compliance,
    describe_original,
)
from feeler.studio.session import _read_message, pack

from ._messages import talk, unpack

OWN = AntennaRequest(toml=write_antenna(make_antenna()))
BOX = {"kind": "box", "size": 1.3, "x": 6.0, "y": 9.0, "heading": -70.0, "speed": 0.2}


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"type": "touch", "slot": "C"}, "slot must be A or B, got 'C'"),
        ({"type": "touch", "id": -1}, "id must be a whole number, got '-1'"),
        ({"type": "touch", "id": True}, "id must be a whole number, got 'True'"),
        ({"type": "tuch"}, "unknown message 'tuch'; valid: hello, touch, .* aim, stop"),
        (
            {"type": "hand", "wish": {}, "pace": 1.5},
            "pace must be a number from 0.001 to 1, got 1.5",
        ),
        (
            {"type": "save", "what": "gif", "wish": {}},
            "one of toml, script, svg, png, mp4, html, got 'gif'",
        ),
    ],
)
def test_a_wrong_message_is_answered_with_what_would_be_right(message, words):
    ((header, _),) = talk(message)
    assert header["type"] == "error" and re.search(words, header["message"]), header["message"]


@pytest.mark.parametrize("heading", [30.0, -110.0])
def test_an_object_faces_and_goes_where_its_heading_points(heading):
    made = ObjectRequest(**BOX | {"heading": heading}, friction=0.3).make(3)
    turn = np.deg2rad(heading)
    np.testing.assert_allclose(made.forward, [np.sin(turn), np.cos(turn)])
    np.testing.assert_allclose(made.velocity, 0.2 * np.array(made.forward))
    assert (made.place, made.friction, made.name) == ((6.0, 9.0), 0.3, "object 4")
    assert (made.feature.half_width, made.feature.half_height) == (1.3, 1.3)


def test_a_length_that_is_too_far_off_is_refused_with_the_lengths_that_are_not():
    length = make_antenna().length
    ends = re.escape(f"within {length / 50:.3g} and {length * 50:.3g} mm")
    for factor in (1 / 51, 51):
        with pytest.raises(InvalidInput, match=ends):
            OWN.replace(length=factor * length).make()
    assert OWN.replace(length=49 * length).make().length == pytest.approx(49 * length)


def steer(aims, base=(0.0, 0.0, 0.0), glide=10.0):
    """Commands of a hand to two objects and the base."""
    one = hand.Hand()
    for what, (x, y, turn) in aims.items():
        one.aim({"what": what, "x": x, "y": y, "turn": turn})
    place = np.array([[[1.0, 2.0], [-3.0, 8.0]]])
    state = SimpleNamespace(place=place, base=np.array([base]))
    return one._steer(SimpleNamespace(state=state), 17, glide)


def test_everything_goes_towards_where_the_hand_has_it_no_faster_than_it_may():
    aims = {1: (-1.0, 5.0, 9.0), 0: (101.0, 2.0, 0.0), -1: (0.5, 0.0, -0.2), 2: (0.0, 0.0, 0.0)}
    found = {what: (sample, *rates) for sample, what, *rates in steer(aims)}
    assert found.keys() == {1, 0, -1}  # there is no third object
    assert found[1] == (
        17,
        pytest.approx(0.2),
        pytest.approx(-0.3),
        0.0,
    )  # an object is not turned
    assert found[0] == (17, pytest.approx(1.2), 0.0, 0.0)
    assert found[-1] == (17, pytest.approx(0.05), 0.0, pytest.approx(-0.02))
    for turn, spin in ((0.9, 0.03), (-0.9, -0.03), (0.3, 0.0)):
        ((_, what, x, y, rate),) = steer({-1: (0.2, -0.1, turn)}, base=(0.2, -0.1, 0.3))
        assert (what, x, y, rate) == (-1, 0.0, 0.0, pytest.approx(spin if turn != 0.3 else 0.0))


def write_recording(times, unit="rad"):
    head = ",".join(["time_ms", *(f"hinge{n}_{unit}" for n in range(1, 6))])
    rows = [
        ",".join([f"{t:g}", *(f"{1e-4 * (k + n):g}" for n in range(5))])
        for k, t in enumerate(times)
    ]
    return "\n".join([head, *rows])


def test_a_recording_s_rate_is_that_of_most_of_its_samples_and_its_sensors_are_the_antenna_s():
    times = 2.0 * np.delete(np.arange(60), [20, 21, 22, 23])  # a gap of four
    message = {"name": "r.csv", "text": write_recording(times), "antenna": OWN.to_plain()}
    header, arrays = opening.open_text(message, None, lambda antenna: None)
    assert (header["rate"], header["robot"], header["what"]) == (500.0, False, "recording")
    assert header["antenna"]["name"] == "awkward" and arrays["base"].shape == (
        header["total"],
        3,
    )
    with pytest.raises(InvalidInput, match=r"r.csv has 5 channels, .* has 56 sensors"):
        opening.open_text(message | {"antenna": {}}, None, lambda antenna: None)
    with pytest.raises(InvalidInput, match=r"r.csv holds capacitance. Open the sensors'"):
        opening.open_text(
            message | {"text": write_recording(times, "pF")}, None, lambda antenna: None
        )


def make_listener(interval=2.5):
    return Listener(make_antenna(), None, interval)


def test_what_a_board_left_out_is_shown_as_it_was_last_and_no_time_is_the_usual_time():
    one = make_listener()
    rows = 0.01 * np.arange(1.0, 6.0) * np.array([[1.0], [-2.0], [3.0]])
    for time_, row in zip((None, None, 12.5), rows, strict=True):  # 0, 2.5, and two are missing
        one.take(time_, row)
    first, arrays = one.give()
    sensed = arrays["angle"][:, make_antenna().sensors - 1]
    wanted = [rows[0], rows[1], rows[1], rows[1], rows[1], rows[2]]
    np.testing.assert_allclose(sensed, np.array(wanted)[[0, 1, 2, 3, 4, 5]])
    assert (first, one.missing) == (0, 3)
    one.take(15.0, rows[0])
    assert one.give()[0] == 6


def test_a_number_that_is_no_angle_is_told():
    with pytest.raises(InvalidInput, match=r"-4\.5 is no angle of a hinge in rad"):
        make_listener().take(0.0, np.array([0.1, 3.0, -4.5, 0.2, 3.5]))


def test_an_unchanged_wish_is_the_preset_itself():
    assert AntennaRequest(preset="linear").make() == feeler.presets.make_preset("linear")


@pytest.mark.parametrize("end", ['"', '""', '"""', '""""', "\\", '\\"', 'a"""b\n', "'", ""])
def test_a_script_holds_the_antennas_text_whatever_it_ends_in(end):
    text = f"{write_antenna(feeler.presets.make_preset('robot'))}# remark {end}"
    tree = ast.parse(_write_script(TouchRequest(antenna=AntennaRequest(toml=text))))
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    (call,) = (one for one in calls if getattr(one.func, "id", "") == "parse_antenna")
    assert ast.literal_eval(call.args[0]) == text


@pytest.mark.parametrize("name", ["linear", "robot"])
def test_handles_lie_on_the_profile_from_its_first_hinge_to_its_last(name):
    antenna = feeler.presets.make_preset(name)
    for quantity, handles in describe_original(antenna)["handles"].items():
        profile, (place, value) = getattr(antenna, quantity), np.transpose(handles)
        assert (place[0], place[-1]) == (0.0, 1.0)
        hinge = place * (len(profile) - 1)
        np.testing.assert_allclose(hinge, np.round(hinge), atol=1e-9)
        np.testing.assert_allclose(value, profile[np.round(hinge).astype(int)], rtol=1e-3)


def test_matched_keeps_the_total_compliance():
    wish = AntennaRequest(stiffness=((0.0, 1.0), (0.4, 30.0), (1.0, 0.2)), matched=True)
    assert _compute_compliance(wish.make().stiffness) == pytest.approx(
        _compute_compliance(AntennaRequest().make().stiffness)
    )


def test_a_longer_antenna_has_more_mass_and_the_same_hinges():
    long, original = AntennaRequest(length=84.0).make(), AntennaRequest().make()
    assert long.length == pytest.approx(84.0)
    assert long.segment_mass.sum() == pytest.approx(2 * original.segment_mass.sum())
    assert np.array_equal(long.stiffness, original.stiffness)


def test_a_file_is_an_antenna_and_its_plain_data_come_back():
    text = feeler.antenna.files.write_antenna(feeler.presets.make_preset("uniform"))
    wish = TouchRequest(
        antenna=AntennaRequest(toml=text), kind="box", objects=[{"kind": "wall", "x": 9.0}]
    )
    assert TouchRequest.from_plain(wish.to_plain()) == wish
    assert wish.antenna.make() == feeler.presets.make_preset("uniform")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ([], "must be a TouchRequest, got"),
        ({"antenna": {}, "colour": 1}, "has no 'colour'"),
        ({"antenna": {"preset": 3}}, "preset must be text"),
        ({"antenna": {"stiffness": [[0.5, 1.0], [0.5, 1.0]]}}, "must rise"),
        ({"antenna": {"stiffness": [[0.0, -1.0]]}}, "stiffness must be 1 to 64"),
        ({"antenna": {"sensors": 0}}, "sensors must be from 1 to 1000"),
        ({"antenna": {"length": 1e-1}}, "length must lie within"),
        ({"antenna": {"toml": "nonsense ="}}, "not valid TOML"),
        (
            {"antenna": {}, "speed": float("nan")},
            "speed must be finite and from 0.001 to 4 m/s",
        ),
        ({"antenna": {}, "size": True}, "size must be a number"),
        ({"antenna": {}, "duration": 1e9}, "duration must be from 2 to 2000 ms"),
        ({"antenna": {}, "kind": "cube"}, "kind must be one of ball"),
        ({"antenna": {}, "objects": [{}] * 9}, "at most 8"),
    ],
)
def test_what_is_wrong_with_a_wish_is_said(content, words):
    with pytest.raises(InvalidInput, match=words):
        TouchRequest.from_plain(content).antenna.make()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(width=32, allow_nan=False), max_size=20), st.text(max_size=10))
def test_messages_come_out_as_they_went_in(values, name):
    header, arrays = unpack(pack({"type": "x", "name": name}, values=np.array(values)))
    assert header == {"type": "x", "name": name}
    assert arrays["values"].tolist() == values


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"type": 3}', "[" * 5000, b"\xff"])
def test_what_is_no_message_is_refused(text):
    with pytest.raises(InvalidInput, match="message must be"):
        _read_message(text)
