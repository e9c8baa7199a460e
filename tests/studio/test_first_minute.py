"""The first minute in the studio: the object stays in the hand, the tour covers nothing, the first
demo decides, fingers scroll, and what is saved is what is shown."""

import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

import feeler
from feeler.plotting.antennas import OBJECT_COLOUR
from feeler.studio import Studio
from feeler.studio.export import make_file

from ._page import ask, press, stop_at, wait_for

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def studio():
    running = Studio(port=0)
    yield running
    running.close()


def open_page(browser, address, width=1440, height=900):
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
    )
    browser.get("about:blank")
    browser.get(address)
    wait_for(browser, "app && app.records.A.ended && app.status == 'exact'")


PLACE = """(() => { const b = document.querySelector('canvas.stage').getBoundingClientRect();
    const { scale, ox, oy } = app.view, r = app.records.A, k = Math.max(0, r.filled - 1);
    const now = r.hand ? r.data.place.slice(k * r.wide.place) : r.data.place;
    return [b.left + ox + scale * now[1], b.top + oy + scale * now[0], scale]; })()"""


@pytest.mark.parametrize(
    "width", [1024, 1920, *(pytest.param(one, marks=pytest.mark.long) for one in (1280, 1440))]
)
def test_an_object_taken_by_hand_stays_under_the_pointer(studio, browser, width):
    open_page(browser, studio.address, width)
    browser.find_element("xpath", "//button[text()='By hand']").click()
    wait_for(browser, "app.root.dataset.mode == 'hand' && app.status == 'exact'")
    stop_at(browser, 0)
    x, y, scale = ask(browser, PLACE)
    y -= scale  # within the ball, whose foremost point is its place
    press(browser, "mousePressed", x, y)
    press(browser, "mouseMoved", x + 1, y)
    wait_for(browser, "app.records.A.hand && app.records.A.filled > 5")
    time.sleep(1.0)
    shown = ask(browser, PLACE)
    away = np.hypot(shown[0] - x - 1, shown[1] - y - scale) / shown[2]  # mm
    press(browser, "mouseReleased", x + 1, y)
    ask(browser, "app.endHand()")
    wait_for(browser, "!app.handOn && app.records.A.ended")
    assert away <= 0.5


def test_a_cut_address_says_so(studio, browser):
    open_page(browser, studio.address)
    browser.get("about:blank")
    browser.get(f"{studio.address}#s=eJyrVkrOz0nVUUrOSCxKLs5")
    wait_for(browser, "app && !app.root.querySelector('.note').hidden")
    assert "cut or damaged" in browser.find_element("css selector", ".note").text


def swipe(browser, x, y, far):
    """A finger that moves upwards by ``far`` pixels."""
    for moved in range(0, far + 1, 20):
        kind = "touchStart" if moved == 0 else "touchMove"
        browser.execute_cdp_cmd(
            "Input.dispatchTouchEvent",
            {"type": kind, "touchPoints": [{"x": x, "y": y - moved}]},
        )
        time.sleep(0.01)
    browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    time.sleep(0.4)


PICTURES = """[...document.querySelectorAll('canvas')].filter(c => c.clientHeight)
    .map(c => c.className)"""
LOOK = """(() => { const c = document.querySelector(`canvas[class="%s"]`);
    c.scrollIntoView({ block: 'center' });
    window.scrollBy(0, -60); // room to scroll, though it is the last of the page
    const b = c.getBoundingClientRect();
    return [b.left + 6, b.top + b.height / 2, window.scrollY]; })()"""


def test_a_finger_scrolls_on_every_picture_and_finds_what_it_needs(studio, browser):
    open_page(browser, studio.address, 390, 844)
    wait_for(browser, "app.studies.A && app.studies.A.labels && !app.isStale()")
    ask(browser, "app.play(false)")
    browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    try:
        pictures = ask(browser, PICTURES)
        assert {"stage", "tensor", "editor", "chart", "matrix"} <= set(pictures)
        for name in dict.fromkeys(pictures):
            x, y, before = ask(browser, LOOK % name)
            swipe(browser, x, y, 120)
            assert ask(browser, "window.scrollY") > before + 40, name
        ask(browser, "window.scrollTo(0, 0)")
        browser.find_element("xpath", "//button[text()='By hand']").click()
        wait_for(browser, "app.root.dataset.mode == 'hand' && app.status == 'exact'")
        ask(browser, "app.startHand()")
        wait_for(browser, "app.handOn && !document.querySelector('.transport .strong').hidden")
        for words in ("Let go", "Save ▾"):
            box = browser.find_element("xpath", f"//button[text()='{words}']").rect
            assert box["x"] >= 0 and box["x"] + box["width"] <= 390, words
        ask(browser, "app.endHand()")
    finally:
        browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})


@pytest.mark.parametrize(
    ("quantity", "label"), [("angle", "hinge angle [°]"), ("curvature", "curvature [1/mm]")]
)
def test_a_saved_picture_shows_the_quantity_of_the_page(quantity, label, monkeypatch):
    import matplotlib as mpl

    monkeypatch.setitem(mpl.rcParams, "svg.fonttype", "none")
    wish = {"duration": 60.0, "speed": 0.3, "antenna": {"name": "mine"}}
    *_, content = make_file({"what": "svg", "quantity": quantity, "wish": wish})
    text = content.decode()
    tensors = feeler.touch(
        feeler.presets.cockroach(),
        feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.3),
        duration=60.0,
    )
    assert label in text and "mine" in text and "0.3 m/s" in text
    assert tensors["angle"].values.max() > 0


def _read_colour(name: str) -> np.ndarray:
    return np.array([int(name[k : k + 2], 16) for k in (1, 3, 5)])


@pytest.mark.parametrize("hand", [None, [[1, 0, 0.2, 0.0, 0.0], [4, -1, 0.0, 0.3, 0.002]]])
def test_a_movie_shows_every_object_and_the_hand(hand):
    """Base left, as the page has it; one frame after the other is another picture."""
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    beside = {"kind": "box", "size": 1.1, "x": 5.0, "y": 30.0, "heading": -90.0, "speed": 0.0}
    wish = {"duration": 24.0, "speed": 0.3, "objects": [{**beside, "friction": 1.0}]}
    message = {
        "what": "mp4",
        "quantity": "angle",
        "wish": wish,
        "commands": hand,
        "samples": 24,
    }
    name, mime, content = make_file(message)
    assert (name, mime) == ("feeler-touch.mp4", "video/mp4")
    with tempfile.NamedTemporaryFile(suffix=".mp4") as file:
        Path(file.name).write_bytes(content)
        frames = imageio_ffmpeg.read_frames(file.name)
        about = next(frames)
        pictures = [np.frombuffer(frame, np.uint8) for frame in frames]
    width, height = about["size"]
    assert width >= 1000 and len(pictures) >= 20
    first, last = (
        one.reshape(height, width, 3).astype(int) for one in pictures[:: len(pictures) - 1]
    )
    seen = 0.85 * _read_colour(OBJECT_COLOUR) + 0.15 * 255  # they are a little transparent
    spots, n = ndimage.label(np.abs(first - seen).max(axis=2) < 12)
    areas = ndimage.sum_labels(spots > 0, spots, range(1, n + 1))
    places = ndimage.center_of_mass(spots > 0, spots, 1 + np.flatnonzero(areas > 200))
    assert len(places) == 2  # ball and box; letters are smaller
    assert all(across < width // 2 for _, across in places)
    assert np.abs(last - first).max() > 100
