"""The server serves one page on this machine to whoever knows the token, and nothing else to nobody
else.
"""

import contextlib
import http.client
import socket
import threading
import time
from threading import Event

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from feeler.errors import InvalidInput
from feeler.studio import Studio
from feeler.studio.export import PAGE, SPACE_SCRIPT
from feeler.studio.server import _MAX_PAGES, FILES
from feeler.studio.session import Desk, Session

from ._messages import unpack


@pytest.fixture(scope="module")
def studio():
    running = Studio(port=0)
    yield running
    running.close()


def get(studio, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer, answer.read()


def test_every_file_of_the_page_is_served_and_may_load_nothing_from_elsewhere(studio):
    own = {path.name for path in PAGE.iterdir() if path.is_file()}
    assert {name for name, _ in FILES.values()} == {*own, SPACE_SCRIPT}
    for name in FILES:
        answer, body = get(studio, f"/{studio.token}/{name}")
        assert answer.status == 200
        assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
        assert b"http://" not in body.replace(b"http://www.w3.org/2000/svg", b"")
        assert b"https://" not in body


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/x/",
        "/{token}",
        "/{token}/../../etc/passwd",
        "/{token}/%2e%2e/pyproject.toml",
        "/{token}/a.js",
    ],
)
def test_everything_else_is_not_found(studio, path):
    assert get(studio, path.format(token=studio.token))[0].status == 404


@pytest.mark.parametrize(
    "headers", [{"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"Origin": "null"}]
)
def test_other_sites_are_refused(studio, headers):
    assert get(studio, f"/{studio.token}/", **headers)[0].status == 403


def open_live(studio, origin=None):
    address = studio.address.replace("http", "ws") + "live"
    return connect(
        address, origin=origin or f"http://127.0.0.1:{studio.port}", compression=None
    )


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1"])
def test_a_foreign_page_gets_no_connection(studio, origin):
    with pytest.raises(InvalidStatus, match="403"):
        open_live(studio, origin)


@pytest.mark.parametrize("twice", ["Host: 127.0.0.1:{port}", "Origin: http://127.0.0.1:{port}"])
def test_a_header_that_is_given_twice_is_refused(studio, twice):
    lines = ["GET /{token}/ HTTP/1.1", "Host: 127.0.0.1:{port}", *[twice] * 2, "", ""]
    text = "\r\n".join(lines).format(token=studio.token, port=studio.port)
    with socket.create_connection(("127.0.0.1", studio.port), timeout=10) as connection:
        connection.sendall(text.encode())
        assert connection.recv(100).startswith(b"HTTP/1.1 403 ")


def test_a_page_too_many_is_told_why_and_may_come_when_another_has_gone(studio):
    with contextlib.ExitStack() as pages:
        first, *_ = [pages.enter_context(open_live(studio)) for _ in range(_MAX_PAGES)]
        with open_live(studio) as late, pytest.raises(ConnectionClosed) as end:
            late.recv(timeout=10)
        assert (end.value.rcvd.code, end.value.rcvd.reason) == (
            1013,
            "8 pages are open already",
        )
        first.close()
        with open_live(studio) as late:
            late.send('{"type": "hello"}')
            assert unpack(late.recv(timeout=60))[0]["type"] == "catalogue"


def test_two_pages_and_one_that_leaves(studio):
    with open_live(studio) as first, open_live(studio) as second:
        for page in (first, second):
            page.send('{"type": "hello", "id": 5}')
            assert unpack(page.recv(timeout=60))[0]["type"] == "catalogue"
        first.send('{"type": "touch", "wish": {"antenna": {}, "duration": 2000}}')
        assert unpack(first.recv(timeout=60))[0]["part"] == "begin"
        first.close()
        end = time.monotonic() + 10
        while studio.busy and time.monotonic() < end:
            time.sleep(0.005)
        assert not studio.busy
        second.send("nonsense")
        assert "must be JSON" in unpack(second.recv(timeout=10))[0]["message"]


def test_a_taken_port_is_said(studio):
    with pytest.raises(InvalidInput, match=f"port {studio.port} is taken"):
        Studio(port=studio.port)


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
