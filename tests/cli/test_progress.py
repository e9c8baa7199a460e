"""Long work shows how far it is, without being asked, where somebody looks."""

import io
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest

from feeler import progress
from feeler.decoding import compute_sweep
from feeler.encoding import ConvolutiveNMF
from feeler.progress import ProgressBar, show_progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_bar_appears_once_patience_is_over_and_one_at_a_time():
    now = iter([0.0, 1.0, 1.0, 4.9, 4.9, 6.0, 6.0, 9.0, 9.0])
    screen, other = Terminal(), Terminal()
    with ProgressBar("touches", patience=5.0, stream=screen, clock=lambda: next(now)) as bar:
        bar(1, 4)
        bar(2, 4)
        assert screen.getvalue() == ""
        bar(3, 4)
        with ProgressBar("within", stream=other) as second:
            second(1, 2)
        bar(4, 4)
    assert "touches" in screen.getvalue() and "4/4" in screen.getvalue()
    assert other.getvalue() == ""
    with ProgressBar("after", stream=other) as third:
        third(2, 2)
    assert "after" in other.getvalue()


def test_a_notebook_gets_one_bar_that_moves(monkeypatch):
    shown = []
    handle = SimpleNamespace(update=lambda html: shown.append(("moved", html.data)))

    def display(html, display_id):
        shown.append(("new", html.data))
        return handle

    ipython = pytest.importorskip("IPython")
    monkeypatch.setattr(ipython, "get_ipython", lambda: SimpleNamespace(kernel=1))
    monkeypatch.setattr("IPython.display.display", display)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    monkeypatch.setattr(progress, "_PATIENCE", 1e-9)
    with show_progress(None, "animals") as advance:
        for done in (1, 2, 3):
            advance(done, 3)
    assert [how for how, _ in shown] == ["new", "moved", "moved"]
    assert '<progress value="3" max="3">' in shown[-1][1] and "animals" in shown[-1][1]


def test_what_is_handed_in_is_called_instead():
    seen = []
    with show_progress(lambda *numbers: seen.append(numbers), "x") as advance:
        advance(1, 2)
    assert seen == [(1, 2)]


def test_threads_may_report_to_a_bar_of_the_main_thread_but_make_none():
    screen, other = Terminal(), Terminal()

    def work(bar):
        for done in range(1, 51):
            bar(done, 100)
        with ProgressBar("within", stream=other) as own:
            own(1, 1)

    with ProgressBar("iterations", stream=screen) as bar:
        threads = [threading.Thread(target=work, args=(bar,)) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    with ProgressBar("after", stream=other):
        pass
    assert "iterations" in screen.getvalue() and other.getvalue() == ""


def _sweep():
    codes = np.random.default_rng(0).normal(size=(6, 2, 5))
    compute_sweep(codes, list("aabbcc"), ratios=(0.0, 0.1), n_repeats=3, n_copies=2)


def _encode():
    tensors = np.random.default_rng(0).random((3, 4, 30))
    ConvolutiveNMF(2, 5, n_restarts=2, max_iter=3, warn=False, random_state=0).fit(tensors)


def _stream():
    tensors = np.random.default_rng(0).random((4, 4, 30))
    model = ConvolutiveNMF(2, 5, warn=False, random_state=0)
    model.fit_stream(tensors, batch_size=2, n_epochs=2)


@pytest.mark.further
@pytest.mark.parametrize(
    "work", [_sweep, pytest.param(_encode, marks=pytest.mark.long), _stream]
)
def test_long_work_of_the_library_draws_its_bar_by_itself(monkeypatch, work):
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(progress, "_PATIENCE", 0.0)
    work()
    word = {_sweep: "noise and repeats", _encode: "iterations", _stream: "batches"}[work]
    assert word in screen.getvalue()
