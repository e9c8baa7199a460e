"""The studio in a real notebook: JupyterLab with its kernel, in a real Chromium."""

import json
import os
import subprocess
import sys
import time
from importlib.util import find_spec

import pytest

import feeler
from feeler.studio.requests import hash_tensor

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("jupyterlab") is None, reason="needs jupyterlab"),
]
APP = "const app = document.querySelector('.feeler-studio')?.studio; return "
CELL = "from feeler.studio import show_studio\n\nwidget = show_studio('matched')\nwidget"


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Address of a JupyterLab of its own that holds one notebook."""
    home = tmp_path_factory.mktemp("lab")
    cell = {
        "cell_type": "code",
        "id": "a",
        "metadata": {},
        "source": CELL,
        "outputs": [],
        "execution_count": None,
    }
    kernel = {
        "kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}
    }
    book = {"cells": [cell], "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}
    (home / "studio.ipynb").write_text(json.dumps(book))
    folders = {
        f"JUPYTER_{name}_DIR": str(home / name) for name in ("CONFIG", "DATA", "RUNTIME")
    }
    options = [
        "--no-browser",
        "--allow-root",
        "--ip=127.0.0.1",
        "--port=0",
        f"--ServerApp.root_dir={home}",
    ]
    more = ["--expose-app-in-browser", "--LabApp.news_url=None", "--IdentityProvider.token=abc"]
    command = [sys.executable, "-m", "jupyterlab", *options, *more]
    with open(home / "log", "w") as log:
        running = subprocess.Popen(
            command, env=os.environ | folders, cwd=home, stdout=log, stderr=log
        )
    try:
        yield _find_address(home, running)
    finally:
        running.terminate()
        running.wait(20)


def _find_address(home, running):
    end = time.monotonic() + 60
    while time.monotonic() < end and running.poll() is None:
        for path in (home / "RUNTIME").glob("jpserver-*.json"):
            if text := path.read_text():
                return f"http://127.0.0.1:{json.loads(text)['port']}/lab/tree/studio.ipynb?token=abc"
        time.sleep(0.05)
    raise AssertionError((home / "log").read_text()[-2000:])


def wait_for(browser, words, seconds=120.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if browser.execute_script(words):
            return
        time.sleep(0.05)
    raise AssertionError(
        f"never came true: {words}; the page says"
        f" {browser.find_element('tag name', 'body').text[-300:]}"
    )


def test_a_notebook_shows_what_touch_gives_and_asks_nobody_else(lab, browser):
    browser.get(lab)
    book = "window.jupyterapp?.shell.currentWidget"
    wait_for(browser, f"return {book}?.sessionContext?.session?.kernel?.status == 'idle'")
    browser.execute_script("window.jupyterapp.commands.execute('notebook:run-all-cells')")
    wait_for(browser, APP + "app?.status == 'exact' && app.records.A.ended")
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.06)
    expected = feeler.touch(feeler.presets.make_preset("matched"), trial)["angle"].values[0]
    assert browser.execute_script(APP + "app.records.A.hash") == hash_tensor(expected)
    browser.execute_script(APP + "app.store.change(s => { s.touch.location = 0.8; })")
    wait_for(
        browser,
        APP + "app.status == 'exact' && app.records.A.ended && app.records.A.hash !="
        f" '{hash_tensor(expected)}'",
    )
    hosts = browser.execute_script(
        "return performance.getEntriesByType('resource').map(entry => new URL(entry.name).hostname)"
    )
    assert set(hosts) <= {"127.0.0.1", "localhost", ""}
