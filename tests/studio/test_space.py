"""An antenna in space in the studio: feeler's touch, turned by hand; what is planar is refused."""

from importlib.resources import files

import numpy as np
import pytest

import feeler
from feeler.antenna.files import write_antenna
from feeler.plotting.antennas import describe_turnable
from feeler.studio import Studio
from feeler.studio.export import SPACE_SCRIPT, read_page
from feeler.studio.requests import AntennaRequest, TouchRequest, hash_tensor, wish_for
from feeler.tensors.transforms import stack_planes
from tests.studio.test_browser import ask, find_problems, open_page, wait_for

from ._messages import talk

pytestmark = pytest.mark.long

WISH = {"antenna": {"preset": "rat-whisker"}, "speed": 0.1, "azimuth": 40.0, "duration": 60.0}
ANTENNA = feeler.presets.make_preset("rat-whisker")


def make_touch(**more):
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.1, azimuth=40.0)
    return trial, feeler.touch(ANTENNA, trial, duration=60.0, **more)


def write(**message):
    return {"slot": "A", "id": 3, **message}


def test_what_is_sent_is_the_touch_and_its_turnable_view():
    said = talk(write(type="touch", wish=WISH))
    (begin, _), (piece, arrays), (end, _) = said
    trial, tensors = make_touch(all_hinges=True)
    angle = tensors["angle"].values[0]
    np.testing.assert_array_equal(arrays["angle"].transpose(1, 2, 0), angle.astype(np.float32))
    assert piece["scene"] == describe_turnable(ANTENNA, trial, tensors)
    assert begin["antenna"]["planes"] == ["x", "z"] and begin["total"] == 60
    own = stack_planes(make_touch()[1]["angle"]).values[0]
    assert end["hash"] == hash_tensor(own) and end["mode"]["frequency"] > 0


@pytest.mark.parametrize(
    "message",
    [
        {"type": "hand", "wish": WISH},
        {"type": "study", "antenna": WISH["antenna"], "speed": 0.3},
        {"type": "listen", "antenna": WISH["antenna"], "port": "x"},
        {"type": "save", "wish": WISH, "what": "mp4"},
        {"type": "save", "wish": WISH, "what": "html"},
    ],
    ids=lambda message: message.get("what", message["type"]),
)
def test_what_stays_in_the_plane_is_refused_by_name(message):
    *_, (last, _) = talk(write(**message))
    assert last["type"] == "error"
    assert "works in the plane, and 'rat-whisker" in last["message"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"objects": [{"kind": "ball"}]}, "one object beside an antenna in space"),
        (
            {"antenna": {"preset": "rat-whisker", "stiffness": [[0, 1], [1, 0.1]]}},
            "has a row for each plane",
        ),
    ],
)
def test_what_a_touch_in_space_has_not_is_said(changes, words):
    *_, (last, _) = talk(write(type="touch", wish=WISH | changes))
    assert last["type"] == "error" and words in last["message"]


def test_a_planar_antenna_has_no_azimuth():
    wish = TouchRequest.from_plain(WISH | {"antenna": {"preset": "linear"}})
    assert wish.make_trial().azimuth == 0.0
    assert TouchRequest.from_plain(WISH).make_trial().azimuth == 40.0


def test_antenna_and_script_leave(tmp_path):
    ((toml, content),) = talk(write(type="save", wish=WISH, what="toml"))
    text = content["content"].tobytes()[: toml["bytes"]].decode()
    assert AntennaRequest(toml=text).make_any() == ANTENNA
    assert write_antenna(ANTENNA) == text
    ((script, content),) = talk(write(type="save", wish=WISH, what="script"))
    code = content["content"].tobytes()[: script["bytes"]].decode()
    known: dict = {}
    exec(code, known)
    np.testing.assert_array_equal(
        known["tensor"], stack_planes(make_touch()[1]["angle"]).values[0].astype("<f4")
    )


def test_the_page_draws_as_the_report_does():
    """Its ``turn.js`` is the report's own without what looks for views on a page of the report."""
    drawing, hands_out = read_page(SPACE_SCRIPT).split("export ")
    own = files("feeler.report").joinpath("turn.js").read_text()
    assert own.startswith(drawing) and "document" not in drawing
    assert hands_out == "{ drawScene };\n"


@pytest.fixture(scope="module")
def studio():
    running = Studio(wish_for("exponential"), port=0)
    yield running
    running.close()


def choose(browser, name):
    """Choose a preset as a person does."""
    from selenium.webdriver.support.ui import Select

    Select(browser.find_element("css selector", "select[aria-label=Preset]")).select_by_value(
        name
    )
    wait_for(
        browser,
        f"app.records.A.ended && app.status == 'exact' &&"
        f" app.records.A.antenna.name == app.catalogue.presets['{name}'].name",
    )
    browser.execute_script(
        "const app = document.getElementById('studio').studio;"
        "app.play(false); clearTimeout(app.studyTimer)"
    )


SHOWN = "document.querySelector('canvas.stage:not([hidden])').className"
FLAT = "document.querySelectorAll('.antenna-panel [hidden], .touch-panel [hidden]').length"


def test_an_antenna_in_space_is_turned_and_one_in_the_plane_comes_back_as_it_was(
    studio, browser
):
    open_page(browser, studio.address)
    before = ask(browser, "[app.records.A.hash, " + FLAT + "]")
    choose(browser, "rat-whisker")
    touch = ask(browser, "app.store.state.touch")
    trial = feeler.Trial(
        feature=feeler.Ball(radius=touch["size"]),
        location=touch["location"],
        speed=touch["speed"],
    )
    tensors = feeler.touch(ANTENNA, trial, duration=touch["duration"])
    assert ask(browser, "app.records.A.hash") == hash_tensor(
        stack_planes(tensors["angle"]).values[0]
    )
    assert ask(browser, SHOWN) == "stage turned"
    off = "[...document.querySelectorAll('header .choice button')].map(b => b.disabled)"
    assert ask(browser, off) == [False, True, True]
    assert "An antenna in space" in browser.find_element("css selector", ".antenna-panel").text
    assert not browser.find_element("css selector", ".columns > .right").is_displayed()
    read_planes(browser, tensors)
    before_turn = take_picture(browser)
    canvas = browser.find_element("css selector", "canvas.turned")
    from selenium.webdriver.common.action_chains import ActionChains

    drag = ActionChains(browser, duration=30).move_to_element(canvas).click_and_hold()
    drag.move_by_offset(60, 10).release().perform()
    assert take_picture(browser) != before_turn
    choose(browser, "exponential")
    assert ask(browser, "[app.records.A.hash, " + FLAT + "]") == before
    assert ask(browser, SHOWN) == "stage"
    assert ask(browser, "[app.records.A.scene, app.records.A.bends]") == [None, None]
    assert ask(browser, off) == [False] * 3
    assert (
        "An antenna in space" not in browser.find_element("css selector", ".antenna-panel").text
    )
    ask(browser, "app.store.undo()")
    wait_for(browser, "app.records.A.ended && app.records.A.scene")
    assert find_problems(browser) == []


def read_planes(browser, tensors):
    """Both planes of bending can be chosen, and are the touch's."""
    from selenium.webdriver.support.ui import Select

    chooser = browser.find_element(
        "css selector", "select[aria-label='Plane of bending shown']"
    )
    assert [option.text for option in Select(chooser).options] == ["towards x", "towards z"]
    for plane in (1, 0):
        Select(chooser).select_by_index(plane)
        words = "[...app.records.A.index.keys()]"
        words += ".map(s => [0, 90, 379].map(k => app.records.A.angle(s, k)))"
        own = tensors["angle"].values[0, plane][:, [0, 90, 379]].astype(np.float32)
        np.testing.assert_array_equal(np.array(ask(browser, words), dtype=np.float32), own)
        peak = np.abs(tensors["angle"].values[0, plane]).max()
        assert ask(browser, "app.findPeak()") == pytest.approx(peak, rel=1e-6)


def take_picture(browser):
    return ask(browser, "document.querySelector('canvas.turned').toDataURL()")
