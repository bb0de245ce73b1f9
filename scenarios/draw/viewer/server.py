"""A page's server, for this machine only: requests of others fail."""

import json
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from email.message import Message
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

from hierarchy.errors import naming

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
_LONGEST = 100_000  # bytes that a page may send

Answer = Callable[[dict[str, Any]], str]


def is_own(headers: Mapping[str, str] | Message) -> bool:
    """Whether a request names this machine as its host and comes from no page of another host.

    A page elsewhere whose name is made to lead to 127.0.0.1 (DNS rebinding) has another Host; a
    script of another page, another Origin.
    """
    host, origin = headers.get("Host", ""), headers.get("Origin")
    with suppress(ValueError):  # such as "[" alone
        own = urlsplit(f"//{host}").hostname in NAMES
        return own and (origin is None or urlsplit(origin).netloc == host)
    return False


@contextmanager
def served(port: int, page: Callable[[], str], answer: Answer | None = None) -> Iterator[str]:
    """Serve a page on 127.0.0.1 and yield its address; port 0 takes a free port.

    page : returns the HTML. answer : takes the JSON object that a script of the page sends, and
    returns what it gets, as JSON. Both are called in threads of the server.

    Raises HierarchyError if the port cannot be used.
    """
    with naming(f"--port {port} cannot be used", of=(OSError, OverflowError)):
        server = ThreadingHTTPServer((HOST, port), partial(_Handler, page, answer))
    server.daemon_threads = True
    Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://{HOST}:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


def announce(address: str, browser: bool) -> None:
    """Print the address of a page, and open it if `browser` is set."""
    print(f"Page: {address}   (Ctrl-C ends)", flush=True)
    if browser:
        webbrowser.open(address)


class _Handler(BaseHTTPRequestHandler):
    """Answers GET with the page, and POST with what is sent back to its script."""

    protocol_version = "HTTP/1.1"  # one connection for all requests of a page

    def __init__(self, page: Callable[[], str], answer: Answer | None, *request: Any) -> None:
        self.page, self.answer = page, answer
        super().__init__(*request)

    def handle(self) -> None:
        """Answer the requests of a connection, which the browser may cut."""
        with suppress(ConnectionError):
            super().handle()

    def do_GET(self) -> None:
        if not is_own(self.headers):
            self._send(HTTPStatus.FORBIDDEN, "Only pages of this machine.\n", "text/plain")
        elif self.path.partition("?")[0] == "/":
            self._send(HTTPStatus.OK, self.page(), "text/html")
        else:
            self._send(HTTPStatus.NOT_FOUND, "", "text/plain")

    def do_POST(self) -> None:
        size = self.headers.get("Content-Length", "")
        if not is_own(self.headers) or self.answer is None or not (
                size.isdecimal() and int(size) <= _LONGEST):
            self.close_connection = True
            self._send(HTTPStatus.FORBIDDEN, "", "text/plain")
            return
        asked = None
        with suppress(ValueError, RecursionError):
            asked = json.loads(self.rfile.read(int(size)))
        if isinstance(asked, dict):
            self._send(HTTPStatus.OK, self.answer(asked), "application/json")
        else:
            self._send(HTTPStatus.BAD_REQUEST, "", "text/plain")

    def _send(self, status: HTTPStatus, text: str, kind: str) -> None:
        body = text.encode()
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""
