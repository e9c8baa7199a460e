"""One Chromium serves all files of tests of a worker: nothing goes from one file to the next."""

import http.server
import threading

import pytest

from tests.conftest import make_clean

pytestmark = pytest.mark.long

KEPT = """
localStorage.kept = sessionStorage.kept = 'yes';
document.cookie = 'kept=yes; max-age=999'; console.error('kept');
caches.open('kept').then(() => {
  const open = indexedDB.open('kept');
  open.onsuccess = () => { open.result.close(); arguments[0](); };
});
"""
SHOWN = """
Promise.all([indexedDB.databases(), caches.keys()]).then(([bases, stores]) => arguments[0]({
  local: localStorage.length, session: sessionStorage.length, cookies: document.cookie,
  bases: bases.length, caches: stores.length, script: typeof window.before,
  touch: 'ontouchstart' in window, media: matchMedia('print').matches,
  dark: matchMedia('(prefers-color-scheme: dark)').matches, back: history.length,
  size: [innerWidth, innerHeight, outerWidth, outerHeight, devicePixelRatio],
}));
"""


class Empty(http.server.BaseHTTPRequestHandler):
    """Answers every question with an empty page."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>empty</title>")

    def log_message(self, *words):
        """Say nothing."""


@pytest.fixture(scope="module")
def address():
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Empty) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def look(browser, address):
    """What a page finds when it is opened."""
    browser.get(address)
    return browser.execute_async_script(SHOWN)


def use(browser, address):
    """Everything that a test may leave behind: kept, emulated, listened to, set or open."""
    ask = browser.execute_cdp_cmd
    browser.get(address)
    browser.execute_async_script(KEPT)
    browser.set_window_size(700, 500)
    browser.set_script_timeout(7)
    browser.set_page_load_timeout(7)
    size = {"width": 390, "height": 400, "deviceScaleFactor": 2, "mobile": True}
    ask("Emulation.setDeviceMetricsOverride", size)
    ask("Emulation.setTouchEmulationEnabled", {"enabled": True})
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    ask("Emulation.setEmulatedMedia", {"media": "print", "features": dark})
    ask("Page.addScriptToEvaluateOnNewDocument", {"source": "window.before = 1"})
    left = look(browser, f"{address}again")
    browser.switch_to.new_window("tab")
    return left


def test_nothing_stays_in_the_browser_from_one_file_to_the_next(browser, address):
    first = look(browser, address)
    times = browser.timeouts.script, browser.timeouts.page_load
    left = use(browser, address)
    same = [name for name in first if left[name] == first[name]]
    assert not same, "what a test leaves behind must show, or nothing is proved"
    make_clean(browser)
    assert browser.get_log("browser") == []
    assert look(browser, address) == first
    assert (browser.timeouts.script, browser.timeouts.page_load) == times
    assert len(browser.window_handles) == 1
