"""How fast the studio answers in a real Chromium: slider to first drawn samples, whole touch,
drags, closing, memory.

    python benchmarks/studio.py [changes] [seconds of dragging]
    python benchmarks/studio.py 2 600          # memory of the server and of the page over ten
    minutes of dragging

Needs chromium and chromedriver, and selenium. Prints medians with the machine's load, which decides
much: two idle cores are meant.
"""

import os
import shutil
import statistics
import sys
import time

import psutil
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

from feeler.studio import Studio

FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run"
    " --disable-background-networking"
)
APP = "const app = document.getElementById('studio').studio; "
REST = 0.5  # s between changes; the touch and its reading end within
CHANGE = "app.store.change(s => { s.A.stiffness = [[0, 37 + 0.1 * %d], [1, 3.85e-4]]; })"
DRAG = """let k = 0; const before = app.frames; const began = performance.now();
    const move = s => { s.touch.location = 0.6 + 0.2 * Math.abs(Math.sin(++k / 30));
      if (k %% 50 === 0) s.A.stiffness = [[0, 30 + 10 * Math.random()], [1, 3.85e-4 * (1 + \
Math.random())]]; };
    const timer = setInterval(() => app.store.change(move, false), 16);
    setTimeout(() => { clearInterval(timer); app.store.change(() => {});
      window.drag = 1000 * (app.frames - before) / (performance.now() - began); }, %d);"""


def main() -> None:
    changes, seconds = (
        int(text) for text in (sys.argv[1:] + ["40", "20"][len(sys.argv) - 1 :])[:2]
    )
    studio = Studio(port=0)
    time.sleep(5)  # its engine is loaded, or compiled once, in the background
    browser = open_browser()
    began = time.perf_counter()
    browser.get(studio.address)
    wait(browser, "app.catalogue && app.root.querySelector('canvas')")
    say(
        "page ready [ms]",
        [
            browser.execute_script(
                "return performance.timing.domContentLoadedEventEnd -"
                " performance.timing.navigationStart"
            )
        ],
    )
    say("first touch whole [ms]", [1e3 * (wait(browser, "app.records.A.ended") - began)])
    wait(browser, "app.studies.A && app.records.A.reading", 900)
    browser.execute_script(APP + "app.play(false); app.study = () => {}; app.latency.length = 0")
    for number in range(changes):
        browser.execute_script(APP + CHANGE % number)
        time.sleep(REST)
    found = browser.execute_script(APP + "return app.latency")
    say("slider to first drawn samples [ms]", [one["first"] for one in found])
    say("slider to the whole touch [ms]", [one["whole"] for one in found if "whole" in one])
    browser.execute_script(
        APP
        + "app.latency.length = 0; app.store.undo(); while (app.store.past.length) app.store.undo()"
    )
    time.sleep(2)
    for number in range(changes // 2):
        browser.execute_script(
            APP + f"app.store.change(s => {{ s.touch.location = 0.6 + 0.005 * {number % 30}; }})"
        )
        time.sleep(REST)
    found = browser.execute_script(APP + "return app.latency")
    say("change of place to code and verdict [ms]", [one["read"] for one in found if "read" in one])
    drag(browser, seconds)
    browser.execute_script(APP + "app.store.change(s => { s.touch.duration = 2000; })")
    time.sleep(0.2)
    browser.get("about:blank")
    began = time.perf_counter()
    while studio.busy:
        time.sleep(0.001)
    say("closed tab to idle server [ms]", [1e3 * (time.perf_counter() - began)])
    browser.quit()
    studio.close()


def drag(browser: webdriver.Chrome, seconds: int) -> None:
    """Drag the object, and now and then the stiffness too; memory is looked at ten times."""
    browser.execute_script(APP + DRAG % (1000 * seconds))
    print(
        "dragging: s, MiB of the server's process (the driver's few among them), MiB of the page's"
        " heap"
    )
    seen = []
    for part in range(11):
        browser.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        heap = browser.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"]
        seen.append((psutil.Process().memory_info().rss / 2**20, heap / 2**20))
        print(f"  {part * seconds / 10:5.0f}  {seen[-1][0]:6.0f}  {seen[-1][1]:6.1f}", flush=True)
        time.sleep(seconds / 10 if part < 10 else 2)
    say("pictures a second while dragging", [browser.execute_script("return window.drag")])
    for name, first, last in zip(("server", "page"), seen[1], seen[-1], strict=True):
        say(f"memory of the {name} grown after the first tenth [MiB]", [last - first])


def open_browser() -> webdriver.Chrome:
    options = Options()
    options.binary_location = shutil.which("chromium") or ""
    for flag in FLAGS.split():
        options.add_argument(flag)
    return webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))


def wait(browser: webdriver.Chrome, words: str, seconds: float = 900.0) -> float:
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        if browser.execute_script(APP + f"return !!(app && {words})"):
            return time.perf_counter()
        time.sleep(0.01)
    raise TimeoutError(words)


def say(what: str, values: list[float]) -> None:
    values = sorted(values)
    if not values:
        print(f"{what:45} none")
        return
    p95 = (
        f", p95 {values[int(0.95 * (len(values) - 1))]:.0f}, n = {len(values)}"
        if len(values) > 1
        else ""
    )
    print(
        f"{what:45} {statistics.median(values):.0f}{p95} (load {os.getloadavg()[0]:.1f})",
        flush=True,
    )


if __name__ == "__main__":
    main()
