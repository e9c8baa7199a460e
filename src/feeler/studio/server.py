"""The local server on 127.0.0.1, and the studio in a notebook's cell."""

import asyncio
import contextlib
import errno
import json
import logging
import os
import secrets
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError
from http import HTTPStatus
from pathlib import PurePath
from typing import Any

from feeler.antenna.segments import Antenna
from feeler.errors import FeelerError, InvalidInput, require_extra
from feeler.studio.export import PAGE, SPACE_SCRIPT, read_page, write_module
from feeler.studio.live import Boards
from feeler.studio.requests import (
    AntennaRequest,
    TouchRequest,
    make_catalogue,
    simulate_pieces,
    wish_for,
)
from feeler.studio.session import MAX_MESSAGE, Session
from feeler.validation import checked

# The local server: static files and one WebSocket, on 127.0.0.1, for whoever knows the token in
# the address.

_HOST, _PORT = "127.0.0.1", 8765
_KINDS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
FILES = {
    "" if name == "index.html" else name: (
        name,
        f"{_KINDS[PurePath(name).suffix]}; charset=utf-8",
    )
    for name in (*(path.name for path in PAGE.iterdir()), SPACE_SCRIPT)
    if PurePath(name).suffix in _KINDS
}
"""What the page is made of, by address: the file and its type."""
_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
}
_MAX_PAGES = 8  # [C] open at once
_TRY_LATER = 1013  # RFC 6455's register: the server is asked too much


@checked
class Studio:
    """A running server, in a thread of its own.

    Parameters
    ----------
    antenna
        What a new page begins with.
    port
        0 takes any free one; None takes 8765, or any free one where it is taken.
    token
        Part of the address; default: a new one, or ``FEELER_STUDIO_TOKEN`` of the environment.
    boards
        Serial ports that a page may listen to; default: those that the system lists.

    Raises
    ------
    InvalidInput
        The port is taken or not allowed.
    """

    def __init__(
        self,
        antenna: AntennaRequest | None = None,
        *,
        port: int | None = None,
        token: str | None = None,
        boards: Boards | None = None,
    ) -> None:
        require_extra("websockets", "studio", "the studio's server")
        self.token = token or os.environ.get("FEELER_STUDIO_TOKEN") or secrets.token_urlsafe(16)
        self._antenna, self._boards, self._sessions = antenna, boards, set[Session]()
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._error: InvalidInput | None = None
        self._asked, self.port = port, 0
        self._stop = asyncio.Event()
        self._thread = threading.Thread(
            target=self._loop.run_until_complete, args=(self._serve(),), daemon=True
        )
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            raise self._error
        threading.Thread(
            target=_warm_up, args=(antenna or AntennaRequest(),), daemon=True
        ).start()

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://{_HOST}:{self.port}/{self.token}/"

    @property
    def busy(self) -> bool:
        """Whether anything is being computed for any page."""
        return any(session.busy for session in list(self._sessions))

    def close(self) -> None:
        """Close every page's connection and end all work."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join(5.0)

    def wait(self) -> None:
        """Serve until Ctrl-C."""
        try:
            while self._thread.is_alive():
                self._thread.join(0.5)
        finally:
            self.close()

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        quiet = logging.getLogger("feeler.studio.server")
        quiet.setLevel(logging.CRITICAL)  # a damaged request is its sender's matter
        options: dict[str, Any] = {
            "process_request": self._answer,
            "compression": None,
            "max_size": MAX_MESSAGE,
            "logger": quiet,
            "server_header": None,
            "close_timeout": 1.0,
        }
        wanted = [_PORT, 0] if self._asked is None else [self._asked]
        for port in wanted:
            try:
                server = await serve(self._talk, _HOST, port, **options)
            except (OSError, OverflowError) as error:
                self._error = _explain(port, error)
                continue
            self._error = None
            async with server:
                self.port = server.sockets[0].getsockname()[1]
                self._ready.set()
                await self._stop.wait()
                for session in list(self._sessions):
                    session.close(1.0)
            return
        self._ready.set()

    def _answer(self, connection: Any, request: Any) -> Any:
        """A static file, or None where a WebSocket may be opened; 403 for other sites, 404 for all
        else.
        """
        own = {f"{name}:{self.port}" for name in (_HOST, "localhost")}
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        if not (
            len(hosts) == 1
            and hosts[0] in own
            and len(origins) <= 1
            and {*origins} <= {f"http://{host}" for host in own}
        ):
            return _respond(connection, HTTPStatus.FORBIDDEN, b"not from here\n")
        path = request.path.partition("?")[0]
        if not secrets.compare_digest(
            path[: len(self.token) + 2].encode(), f"/{self.token}/".encode()
        ):
            return _respond(
                connection,
                HTTPStatus.NOT_FOUND,
                b"open the address that feeler studio printed\n",
            )
        name = path[len(self.token) + 2 :]
        if name == "live":
            return (
                None if origins else _respond(connection, HTTPStatus.FORBIDDEN, b"no origin\n")
            )
        if name not in FILES:
            return _respond(connection, HTTPStatus.NOT_FOUND, b"no such file\n")
        file, kind = FILES[name]
        return _respond(connection, HTTPStatus.OK, read_page(file).encode(), kind)

    async def _talk(self, connection: Any) -> None:
        from websockets.exceptions import ConnectionClosed

        if len(self._sessions) >= _MAX_PAGES:  # a page is told no reason before it is connected
            await connection.close(_TRY_LATER, f"{_MAX_PAGES} pages are open already")
            return
        session = Session(_make_put(connection, self._loop), self._antenna, self._boards)
        self._sessions.add(session)
        try:
            with contextlib.suppress(ConnectionClosed):
                async for text in connection:
                    session.take(text)
        finally:
            self._sessions.discard(session)
            session.close()


def _warm_up(antenna: AntennaRequest) -> None:
    """Load, or compile once, what the first page needs; what is wrong with the antenna its page
    will hear.
    """
    with contextlib.suppress(FeelerError):
        for _ in simulate_pieces(
            TouchRequest(antenna=antenna, duration=8.0), threading.Event()
        ):
            pass
        make_catalogue(antenna)


def _make_put(connection: Any, loop: asyncio.AbstractEventLoop) -> Callable[[bytes], None]:
    """Send from any thread and wait until it is on its way: who computes faster than the page reads
    has to wait.
    """
    from websockets.exceptions import ConnectionClosed

    def put(data: bytes) -> None:
        try:
            asyncio.run_coroutine_threadsafe(connection.send(data), loop).result(10.0)
        except (ConnectionClosed, RuntimeError, TimeoutError, CancelledError) as error:
            raise ConnectionError("the page is gone") from error

    return put


def _respond(
    connection: Any, status: HTTPStatus, body: bytes, kind: str = "text/plain; charset=utf-8"
) -> Any:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    headers = Headers(
        {
            **_HEADERS,
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Connection": "close",
        }
    )
    return Response(status.value, status.phrase, headers, body)


def _explain(port: int, error: Exception) -> InvalidInput:
    if getattr(error, "errno", None) == errno.EADDRINUSE:
        return InvalidInput(
            f"port {port} is taken, perhaps by another studio; give --port 0 to take any free one."
        )
    return InvalidInput(
        f"cannot listen on port {port} of {_HOST}: {str(error).rstrip('.')}. Give --port 0 to take"
        " any free one."
    )


# The studio in a notebook's cell: the same front end; the kernel replaces the server.


@checked
def show_studio(antenna: Antenna | str = "exponential") -> Any:
    """A widget for Jupyter, VS Code, Colab or marimo; show it as a cell's last value.

    Parameters
    ----------
    antenna
        The name of a preset, or an antenna of your own.

    Returns
    -------
    anywidget.AnyWidget
        Its ``session`` does the work; ``close()`` ends it.

    Raises
    ------
    MissingDependencyError
        anywidget is not installed.
    InvalidInput
        No preset of this name.
    """
    wish = wish_for(antenna)
    require_extra("anywidget", "notebook", "the studio in a notebook")
    import anywidget

    class StudioWidget(anywidget.AnyWidget):
        _esm = write_module()
        _css = read_page("studio.css")

        def __init__(self) -> None:
            super().__init__()
            self.session = Session(lambda data: self.send({}, buffers=[data]), wish)
            self.on_msg(lambda widget, content, buffers: self.session.take(json.dumps(content)))

        def close(self) -> None:
            self.session.close()
            super().close()

    return StudioWidget()
