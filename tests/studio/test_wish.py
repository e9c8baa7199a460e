"""Wishes are validated data; what is made of them is what the same calls make by hand."""

import ast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import feeler
from feeler.antenna.files import write_antenna
from feeler.errors import InvalidInput
from feeler.studio.export import _write_script
from feeler.studio.requests import (
    AntennaRequest,
    TouchRequest,
    _compute_compliance,
    describe_original,
)
from feeler.studio.session import _read_message, pack

from ._messages import unpack


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
