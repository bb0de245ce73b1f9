"""Pages of this machine only: requests that name another host or come from another site fail."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from html import escape
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

_TITLE = b"<title>Viser</title>"
NAMES = ("127.0.0.1", "localhost")


def is_own(headers: Mapping[str, str]) -> bool:
    """Whether a request names this machine as its host and comes from no page of another host.

    A page elsewhere whose name is made to lead to 127.0.0.1 (DNS rebinding) has another Host; a
    script of another page, another Origin.
    """
    host, origin = headers.get("Host", ""), headers.get("Origin")
    own = urlsplit(f"//{host}").hostname in NAMES
    return own and (origin is None or urlsplit(origin).netloc == host)


def _titled(response: Any, title: str) -> Any:
    """Give a page of viser another title."""
    if response is not None and response.body and _TITLE in response.body:
        response.body = response.body.replace(
            _TITLE, f"<title>{escape(title)}</title>".encode(), 1)
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))
    return response


@contextmanager
def guarded(title: str) -> Iterator[None]:
    """Let a server that is started meanwhile reject the requests of others, and title its page."""
    from websockets.asyncio import server

    serve = server.serve

    def start(*arguments: Any, process_request: Callable[..., Any] | None = None,
              **options: Any) -> Any:
        def judge(connection: Any, request: Any) -> Any:
            if not is_own(request.headers):
                return connection.respond(HTTPStatus.FORBIDDEN, "Only pages of this machine.\n")
            if process_request is None:
                return None
            if urlsplit(request.path).path in ("/", "/index.html"):
                request.headers.pop("Accept-Encoding", None)  # compressed, it has no title to find
            return _titled(process_request(connection, request), title)

        return serve(*arguments, process_request=judge, **options)

    server.serve = start  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]
