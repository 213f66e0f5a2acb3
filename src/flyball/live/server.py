"""The live page on this machine: one address with a random token, and a WebSocket for each open page.

The server listens on the loopback interface only. A page is delivered, and a WebSocket accepted, only under the address
with the token; the browser's ``Origin`` must be this server. Each page has a session and a thread of its own.
"""

from __future__ import annotations

import hmac
import secrets
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from http import HTTPStatus
from pathlib import Path
from typing import Any

from ..errors import ModelError
from ..model.model import Model
from ..view.page import live_page
from .options import LiveOptions, make_sliders
from .session import ClosedPage, LiveSession, exchange_messages

HOST = "127.0.0.1"
MAX_MESSAGE_SIZE = 4096
"""Bytes of a message of the page; a connection with larger ones is closed."""
MAX_PAGES = 8
"""Pages open at once: each computes in a thread of its own."""
OPEN_TIMEOUT = 2.0
"""Time in which a connection must send its request [s]; stopping the server waits for it."""
CLOSE_TIMEOUT = 2.0
"""Time in which a page must close its connection [s]."""
PAGE_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Frame-Options": "DENY",
}
POLICY_VIOLATION, TRY_AGAIN_LATER = 1008, 1013  # codes of closed WebSockets


class LiveServer:
    """Serves a model until it is stopped.

    Parameters
    ----------
    load : callable
        Returns the model; called for each page, and again when its file has changed.
    o : LiveOptions
    file : Path, optional
        The model's file, which is watched.
    wording : callable
        Converts the text of an error to that of the terminal.

    Attributes
    ----------
    address : str
        Address of the page, with the token.

    Raises
    ------
    ModelError
        If the package websockets is not installed, or the port is taken.
    """

    def __init__(
        self,
        load: Callable[[], Model],
        o: LiveOptions,
        file: Path | None = None,
        wording: Callable[[str], str] = str,
    ) -> None:
        try:
            from websockets.sync.server import serve
        except ImportError:
            raise ModelError("a live page needs the package websockets: pip install 'flyball[live]'") from None
        self._load, self._options, self._file, self._wording = load, o, file, wording
        self._token = secrets.token_urlsafe(24)
        self._pages = threading.BoundedSemaphore(MAX_PAGES)
        self._ending = threading.Event()
        model = load()
        make_sliders(model, o.ranges)  # refuses invalid ranges
        self._name = model.name
        try:
            self._server = serve(
                self._serve_page,
                HOST,
                o.port,
                process_request=self._process_request,
                max_size=MAX_MESSAGE_SIZE,
                compression=None,
                open_timeout=OPEN_TIMEOUT,
                close_timeout=CLOSE_TIMEOUT,
                ping_interval=None,  # a page computes for longer than a ping may take; a closed one ends its connection
                server_header=None,
            )
        except OSError as error:
            raise ModelError(
                f"port {o.port} of {HOST} cannot be used: {error.strerror or error}; leave port out"
            ) from None
        self._origin = f"http://{HOST}:{self._server.socket.getsockname()[1]}"
        self.address = f"{self._origin}/{self._token}"

    def run(self) -> None:
        """Serve until `stop` is called, or the user interrupts."""
        try:
            self._server.serve_forever()
        finally:
            self.stop()

    def start(self) -> threading.Thread:
        """Serve in a thread, and return it."""
        thread = threading.Thread(target=self.run, name="flyball live")
        thread.start()
        return thread

    def stop(self) -> None:
        """Close all pages, and end."""
        self._ending.set()
        self._server.shutdown()

    # ---- one request

    def _process_request(self, connection: Any, request: Any) -> Any:
        """Deliver the page, accept its WebSocket, or refuse; None accepts."""
        given = request.path.partition("?")[0].removeprefix("/")
        token, _, what = given.partition("/")
        if not hmac.compare_digest(token.encode(), self._token.encode()) or what not in ("", "socket"):
            return connection.respond(
                HTTPStatus.NOT_FOUND, "There is nothing here: use the address that was printed.\n"
            )
        if request.headers.get_all("Host") != [self._origin.removeprefix("http://")]:
            return connection.respond(HTTPStatus.FORBIDDEN, "This host is not served.\n")
        if what == "socket":
            if request.headers.get_all("Origin") != [self._origin]:
                return connection.respond(HTTPStatus.FORBIDDEN, "Only the page of this server may connect.\n")
            return None
        response = connection.respond(HTTPStatus.OK, live_page(self._name, self._origin.replace("http", "ws", 1)))
        del response.headers["Content-Type"]
        response.headers.update(PAGE_HEADERS)
        return response

    # ---- one page

    def _serve_page(self, connection: Any) -> None:
        """Serve one page until it is closed."""
        if not self._pages.acquire(blocking=False):
            connection.close(TRY_AGAIN_LATER, f"only {MAX_PAGES} pages at once")
            return
        try:
            self._exchange_messages(connection)
        except ClosedPage as ended:
            connection.close(POLICY_VIOLATION, str(ended))
        finally:
            self._pages.release()

    def _exchange_messages(self, connection: Any) -> None:
        from websockets.exceptions import ConnectionClosed

        def receive(timeout: float | None) -> str | bytes:
            if self._ending.is_set():
                raise ClosedPage
            try:
                return connection.recv(timeout=timeout)  # type: ignore[no-any-return]
            except ConnectionClosed:
                raise ClosedPage from None

        def send(message: bytes) -> None:
            try:
                connection.send(message)
            except ConnectionClosed:
                raise ClosedPage from None

        exchange_messages(LiveSession(self._load, self._options, self._file, self._wording), receive, send)


def serve_model(
    load: Callable[[], Model],
    o: LiveOptions,
    show: Callable[[str, str], None],
    file: Path | None = None,
    wording: Callable[[str], str] = str,
) -> None:
    """Serve a model until the user interrupts.

    ``show`` prints the address and a note; the page is opened in the browser unless the options say otherwise.
    """
    server = LiveServer(load, o, file, wording)
    show(server.address, "The page is open to this machine only. Ctrl-C ends it.")
    with suppress(KeyboardInterrupt), nullcontext() if o.no_open else _redirect_file(server.address) as redirect:
        if redirect is not None:
            webbrowser.open(redirect.as_uri())
        server.run()


@contextmanager
def _redirect_file(address: str) -> Iterator[Path]:
    """Write a page that leads to an address and that only this user can read.

    The browser gets the path of the file: all users of the machine can read the arguments of a command, and the address
    contains the token.
    """
    with tempfile.TemporaryDirectory(prefix="flyball-") as folder:  # of mode 0700
        path = Path(folder) / "live.html"
        path.touch(mode=0o600)
        path.write_text(f'<!doctype html><meta http-equiv="refresh" content="0; url={address}">\n', encoding="utf-8")
        yield path
