"""The page in the browser: what it shows, and what is asked for on it."""

import time

import numpy as np
import pytest
from headless import chromium

from hierarchy.errors import HierarchyError
from scenarios.cli.main import run_command
from scenarios.config import load
from scenarios.draw.viewer.live import Live
from scenarios.draw.viewer.moment import Became, of_scene
from scenarios.draw.viewer.stack_list import stack_html
from scenarios.loop.simulation import simulate
from scenarios.measure.run_folder import load_run
from scenarios.recording.fate import Fate
from scenarios.scene import scene

LIMITED = load("ellipse-limits", ["control.duration=0.6"])


def ticks(live, count):
    for _ in range(count):
        live.tick()


@pytest.fixture(scope="module")
def recording():
    return simulate(LIMITED)


@pytest.fixture
def server():
    pytest.importorskip("viser", reason="needs the extra view")
    from scenarios.draw.viewer.server import open_server

    opened = open_server(0, "test")
    yield opened
    opened.stop()


# The moment that is drawn


def test_a_run_that_goes_on_and_its_recording_show_the_same_moments():
    live, seen = Live(LIMITED), {}
    for k in range(600):
        live.tick()
        seen[k] = live.moment() if k % 20 == 0 else None
    recorded = scene(live.recording(), rate=50.0)
    for f, k in enumerate(recorded.ticks.tolist()):
        if seen.get(k) is not None:
            one, other = of_scene(recorded, f), seen[k]
            assert (one.order, one.active, one.linked) == (other.order, other.active, other.linked)
            assert {name: became.fate for name, became in one.became.items()} == {
                name: became.fate for name, became in other.became.items()}
            assert (one.saturated == other.saturated).all()


@pytest.mark.slow
def test_the_list_says_what_is_active_given_up_saturated_and_out_of_the_stack(recording):
    now = of_scene(scene(recording), 0)
    saturated = np.array([0, 1, 0, 0, -1, 0, 0], np.int8)
    now = type(now)(**{**vars(now), "order": ("position", "<pointing>"), "saturated": saturated,
                       "became": {"position": Became(Fate.MET, 0.0),
                                  "<pointing>": Became(Fate.MISSED, 0.123, "m/s²")}})
    html = stack_html("tpm", "#123456", now, ["position", "avoidance"])
    assert html.index("position") < html.index("&lt;pointing&gt;") < html.index("avoidance")
    for said in (">row met<", "row missed by 0.12 m/s²", "not in the stack",
                 "saturated: joint 2 (upper), 5 (lower)", "#123456"):
        assert said in html


# A live run


def test_a_live_run_that_nobody_touches_is_the_run_itself(recording):
    live = Live(LIMITED)
    ticks(live, 700)
    assert live.over
    assert live.recording().fault is None
    found = live.recording()
    assert "changed" not in found
    for name in ("t", "q", "v", "command", "order"):
        assert (found[name] == recording[name]).all(), name


def test_a_live_run_that_starts_again_keeps_its_settings_and_nothing_of_its_motion(recording):
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


def test_the_resolver_is_switched_in_mid_motion_and_back():
    live = Live(load("ellipse", ["control.duration=0.6"]))
    ticks(live, 100)
    q = live.controller.cell.plant.q.copy()
    for spec, label in (("tpm", "tpm"), ("hcod", "hcod"), ("tpm-published", "tpm-published")):
        live.switch(spec)
        assert live.controller.resolver.label == label
        assert live.controller.cell.plant.q == pytest.approx(q, abs=0.01)
        ticks(live, 5)
    found = live.recording()
    assert np.abs(np.diff(found["v"], axis=0)).max() < 0.1  # rad/s
    assert found["changed"].tolist() == [False] * 100 + [True] * 10 + [False] * 5


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


@pytest.mark.slow
@pytest.mark.parametrize(("key", "value", "read"), [
    ("pointing.alpha_d", 35.0, lambda cell: np.degrees(cell.pointing.half_angle)),
    ("avoidance.near", 0.1, lambda cell: cell.areas.near),
    ("avoidance.end_effector", 0.2, lambda cell: cell.position.repulsion_within),
    ("position.stiffness", 60.0, lambda cell: cell.position.stiffness),
    ("damping.value", 2.0, lambda cell: cell.stack.reference.damping),
], ids=lambda one: one if isinstance(one, str) else "")
def test_a_setting_that_is_changed_holds_from_the_next_tick_on(key, value, read):
    live = Live(LIMITED)
    ticks(live, 20)
    live.change({key: value})
    ticks(live, 20)
    assert read(live.controller.cell) == pytest.approx(value)
    assert live.changes == [{"t": pytest.approx(0.02), "key": key, "value": value}]


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [
    lambda live: live.change({"avoidance.near": 0.3}),
    lambda live: live.change({"pointing.alpha_d": float("nan")}),
    lambda live: live.change({"position.stiffness": -1.0}),
    lambda live: live.switch("recursive"),
    lambda live: live.switch("tmp"),
    lambda live: live.drag(7, (0.0, 0.0, 0.0)),
    lambda live: live.drag(0, (0.0, 0.0, float("inf"))),
], ids=["far below near", "nan", "negative", "no bounds", "no such", "no obstacle", "infinite"])
def test_what_cannot_be_is_refused_and_the_run_goes_on(spoil, recording):
    live = Live(LIMITED)
    ticks(live, 300)
    with pytest.raises(HierarchyError):
        spoil(live)
    ticks(live, 300)
    assert live.over
    assert (live.recording()["q"] == recording["q"]).all()
    assert live.changes == []


# Pages, without a browser


@pytest.mark.slow
def test_a_page_plays_and_scrubs_runs_of_different_length(server, recording):
    from scenarios.draw.viewer.view import View, labelled

    longer = simulate(LIMITED.with_resolver("hcod").with_changes({"control.duration": 0.8}))
    runs = labelled(["a", "b"], [recording, longer])
    view = View(server, runs)
    assert set(view.lists) == {"tpm", "hcod"}
    view.requests.put("toggle")
    view.step(0.3)
    assert view.playback.t == pytest.approx(0.3)
    view.requests.put("seek", 0.75)
    view.requests.put("layout", "overlaid")
    view.step(0.1)
    assert view.playback.t == 0.75
    assert "ended" in view.lists["tpm"]
    assert "ended" not in view.lists["hcod"]
    assert view.models["hcod"]._root.position.tolist() == [0.0] * 3


@pytest.mark.slow
def test_a_live_page_does_what_is_asked_for_and_says_what_it_refuses(server):
    from scenarios.draw.viewer.live_page import LivePage

    page = LivePage(server, Live(LIMITED))
    higher = page._middle + np.array([0.0, 0.02, 0.0])
    for what, value in (("resolver", "hcod"), ("obstacle 0", np.array([0.1, 0.5, 0.2])),
                        ("path", higher), ("pointing.alpha_d", 15.0)):
        page.requests.put(what, value)
    for _ in range(4):
        page.step(0.03)
    assert page.live.t == pytest.approx(0.12, abs=0.02)
    assert ">hcod<" in page.list
    assert page.live.scenario.position.offset == pytest.approx((0.0, 0.02, 0.0))
    assert page.live.obstacles.offset[0, 2] > 0.05
    assert page.refused == ""
    page.panel.sliders["avoidance.near"].value = 0.3
    page.requests.put("avoidance.near", 0.3)
    page.step(0.03)
    assert "near = 0.3 m is beyond far" in page.refused
    assert page.panel.sliders["avoidance.near"].value == 0.05
    page.requests.put("toggle")
    page.step(0.03)
    t = page.live.t
    page.step(0.03)
    assert page.live.t == t


@pytest.mark.slow
def test_a_live_run_is_kept_at_ctrl_c(tmp_path, monkeypatch, capsys):
    pytest.importorskip("viser", reason="needs the extra view")
    from scenarios.draw.viewer.live_page import LivePage

    def interrupted(page, seconds):
        ticks(page.live, 20)
        raise KeyboardInterrupt

    monkeypatch.setattr(LivePage, "step", interrupted)
    line = ["run", "ellipse", "--live", "--no-wait", "--no-browser", "--port", "0", "--out"]
    assert run_command([*line, str(tmp_path / "a")]) == 1
    assert load_run(tmp_path / "a").ticks == 21
    out, err = capsys.readouterr()
    assert "21 ticks in" in out
    assert "fault: interrupted at tick 21" in err


# In a browser

_SECONDS = 60.0  # of patience: without a GPU the first picture takes ten
_WINDOW = (900, 600)  # [px], since the browser renders without a GPU


def until(done, step, what):
    """Let a page step until something holds."""
    end = time.monotonic() + _SECONDS
    while not done():
        assert time.monotonic() < end, f"{what}: not within {_SECONDS:g} s"
        step(0.02)
        time.sleep(0.02)


def shown(browser, text):
    return lambda: text in browser.run("document.body.innerText")


def press(browser, text):
    """Click on the smallest element that says this."""
    x, y = browser.run(f"""(() => {{
        const said = [...document.querySelectorAll('button, [role=option], span, div, input')]
            .filter(one => (one.innerText || one.value || '').trim() === {text!r}
                           && one.offsetParent !== null);
        const box = said.at(-1).getBoundingClientRect();
        return [box.x + box.width / 2, box.y + box.height / 2];
    }})()""")
    browser.mouse(("mousePressed", x, y), ("mouseReleased", x, y))


def errors(browser):
    """What the page complained of, but for a warning of viser's own."""
    return [one for one in browser.complaints if "THREE.Clock" not in one]


@pytest.fixture
def patient(monkeypatch):
    monkeypatch.setattr("headless._PATIENCE", _SECONDS)


@pytest.mark.usefixtures("patient")
def test_in_a_browser_play_moves_the_arm(server, recording):
    from scenarios.draw.viewer.server import address
    from scenarios.draw.viewer.view import View

    view = View(server, {"tpm": recording})
    with chromium() as browser:
        browser.look_at(address(server), *_WINDOW)
        until(shown(browser, "Joint speeds"), view.step, "the curves are shown")
        until(shown(browser, "row met"), view.step, "the stack is shown")
        before = browser.screenshot()
        press(browser, "Play")
        until(lambda: view.playback.t > 0.3, view.step, "time plays")
        until(lambda: not view.playback.playing, view.step, "the run comes to its end")
        until(lambda: browser.screenshot() != before, view.step, "the picture changes")
        assert errors(browser) == []


@pytest.mark.slow
@pytest.mark.usefixtures("patient")
def test_in_a_browser_the_resolver_is_switched_in_mid_motion(server):
    from scenarios.draw.viewer.live_page import LivePage
    from scenarios.draw.viewer.server import address

    page = LivePage(server, Live(load("ellipse-limits", ["control.duration=60.0"])))
    with chromium() as browser:
        browser.look_at(address(server), *_WINDOW)
        until(shown(browser, "Restart"), page.step, "the panel is shown")
        until(shown(browser, "joint limits"), page.step, "the stack is shown")
        press(browser, "tpm")
        until(shown(browser, "sns"), page.step, "the resolvers are shown")
        t = page.live.t
        press(browser, "hcod")
        until(lambda: page.live.controller.resolver.name == "hcod", page.step, "it is switched")
        until(lambda: "hcod t =" in browser.run("document.body.innerText").replace("\n", " "),
              page.step, "the list says so")
        assert page.live.t > t > 0.0
        assert errors(browser) == []
