"""How fast the studio answers in a real Chromium: touches, drags, a hand, a wall, a board, memory,
and the standalone page.

    python benchmarks/studio.py [changes] [seconds of dragging]
    python benchmarks/studio.py 2 600          # memory of the server and of the page over ten
    minutes of dragging

Needs chromium, chromedriver, selenium and pyserial. Prints medians with the machine's load, which
decides much: two idle cores are meant.
"""

import os
import pty
import shutil
import statistics
import sys
import tempfile
import threading
import time
import tty
from pathlib import Path

import psutil
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

from feeler.studio import Boards, Studio, write_touch_page

FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run"
    " --disable-background-networking"
)
APP = "const app = document.getElementById('studio').studio; "
REST = 0.5  # s between changes; the touch and its reading end within
CHANGE = "app.store.change(s => { s.A.stiffness = [[0, 37 + 0.1 * %d], [1, 3.85e-4]]; })"
DRAG = """let k = 0; const before = app.frames; const began = performance.now();
    const move = s => { s.touch.location = 0.6 + 0.2 * Math.abs(Math.sin(++k / 30));
      if (%s && k %% 50 === 0) s.A.stiffness = [[0, 30 + 10 * Math.random()], [1, 3.85e-4 * (1 + \
Math.random())]]; };
    const timer = setInterval(() => app.store.change(move, false), 16);
    setTimeout(() => { clearInterval(timer); app.store.change(() => {});
      window.drag = 1000 * (app.frames - before) / (performance.now() - began); }, %d);"""
HAND = """const before = app.frames, n = app.records.A.filled, began = performance.now(); let k = 0;
    const done = arguments[arguments.length - 1], p = [...app.records.A.data.place.slice(0, 2)];
    app.startHand();
    const timer = setInterval(() => app.aim(0, p[0] + 6 * Math.sin(++k / 40), p[1], 0), 16);
    setTimeout(() => { clearInterval(timer);
      const s = (performance.now() - began) / 1000; app.endHand();
      done([(app.frames - before) / s, app.records.A.filled / s]); }, 5000);"""
FOLLOW = """const done = arguments[arguments.length - 1], { id } = app.walls.A; let first = 0;
    const began = performance.now(); app.store.change(s => { s.wall.turn = %d; });
    const look = () => { const r = app.walls.A, now = performance.now() - began;
      if (r.id !== id && r.n) first = first || now;
      if (r.id !== id && r.end) done([first, now]); else requestAnimationFrame(look); }; look();"""
WATCH = """const done = arguments[arguments.length - 1], seen = [], r = app.records.A;
    const before = app.frames, began = performance.now();
    const look = () => { seen.push([Date.now(), r.dropped + r.filled]);
      if (performance.now() - began < 5000) requestAnimationFrame(look);
      else done([seen, (app.frames - before) / 5]); }; look();"""
BOARD_RATE, BOARD_CHANNELS = 500, 8  # lines a second, as many sensors as the robot has


def main() -> None:
    changes, seconds = (
        int(text) for text in (sys.argv[1:] + ["40", "20"][len(sys.argv) - 1 :])[:2]
    )
    studio = Studio(port=0)
    time.sleep(5)  # its engine is loaded, or compiled once, in the background
    browser = open_browser()
    browser.set_script_timeout(600)
    touch(browser, studio, changes)
    drag(browser, seconds)
    move_by_hand(browser)
    follow(browser, changes // 4)
    close(browser, studio)
    listen(browser)
    open_file(browser, changes // 4)
    browser.quit()


def touch(browser: webdriver.Chrome, studio: Studio, changes: int) -> None:
    """From a change to what is drawn: of the antenna, then of the place, which is decoded too."""
    began = time.perf_counter()
    browser.get(studio.address)
    wait(browser, "app.catalogue && app.root.querySelector('canvas')")
    timing = "performance.timing.domContentLoadedEventEnd - performance.timing.navigationStart"
    say("page ready [ms]", [browser.execute_script(f"return {timing}")])
    say("first touch whole [ms]", [1e3 * (wait(browser, "app.records.A.ended") - began)])
    wait(browser, "app.studies.A && app.records.A.reading")
    browser.execute_script(
        APP + "app.play(false); app.study = () => {}; app.latency.length = 0"
    )
    for number in range(changes):
        browser.execute_script(APP + CHANGE % number)
        time.sleep(REST)
    say_latency(browser, "slider to first drawn samples [ms]", "first")
    say_latency(browser, "slider to the whole touch [ms]", "whole")
    browser.execute_script(
        APP
        + "app.latency.length = 0; app.store.undo(); while (app.store.past.length) app.store.undo()"
    )
    time.sleep(2)
    move_object(browser, changes // 2)
    say_latency(browser, "change of place to code and verdict [ms]", "read")


def move_object(browser: webdriver.Chrome, changes: int) -> None:
    for number in range(changes):
        browser.execute_script(
            APP
            + f"app.store.change(s => {{ s.touch.location = 0.6 + 0.005 * {number % 30}; }})"
        )
        time.sleep(REST)


def drag(browser: webdriver.Chrome, seconds: int) -> None:
    """Drag the object, and now and then the stiffness too; memory is looked at ten times."""
    browser.execute_script(APP + DRAG % ("true", 1000 * seconds))
    print(
        "dragging: s, MiB of the server's process (the driver's few among them), MiB of the page's"
        " heap"
    )
    seen = []
    for part in range(11):
        browser.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        heap = browser.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"]
        seen.append((psutil.Process().memory_info().rss / 2**20, heap / 2**20))
        print(
            f"  {part * seconds / 10:5.0f}  {seen[-1][0]:6.0f}  {seen[-1][1]:6.1f}", flush=True
        )
        time.sleep(seconds / 10 if part < 10 else 2)
    say("pictures a second while dragging", [browser.execute_script("return window.drag")])
    for name, first, last in zip(("server", "page"), seen[1], seen[-1], strict=True):
        say(f"memory of the {name} grown after the first tenth [MiB]", [last - first])


def move_by_hand(browser: webdriver.Chrome) -> None:
    browser.execute_script(APP + "app.store.change(s => { s.mode = 'hand'; })")
    wait(browser, "app.records.A.ended && app.status == 'exact'")
    pictures, samples = browser.execute_async_script(APP + HAND)
    say("pictures a second by hand", [pictures])
    say("samples a second by hand (100 are asked)", [samples])
    wait(browser, "!app.handOn")


def follow(browser: webdriver.Chrome, changes: int) -> None:
    """A run along a wall; the first one also learns what distance feels like."""
    browser.execute_script(APP + "app.store.change(s => { s.mode = 'wall'; })")
    wait(browser, "app.walls.A.end")
    found = [browser.execute_async_script(APP + FOLLOW % (5 * (k + 1))) for k in range(changes)]
    say("turn of the wall to first drawn samples [ms]", [first for first, _ in found])
    say("turn of the wall to the whole run [ms]", [whole for _, whole in found])


def close(browser: webdriver.Chrome, studio: Studio) -> None:
    browser.execute_script(
        APP + "app.store.change(s => { s.mode = 'touch'; s.touch.duration = 1000; })"
    )
    time.sleep(0.2)
    browser.get("about:blank")
    began = time.perf_counter()
    while studio.busy:
        time.sleep(0.001)
    say("closed tab to idle server [ms]", [1e3 * (time.perf_counter() - began)])
    studio.close()


def listen(browser: webdriver.Chrome) -> None:
    """A board on a pseudo-terminal, heard by its serial port."""
    board, port = pty.openpty()
    tty.setraw(port)
    name, sent, ended = os.ttyname(port), [], threading.Event()

    def run() -> None:
        while not ended.wait(1 / BOARD_RATE):
            values = ",".join(["0.01"] * BOARD_CHANNELS)
            sent.append(1e3 * time.time())
            os.write(board, f"{1000 * len(sent) / BOARD_RATE:g},{values}\n".encode())

    studio, thread = Studio(port=0, boards=Boards(name)), threading.Thread(target=run)
    browser.get(studio.address)
    wait(browser, "app.records.A.ended")
    browser.execute_script(APP + "app.store.change(s => { s.mode = 'board'; })")
    wait(browser, f"'{name}' in app.ports")
    thread.start()
    browser.execute_script(APP + f"app.listen('{name}')")
    wait(browser, "app.status == 'live' && app.records.A.filled > 50")
    seen, pictures = browser.execute_async_script(APP + WATCH)
    ended.set()
    thread.join()
    say("pictures a second of a board", [pictures])
    late = [now - sent[count] for now, count in seen if count < len(sent)]
    say("line of a board to its picture [ms]", late)
    browser.get("about:blank")
    studio.close()


def open_file(browser: webdriver.Chrome, changes: int) -> None:
    """The page that computes by itself, from a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drag.html"
        path.write_text(write_touch_page(), encoding="utf-8")
        say("size of the page [kB]", [path.stat().st_size / 1000])
        shown = {"first samples": "filled", "whole touch": "ended", "verdict": "reading"}
        seen = {word: [] for word in shown}
        for _ in range(5):
            browser.get("about:blank")
            began = time.perf_counter()
            browser.get(path.as_uri())
            for word, what in shown.items():
                seen[word].append(1e3 * (wait(browser, f"app.records.A.{what}") - began))
        for word, values in seen.items():
            say(f"page opened to {word} [ms]", values)
        browser.execute_script(APP + "app.play(false); app.latency.length = 0")
        move_object(browser, changes)
        say_latency(browser, "page: change of place to first samples [ms]", "first")
        say_latency(browser, "page: change of place to the verdict [ms]", "read")
        browser.execute_script(APP + DRAG % ("false", 5000))
        time.sleep(6)
        say("page: pictures a second while dragging", [browser.execute_script("return drag")])


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


def say_latency(browser: webdriver.Chrome, what: str, part: str) -> None:
    found = browser.execute_script(APP + "return app.latency")
    say(what, [one[part] for one in found if part in one])


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
