"""Which requests the pages in the browser answer."""

from contextlib import closing

import pytest

from scenarios.draw.viewer.server import is_own


@pytest.mark.parametrize("headers", [
    {"Host": "127.0.0.1:8080"},
    {"Host": "localhost:8080"},
    {"Host": "127.0.0.1:8080", "Origin": "http://127.0.0.1:8080"}])
def test_a_browser_of_this_machine_is_answered(headers):
    assert is_own(headers)


@pytest.mark.parametrize("headers", [
    {}, {"Host": "rebound.example:8080"}, {"Host": "127.0.0.1.example"},
    {"Host": "127.0.0.1:8080", "Origin": "http://elsewhere.example"},
    {"Host": "127.0.0.1:8080", "Origin": "http://127.0.0.1:3000"},
    {"Host": "127.0.0.1:8080", "Origin": "null"}])
def test_other_names_and_pages_of_others_are_rejected(headers):
    assert not is_own(headers)


@pytest.mark.slow
def test_the_server_of_a_page_rejects_them():
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
                answer.read()
                found.append(answer.status)
        assert found == [200, 403]
    finally:
        close(server)
