"""A desk keeps to one thread for each kind of work, and does what was wished for last."""

import threading
import time
from threading import Event

from feeler.studio.session import Desk, Session


def wait_until(condition, seconds=10.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.002)
    assert condition()


def test_of_many_works_of_a_kind_the_first_and_the_last_are_done():
    desk, begun, go, done = Desk(), Event(), Event(), []

    def first(stop):
        begun.set()
        go.wait(10)
        done.append(("first", stop.is_set()))

    desk.give("a", first)
    begun.wait(10)
    before = threading.active_count()
    for k in range(1000):
        desk.give("a", lambda stop, k=k: done.append((k, stop.is_set())))
    assert threading.active_count() == before
    go.set()
    wait_until(lambda: not desk.busy)
    assert done == [("first", True), (999, False)]


def test_what_has_not_begun_is_not_begun_once_all_is_ended():
    desk, begun, go, done = Desk(), Event(), Event(), []

    def first(stop):
        begun.set()
        go.wait(10)

    desk.give("a", first)
    begun.wait(10)
    desk.give("a", done.append)
    desk.clear()
    go.set()
    wait_until(lambda: not desk.busy)
    assert done == []
    desk.give("a", lambda stop: done.append(stop.is_set()))
    wait_until(lambda: done == [False])


def test_a_flood_of_garbage_leaves_no_threads():
    heard, before = [], threading.active_count()
    session = Session(heard.append)
    most = 0
    for k in range(20_000):
        session.take(f"garbage {k}" if k % 2 else '{"type": "touch", "wish": 3, "slot": "B"}')
        if k % 100 == 0:
            most = max(most, threading.active_count())
    assert most <= before + 2
    wait_until(lambda: not session.busy)
    assert heard
