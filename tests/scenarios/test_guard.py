"""Which requests the pages in the browser answer."""

from contextlib import closing

import pytest

from scenarios.draw.viewer.server import is_own


@pytest.mark.parametrize(("headers", "own"), [
    ({"Host": "127.0.0.1:8080"}, True),
    ({"Host": "localhost:8080"}, True),
    ({"Host": "127.0.0.1:8080", "Origin": "http://127.0.0.1:8080"}, True),
    ({}, False), ({"Host": "rebound.example:8080"}, False), ({"Host": "127.0.0.1.example"}, False),
    ({"Host": "127.0.0.1:8080", "Origin": "http://elsewhere.example"}, False),
    ({"Host": "127.0.0.1:8080", "Origin": "http://127.0.0.1:3000"}, False),
    ({"Host": "127.0.0.1:8080", "Origin": "null"}, False)])
def test_only_a_browser_of_this_machine_on_our_own_page_is_answered(headers, own):
    assert is_own(headers) == own


@pytest.mark.slow
def test_the_server_of_a_page_rejects_them_and_its_page_has_a_title_and_is_as_dark_as_asked():
    pytest.importorskip("viser")
    import http.client

    from scenarios.draw.viewer.server import close, open_server

    server = open_server(0, "test")
    assert server.get_host() == "127.0.0.1"
    try:
        found = []
        for host in (None, "rebound.example"):
            with closing(http.client.HTTPConnection("127.0.0.1", server.get_port())) as connection:
                connection.request("GET", "/", headers={"Host": host} if host else {})
                answer = connection.getresponse()
                found.append((answer.status, answer.read().decode()))
        (status, page), (rejected, _) = found
        assert (status, rejected) == (200, 403)
        assert "<title>test</title>" in page
        assert 'matchMedia("(prefers-color-scheme: dark)")' in page
    finally:
        close(server)
