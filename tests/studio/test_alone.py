"""The page that computes by itself: feeler's numbers in a browser, from a file, with no server."""

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest

import feeler
from feeler.errors import SimulationDivergedError
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock
from feeler.physics.simulation import build_scene
from feeler.studio import export as alone
from feeler.studio import study
from feeler.studio.export import _bundle, _pack_antenna, _pack_contact, _pack_shape, make_file
from feeler.studio.requests import AntennaRequest, TouchRequest
from feeler.studio.study import Range, _pack_templates

from ._page import APP, ask, press, read_shown, stop_at, wait_for

pytestmark = pytest.mark.long

DECLARED = json.loads(Path(__file__).with_name("declared_touches.json").read_text())
TIMESTEP = 0.05
CHECK = """
const read = text => new Float64Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
window.compare = ({ constants, objects, contact, touch, angle, samples }) => {
  const chain = new Chain(read(constants), objects, contact, TIMESTEP), want = read(angle);
  let agreed = 0;
  for (let s = 0; s < samples && agreed === s; s++) {
    if (s) chain.step(Math.round(1 / TIMESTEP));
    agreed += chain.w.angle.every((v, i) => Math.abs(v - want[s * chain.n + i]) < 1e-9);
  }
  const found = placeObject(layOut(chain.c), objects[0].shape, touch), { x, y } = objects[0];
  return [agreed, Math.hypot(found.x - x, found.y - y)];
};
"""


def run(wish, aside=0.0):
    """Angles (sample, segment) of a touch, begun so far aside, until it is no longer finite."""
    antenna = wish.antenna.make()
    start = antenna.rest_angle + aside * np.sign(np.sin(np.arange(1, antenna.n_segments + 1)))
    scene = build_scene(antenna, wish.make_objects(), angle=start)
    for duration in (wish.duration, wish.duration / 2, wish.duration / 4):
        try:
            return run_scene(scene, Clock(duration=duration, timestep=TIMESTEP)).angle
        except SimulationDivergedError:
            continue
    raise AssertionError("no finite part")


def find_sound(angle, other):
    """Samples before two runs that began 1e-16 rad apart differ by 1e-10 rad."""
    n = min(len(angle), len(other))
    apart = np.abs(angle[:n] - other[:n]).max(axis=1) > 1e-10
    return int(np.argmax(apart)) if apart.any() else n


def describe(touch, angle):
    wish = TouchRequest.from_plain(touch)
    antenna = wish.antenna.make()
    objects = [
        {
            "shape": _pack_shape(item.feature, antenna),
            "x": item.place[0],
            "y": item.place[1],
            "forward": item.forward,
            "velocity": item.velocity,
            "friction": item.friction,
        }
        for item in build_scene(antenna, wish.make_objects()).objects
    ]
    return {
        "constants": _pack_antenna(antenna),
        "objects": objects,
        "contact": _pack_contact(),
        "touch": {
            name: touch[name] for name in ("location", "approach", "side", "speed", "lead")
        },
        "angle": base64.b64encode(angle.astype("<f8").tobytes()).decode(),
        "samples": len(angle),
    }


def test_the_page_s_engine_agrees_with_feeler_s_on_the_declared_touches(browser, tmp_path):
    """To 1e-9 rad: 48 of them whole. Where not, feeler's own engine turns a push of 1e-16 rad into
    1e-10: walls that crush the antenna, one until the engine gives up.
    """
    path = tmp_path / "engine.html"
    script = f"{_bundle('worker.js')}\n{CHECK}"  # host.js says TIMESTEP
    path.write_text(
        f"<script>window.port = {{}}</script><script type=module>{script}</script>",
        encoding="utf-8",
    )
    browser.get(path.as_uri())
    assert len(DECLARED) == 50
    whole = 0
    for touch in DECLARED:
        wish = TouchRequest.from_plain(touch)
        angle = run(wish)
        agreed, gap = browser.execute_script(
            "return compare(arguments[0])", describe(touch, angle)
        )
        whole += agreed == wish.duration
        assert agreed == len(angle) or agreed >= find_sound(angle, run(wish, 1e-16)), touch
        assert gap < 1e-9, touch
    assert whole >= 48


def plant(wish, speed, unsure, step):
    """What a decoder might have been trained on, at no cost."""
    pattern = np.outer(np.sin(np.linspace(0, 3, 56)), np.linspace(0, 1, 360) ** 2)
    templates = np.array([0.1 * (1 + c / 30) * pattern for c in range(30)], np.float32)
    scores = {"clean": 0.9, "noisy": 0.57, "confidently_wrong": 0.01, "outside": 0.0, "n": 30}
    return {
        "templates": _pack_templates(templates, step),
        "kinds": [c % 3 for c in range(30)],
        "peak": 0.2,
        "curvature": 0.8,
        "onset": 0.0016,
        "noise": 0.03,
        "tempering": 1.0,
        "limit": [1e9] * 360,
        "range": Range.around(speed, unsure).to_plain(),
        "scores": scores,
    }


@pytest.fixture(scope="module")
def quiet_page(tmp_path_factory):
    """A page that was taught by nothing, so that it costs little."""
    path = tmp_path_factory.mktemp("page") / "drag.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(alone, "_keep", plant)
        path.write_text(alone.write_touch_page(), encoding="utf-8")
    return path


def open_page(browser, path, width=1280, height=720):
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500},
    )
    browser.get("about:blank")
    browser.get_log("browser")
    browser.get(path.as_uri())
    wait_for(browser, "app && app.status == 'here' && app.records.A.ended")


def expect(browser):
    """The tensor that feeler makes of what the page says that it shows."""
    state = ask(browser, "app.store.state")
    wish = TouchRequest.from_plain({"antenna": state["A"], **state["touch"]})
    return feeler.touch(wish.antenna.make(), wish.make_trial(), duration=wish.duration)["angle"]


BALL = """(() => { const b = document.querySelector('canvas.stage').getBoundingClientRect();
    const { scale, ox, oy } = app.view, p = app.records.A.data.place;
    return [b.left + ox + scale * p[1], b.top + oy + scale * (p[0] - 1), scale]; })()"""


@pytest.mark.parametrize("width", [390, pytest.param(1280, marks=pytest.mark.long), 1920])
def test_the_page_is_dragged_from_a_file_and_shows_feeler_s_tensor(browser, quiet_page, width):
    assert quiet_page.stat().st_size < 500_000
    open_page(browser, quiet_page, width)
    assert ask(browser, "document.documentElement.scrollWidth <= innerWidth")
    wait_for(browser, "app.records.A.reading && app.studies.A && !app.isStale()")
    cells = ask(browser, "[...document.querySelectorAll('.tally td')].map(c => c.innerText)")
    assert [text for text in cells if text] == ["57 %"] * 4
    stop_at(browser, 0)
    x, y, scale = ask(browser, BALL)
    press(browser, "mousePressed", x, y)
    for step in range(1, 5):
        press(browser, "mouseMoved", x - step * scale, y)
    wait_for(browser, "app.status == 'preview' && app.records.A.ended")
    press(browser, "mouseReleased", x - 4 * scale, y)
    wait_for(browser, "app.status == 'here' && app.records.A.ended")
    assert ask(browser, "app.store.state.touch.location") == pytest.approx(
        0.7 - 4 / 42, abs=0.01
    )
    assert read_shown(browser) == pytest.approx(expect(browser).values[0], abs=1e-7)  # float32
    assert ask(browser, "performance.getEntriesByType('resource').length") == 0
    bad = [one for one in browser.get_log("browser") if one["level"] in ("SEVERE", "WARNING")]
    assert bad == []


def test_an_exported_page_computes_and_says_what_it_is(browser, tmp_path, monkeypatch):
    monkeypatch.setattr(alone, "_teach_all", lambda *_: None)
    mine = {"preset": "linear", "length": 50.0, "name": "mine </script>"}
    touch = {"antenna": mine, "kind": "triangle", "size": 2.2, "speed": 0.2, "side": "right"}
    touch |= {"approach": 80.0, "location": 0.66, "duration": 90.0}
    other = {**touch, "antenna": {"preset": "matched"}}
    *_, content = make_file({"what": "html", "wish": touch, "other": other})
    path = tmp_path / "shown.html"
    path.write_bytes(content)
    open_page(browser, path)
    assert read_shown(browser) == pytest.approx(expect(browser).values[0], abs=1e-7)
    words = ask(browser, "document.querySelector('.about-panel').textContent")
    for said in (
        "mine </script>, 50 mm",
        "triangle of half-width 2.2",
        "0.2 m/s",
        "Mongeau 2025",
    ):
        assert said in words
    assert "feeler studio" in words
    buttons = ask(
        browser, "[...document.querySelectorAll('header button')].map(b => b.innerText)"
    )
    assert {"A: mine </script>", "B: matched", "0.2 m/s", "slow", "fast"} <= set(buttons)


def test_a_run_by_hand_is_computed_again(browser, tmp_path, monkeypatch):
    from feeler.studio.live import replay

    monkeypatch.setattr(alone, "_teach_all", lambda *_: None)
    commands = [[1, 0, 0.0, 0.0, 0.0], [3, 0, 0.4, -0.1, 0.0], [9, -1, 0.05, 0.1, 0.004]]
    wish = {"antenna": {"preset": "matched"}, "location": 0.6, "lead": 2.0}
    message = {"what": "html", "wish": wish, "commands": commands, "samples": 40}
    path = tmp_path / "hand.html"
    path.write_bytes(make_file(message)[-1])
    browser.get(path.as_uri())
    wait_for(browser, "app && app.records.A.hand && app.records.A.ended")
    again = replay(TouchRequest.from_plain(wish), [tuple(one) for one in commands], 40)
    sensed = np.asarray(TouchRequest.from_plain(wish).antenna.make().sensors) - 1
    assert np.abs(again["angle"][:, sensed]).max() > 1e-3
    assert read_shown(browser) == pytest.approx(again["angle"][:, sensed].T, abs=1e-7)


@pytest.mark.slow
def test_the_verdict_is_the_studio_s_and_the_tour_s_sentence_holds(browser, tmp_path):
    """Accuracies on held-out touches; and what the tour says: a graded antenna bends where it is
    touched, a uniform one at its base, and a fast touch is over sooner.
    """
    path = tmp_path / "drag.html"
    path.write_text(alone.write_touch_page(), encoding="utf-8")
    assert path.stat().st_size <= 500_000
    open_page(browser, path)
    wait_for(browser, "app.records.A.reading && !app.records.A.reading.old")
    kept = alone._keep(AntennaRequest(), 0.06, study.UNSURE, alone._STEPS[0])
    assert ask(browser, "app.studies.A.scores") == kept["scores"]
    bent = {}
    for antenna in (0, 1):
        for location in (0.5, 0.7, 0.9):
            for speed in (0.06, 0.6):
                bent[antenna, location, speed] = felt(browser, antenna, location, speed)
    for location in (0.5, 0.7, 0.9):
        assert bent[0, location, 0.06][0] == pytest.approx(location, abs=0.13)
        assert bent[1, location, 0.06][0] < 0.05
        assert bent[0, location, 0.6][1] < bent[0, location, 0.06][1] / 5
    cells = ask(browser, "[...document.querySelectorAll('.tally td')].map(c => c.innerText)")
    slow, fast, *uniform = (int(text.split()[0]) for text in cells if text)
    assert slow > fast + 10 and fast > max(uniform) + 10


def felt(browser, antenna, location, speed):
    """Where the antenna bends most (median share of its length), and for how many ms it touches."""
    browser.execute_script(
        APP + "const [a, location, speed] = arguments; app.store.change("
        "s => { s.A = JSON.parse(document.getElementById('config').textContent).antennas[a].wish;"
        " Object.assign(s.touch, { location, speed }); })",
        antenna,
        location,
        speed,
    )
    wait_for(browser, "app.status == 'here' && app.records.A.ended")
    wait_for(browser, "document.querySelector('.felt').textContent.includes('lasts')")
    said = ask(browser, "document.querySelector('.felt').textContent")
    bent, lasts = re.search(r"mostly bends at ([\d.]+) %.* lasts (\d+) ms", said).groups()
    return float(bent) / 100, float(lasts)
