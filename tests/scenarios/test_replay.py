import base64
import json
import re

import numpy as np
import pytest
from headless import chromium

from scenarios import load, save, simulate
from scenarios.cli.main import run_command
from scenarios.draw.replay.page import NOTHING, html
from scenarios.scene import scene


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


def test_the_document_refers_to_nothing_outside_itself(document):
    allowed = "http://www.w3.org/2000/svg"  # a name, which is not fetched
    assert set(re.findall(r"https?://[^\s\"'<>]+", document)) <= {allowed}
    assert not re.search(r"""(?:src|href)\s*=|@import|url\(|\bimport\b|fetch\(|XMLHttp""", document)
    assert "default-src 'none'" in document


def test_a_label_cannot_end_the_data(runs):
    name = "</script><script>alert(1)</script>"
    text = html({name: runs["recursive"]}, "x")
    assert text.count("</script>") == 2
    assert data_of(text)["runs"][0]["label"] == name


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
        assert page.run("player.t") == stopped
        assert page.complaints == []


def test_the_command_takes_several_runs_and_a_name(runs, tmp_path):
    folders = [str(save(run, tmp_path / label)) for label, run in runs.items()]
    file = tmp_path / "new" / "two.html"
    assert run_command(["replay", *folders, "--out", str(file)]) == 0
    assert len(data_of(file.read_text(encoding="utf-8"))["runs"]) == 2
