"""A session shows what feeler computes, to the last bit, and the newest wish ends the work on the
older.
"""

import json
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import feeler
from feeler.studio.live import replay
from feeler.studio.requests import (
    TouchRequest,
    hash_tensor,
    join_samples,
    make_simulation,
    read_sample,
)
from feeler.studio.session import Session

from ._messages import unpack

SHORT = {"duration": 30.0, "speed": 0.3}
CHANGED = {
    "stiffness": [[0.0, 20.0], [0.5, 0.3], [1.0, 2e-3]],
    "matched": True,
    "length": 40.0,
    "sensors": 20,
}


class Page:
    """What a page hears."""

    def __init__(self, **options):
        self.heard, self.session = (
            [],
            Session(lambda data: self.heard.append(unpack(data)), **options),
        )

    def ask(self, message):
        self.session.take(json.dumps(message))
        return self

    def wait(self, seconds=60.0):
        end = time.monotonic() + seconds
        while self.session.busy and time.monotonic() < end:
            time.sleep(0.002)
        assert not self.session.busy
        return self.heard

    def find(self, kind, part=None):
        return [
            (h, a) for h, a in self.heard if h["type"] == kind and part in (None, h.get("part"))
        ]

    def join(self, name):
        return np.concatenate([arrays[name] for _, arrays in self.find("touch", "piece")])


@pytest.mark.parametrize(
    "antenna", [{}, CHANGED, {"preset": "robot"}], ids=["preset", "changed", "robot"]
)
def test_what_is_shown_is_what_touch_gives_bit_for_bit(antenna):
    wish = {"antenna": antenna, "kind": "box", **SHORT}
    page = Page().ask({"type": "touch", "id": 3, "wish": wish})
    page.wait()
    made = TouchRequest.from_plain(wish)
    tensors = feeler.touch(made.antenna.make(), made.make_trial(), duration=30.0)
    expected = tensors["angle"].values[0].astype(np.float32)
    assert np.array_equal(page.join("angle")[:, made.antenna.make().sensors - 1].T, expected)
    end, _ = page.find("touch", "end")[0]
    assert end["hash"] == hash_tensor(expected)
    assert not end["preview"]


def test_a_preview_says_so():
    page = Page().ask({"type": "touch", "wish": {"antenna": {}, "preview": True, **SHORT}})
    page.wait()
    assert page.find("touch", "begin")[0][0]["preview"]
    assert page.find("touch", "end")[0][0]["preview"]


def test_the_newest_wish_ends_the_older():
    page = Page()
    for number in range(12):
        page.ask(
            {
                "type": "touch",
                "id": number,
                "wish": {"antenna": {}, "duration": 1000.0, "location": 0.6 + 0.01 * number},
            }
        )
    page.wait()
    ended = [header["id"] for header, _ in page.find("touch", "end")]
    assert ended == [11]


def test_whoever_leaves_frees_the_processor():
    page = Page().ask({"type": "touch", "wish": {"antenna": {}, "duration": 2000.0}})
    while not page.find("touch", "piece"):
        time.sleep(0.001)
    page.session.close()
    began = time.monotonic()
    page.wait(5.0)
    assert (
        time.monotonic() - began < 2.0
    )  # 50 ms on an idle machine; benchmarks/studio.py measures it
    assert not page.find("touch", "end")


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_page_that_is_gone_ends_its_work_quietly():
    def put(data):
        raise ConnectionError("gone")

    page = Page()
    page.session = Session(put)
    page.ask({"type": "touch", "wish": {"antenna": {}, "duration": 2000.0}}).wait(10.0)


def test_several_objects_and_a_wall_are_felt():
    wish = {
        "antenna": {},
        **SHORT,
        "objects": [{"kind": "wall", "x": 3.0, "y": 30.0, "heading": -90.0}],
    }
    page = Page().ask({"type": "touch", "wish": wish})
    page.wait()
    assert page.join("force").shape[1:] == (2, 2)
    alone = Page().ask({"type": "touch", "wish": {"antenna": {}, **SHORT}})
    alone.wait()
    assert not np.array_equal(page.join("angle"), alone.join("angle"))


OBJECTS = [
    {"kind": "box", "x": 6.0, "y": 25.0, "heading": -60.0, "speed": 0.2},
    {"kind": "ball", "x": -7.0, "y": 12.0, "heading": 80.0, "speed": 0.3},
]


def make_read(**wish):
    """A simulation of a wish, and what a page is shown of its beginning."""
    wish = TouchRequest.from_plain({"antenna": {}, **SHORT, **wish})
    simulation = make_simulation(wish)
    return wish, simulation, join_samples([read_sample(simulation)])


def test_objects_are_shown_turned_as_they_face():
    """By the angle from +y towards +x, as an antenna's hinges turn."""
    _, simulation, shown = make_read(approach=70.0, objects=OBJECTS)
    turn = shown["place"][0, :, 2]
    facing = np.stack([np.sin(turn), np.cos(turn)], axis=1)
    np.testing.assert_allclose(facing, simulation.state.forward[0], atol=1e-12)
    assert np.degrees(turn[1:]) == pytest.approx([-60.0, 80.0])


def test_a_diverging_antenna_is_said_and_the_next_wish_goes_on():
    page = Page()
    hard = {
        "antenna": {
            "stiffness": [[0.0, 1e-9], [1.0, 1e-9]],
            "damping": [[0.0, 1e-12]],
            "preset": "robot",
        },
        "speed": 4.0,
    }
    page.ask({"type": "touch", "wish": {**hard, "size": 20.0, "duration": 200.0}}).wait()
    page.ask({"type": "touch", "wish": {"antenna": {}, **SHORT}}).wait()
    assert page.find("touch", "end")
    assert all("made a mistake" not in header["message"] for header, _ in page.find("error"))


def run_hand(page, aims, pace=1.0, race=False, wish=None):
    page.ask(
        {
            "type": "hand",
            "wish": {"antenna": {}, "location": 0.6} | (wish or {}),
            "pace": pace,
            "race": race,
        }
    )
    while not page.find("touch", "begin"):
        time.sleep(0.002)
    for aim in aims:
        page.ask({"type": "aim", **aim})
        time.sleep(0.05)
    if not race:  # which ends by itself
        page.ask({"type": "aim", "what": "end"})
    page.wait()


def test_a_run_by_hand_can_be_repeated_to_the_last_bit():
    page = Page()
    run_hand(
        page,
        [
            {"what": 0, "x": 3.0, "y": 25.0},
            {"what": -1, "x": 1.0, "y": 0.0, "turn": 0.2},
            {"what": 0, "x": 6.0, "y": 20.0},
        ],
    )
    end, _ = page.find("touch", "end")[0]
    angle = page.join("angle")
    assert np.abs(angle).max() > 1e-3
    again = replay(
        TouchRequest.from_plain({"antenna": {}, "location": 0.6}), end["commands"], len(angle)
    )
    assert np.array_equal(again["angle"].astype(np.float32), angle)
    assert page.join("base")[-1, 0] > 0


def test_what_a_hand_says_before_its_run_has_begun_is_heard():
    """A quick hand has moved, or let go, before the simulation stands."""
    page = Page()
    wish = {"antenna": {}, "location": 0.6}
    page.ask({"type": "hand", "wish": wish}).ask({"type": "aim", "what": "end"}).wait()
    assert len(page.find("touch", "end")) == 1
    page = Page().ask({"type": "hand", "wish": wish, "pace": 1.0})
    page.ask({"type": "aim", "what": 0, "x": 3.0, "y": 25.0})
    end = time.monotonic() + 60
    # the first piece may be of rest, sent between the two words; more come only if the hand moves
    while len(page.find("touch", "piece")) < 3:
        assert time.monotonic() < end
        time.sleep(0.01)
    page.ask({"type": "aim", "what": "end"}).wait()
    commands = page.find("touch", "end")[0][0]["commands"]
    assert any(what == 0 and vx > 0 for _, what, vx, *_ in commands)


@pytest.mark.parametrize("kind", ["touch", "objects", "hand"])
def test_the_script_gives_the_same_tensor(kind, capsys):
    page, wish = Page(), {"antenna": CHANGED, "kind": "triangle", **SHORT}
    message = {"type": "save", "what": "script", "wish": wish}
    if kind == "objects":
        wish["objects"] = [
            {"kind": "ball", "x": 3.0, "y": 30.0, "speed": 0.1, "heading": -80.0}
        ]
    if kind == "hand":
        run_hand(page, [{"what": 0, "x": 3.0, "y": 25.0}])
        end, _ = page.find("touch", "end")[0]
        message |= {
            "wish": {"antenna": {}, "location": 0.6},
            "commands": end["commands"],
            "samples": len(page.join("angle")),
        }
        expected = end["hash"]
    else:
        page.ask({"type": "touch", "wish": wish}).wait()
        expected = page.find("touch", "end")[0][0]["hash"]
    page.ask(message).wait()
    header, arrays = page.find("file")[0]
    exec(compile(arrays["content"].tobytes()[: header["bytes"]], "shown.py", "exec"), {})
    assert capsys.readouterr().out.split()[-1] == expected


def test_what_cannot_be_computed_names_remedies_that_the_page_has():
    soft = {"stiffness": [[0, 10000], [1, 1e-5]], "matched": True}
    page = Page().ask({"type": "touch", "wish": {"antenna": soft, **SHORT, "duration": 60.0}})
    page.wait()
    words = page.find("error")[0][0]["message"]
    assert "gentler gradient" in words
    assert "timestep" not in words


def test_every_other_way_out(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "feeler.studio.export._teach_all", lambda *_: None
    )  # test_alone.py has it
    page = Page()
    for what, begin in (
        ("toml", b"schema"),
        ("svg", b"<?xml"),
        ("png", b"\x89PNG"),
        ("html", b"<!doctype html>"),
    ):
        page.ask({"type": "save", "what": what, "wish": {"antenna": CHANGED, **SHORT}}).wait()
        header, arrays = page.find("file")[-1]
        content = arrays["content"].tobytes()[: header["bytes"]]
        assert content.startswith(begin)
        (tmp_path / f"a.{what}").write_bytes(content)
    assert (
        feeler.load_antenna(tmp_path / "a.toml")
        == TouchRequest.from_plain({"antenna": CHANGED}).antenna.make()
    )


def test_files_are_opened_and_damaged_ones_are_explained():
    page = Page()
    text = feeler.antenna.files.write_antenna(feeler.presets.make_preset("robot"))
    page.ask({"type": "open", "name": "a.toml", "text": text}).wait()
    assert page.find("opened")[0][0]["original"]["length"] == pytest.approx(62.45)
    rows = "\n".join(f"{k},{','.join([str(0.001 * k)] * 8)}" for k in range(20))
    recording = "time_ms," + ",".join(f"hinge{n}_rad" for n in range(1, 9)) + "\n" + rows
    page.ask({"type": "open", "name": "r.csv", "text": recording}).wait()
    assert page.find("opened")[1][1]["angle"] == pytest.approx(
        np.tile(0.001 * np.arange(20)[:, None], 8), abs=1e-6
    )
    wrong = "\n".join(line.rpartition(",")[0] for line in recording.splitlines())
    for name, content, words in (
        ("a.toml", text.replace("stiffness", "softness"), "softness"),
        ("r.csv", wrong, "7 channels"),
        ("r.csv", "\0\xff", "csv"),
        ("a.exe", "x", "neither an antenna"),
    ):
        page.ask({"type": "open", "name": name, "text": content}).wait()
        assert words in page.find("error")[-1][0]["message"]


WORDS = st.sampled_from(
    [
        "touch",
        "study",
        "hand",
        "aim",
        "save",
        "open",
        "ports",
        "listen",
        "stop",
        "hello",
        "A",
        "B",
        "html",
        "toml",
        "../../x",
        "end",
        "",
    ]
)
VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers(-(10**20), 10**20) | WORDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3),
    max_leaves=6,
)
KEYS = st.sampled_from(
    [
        "wish",
        "slot",
        "id",
        "what",
        "text",
        "name",
        "commands",
        "antenna",
        "speed",
        "pace",
        "x",
        "other",
        "port",
    ]
)


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.lists(
        st.tuples(WORDS, st.dictionaries(KEYS, VALUES, max_size=4)), min_size=1, max_size=4
    )
)
def test_no_message_brings_a_session_down(messages):
    page = Page()
    for kind, rest in messages:
        if kind not in ("study", "follow"):  # costly, and read by the same rules
            page.session.take(json.dumps({**rest, "type": kind}))
    page.session.take("{" * 50)
    page.session.close()
    page.wait()
    assert [
        h["message"] for h, _ in page.find("error") if "made a mistake" in h["message"]
    ] == []
