"""Pages in the browser, of a run that goes on and of runs that are over."""

import base64
import itertools
import json
import re
import tempfile
import time
from contextlib import closing, suppress
from http.client import HTTPConnection
from unittest import mock
from urllib.parse import urlsplit

import numpy as np
import pytest
from headless import chromium

from hierarchy.errors import HierarchyError
from scenarios import load, load_run, save, simulate
from scenarios.cli import shown
from scenarios.draw.replay import NOTHING, html
from scenarios.draw.viewer.live import Live
from scenarios.draw.viewer.live_page import LivePage
from scenarios.draw.viewer.server import served
from scenarios.measure.happenings import jumps
from scenarios.scene.drawn import scene

LIMITED = load("ellipse-limits", ["control.duration=0.6"])


def ticks(live, count):
    for _ in range(count):
        live.tick()


def test_a_live_run_starts_again_with_its_settings(tmp_path):
    live = Live(LIMITED)
    first = live.controller.cell.plant.q.copy()
    ticks(live, 10)
    live.drag(0, (3.0, 4.0, 0.0))  # as far as it may go
    live.drag(0, (0.0, 0.0, 0.1))
    live.change({"pointing.alpha_d": 15.0})
    ticks(live, 50)
    save(live.recording(), tmp_path / "run", live.changes)
    kept = json.loads((tmp_path / "run" / "changes.json").read_text())
    assert [(one["t"], one["key"]) for one in kept][-1] == (0.01, "pointing.alpha_d")
    live.restart()
    assert (live.t, live.changes, live.over) == (0.0, [], False)
    assert live.scenario.pointing.alpha_d == 15.0
    assert not live.obstacles.offset.any()
    ticks(live, 1)
    np.testing.assert_array_equal(live.recording()["q"][0], first)


@pytest.mark.parametrize(("name", "changes", "count"), [
    ("ellipse", {"control.jacobian_derivative": "difference"}, 120),
    ("ellipse-limits", {"control.level": "velocity", "plant": {"kind": "mujoco"},
                        "limits.acceleration": 3.0}, 60),
    ("ellipse", {"control.transition": "blend", "control.transition_time": 0.1}, 380),
    ("step", {"control.resolver": "merged"}, 60),
    ("ellipse-limits", {"start.v": [0.2] * 7, "control.policy": {
        "deadline": 1e-9, "overrun": "stop"}}, 30)],
    ids=["differences", "lag", "transition", "torque step and memory", "stop"])
def test_a_change_to_the_same_settings_changes_no_command(name, changes, count):
    lives = [Live(load(name, changes)) for _ in range(2)]
    for live, changed in zip(lives, (False, True), strict=True):
        ticks(live, count - 20)
        if changed:
            live.switch("own")
        ticks(live, 20)
    alone, other = (live.recording() for live in lives)
    assert alone.ticks == other.ticks
    np.testing.assert_array_equal(alone["command"], other["command"])
    assert lives[0].controller.policy.fault == lives[1].controller.policy.fault


def test_the_last_good_command_is_held_across_a_change():
    live = Live(LIMITED)
    ticks(live, 5)
    live.change({"control.policy": {"deadline": 1e-9, "overrun": "hold"}})
    ticks(live, 1)
    found = live.recording()
    assert found.events == ((5, "overrun", "hold"),)
    np.testing.assert_array_equal(found["command"][5], found["command"][4])


CAMERA = {"kind": "camera", "width": 64, "height": 48, "fx": 52.0, "fy": 52.0, "rate": 100.0,
          "latency": 0.01}


@pytest.mark.parametrize(("name", "changes"), [
    ("strictness", {}), ("ellipse", {"sensor": CAMERA}), ("ellipse-limits", {})])
def test_a_live_run_that_nobody_touches_is_the_run_itself(name, changes):
    scenario = load(name, {"control.duration": 0.6 if "limits" in name else 0.02, **changes})
    live, recording = Live(scenario), simulate(scenario)
    ticks(live, 1000)
    live.change({"position.stiffness": 31.0})
    assert live.changes == [], "they are for the next run"
    assert live.over
    found = live.recording()
    assert (found.fault, found.signals.keys()) == (None, recording.signals.keys())
    for signal, values in recording.signals.items():
        if not signal.startswith("time_"):
            np.testing.assert_array_equal(found[signal], values, signal)


def test_a_camera_goes_on_seeing_when_what_is_avoided_changes():
    live = Live(load("ellipse", {"sensor": CAMERA}))
    ticks(live, 15)
    live.change({"avoidance.far": 0.22})
    ticks(live, 15)
    blind = [event.tick for event in live.recording().events if event.kind == "stale"]
    assert blind == list(range(10)), "before the first image"


def test_a_jump_that_a_hand_has_made_is_not_explained_by_rows_without_it():
    live = Live(LIMITED)
    ticks(live, 10)
    live.change({"position.stiffness": 400.0})
    ticks(live, 1)
    (cause,) = jumps(live.recording(), 10)[0].causes
    assert cause.text == "its rows do not follow from the recording"


def test_in_a_browser_the_resolver_is_switched_and_an_obstacle_dragged_in_mid_motion():
    page = LivePage(Live(load("ellipse-limits", ["control.duration=600.0"])))
    with served(0, page.html, page.answer) as address, chromium() as browser:
        browser.look_at(address, 700, 500)  # small, since there is no graphics card

        def until(script):
            end = time.monotonic() + 180.0  # of patience, which only a page that hangs takes
            while not browser.run(script):
                assert time.monotonic() < end, script
                page.step(0.02)
                time.sleep(0.02)

        until("player.runs[0].frames > 3 && !player.stage.flat")
        before = browser.screenshot()
        browser.run("window.curves = player.curves, window.card = player.stacks[0].card, 0")
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
        browser.run("player.ask('pointing.alpha_d', 15)")
        until("player.runs[0].series[1].marks[0][1] === 15")
        browser.run("player.ask('avoidance.near', 0.3)")
        until("player.warning.textContent.includes('beyond far')")
        browser.run("player.ask('restart', null)")
        until("player.begun === 1 && player.runs[0].frames > 3")
        assert browser.run("player.curves === window.curves && player.stacks[0].card !== card")
        assert browser.run("document.querySelectorAll('#curves .line').length") > 4
        assert browser.complaints == []


def test_a_run_that_is_over_does_not_play():
    assert not LivePage(Live(load("ellipse", ["control.duration=0.001"]))).data()["playing"]


@pytest.mark.parametrize(("frames", "folder", "ticks", "code"), [
    (0, "run", 1, 1), (1, "run", 10, 0), (1, "file/run", 10, 1)])
def test_the_command_of_a_live_run_ends_with_1_where_it_did_not_end_or_is_saved_elsewhere(
        frames, folder, ticks, code, tmp_path, monkeypatch, capsys):
    sleep = mock.Mock(side_effect=[None] * frames + [KeyboardInterrupt])
    monkeypatch.setattr(shown, "time", mock.Mock(sleep=sleep, monotonic=itertools.count().__next__))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").touch()
    run = load("ellipse", ["control.duration=0.01"])
    assert shown.show_live(run, tmp_path / folder, 0, 1.0, browser=False, wait=False) == code
    refusal, _, elsewhere = capsys.readouterr().err.strip().partition("; the run is in ")
    assert refusal.endswith("file is no folder") == ("file" in folder)
    assert load_run(elsewhere or tmp_path / folder).ticks == ticks


def test_only_a_browser_of_this_machine_on_our_own_page_is_answered():
    asked = []

    def status(method, path="/", body=None, **headers):
        with closing(HTTPConnection(urlsplit(address).netloc)) as connection:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            answer.read()
            return answer.status

    with served(0, lambda: "<p>page</p>", lambda one: asked.append(one) or "{}") as address:
        assert address.startswith("http://127.0.0.1:")
        assert (status("GET"), status("POST", "/now", '{"a": 1}')) == (200, 200)
        assert (status("GET", "/elsewhere"), status("POST", "/now", "[")) == (404, 400)
        for own in ({"Host": "localhost:80"}, {"Host": "127.0.0.1:80", "Origin": "http://127.0.0.1:80"}):
            assert status("GET", **own) == 200
        for others in ({"Host": "rebound.example:80"}, {"Host": "127.0.0.1.example"}, {"Host": "["},
                       {"Host": ""}, *({"Origin": of} for of in (
                           "http://elsewhere.example", "http://127.0.0.1:3000", "null"))):
            assert status("GET", **others) == status("POST", "/now", '{"b": 2}', **others) == 403
        assert status("POST", "/now", "x" * 200_000) == 403
        assert status("POST", "/now", "{}", **{"Content-Length": "²"}) == 403
        with closing(HTTPConnection(urlsplit(address).netloc, timeout=9.0)) as connection:
            connection.request("POST", "/now", "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
                               {"Host": "rebound.example"})
            connection.getresponse().read()
            with suppress(ConnectionResetError):  # what was refused is not read as a request
                assert connection.sock.recv(1) == b""
        with pytest.raises(HierarchyError, match="--port"), served(urlsplit(address).port, str):
            pass
    assert asked == [{"a": 1}]


@pytest.fixture(scope="module")
def runs():
    """Two ways of resolving two seconds, in which the order of the stack changes."""
    asked = load("ellipse", ["control.duration=2.0"])
    return {"tpm-published": simulate(asked),
            "recursive": simulate(asked.with_resolver("recursive"))}


@pytest.fixture(scope="module")
def document(runs):
    return html(runs, "An <ellipse> & two ways")


def data_of(document):
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', document, re.S)
    return json.loads(found[1])


def unpacked(array):
    """The array given to `packed`, to its precision; with steps, infinite becomes NaN."""
    kind = {"f4": "<f4", "i2": "<i2", "u2": "<u2", "i1": "|i1"}[array["kind"]]
    values = np.frombuffer(base64.b64decode(array["data"]), kind).reshape(array["shape"])
    if "step" not in array:
        return values
    return np.where(values == NOTHING, np.nan, array["low"] + values * array["step"])


def test_a_label_cannot_end_the_data(runs):
    name = "</script><script>alert(1)</script>"
    text = html({name: runs["recursive"]}, "x")
    assert (text.count("</script>"), data_of(text)["runs"][0]["label"]) == (2, name)


def test_the_data_are_those_of_the_recording(runs, document):
    for run, (label, recording) in zip(data_of(document)["runs"], runs.items(), strict=True):
        shown = scene(recording)
        assert run["label"] == label
        error = 1e3 * np.linalg.norm(recording["position_error"][shown.ticks], axis=1)
        for found, expected, step in (  # a step of what is kept is below 0.1 mm
                (run["t"], recording["t"][shown.ticks], 1e-6), (run["links"], shown.links, 1e-4),
                (run["order"], recording["order"][shown.ticks], 0.0),
                (run["fate"], shown.levels.fate, 0.0),
                (run["violation"], shown.levels.violation, 1e-8)):
            np.testing.assert_allclose(unpacked(found), expected, rtol=1e-5, atol=step)
        assert np.allclose(unpacked(run["points"])[:, -1], recording["ee_position"][shown.ticks],
                           atol=1e-4)
        assert np.allclose(unpacked(run["series"][0]["value"])[:, 0], error)
        assert [" > ".join(order) for order in run["orders"]] == list(recording.orders)


def test_the_page_shows_the_arm_in_space_and_plays_it_until_it_is_paused(document, tmp_path):
    (tmp_path / "replay.html").write_text(document, encoding="utf-8")
    with chromium() as page:  # small, since there is no graphics card
        page.look_at((tmp_path / "replay.html").as_uri(), 1000, 600)
        page.run("if (player.playing) player.toggle(); player.seek(0)")
        assert page.run("player.stage !== undefined && document.getElementById('notice').hidden")
        colours = page.run("""(() => { player.stage.draw(0.5, false);
            const {gl} = player.stage.painter, seen = new Set();
            const one = new Uint8Array(4 * 300 * 300);
            gl.readPixels(150, 150, 300, 300, gl.RGBA, gl.UNSIGNED_BYTE, one);
            for (let i = 0; i < one.length; i += 4) seen.add(one.slice(i, i + 3).join());
            return seen.size; })()""")
        assert colours > 100  # lit solids, not an empty floor
        before = page.screenshot()
        page.press(" ", "Space")
        page.wait("player.t > 0.3")
        page.press(" ", "Space")
        stopped = page.run("player.t")
        assert not page.run("player.playing")
        assert page.screenshot() != before
        assert (page.run("player.t"), page.complaints) == (stopped, [])
