"""What drives the studio's page in a real Chromium."""

import time

import numpy as np

APP = "const app = document.getElementById('studio').studio; "


def ask(browser, words):
    return browser.execute_script(APP + "return " + words)


def wait_for(browser, words, seconds=120.0):
    end = time.monotonic() + seconds
    while not ask(browser, words):
        if time.monotonic() > end:
            raise AssertionError(
                f"never came true: {words}; status {ask(browser, 'app.status')}"
            )
        time.sleep(0.02)


def read_shown(browser):
    """The tensor (sensor, time) in the page."""
    words = (
        "[...Array(app.records.A.index.length).keys()].map(s =>"
        " [...Array(app.records.A.filled).keys()]"
    )
    return np.array(
        ask(browser, words + ".map(k => app.records.A.angle(s, k)))"), dtype=np.float32
    )


def stop_at(browser, ms):
    """Stop playing and wait until the page is drawn as it is then: before, what the mouse can take
    lies where it was drawn last.
    """
    frames = ask(browser, f"(app.play(false), app.seek({ms}), app.frames)")
    wait_for(browser, f"app.frames > {frames}")


def press(browser, kind, x, y):
    buttons = 0 if kind == "mouseReleased" else 1
    event = {
        "type": kind,
        "x": x,
        "y": y,
        "button": "left",
        "buttons": buttons,
        "clickCount": 1,
    }
    browser.execute_cdp_cmd("Input.dispatchMouseEvent", event)
