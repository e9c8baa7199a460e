"""What a page asks for is what is done, with every number of it, and what it is told is of what was
asked: each option on its way, without a browser and without a touch where none is needed.
"""

import json
import re
import time
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest
from awkward_touches import make_antenna
from matplotlib.figure import Figure

import feeler
from feeler.antenna.files import write_antenna
from feeler.errors import InvalidInput
from feeler.physics.contact import get_contact
from feeler.studio import Session, session, study
from feeler.studio import export as alone
from feeler.studio import export as drawing
from feeler.studio import export as leaving
from feeler.studio import live as board
from feeler.studio import live as hand
from feeler.studio import live as opening
from feeler.studio import requests as catalogue
from feeler.studio import server as widget
from feeler.studio import session as running
from feeler.studio import session as turning
from feeler.studio.decoder import Range
from feeler.studio.export import _write_script
from feeler.studio.live import Listener
from feeler.studio.requests import (
    AntennaRequest,
    ObjectRequest,
    TouchRequest,
    describe_mode,
    describe_scene,
    make_simulation,
    read_number,
    simulate_pieces,
    wish_for,
)
from feeler.wall import make_turn

from ._messages import unpack

OWN = AntennaRequest(toml=write_antenna(make_antenna()))
BOX = {"kind": "box", "size": 1.3, "x": 6.0, "y": 9.0, "heading": -70.0, "speed": 0.2}
WISH = TouchRequest.from_plain(
    {
        "antenna": OWN.to_plain(),
        "kind": "triangle",
        "size": 2.2,
        "location": 0.61,
        "speed": 0.37,
        "approach": 81.0,
        "side": "right",
        "friction": 0.4,
        "lead": 7.0,
        "duration": 33.0,
    }
)


def talk(*messages):
    """What a session answers to all of these, one after the other."""
    said = []
    one = Session(lambda packed: said.append(unpack(packed)))
    for message in messages:
        one.take(json.dumps(message))
        end = time.monotonic() + 60
        while one.busy and time.monotonic() < end:
            time.sleep(0.001)
    return said


def listen_to(monkeypatch, place, name, answer=None):
    """All calls of a function, which then gives ``answer``."""
    calls = []

    def note(*given, **how):
        calls.append((given, how))
        return answer

    monkeypatch.setattr(place, name, note)
    return calls


def make_study(antenna=None, **more):
    """A study with numbers that differ in everything; its decoder notices late."""
    labels = (("ball", 1.5, 0.5), ("box", 3.0, 0.7), ("triangle", 1.5, 0.9))
    rng = np.random.default_rng(5)
    similarity = {name: rng.uniform(size=(3, 3)) for name in study.INDEX_NAMES}

    def decode(angle):
        posterior = np.tile([0.1, 0.2, 0.7, 0.0], (angle.shape[1], 1))
        posterior[::2] = [0.3, 0.6, 0.1, 0.0]
        return posterior, 4 if angle.shape[1] > 4 else -1

    made = {
        "antenna": antenna or make_antenna(),
        "speed": 0.37,
        "labels": labels,
        "tensors": rng.normal(size=(3, 5, 9)),
        "similarity": similarity,
        "encoder": SimpleNamespace(
            n_lags=3,
            components_=rng.uniform(size=(2, 5, 3)),
            transform=lambda values, code: np.cumsum(values.sum(axis=1), axis=1)[:, None],
        ),
        "decoder": SimpleNamespace(decode=decode, noise=0.03),
        "range": Range.around(0.37, 0.02),
        "scores": {
            "clean": 0.9,
            "noisy": 0.8,
            "confidently_wrong": 0.0,
            "outside": 0.0,
            "n": 7,
        },
        "peak": 0.043,
    }
    return study.AntennaStudy(**made | more)


def test_a_run_along_a_wall_is_of_its_own_turn_speed_and_slot(monkeypatch):
    calls = listen_to(monkeypatch, session, "_run_along_wall")
    message = {"type": "follow", "slot": "B", "id": 12, "antenna": OWN.to_plain()}
    talk(message | {"turn": -35.5, "speed": 0.29}, message)
    (antenna, turn, speed, say, _), _ = calls[0]
    assert (antenna, turn, speed) == (make_antenna(), -35.5, 0.29)
    assert say.args == ({"type": "follow", "slot": "B", "id": 12},)
    assert calls[1][0][1:3] == (30.0, 0.45)


def test_a_run_by_hand_has_its_own_pace_wish_and_slot(monkeypatch):
    calls = []
    monkeypatch.setattr(hand.Hand, "run", lambda self, *given: calls.append(given))
    talk({"type": "hand", "slot": "B", "id": 4, "wish": WISH.to_plain(), "pace": 0.37})
    wish, pace, say, _ = calls[0]
    assert (wish, pace) == (WISH, 0.37)
    assert say.args == ({"type": "touch", "slot": "B", "id": 4, "hand": True},)


def test_a_study_tells_each_index_its_own_mean_and_what_is_drawn_of_it(monkeypatch):
    made = make_study()
    calls = listen_to(monkeypatch, session.study, "make_study", made)
    message = {"type": "study", "slot": "B", "id": 8, "antenna": OWN.to_plain(), "unsure": 0.13}
    ((header, arrays),) = talk(message | {"speed": 0.37})
    ((antenna, speed, _, _, unsure), _) = calls[0]
    assert (antenna, speed, unsure) == (make_antenna(), 0.37, 0.13)
    own = {"type": "study", "slot": "B", "id": 8, "part": "end", "speed": 0.37, "peak": 0.043}
    assert header.items() >= own.items()
    assert header["labels"] == [list(label) for label in made.labels]
    for name, matrix in made.similarity.items():
        closest = (matrix - 9 * np.eye(3)).max(axis=1).mean()
        assert header["averages"][name] == pytest.approx(closest)
        np.testing.assert_allclose(arrays[f"similarity {name}"], matrix, rtol=1e-6)
    np.testing.assert_allclose(arrays["tensors"], made.tensors[:, ::2, ::4], rtol=1e-6)
    np.testing.assert_allclose(arrays["bases"], made.encoder.components_, rtol=1e-6)


def test_what_is_being_done_is_told_to_its_own_slot(monkeypatch):
    def make(antenna, speed, tell, stop, unsure):
        tell("touching", 0.25)
        return make_study()

    monkeypatch.setattr(session.study, "make_study", make)
    message = {"type": "study", "slot": "B", "id": 8, "antenna": OWN.to_plain(), "speed": 0.3}
    (header, _), _ = talk(message)
    own = {"slot": "B", "id": 8, "part": "doing", "doing": "touching", "share": 0.25}
    assert header.items() >= own.items()


@pytest.mark.parametrize("duration", [6.0, 20.0])
def test_a_touch_is_read_whole_by_its_code_and_as_long_as_was_learned_by_its_decoder(
    monkeypatch, duration
):
    """It is found by the antenna, speed and doubt of the page."""
    made = make_study()
    monkeypatch.setattr(session.study, "make_study", lambda *asked: made)
    calls = listen_to(monkeypatch, session.study, "find_study", made)
    asked = {"type": "study", "antenna": OWN.to_plain(), "speed": 0.37, "unsure": 0.13}
    wish = WISH.replace(duration=duration).to_plain()
    said = talk(asked, {"type": "touch", "slot": "B", "id": 3, "wish": wish})
    assert calls == [((make_antenna(), 0.37, 0.13), {})]
    readings = [(header, arrays) for header, arrays in said if header["type"] == "reading"]
    ((header, arrays),) = readings
    assert header.items() >= {"slot": "B", "id": 3, "noticed": 4}.items()  # when it was noticed
    n = min(int(duration), 9)
    assert arrays["posterior"].shape == (n, 4) and arrays["code"].shape == (1, int(duration))
    np.testing.assert_allclose(
        arrays["posterior"][:2], [[0.3, 0.6, 0.1, 0], [0.1, 0.2, 0.7, 0]]
    )
    assert header["outside"] == made.range.find_outside(WISH) != []
    np.testing.assert_array_equal(arrays["posterior"][4:], [[0, 0, 0, 1]] * (n - 4))


def test_what_is_shorter_than_a_basis_is_not_read(monkeypatch):
    listen_to(monkeypatch, session.study, "find_study", make_study())
    said = talk({"type": "touch", "wish": WISH.replace(duration=2.0).to_plain()})
    assert {header["type"] for header, _ in said} == {"touch"}


def test_a_recording_and_a_board_are_judged_by_the_study_of_their_own_speed(monkeypatch):
    calls = listen_to(monkeypatch, session.study, "find_study")
    opened = listen_to(monkeypatch, session, "open_text", ({"what": "x"}, {}))
    heard = listen_to(monkeypatch, session, "listen")
    monkeypatch.setattr(board.Boards, "open", lambda self, port: iter([port]))
    page = {"slot": "B", "id": 5, "antenna": OWN.to_plain(), "speed": 0.29}
    ((header, _),) = talk(
        page | {"type": "open", "name": "r.csv", "text": "x"},
        page | {"type": "listen", "port": "/dev/x"},
        page | {"type": "listen", "port": ""},
    )
    own = {"type": "opened", "slot": "B", "id": 5, "name": "r.csv"}
    assert header.items() >= own.items()
    ((lines, antenna, calibration, find, say, _), _) = heard[0]
    assert ([*lines], antenna, calibration, len(heard)) == (["/dev/x"], make_antenna(), None, 1)
    assert say.args == ({"type": "touch", "slot": "B", "id": 5, "live": True},)
    for one in (find, opened[0][0][2]):
        one("antenna")
        assert calls.pop()[0] == ("antenna", 0.29, study.UNSURE)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (
            {"type": "study", "antenna": {}, "speed": 0.3},
            "One of the touches that train this antenna's decoder",
        ),
        ({"type": "touch", "wish": {}}, "This touch cannot be computed"),
    ],
    ids=lambda one: str(one)[:10],
)
def test_what_cannot_be_computed_is_named_as_what_was_asked(monkeypatch, asked, words):
    def fail(*_):
        raise feeler.errors.SimulationDivergedError("x", time=1.0)

    monkeypatch.setattr(session.study, "make_study", fail)
    monkeypatch.setattr(session, "simulate_pieces", fail)
    *_, (header, _) = talk(asked | {"slot": "B", "id": 6})
    assert header["message"].startswith(words)
    assert (header["of"], header["slot"], header["id"]) == (asked["type"], "B", 6)


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
            {"type": "follow", "antenna": {}, "turn": -80},
            "turn must be a number from -79 to 79, got -80",
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


def test_a_number_is_taken_up_to_both_its_ends_and_no_further():
    assert [read_number(value, "x", -2.0, 3.0) for value in (-2, 3.0)] == [-2.0, 3.0]
    for value in (-2.01, 3.01, float("nan"), True, "1"):
        with pytest.raises(InvalidInput, match=r"x must be a number from -2 to 3, got"):
            read_number(value, "x", -2.0, 3.0)


@pytest.mark.parametrize(
    ("stiffness", "names"),
    [
        (((0.0, 5.0), (1.0, 1.0)), ["graded", "uniform"]),
        (((0.0, 1.0), (1.0, 5.0)), ["graded", "uniform"]),
        (((0.0, 1.04), (1.0, 1.0)), ["graded", "uniform"]),
    ],
)
def test_of_a_page_s_two_antennas_the_graded_one_is_the_graded_one(stiffness, names):
    wish = OWN.replace(stiffness=stiffness)
    choices = alone._choose(wish, None)
    assert [name for name, _ in choices] == names
    spread = [np.ptp(np.log(own.make().stiffness)) for _, own in choices]
    assert spread[0] > 1 and spread[1] < np.log(1.05)
    assert wish in [own for _, own in choices]


def test_of_two_chosen_antennas_each_has_its_own_name():
    one, other = OWN.replace(name="x" * 60), AntennaRequest(preset="robot")
    named = [name for name, _ in alone._choose(one, other)]
    robot = feeler.presets.robot().name
    assert named == [("A: " + "x" * 60)[:40], f"B: {robot}"[:40]]


def capture_page(monkeypatch, sizes=(1,), **how):
    """What a standalone page is filled with; its sizes one after the other."""
    pages, taught = [], []
    left = [*sizes]
    monkeypatch.setattr(
        alone, "_fill_page", lambda config: pages.append(config) or "x" * left.pop(0)
    )
    monkeypatch.setattr(alone, "_teach_all", lambda *given: taught.append(given) or len(taught))
    text = alone.write_touch_page(WISH.replace(preview=True), **how)
    return text, pages, taught


def test_a_page_that_leaves_shows_what_was_asked_for_at_the_speed_that_was_asked_for(
    monkeypatch,
):
    commands = [(3, 0, 0.1, 0.2, 0.0)]
    _, (page), taught = capture_page(
        monkeypatch,
        unsure=0.13,
        commands=commands,
        samples=31,
        other=AntennaRequest(preset="linear"),
    )
    (config,) = page
    state = config["state"]
    assert (state["mode"], state["unsure"], state["A"]) == ("hand", 0.13, OWN.to_plain())
    plain = WISH.to_plain()
    assert state["touch"] == {k: v for k, v in plain.items() if k not in ("antenna", "preview")}
    assert config["speeds"] == [
        {"name": "slow", "value": 0.06},
        {"name": "0.37 m/s", "value": 0.37},
        {"name": "fast", "value": 0.6},
    ]
    assert (config["commands"], config["samples"]) == (commands, 31)
    (choices, speeds, unsure, _) = taught[0]
    assert ([own for _, own in choices], speeds, unsure) == (
        [OWN, AntennaRequest(preset="linear")],
        [0.06, 0.37, 0.6],
        0.13,
    )
    assert [one["name"] for one in config["antennas"]] == [name for name, _ in choices]


def test_a_page_is_as_fine_as_its_size_allows_and_no_coarser(monkeypatch):
    small, large = alone._LARGEST, alone._LARGEST + 1
    for sizes, step in (([small], 0), ([large, small], 1), ([large, large], 1)):
        text, pages, taught = capture_page(monkeypatch, sizes)
        assert [given[3] for given in taught] == [*alone._STEPS[: step + 1]]
        assert len(text) == sizes[-1] and pages[-1]["taught"] == step + 1
        assert pages[0]["state"]["mode"] == "touch" and pages[0]["commands"] is None


def test_what_was_taught_stands_by_antenna_and_then_by_speed(monkeypatch):
    monkeypatch.setattr(alone, "_keep", lambda wish, speed, unsure, step: (wish, speed, unsure))
    choices = [(name, AntennaRequest(preset=name)) for name in ("linear", "constant")]
    taught = alone._teach_all(choices, [0.1, 0.2, 0.3], 0.13, 0.004)
    assert taught["kept"] == [
        [(wish, speed, 0.13) for speed in (0.1, 0.2, 0.3)] for _, wish in choices
    ]
    assert taught["answers"] == ("ball", "box", "triangle", "outside")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_a_decoder_expects_is_packed_whichever_way_it_is_greatest(sign):
    """Cosines beyond 16 bits of the finest step; the step then is coarser, and nothing wraps."""
    expected = np.zeros((2, 3, 40))
    expected[0] = sign * 30.0
    expected[1, 1] = np.linspace(0, 1, 40)
    found, packed = alone._pack_expected(expected, 0.002)
    greatest = packed["step"] * 32767
    assert greatest >= 30.0 * np.sqrt(3 * 40) * (1 - 1e-6) > 0.002 * 32767
    assert np.sqrt(np.mean((found - expected) ** 2)) < packed["step"]


def test_facts_of_the_robot_are_told_with_their_own_source_and_unit():
    told = catalogue.make_catalogue(OWN)
    for table, facts in (
        ("facts", catalogue.FACTS),
        ("robot facts", catalogue.ROBOT_FACTS),
    ):
        assert told[table].keys() == facts.keys()
        for name, fact in facts.items():
            shown = told[table][name]
            assert (shown["tag"], shown["unit"], shown["note"]) == (
                fact.tag,
                fact.unit,
                fact.note,
            )
            assert {*fact.tag.split("+")} <= {*told["tags"]}
    assert told["first"] == OWN.to_plain()
    antenna = told["presets"]["robot"]
    robot = feeler.presets.robot()
    assert antenna["compliance"] == pytest.approx((1 / robot.stiffness).sum())
    np.testing.assert_array_equal(antenna["damping"], robot.damping)


def test_a_trial_is_all_that_was_wished_for():
    trial = WISH.make_trial()
    names = ("location", "speed", "approach", "side", "friction", "lead")
    assert {n: getattr(trial, n) for n in names} == {n: getattr(WISH, n) for n in names}
    assert (trial.feature.kind, trial.feature.half_width) == ("triangle", 2.2)
    assert WISH.replace(duration=33.4).duration == 33.0


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


def test_a_notebook_s_studio_begins_with_the_antenna_that_was_named(monkeypatch):
    monkeypatch.setattr(widget, "_make_widget", lambda wish: wish)
    assert widget.show_studio() == AntennaRequest(preset="exponential")
    assert widget.show_studio("linear") == AntennaRequest(preset="linear")
    assert widget.show_studio(make_antenna()).make() == make_antenna()


def test_the_wish_for_an_antenna_is_that_antenna():
    assert wish_for(make_antenna()).make() == make_antenna()
    assert wish_for("linear") == AntennaRequest(preset="linear")
    with pytest.raises(InvalidInput, match="nobody"):
        wish_for("nobody")


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


def test_what_was_said_to_a_run_before_is_not_said_to_the_next():
    one = hand.Hand()
    one.aim({"what": 0, "x": 5.0, "y": 5.0})
    ended = one._ended
    one.begin()
    assert ended.is_set() and not one._ended.is_set() and one._aims == {}
    with pytest.raises(InvalidInput, match=r"aim.what must be a number from -1 to 100, got -2"):
        one.aim({"what": -2})


@pytest.mark.parametrize(
    ("commands", "speed", "still"),
    [
        ([(1, 0, 0.0, 0.0, 0.0)], 1e-5, True),
        ([(1, 0, 0.0, 0.0, 0.0)], -3e-5, False),
        ([(1, -1, 0.0, 0.0, 0.01)], 0.0, False),
        ([(1, 0, 0.0, -0.1, 0.0), (2, 1, 0.0, 0.0, 0.0)], 0.0, False),
        ([(1, 0, 0.0, -0.1, 0.0), (2, 0, 0.0, 0.0, 0.0)], 0.0, True),
    ],
)
def test_time_stands_still_where_nothing_moves_or_turns(commands, speed, still):
    state = SimpleNamespace(velocity=np.array([[0.0, speed]]))
    assert hand._is_still(SimpleNamespace(state=state), commands) is still


def test_a_command_holds_from_its_own_sample_on_in_whatever_order_it_comes():
    commands = [(5, -1, 0.0, 0.0, 0.0), (3, -1, 0.2, -0.1, 0.004), (1, 0, 0.0, 0.0, 0.0)]
    shown = hand.replay(WISH, commands, 9)
    steps = np.diff(shown["base"], axis=0)
    wanted = np.zeros((8, 3))
    wanted[2:4] = [0.2, -0.1, 0.004]  # between samples 2 and 4
    np.testing.assert_allclose(steps, wanted, atol=1e-12)
    assert hand.read_commands([[3, -1, 0.2, -0.1, 0.004]]) == [(3, -1, 0.2, -0.1, 0.004)]
    assert hand.read_commands("x") == []
    with pytest.raises(InvalidInput, match="command must be a number"):
        hand.read_commands([[1, 2, 3]])


@pytest.mark.parametrize("pace", [0.05, 0.4])
def test_simulated_time_passes_at_the_pace_that_was_asked_for(monkeypatch, pace):
    """By a clock of its own; 30 frames of 1/60 s."""
    now = [0.0]
    monkeypatch.setattr(hand, "time", SimpleNamespace(monotonic=lambda: now[0]))
    one, frames, said = hand.Hand(), [], []
    one.aim({"what": 0, "x": 300.0, "y": 20.0})

    def wait(seconds):
        frames.append(seconds)
        now[0] += seconds

    one._ended = SimpleNamespace(is_set=lambda: len(frames) >= 30, wait=wait)
    one.run(WISH, pace, lambda header, **arrays: said.append((header, arrays)), Event())
    assert frames == pytest.approx([1 / 60] * 30)
    pieces = [(header["first"], len(arrays["angle"])) for header, arrays in said[1:-1]]
    assert [first for first, _ in pieces] == [*np.cumsum([0] + [n for _, n in pieces[:-1]])]
    assert sum(n for _, n in pieces) == pytest.approx(pace * 500, abs=pace * 20 + 1)
    commands = said[-1][0]["commands"]
    assert commands[0] == (1, 0, 0.0, 0.0, 0.0) and commands[1][2] == pytest.approx(
        1.2, rel=0.01
    )


def test_a_preview_is_computed_coarsely_and_nothing_else_is():
    contact = get_contact(None, make_antenna())
    for preview, timestep in ((True, 0.1), (False, 0.05)):
        found = make_simulation(WISH.replace(preview=preview)).timestep
        assert found == contact.scale_timestep(timestep)
        assert describe_scene(WISH.replace(preview=preview))["preview"] is preview


def test_outlines_stand_in_the_order_of_the_objects_and_pieces_follow_one_another():
    wish = WISH.replace(
        objects=(ObjectRequest(**BOX), ObjectRequest(kind="wall")), duration=70.0
    )
    sizes = [np.abs(np.concatenate(rims)).max() for rims in describe_scene(wish)["rims"]]
    assert sizes[1] == 2.6 and sizes[2] > 100 and sizes[0] == 4.4
    wish = wish.replace(objects=wish.objects[:1])
    firsts = [
        (first, len(readings["angle"])) for first, readings in simulate_pieces(wish, Event())
    ]
    assert firsts == [(0, 12), (12, 46), (58, 12)]
    assert readings_have(wish, {"place": (2, 3), "force": (2, 2), "base": (3,), "contact": ()})


def readings_have(wish, shapes):
    (_, readings), *_ = simulate_pieces(wish, Event())
    return {name: readings[name].shape[1:] for name in shapes} == shapes


def test_an_antenna_that_does_not_swing_has_no_frequency():
    damped = describe_mode(make_antenna().replace(damping=1e3 * make_antenna().damping))
    assert damped["frequency"] is None and damped["damping_ratio"] > 1
    soft = describe_mode(make_antenna().replace(damping=1e-2 * make_antenna().damping))
    assert 0 < soft["damping_ratio"] < 1 and soft["frequency"] > 0


def run_script(monkeypatch, wish):
    """What a script asks feeler for."""
    asked = []
    angle = np.zeros((1, make_antenna().sensors.size, 4))

    def touch(antenna, trial, **how):
        asked.append((antenna, trial, how))
        return {"angle": SimpleNamespace(values=angle)}

    monkeypatch.setattr(feeler, "touch", touch)
    exec(_write_script(wish), {})
    return asked[0]


@pytest.mark.parametrize("preview", [True, False])
def test_a_script_asks_for_the_very_touch_of_the_page(monkeypatch, preview, capsys):
    antenna, trial, how = run_script(monkeypatch, WISH.replace(preview=preview))
    assert (antenna, trial) == (make_antenna(), WISH.make_trial())
    assert how == {"duration": 33.0} | (
        {"timestep": get_contact(None, antenna).scale_timestep(0.1)} if preview else {}
    )
    assert capsys.readouterr().out.startswith("(5, 4) ")


def test_what_leaves_has_a_name_and_a_kind_of_its_own(monkeypatch):
    monkeypatch.setattr(leaving, "draw", lambda shown, kind: kind.encode())
    monkeypatch.setattr(leaving, "film", lambda shown: b"film")
    monkeypatch.setattr(leaving, "_write_html", lambda *given: "page")
    monkeypatch.setattr(leaving, "_read_whole", lambda wish, commands, samples: None)
    shown = []
    monkeypatch.setattr(leaving, "read_shown", lambda *given, **how: shown.append((given, how)))
    wish, made, contents = WISH.to_plain(), {}, {}
    for what in ("toml", "script", "svg", "png", "mp4", "html"):
        asked = {"what": what, "wish": wish, "quantity": "curvature"}
        name, mime, contents[what] = leaving.make_file(asked)
        made[what] = name, mime
    assert (contents["svg"], contents["png"], contents["mp4"]) == (b"svg", b"png", b"film")
    assert made == {
        "toml": ("feeler-antenna.toml", "application/toml"),
        "script": ("feeler-touch.py", "text/x-python"),
        "svg": ("feeler-touch.svg", "image/svg+xml"),
        "png": ("feeler-touch.png", "image/png"),
        "mp4": ("feeler-touch.mp4", "video/mp4"),
        "html": ("feeler-touch.html", "text/html"),
    }
    assert shown == [((WISH, None, "curvature"), {"by_hand": False})] * 3


def test_a_run_along_a_wall_is_told_in_pieces_that_follow_one_another(monkeypatch):
    """Of 45 periods; and each number of its end is its own."""
    end = {"error": 1.1, "collided": True, "target": 12.5, "nearest": 0.7}
    arrays = {"distance": np.arange(3.0), "estimate": np.arange(3.0) + 10}

    def follow(antenna, course, *, speed, distance_map, watch):
        for k in range(45):
            watch(np.full(3, float(k)), np.full(11, -float(k)))
        assert (speed, distance_map) == (0.29, "map")
        return SimpleNamespace(**end, **arrays)

    monkeypatch.setattr(running, "follow", follow)
    monkeypatch.setattr(running, "_find_map", lambda antenna, speed, stop: "map")
    said = []
    running._run_along_wall(
        make_antenna(), -35.0, 0.29, lambda header, **more: said.append((header, more)), Event()
    )
    (begin, _), *pieces, (last, numbers) = said
    assert [header["first"] for header, _ in pieces] == [0, 20, 40]
    for name, sign in (("body", 1), ("angle", -1)):
        told = np.concatenate([more[name] for _, more in pieces])[:, 0]
        np.testing.assert_array_equal(told, sign * np.arange(45.0))
    assert last == {"part": "end"} | end
    assert numbers.keys() == arrays.keys()
    assert (
        numbers["estimate"] is arrays["estimate"] and numbers["distance"] is arrays["distance"]
    )
    lines = {turn: make_turn(turn, running._FACES).line.tolist() for turn in (-35.0, 35.0)}
    assert begin["wall"] == lines[-35.0] != lines[35.0]


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


def make_shown(by_hand=False):
    """Readings of four samples with a sign, of an antenna whose segments differ."""
    angle = np.linspace(-0.2, 0.3, 44).reshape(4, 11)
    return drawing.read_shown(WISH, {"angle": angle}, "angle", by_hand=by_hand), angle


def test_a_picture_has_the_sign_of_a_bend_and_each_segment_s_own_length():
    shown, angle = make_shown()
    np.testing.assert_allclose(shown.values, np.rad2deg(angle.T))
    np.testing.assert_allclose(shown.tensor, shown.values[make_antenna().sensors - 1])
    curved = drawing.read_shown(WISH, {"angle": angle}, "curvature", by_hand=False)
    np.testing.assert_allclose(curved.values, angle.T / make_antenna().segment_length[:, None])
    assert (shown.label, curved.label) == ("hinge angle [°]", "curvature [1/mm]")
    assert shown.time.tolist() == [0, 1, 2, 3]


def test_a_movie_shows_the_tensor_up_to_now_and_objects_turned_as_they_are(monkeypatch):
    from feeler.plotting import antennas as posture
    from feeler.plotting import movie

    patches, films = [], []
    make_patch = posture.make_patch
    monkeypatch.setattr(
        posture, "make_patch", lambda *given: patches.append(given) or make_patch(*given)
    )

    def write_movie(path, figure, move, n, fps):
        films.append((figure, [move(k) for k in range(n)][-1], n))
        for k in (0, n - 1):
            move(k)
            image = figure.axes[1].images[0].get_array()
            shown = np.isfinite(np.ma.filled(image, np.nan)).all(axis=0)
            assert shown.tolist() == [True] + [k > 0] * 3
        path.write_bytes(b"film")
        return path

    monkeypatch.setattr(movie, "write_movie", write_movie)
    angle = np.linspace(-0.2, 0.3, 44).reshape(4, 11)
    place = np.array([[[k, 2.0 * k, 0.4 + 0.1 * k]] for k in range(4)], dtype=float)
    readings = {"angle": angle, "base": np.zeros((4, 3)), "place": place}
    shown = drawing.read_shown(WISH, readings, "angle", by_hand=True)
    assert drawing.film(shown) == b"film"
    _, origin, forward = patches[-1]
    np.testing.assert_allclose(origin, [3.0, 6.0])
    np.testing.assert_allclose(forward, [np.sin(0.7), np.cos(0.7)])
    left = films[0][0].axes[0]
    assert (left.get_xlabel(), left.get_ylabel()) == ("along [mm]", "across [mm]")


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


def test_beliefs_stand_beside_their_own_samples_and_before_a_study_there_is_none(monkeypatch):
    one = make_listener()
    heard = []

    def judge(known, interval):
        def update(angle, time_):
            heard.append((interval, time_))
            return np.array([0.3, 0.7]) * len(heard), len(heard) == 2

        return SimpleNamespace(study=known, update=update, restart=lambda: None)

    monkeypatch.setattr("feeler.studio.live.Judge", judge)
    row = np.full(5, 0.01)
    one.take(0.0, row)
    one.learn("study")
    for time_ in (2.5, 5.0, 12.5, 15.0):
        one.take(time_, row)
    one.learn("study")  # the same one is not begun anew
    _, arrays = one.give()
    wanted = np.outer([0, 1, 2, 2, 2, 3, 4], [0.3, 0.7])
    np.testing.assert_allclose(arrays["posterior"], wanted)
    assert one.contact == 2 and heard == [(2.5, time_) for time_ in (2.5, 5.0, 12.5, 15.0)]


def test_a_number_that_is_no_angle_is_told():
    with pytest.raises(InvalidInput, match=r"-4\.5 is no angle of a hinge in rad"):
        make_listener().take(0.0, np.array([0.1, 3.0, -4.5, 0.2, 3.5]))


def test_a_port_is_opened_at_the_rate_that_was_named(monkeypatch):
    calls = listen_to(monkeypatch, board, "open_serial", iter([]))
    board.Boards("/dev/x", baudrate=9600).open("/dev/x")
    board.Boards("/dev/y").open("/dev/y")
    assert [given for given, _ in calls] == [("/dev/x", 9600), ("/dev/y", 115_200)]
    with pytest.raises(InvalidInput, match=r"no board at '/dev/z'; found: .*/dev/x"):
        board.Boards("/dev/x").open("/dev/z")


def test_the_usual_interval_is_the_mean_of_those_without_a_loss():
    times = [0.0, 2.0, 4.1, 10.0, 12.0, 14.1]  # three are lost in the middle
    lines = [",".join([f"{t}", "0.1", "0.2"]).encode() + b"\n" for t in times]
    assert board._find_interval(lines, 2) == pytest.approx(2.05)
    assert board._find_interval([b"0.1,0.2\n"] * 5, 2) == 1.0


@pytest.mark.parametrize(("preview", "timestep"), [(True, 0.1), (False, None)])
def test_a_touch_in_space_is_asked_for_as_it_was_wished_for(monkeypatch, preview, timestep):
    calls = listen_to(monkeypatch, turning, "touch", "touch")
    antenna = {"preset": "rat-whisker"}
    wish = TouchRequest.from_plain(
        WISH.to_plain() | {"antenna": antenna, "azimuth": -35.0, "preview": preview}
    )
    assert turning._touch_in_space(wish) == "touch"
    ((given, trial), how) = calls[0]
    assert given == feeler.presets.make_preset("rat-whisker") and trial.azimuth == -35.0
    step = timestep and get_contact(None, given).scale_timestep(timestep)
    assert how == {"duration": 33.0, "timestep": step, "all_hinges": True}
    with pytest.raises(InvalidInput, match="shows one object beside an antenna in space"):
        turning._touch_in_space(wish.replace(objects=(ObjectRequest(),)))


@pytest.mark.parametrize("preview", [True, False])
def test_a_touch_in_space_tells_its_mode_once_it_is_exact(monkeypatch, preview):
    angle = np.arange(3 * 5 * 4.0).reshape(1, 3, 5, 4)
    tensors = {"angle": SimpleNamespace(values=angle)}
    monkeypatch.setattr(session, "_touch_in_space", lambda wish: tensors)
    monkeypatch.setattr(session, "describe_turnable", lambda *given: "scene")
    monkeypatch.setattr(session, "_fold_sensors", lambda antenna, angle: angle[0])
    monkeypatch.setattr(session, "describe_mode", lambda antenna: "mode")
    wish = {"antenna": {"preset": "rat-whisker"}, "speed": 0.3, "duration": 4.0}
    said = talk({"type": "touch", "slot": "B", "id": 2, "wish": wish | {"preview": preview}})
    np.testing.assert_array_equal(said[1][1]["angle"], np.moveaxis(angle[0], 2, 0))
    end = said[-1][0]
    assert (end["part"], end["preview"], "mode" in end) == ("end", preview, not preview)
    assert {(header["slot"], header["id"]) for header, _ in said} == {("B", 2)}


def test_a_movie_s_picture_holds_all_that_the_antenna_reaches_base_at_the_left():
    """In the picture a point x, y of feeler's plane stands at y along and −x across."""
    points = np.array(
        [[[0.0, 0.0], [-2.0, 6.0], [-7.0, 11.0]], [[0.0, 0.0], [1.0, 6.0], [3.0, 12.0]]]
    )
    ax = Figure().subplots()
    drawing._set_limits(ax, points)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert left < 0.0 and right > 12.0
    room = 0.25 * 12.0
    assert (low, high) == pytest.approx((-3.0 - room, 7.0 + room))
