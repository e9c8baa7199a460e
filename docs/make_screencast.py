"""A screencast of the studio: a real page in Chromium, its clock moved on frame by frame.

python -m docs.make_screencast [screencast.mp4] [seconds]

Needs Chromium with chromedriver, and the extras studio, movie and test.
"""

import base64
import io
import shutil
import sys
import time
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from PIL import Image

from feeler.studio import Studio

WIDTH, HEIGHT, RATE = 1280, 800, 10  # px, px, frames a second
APP = "const app = document.getElementById('studio').studio; "
BALL, BOX = "{ ...s.touch, kind: 'ball', size: 1.5 }", "{ ...s.touch, kind: 'box', size: 3 }"
GRADED, UNIFORM = "{ preset: 'exponential' }", "{ preset: 'matched' }"
SCENES = (
    (
        "A ball of 1.5 mm sweeps past an insect's antenna",
        f"s.A = {GRADED}; s.touch = {BALL};",
        (),
    ),
    ("Touched nearer to the base, it bends nearer to the base", "", (0.7, 0.5)),
    (
        "A uniform antenna bends at its base, wherever it is touched",
        f"s.A = {UNIFORM};",
        (0.5, 0.8),
    ),
    (
        "Side by side: graded, uniform, and their difference",
        f"s.A = {GRADED}; s.B = {UNIFORM};",
        (),
    ),
    (
        "A box: the decoder says what it infers, and how surely",
        f"s.B = null; s.touch = {BOX};",
        (),
    ),
)
"""What is said, the change of the page's state, and from where to where the object is dragged."""


def open_page(address):
    """A browser that shows the studio, light."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for word in ("--headless=new", "--no-sandbox", "--hide-scrollbars", "--disable-gpu"):
        options.add_argument(word)
    driver = webdriver.ChromeService(shutil.which("chromedriver"))
    browser = webdriver.Chrome(options, driver)
    size = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(address)
    return browser


def wait(browser, words, seconds=120.0):
    """Until something holds of the page, or so long."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if browser.execute_script(f"{APP} return Boolean({words})"):
            return
        time.sleep(0.05)


def film(browser, writer, words, change, dragged, n_frames):
    """One scene: said, changed, dragged, and then played for the rest of its frames."""
    browser.execute_script(APP + "app.store.change((s) => { " + change + " })")
    say = "document.querySelector('.tour h2').textContent = arguments[0];"
    browser.execute_script(f"{say} document.querySelector('.tour p').textContent = ''", words)
    drag = n_frames // 3 if dragged else 0
    for k in range(n_frames):
        if k < drag:
            at = np.interp(k, (0, drag - 1), dragged)
            done = str(k == drag - 1).lower()
            move = f"app.store.change((s) => {{ s.touch.location = {at:.3f}; }}, {done})"
            browser.execute_script(APP + move)
        if k in (0, drag):
            wait(
                browser,
                "app.records.A.ended && app.records.A.reading && !app.records.A.reading.old",
            )
        moment = 379 * max(k - drag, 0) / max(n_frames - drag - 1, 1)
        browser.execute_script(f"{APP} app.play(false); app.seek({moment:.1f})")
        shot = browser.execute_cdp_cmd(
            "Page.captureScreenshot", {"format": "jpeg", "quality": 90}
        )
        picture = Image.open(io.BytesIO(base64.b64decode(shot["data"]))).convert("RGB")
        writer.send(np.asarray(picture.resize((WIDTH, HEIGHT))).tobytes())


def main(path, seconds):
    """Write the film."""
    studio = Studio(port=0)
    browser = open_page(studio.address)
    try:
        wait(browser, "app && app.records.A.ended")
        writer = imageio_ffmpeg.write_frames(
            str(path), (WIDTH, HEIGHT), fps=RATE, macro_block_size=8
        )
        writer.send(None)
        for scene in SCENES:
            film(browser, writer, *scene, round(seconds * RATE / len(SCENES)))
        writer.close()
    finally:
        browser.quit()
        studio.close()
    print(f"wrote {path}: {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(
        Path(sys.argv[1] if sys.argv[1:] else "screencast.mp4"),
        float(sys.argv[2] if sys.argv[2:] else 60.0),
    )
