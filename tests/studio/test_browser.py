"""The studio in a real Chromium: what is shown is exact, the mouse works, nothing is loaded from
elsewhere.
"""

import itertools
import os
import threading
import time

import numpy as np
import pytest

import feeler
from feeler.studio import Boards, Studio
from feeler.studio.requests import hash_tensor

from ._page import APP, ask, read_shown, stop_at, wait_for

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def studio():
    feeler.touch(
        feeler.presets.cockroach(),
        feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.3),
        duration=8.0,
    )
    running = Studio(port=0, token="the-same-after-a-restart")
    yield running
    running.close()


def open_page(browser, address):
    browser.get(address)
    wait_for(browser, "app && app.records.A.ended && app.status == 'exact'")
    ask(browser, "(app.play(false), clearTimeout(app.studyTimer))")


def find_problems(browser):
    return [
        line["message"]
        for line in browser.get_log("browser")
        if line["level"] in ("SEVERE", "WARNING")
    ]


def test_the_page_shows_what_touch_gives_and_asks_nobody_else(studio, browser):
    open_page(browser, studio.address)
    touch = ask(browser, "app.store.state.touch")
    trial = feeler.Trial(
        feature=feeler.Ball(radius=touch["size"]),
        location=touch["location"],
        speed=touch["speed"],
    )
    expected = (
        feeler.touch(feeler.presets.cockroach(), trial)["angle"].values[0].astype(np.float32)
    )
    assert np.array_equal(read_shown(browser), expected)
    assert ask(browser, "app.records.A.hash") == hash_tensor(expected)
    addresses = ask(
        browser, "performance.getEntriesByType('resource').map(entry => entry.name)"
    )
    assert all(address.startswith(studio.address) for address in addresses)
    assert find_problems(browser) == []


def find_object(browser):
    """Where the first object is on the stage, from its middle [px]."""
    place = """(() => { const c = document.querySelector('canvas.stage');
        const p = app.records.A.data.place, { scale, ox, oy } = app.view;
        return [ox + scale * p[1] - c.clientWidth / 2,
            oy + scale * (p[0] - 1.5) - c.clientHeight / 2]; })()"""
    return ask(browser, place)


def test_the_object_is_dragged_previewed_and_then_exact(studio, browser):
    from selenium.webdriver.common.action_chains import ActionChains

    open_page(browser, studio.address)
    stop_at(browser, 0)
    before = ask(browser, "app.store.state.touch.location")
    stage = browser.find_element("css selector", "canvas.stage")
    mouse = ActionChains(browser, duration=30).move_to_element_with_offset(
        stage, *map(round, find_object(browser))
    )
    mouse.click_and_hold()
    for _ in range(8):
        mouse.move_by_offset(8, 0)
    mouse.perform()
    wait_for(browser, "app.status == 'preview'")  # it stays until the mouse lets go
    ActionChains(browser).release().perform()
    wait_for(browser, "app.status == 'exact' && app.records.A.ended")
    touch = ask(browser, "app.store.state.touch")
    assert touch["location"] > before + 0.03
    trial = feeler.Trial(
        feature=feeler.Ball(radius=touch["size"]),
        location=touch["location"],
        speed=touch["speed"],
    )
    assert ask(browser, "app.records.A.hash") == hash_tensor(
        feeler.touch(feeler.presets.cockroach(), trial)["angle"].values[0]
    )
    ask(browser, "app.store.undo()")
    assert ask(browser, "app.store.state.touch.location") == before
    assert find_problems(browser) == []


def test_the_base_is_taken_in_the_hand(studio, browser):
    open_page(browser, studio.address)
    browser.find_element("xpath", "//button[text()='By hand']").click()
    browser.execute_script(APP + "app.startHand(); app.aim(-1, 3, 0, 0.1)")
    wait_for(
        browser,
        "app.records.A.hand && app.records.A.filled > 10 && app.records.A.data.base[3 *"
        " app.records.A.filled - 3] > 0.1",
    )
    ask(browser, "app.endHand()")
    wait_for(browser, "!app.handOn && app.records.A.ended")
    assert ask(browser, "app.records.A.commands.length") > 1


def test_a_state_travels_in_its_address_and_nonsense_does_not_stop_the_page(studio, browser):
    open_page(browser, studio.address)
    browser.execute_script(
        APP
        + "app.store.change(s => { s.A.stiffness = [[0, 20], [1, 0.01]]; s.touch.kind = 'box'; })"
    )
    wait_for(browser, "app.records.A.ended && app.status == 'exact'")
    shown = ask(browser, "app.records.A.hash")
    browser.find_element("xpath", "//button[contains(text(), 'Save')]").click()
    browser.find_element("xpath", "//b[text()='Copy address']").click()
    end = time.monotonic() + 10
    while "#s=" not in browser.current_url and time.monotonic() < end:
        time.sleep(0.05)
    address = browser.current_url
    for hash_part in (address.partition("#")[2], "s=nonsense", "s=" + "A" * 999):
        browser.get("about:blank")
        open_page(browser, studio.address + "#" + hash_part)
        assert (ask(browser, "app.records.A.hash") == shown) == (hash_part in address)


def test_axe_finds_no_barrier_in_any_mode_light_or_dark(studio, browser, find_barriers):
    open_page(browser, studio.address)
    for mode, theme, menu in (
        ("touch", "light", True),
        ("touch", "dark", False),
        ("hand", "light", False),
        ("board", "dark", True),
    ):
        browser.execute_script(
            APP
            + f"app.root.dataset.theme = '{theme}'; app.store.change(s => {{ s.mode = '{mode}'; }})"
        )
        browser.execute_script(
            APP + f"app.root.querySelector('.share .menu').hidden = {str(not menu).lower()}"
        )
        wait_for(browser, f"app.root.dataset.mode == '{mode}'")
        assert find_barriers() == [], (mode, theme)


DROP = """const data = new DataTransfer(); data.items.add(new File([arguments[1]], arguments[0]));
    app.root.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: \
true }));"""


def drop(browser, name, text):
    browser.execute_script(APP + DROP, name, text)


def read_note(browser):
    return ask(browser, "document.querySelector('.note.bad:not([hidden])')?.textContent || ''")


def write_recording(n_channels, n_samples=120):
    rows = ",".join(["{time}", *("{turn:.4f}" for _ in range(n_channels))]) + "\n"
    head = ",".join(["time_ms", *(f"hinge{n + 1}_rad" for n in range(n_channels))]) + "\n"
    return head + "".join(
        rows.format(time=k, turn=0.2 * np.sin(0.1 * k)) for k in range(n_samples)
    )


def test_damaged_and_foreign_files_get_one_clear_message_and_the_page_goes_on(studio, browser):
    open_page(browser, studio.address)
    before = ask(browser, "app.records.A.hash")
    good = feeler.antenna.files.write_antenna(feeler.presets.make_preset("linear"))
    for name, text, words in (
        ("mine.toml", good.replace("stiffness", "softness"), "softness"),
        ("mine.toml", good[:200] + "= = [", "not valid TOML"),
        (
            "touch.csv",
            write_recording(7),
            "has 7 channels, but the antenna 'exponential' has 56 sensors (and the robot 8)",
        ),
        ("touch.csv", "time_ms,hinge1_rad\n0,x\n", "touch.csv"),
        ("touch.doc", "?", "neither an antenna"),
    ):
        browser.execute_script(APP + "document.querySelector('.note').hidden = true")
        drop(browser, name, text)
        wait_for(browser, "document.querySelector('.note.bad:not([hidden])')")
        assert words in read_note(browser)
        assert ask(browser, "[app.records.A.hash, app.store.state.mode]") == [before, "touch"]
    drop(browser, "mine.toml", good)
    wait_for(browser, "app.store.state.A.toml && app.status == 'exact' && app.records.A.ended")
    assert find_problems(browser) == []


def test_a_recording_is_played_back_and_leaves_as_it_came(studio, browser):
    open_page(browser, studio.address)
    text = write_recording(8)
    drop(browser, "touch.csv", text)
    wait_for(browser, "app.status == 'recorded' && app.playing && app.time > 1")
    first = read_shown(browser)
    assert first == pytest.approx(np.tile(0.2 * np.sin(0.1 * np.arange(120)), (8, 1)), abs=6e-5)
    assert ask(browser, "app.store.state.A.preset") == "robot"
    browser.execute_script(
        APP
        + "URL.createObjectURL = blob => { blob.text().then(t => { window.left = t; }); return"
        " 'data:,left'; };"
    )
    ask(browser, "app.views.share.save('csv')")
    wait_for(browser, "window.left")
    drop(browser, "again.csv", browser.execute_script("return window.left"))
    wait_for(browser, "app.records.A.name == 'again.csv' && app.records.A.ended")
    assert read_shown(browser) == pytest.approx(first, abs=1e-6)
    ask(browser, "app.store.change(s => { s.mode = 'touch'; })")
    wait_for(browser, "app.status == 'exact' && app.records.A.ended && !app.records.A.name")


def test_a_board_is_heard_live_until_it_is_unplugged(browser):
    pty, tty = pytest.importorskip("pty"), pytest.importorskip("tty")
    pytest.importorskip("serial")
    board, port = pty.openpty()
    tty.setraw(port)
    name = os.ttyname(port)
    studio, unplug = Studio(port=0, boards=Boards(name)), threading.Event()

    def run():
        for first in itertools.count(step=50):
            if unplug.is_set():
                return os.close(board)
            lines = (
                f"{2 * k},{','.join([f'{0.3 * np.sin(k / 50):.4f}'] * 8)}\n"
                for k in range(first, first + 50)
            )
            os.write(board, "".join(lines).encode())
            time.sleep(0.02)

    thread = threading.Thread(target=run)
    try:
        open_page(browser, studio.address)
        browser.find_element("xpath", "//button[text()='Own antenna']").click()
        wait_for(browser, f"'{name}' in app.ports")
        thread.start()
        browser.find_element("xpath", "//button[text()='Listen']").click()
        wait_for(
            browser, "app.records.A.live && app.records.A.dropped > 0"
        )  # more than the page keeps
        assert ask(
            browser, "[app.status, app.records.A.interval, app.store.state.A.preset]"
        ) == [
            "live",
            2,
            "robot",
        ]
        shown = read_shown(browser)[0]
        assert np.abs(shown).max() == pytest.approx(0.3, abs=1e-3)
        assert (
            np.abs(np.diff(shown)).max() < 0.02
        )  # one curve, though its oldest part was dropped
        unplug.set()
        wait_for(browser, "app.status == 'error' && !app.listening")
        assert f"the board at {name} is gone" in read_note(browser)
        assert find_problems(browser) == []
    finally:
        unplug.set()
        if thread.ident:
            thread.join()
        browser.get("about:blank")
        studio.close()
        os.close(port)


def test_two_tabs_and_a_server_that_comes_back(studio, browser):
    open_page(browser, studio.address)
    first = browser.current_window_handle
    browser.switch_to.new_window("tab")
    open_page(browser, studio.address)
    port = studio.port
    studio.close()
    wait_for(browser, "app.away")
    again = Studio(port=port, token=studio.token)
    try:
        for handle in (browser.current_window_handle, first):
            browser.switch_to.window(handle)
            wait_for(browser, "!app.away")
            browser.execute_script(APP + "app.store.change(s => { s.touch.location = 0.8; })")
            wait_for(browser, "app.status == 'exact' && app.records.A.ended")
            if handle != first:
                browser.close()
    finally:
        browser.switch_to.window(first)
        browser.get("about:blank")
        again.close()


def test_a_notebook_draws_the_same_front_end(browser, tmp_path):
    """The kernel's widget and the page's ``render`` speak by anywidget's model, which here is a
    stand-in.
    """
    from feeler.studio import show_studio

    widget = show_studio("matched")
    page = """<body><div id=host></div><script type=module>{module}
        window.sent = []; const heard = [];
        window.model = {{ on: (name, f) => heard.push(f), off: () => {{}}, send: message => \
window.sent.push(message) }};
        const read = text => new DataView(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
        window.tell = text => heard.forEach(f => f({{}}, [read(text)]));
        window.leave = render({{ model: window.model, el: document.getElementById('host') }});
        document.getElementById('host').firstChild.id = 'studio';</script>"""
    module = widget._esm.replace("export default { render };", "")
    (tmp_path / "notebook.html").write_text(page.format(module=module), encoding="utf-8")
    browser.get((tmp_path / "notebook.html").as_uri())
    import base64

    given = []
    widget.send = lambda content, buffers=None: given.extend(buffers)
    end = time.monotonic() + 60
    while not browser.execute_script(
        "return window.model && document.getElementById('studio').studio.status == 'exact'"
    ):
        for message in browser.execute_script("return (window.sent || []).splice(0)"):
            widget._handle_custom_msg(message, [])
        while given:
            browser.execute_script(
                "window.tell(arguments[0])", base64.b64encode(given.pop(0)).decode()
            )
        assert time.monotonic() < end
        time.sleep(0.02)
    assert ask(browser, "app.store.state.A.preset") == "matched"
    browser.execute_script("window.leave()")
    assert [message["type"] for message in browser.execute_script("return window.sent")][
        -1
    ] == "stop"
    widget.close()
