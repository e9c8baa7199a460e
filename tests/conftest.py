"""What all tests share: one thread within libraries where several workers share the machine (their
threads would only be in each other's way), no deadline of Hypothesis (a busy machine breaks no
law), no search for garbage among what stays to the end, which file of tests goes to which worker,
a guard that starts no process, and a browser."""

import gc
import json
import os
import shutil
import tempfile
from contextlib import contextmanager
from importlib import resources

import hypothesis
import pytest

hypothesis.settings.register_profile("patient", deadline=None)
hypothesis.settings.load_profile("patient")
gc.disable()  # until all is imported and collected: it takes half as long again, and finds nothing

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
DRIVER = shutil.which("chromedriver")
FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run"
    " --disable-background-networking"
)
WHOLE = tuple(f"paper/test_{name}.py" for name in ("whole", "print"))
"""Files that look at one whole run of the paper: they go to one worker, which makes it once."""
STUDIED = tuple(f"studio/test_{name}.py" for name in ("board", "decoder"))
"""Files that ask one trained decoder."""
ENCODED = tuple(f"encoding/test_{name}.py" for name in ("states", "selection", "model"))
"""Files that compile the encoder."""
TORCH = (
    *("decoding/test_cnn.py", "decoding/test_common.py"),
    *("learn/test_dataset.py", "objects/test_one_noise.py"),
)
"""Files that load PyTorch, which takes three seconds."""
FIRST = (
    *WHOLE,
    "physics/test_space.py",
    "physics/test_accuracy.py",
    "examples/test_examples.py",
    *STUDIED,
    "active/test_observer.py",
    "analysis/test_dispersion.py",
    "physics/test_parity_chain.py",
    "active/test_environment.py",
    "calibration/test_own.py",
    "physics/test_lanes.py",
    "tensors/test_store.py",
    *ENCODED,
)
"""Files that begin first: of two workers one compiles the engine for one antenna and the other that
for eight and part of the encoder, or the engine in space, once, while neither needs what the other
compiles; then what takes longest, so that no worker is left alone with one at the end, and what
needs the rest of the encoder.
"""
JUDGED = (
    "feeler.cli.",
    "feeler.design.",
    "feeler.comparison",
    "feeler.active.contests",
    "feeler.tradeoff",
)
"""Modules that draw the figures of verbs; the report's own figures have a law of their own."""
SIZE = "--window-size=1440,900"
ALONE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"


def pytest_configure(config):
    """One thread within BLAS and within PyTorch, where several workers share the machine. Workers
    must find this when they start: a plugin of pytest loads NumPy before a worker comes to this
    file.
    """
    # trained decoders are kept there
    os.environ.setdefault("FEELER_CACHE", tempfile.mkdtemp(prefix="feeler-cache-"))
    if config.getoption("numprocesses", None):
        for library in ("OPENBLAS", "OMP"):
            os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def find_rank(path):
    """When a file of tests begins, in the order of FIRST."""
    return next((k for k, end in enumerate(FIRST) if path.as_posix().endswith(end)), len(FIRST))


@pytest.hookimpl(tryfirst=True)  # before pytest leaves out what is long
def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: find_rank(item.path))
    begun = set()
    for item in items:
        if item.get_closest_marker("further"):
            law = item.nodeid.partition("[")[0]
            if law in begun:
                item.add_marker("long")
            begun.add(law)


def pytest_collection_finish():
    """What is there by now stays: the thousands of tests and all modules need not be looked through
    again and again.
    """
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """A file goes to one worker, whatever ``--dist`` says, and so do WHOLE, STUDIED, ENCODED and
    TORCH: what their tests share is then made once.
    """
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid):
            path = super()._split_scope(nodeid)
            together = [
                group for group in (WHOLE, STUDIED, ENCODED, TORCH) if path.endswith(group)
            ]
            return together[0][0] if together else path

    config.option.loadscopereorder = False  # they are in order already
    return Scheduling(config, log)


@pytest.fixture(scope="session", autouse=True)
def guard_in_process():
    """The guard works in the process of the test, without its limits on memory and time: what is
    read is the same, and a process for each file costs a quarter of a second.
    """
    import numpy as np

    from feeler import sandbox as guard
    from feeler.errors import InvalidInput

    def ask(function, path, limits, name, words):
        try:
            text, *arrays = guard.answer(function, path, limits.max_bytes, *words)
        except InvalidInput as error:
            raise InvalidInput(f"{name}: {error}") from error
        content, plan = json.loads(text)
        guard._check_bytes(limits, plan, name)
        return content, {one[0]: np.array(a) for one, a in zip(plan, arrays, strict=True)}

    whole = guard._ask
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(guard, "_ask", ask)
        yield whole


@pytest.fixture(autouse=True)
def guard_of_users(request, guard_in_process, monkeypatch):
    """Where a test is marked ``guarded``, the guard is that of users, in a process of its own."""
    if request.node.get_closest_marker("guarded"):
        monkeypatch.setattr("feeler.sandbox._ask", guard_in_process)


@contextmanager
def open_chromium():
    """A real Chromium that finds no other host."""
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS.split(), ALONE, SIZE):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.set_script_timeout(30)
    try:
        yield driver
    finally:
        driver.quit()


@pytest.fixture(scope="session")
def chromium():
    """One Chromium for each worker; tests that need one are skipped without it, but not where it is
    promised.
    """
    if not (CHROMIUM and DRIVER) and not os.environ.get("FEELER_NEEDS_CHROMIUM"):
        pytest.skip("no Chromium with chromedriver: apt-get install chromium chromium-driver")
    with open_chromium() as driver:
        yield driver


def make_clean(driver):
    """A tab that knows nothing of what any test did before: what was emulated, listened to or kept
    in a tab goes with the tab, the rest is cleared by name.
    """
    used = driver.window_handles
    driver.switch_to.new_window("tab")
    fresh = driver.current_window_handle
    for handle in used:
        driver.switch_to.window(handle)
        driver.close()
    driver.switch_to.window(fresh)
    everything = {"origin": "*", "storageTypes": "all"}
    driver.execute_cdp_cmd("Storage.clearDataForOrigin", everything)
    driver.execute_cdp_cmd("Network.clearBrowserCache", {})
    driver.set_script_timeout(30)
    driver.set_page_load_timeout(300)
    driver.set_window_size(1440, 900)
    driver.get_log("browser")


@pytest.fixture(scope="module")
def browser(chromium):
    """The worker's Chromium, with nothing in it from the tests of another file."""
    make_clean(chromium)
    yield chromium
    chromium.get("about:blank")  # no page goes on computing beside other tests


@pytest.fixture
def find_barriers(browser):
    """Asks axe what is wrong with the page as it is: (rule, element, what to do) of each."""
    script = (
        resources.files(pytest.importorskip("axe_core_python"))
        .joinpath("axe.min.js")
        .read_text(encoding="utf-8")
    )
    ask = (
        "const tell = arguments[0]; axe.run(document, { resultTypes: ['violations'] }).then(found"
        " => tell(found.violations));"
    )
    browser.set_script_timeout(300)  # axe takes seconds, or a minute on a busy machine

    def find():
        browser.execute_script(f"if (!window.axe) {{ {script} }}")
        found = browser.execute_async_script(ask)
        return [
            (item["id"], node["html"][:120], node["failureSummary"])
            for item in found
            for node in item["nodes"]
        ]

    return find


@pytest.fixture(scope="session", autouse=True)
def readable():
    """Every figure that a verb puts into a page follows the standard of figures, in whichever test
    the verb runs.
    """
    from tests.figures import find_faults, watch_figures

    def judge(figure, name, draw):
        if draw.__module__.startswith(JUDGED):
            assert not find_faults(figure), f"figure {name!r}"

    with watch_figures(judge):
        yield
