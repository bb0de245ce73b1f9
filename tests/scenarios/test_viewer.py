"""The page in the browser: what it shows, and what is asked for on it."""

import json
import time
from contextlib import closing
from http.client import HTTPConnection
from urllib.parse import urlsplit

import numpy as np
import pytest
from headless import chromium

from hierarchy.errors import HierarchyError
from scenarios.config import load
from scenarios.draw.viewer.live import Live
from scenarios.draw.viewer.live_page import LivePage
from scenarios.draw.viewer.server import is_own, served
from scenarios.loop.simulation import simulate
from scenarios.scene import scene

LIMITED = load("ellipse-limits", ["control.duration=0.6"])


def ticks(live, count):
    for _ in range(count):
        live.tick()


@pytest.fixture(scope="module")
def recording():
    return simulate(LIMITED)


def test_a_live_run_that_nobody_touches_is_the_run_itself_and_starts_again_with_its_settings(
        recording):
    live = Live(LIMITED)
    ticks(live, 700)
    assert live.over
    assert live.recording().fault is None
    found = live.recording()
    assert "changed" not in found
    for name in ("t", "q", "v", "command", "order"):
        assert (found[name] == recording[name]).all(), name
    live = Live(LIMITED)
    ticks(live, 10)
    live.drag(0, (0.0, 0.0, 0.1))
    live.change({"pointing.alpha_d": 15.0})
    ticks(live, 50)
    live.restart()
    assert (live.t, live.changes, live.over) == (0.0, [], False)
    assert live.scenario.pointing.alpha_d == 15.0
    assert not live.obstacles.offset.any()
    ticks(live, 1)
    np.testing.assert_array_equal(live.recording()["q"][0], recording["q"][0])


def test_an_obstacle_that_is_dragged_goes_there_no_faster_than_a_hand():
    live = Live(load("ellipse", ["control.duration=0.6"]))
    ticks(live, 10)
    live.drag(0, (0.0, 0.0, 0.1))
    ticks(live, 50)
    assert live.obstacles.centres[0] == pytest.approx([0.1, 0.5, 0.15])
    ticks(live, 100)
    assert live.obstacles.centres[0] == pytest.approx([0.1, 0.5, 0.2])
    found = live.recording()
    assert found["changed"].tolist() == [False] * 10 + [True] * 150
    drawn = scene(found)
    assert drawn.centres[-1, 0] == pytest.approx([0.1, 0.5, 0.2])
    assert drawn.levels.known[0]
    assert not drawn.levels.known[-1]


def test_a_live_page_does_what_is_asked_for_and_says_what_it_refuses():
    page = LivePage(Live(LIMITED))
    higher = (page.middle + np.array([0.0, 0.02, 0.0])).tolist()
    for asked in ({"resolver": "hcod"}, {"obstacle 0": [0.1, 0.5, 0.2]},
                  {"path": higher, "pointing.alpha_d": 15.0}):
        page.answer(asked)
    for _ in range(4):
        page.step(0.03)
    shown = json.loads(page.now)
    assert page.live.t == pytest.approx(0.12, abs=0.02)
    assert shown["runs"][0]["label"] == shown["resolver"] == "hcod"
    assert shown["handles"]["path"] == pytest.approx(higher)
    assert page.live.scenario.position.offset == pytest.approx((0.0, 0.02, 0.0))
    assert page.live.obstacles.offset[0, 2] > 0.05
    assert page.refused == ""
    for asked, why in (({"avoidance.near": 0.3}, "near = 0.3 m is beyond far"),
                       ({"avoidance.nearly": 0.3}, "avoidance.near"),
                       ({"obstacle 0": "up"}, "up"), ({"resolver": [1]}, "list"),
                       ({"resolver": "hcood"}, "hcod"), ({"obstacle 7": [0, 0, 0]}, "7"),
                       ({"speed": "fast"}, "fast")):
        page.answer(asked)
        page.step(0.03)
        assert why in page.refused
    assert {one["key"]: one["value"] for one in json.loads(page.now)["settings"]}[
        "avoidance.near"] == 0.05
    page.answer({"toggle": None})
    page.step(0.03)
    t = page.live.t
    page.step(0.03)
    assert page.live.t == t
    assert any("cone" in goal for goal in json.loads(page.now)["runs"][0]["goals"])


_SECONDS = 180.0  # of patience, which only a page that hangs takes


def test_in_a_browser_the_resolver_is_switched_and_an_obstacle_dragged_in_mid_motion():
    page = LivePage(Live(load("ellipse-limits", ["control.duration=600.0"])))
    with served(0, page.html, page.answer) as address, chromium() as browser:
        browser.look_at(address, 700, 500)  # small, since there is no graphics card

        def until(script):
            end = time.monotonic() + _SECONDS
            while not browser.run(script):
                assert time.monotonic() < end, script
                page.step(0.02)
                time.sleep(0.02)

        until("player.runs[0].frames > 3 && !player.stage.flat")
        before = browser.screenshot()
        browser.run("player.choice.value = 'hcod'")
        browser.run("player.choice.dispatchEvent(new Event('change'))")
        until("document.querySelector('.card h2').textContent.startsWith('hcod')")
        until("player.runs[0].stretches.length === 2 && player.runs[0].frames > 8")
        assert page.live.controller.resolver.name == "hcod"
        assert browser.screenshot() != before
        x, y = browser.run("""(() => {
            const box = player.parts.space.getBoundingClientRect();
            const p = player.handles['obstacle 0'];
            const m = player.stage.camera.matrix(box.width / box.height);
            const row = r => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r];
            return [box.left + (row(0) / row(3) + 1) / 2 * box.width,
                    box.top + (1 - row(1) / row(3)) / 2 * box.height]; })()""")
        browser.mouse(("mousePressed", x, y), ("mouseMoved", x, y - 20),
                      ("mouseReleased", x, y - 20))
        until("player.handles['obstacle 0'][2] > 0.12")
        assert page.live.obstacles.offset[0, 2] > 0.02
        browser.run("player.ask('avoidance.near', 0.3)")
        until("player.warning.textContent.includes('beyond far')")
        browser.run("player.ask('restart', null)")
        until("player.begun === 1 && player.runs[0].frames > 1")
        assert browser.complaints == []


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
