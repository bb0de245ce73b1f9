"""Which requests the pages in the browser answer."""

from contextlib import closing
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest

from hierarchy.errors import HierarchyError
from scenarios.draw.viewer.server import is_own, served


@pytest.mark.parametrize(("headers", "own"), [
    ({"Host": "localhost:8080"}, True),
    ({"Host": "127.0.0.1:8080", "Origin": "http://127.0.0.1:8080"}, True),
    ({}, False), ({"Host": "rebound.example:8080"}, False), ({"Host": "127.0.0.1.example"}, False),
    ({"Host": "127.0.0.1:8080", "Origin": "http://elsewhere.example"}, False),
    ({"Host": "127.0.0.1:8080", "Origin": "http://127.0.0.1:3000"}, False),
    ({"Host": "127.0.0.1:8080", "Origin": "null"}, False)])
def test_only_a_browser_of_this_machine_on_our_own_page_is_answered(headers, own):
    assert is_own(headers) == own


def test_the_server_of_a_page_rejects_them():
    asked = []

    def answer(one):
        asked.append(one)
        return "{}"

    def status(method, path="/", body=None, **headers):
        with closing(HTTPConnection(urlsplit(address).netloc)) as connection:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            answer.read()
            return answer.status

    with served(0, lambda: "<p>page</p>", answer) as address:
        assert address.startswith("http://127.0.0.1:")
        assert status("GET") == 200
        assert status("POST", "/now", '{"a": 1}') == 200
        assert status("GET", "/elsewhere") == 404
        assert status("POST", "/now", "[") == 400
        for others in ({"Host": "rebound.example"}, {"Origin": "http://elsewhere.example"}):
            assert status("GET", **others) == status("POST", "/now", '{"b": 2}', **others) == 403
        assert status("POST", "/now", "x" * 200_000) == 403
        with pytest.raises(HierarchyError, match="--port"), served(urlsplit(address).port, str):
            pass
    assert asked == [{"a": 1}]
