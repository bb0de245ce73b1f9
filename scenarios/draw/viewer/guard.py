"""Pages of this machine only: requests that name another host or come from another site fail."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

NAMES = ("127.0.0.1", "localhost")


def is_own(headers: Mapping[str, str]) -> bool:
    """Whether a request names this machine as its host and comes from no page of another host.

    A page elsewhere whose name is made to lead to 127.0.0.1 (DNS rebinding) has another Host; a
    script of another page, another Origin.
    """
    host, origin = headers.get("Host", ""), headers.get("Origin")
    own = urlsplit(f"//{host}").hostname in NAMES
    return own and (origin is None or urlsplit(origin).netloc == host)


@contextmanager
def guarded() -> Iterator[None]:
    """Let a server of websockets that is started meanwhile reject the requests of others."""
    from websockets.asyncio import server

    serve = server.serve

    def start(*arguments: Any, process_request: Callable[..., Any] | None = None,
              **options: Any) -> Any:
        def judge(connection: Any, request: Any) -> Any:
            if not is_own(request.headers):
                return connection.respond(HTTPStatus.FORBIDDEN, "Only pages of this machine.\n")
            return process_request(connection, request) if process_request else None

        return serve(*arguments, process_request=judge, **options)

    server.serve = start  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]
