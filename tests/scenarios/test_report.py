"""Pages and figures."""

import dataclasses
import itertools
import re
import shlex
from unittest import mock

import numpy as np
import pytest
from hand_made import asked, recording
from headless import Balanced, chromium

from hierarchy.avoidance import Measurement, Obstacle
from hierarchy.avoidance.measurement import measure_exactly
from hierarchy.errors import HierarchyError
from scenarios import load, save, simulate
from scenarios.cell.sensors.sensor import packed_laws
from scenarios.draw.figures import drawing, letter, picture, timeline
from scenarios.draw.figures.palette import looks
from scenarios.measure.metrics import Metric
from scenarios.measure.motions import motions
from scenarios.measure.runs import Run, table
from scenarios.measure.verdict import Comparison
from scenarios.recording.recording import Event
from scenarios.results import page as results_page
from scenarios.results import sections
from scenarios.results.page import comparison_page as page
from scenarios.results.page import run_command
from scenarios.scene.drawn import scene

LETTER = "tpm-published"
TURNED = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]


def made(spec="tpm-published", fault=None, error=None, scenario=None, **signals):
    scenario = (scenario or asked()).with_resolver(spec)
    run = None if error else recording(scenario, fault, **signals)
    return Run(scenario, spec, spec, run, error)


def comparison(*runs):
    return Comparison(runs, "hierarchy compare hand-made", {"python": "3.11"})


def best(row):
    return {i for i, cell in enumerate(row.cells) if cell.kind == "best"}


ONES = np.ones((5, 7))


@pytest.mark.parametrize(("runs", "label", "marked"), [
    ([made(LETTER, minimal_distance=np.full(5, 0.2)), made("hqp")], "Body distance", {1}),
    ([made(LETTER, a=ONES), made("hqp")], "Joint acceleration", {1}),
    ([made(LETTER, a=1.005 * ONES), made("hqp", a=ONES), made("recursive", a=2.0 * ONES)],
     "Joint acceleration", {0, 1}),
    ([made(LETTER, fault="diverged at tick 5"), made("hqp", a=ONES),
      made("recursive", a=2.0 * ONES)], "Joint acceleration", {1}),
], ids=["more is better", "less is better", "equal within a percent", "stopped early"])
def test_the_best_of_each_row_is_marked(runs, label, marked):
    assert best(next(row for row in table(runs) if row.label.startswith(label))) == marked


@pytest.mark.parametrize("units", [("rad", "m"), ("rad or m", "rad or m"), ("rad", "rad or m")])
def test_units_of_joints_that_turn_and_of_those_that_slide_are_not_mixed(units):
    runs = [made(LETTER), made(LETTER, scenario=asked(name="other"))]
    for run, unit in zip(runs, units, strict=True):
        vars(run)["metrics"] = {"excess": Metric("excess", "Beyond", 0.5, unit)}
    (row,) = table(runs)
    assert (row.unit, *(cell.text for cell in row.cells)) == ("rad or m", "0.500", "0.500")


def test_times_are_those_of_a_run_that_was_alone_and_nothing_else_is():
    alone = recording(time_tick=np.full(5, 9e-6), a=2.0 * ONES)
    found = dataclasses.replace(made(LETTER, a=ONES), timing=alone).metrics
    assert found["time_tick_median"].value == pytest.approx(9e-6)
    assert found["acceleration_max"].value == 1.0


@pytest.mark.parametrize("runs", [
    [made(LETTER)], [made(LETTER), made("tpm"), made("recursive")],
    [made(LETTER), made("hqp", fault="diverged at tick 5")],
    [made(LETTER), made("hqp", error="HierarchyError: cannot")],
    [made("hqp", error="HierarchyError: cannot")], [made(LETTER, t=[0.0])],
    [made(LETTER), made(LETTER, scenario=asked(name="other"))],
    [made(LETTER, scenario=asked(title="<script>alert(1)</script> & co", pointing=None,
                                 avoidance=None))],
], ids=["one", "three", "a fault", "an error", "only an error", "one tick", "two scenarios",
        "no tasks but position, and markup"])
def test_a_page_is_whole_and_needs_nothing_outside_itself(runs, request):
    if len(runs) != 3:  # the same figures
        request.getfixturevalue("undrawn")
    text = page(comparison(*runs))
    Balanced(text)
    assert "<script>alert" not in text
    assert "--resolvers" not in text  # names of scenarios that `compare` does not know
    assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//""", text)
    assert not re.search(r"<(?:link|img|(?:iframe|script)[^>]* src)\b|@import|url\((?!#)", text)


def test_the_page_shows_every_event_in_words_and_in_the_stack_over_time():
    run = made(LETTER, contacts=[0, 1, 0, 0, 0], contact_depth=np.zeros(5),
               contact_force=np.zeros(5))
    run = dataclasses.replace(run, recording=dataclasses.replace(
        run.recording, events=(Event(3, "not_finite", "hold"),)))
    text = page(comparison(run, made("hqp")))
    first = '<span class="number">3.000 s</span>'
    assert f"<td>not finite</td><td>hold</td><td>1</td><td>{first}</td>" in text
    assert "<td>contact</td>" in text
    drawn = re.search(r'aria-label="hand-made, tpm-published: the stack over time".*?</svg>', text)
    assert ">not finite: hold</text>" in drawn[0]
    assert ">contact</text>" in drawn[0]


def test_every_run_has_a_command_that_makes_it_again():
    scenario = load("ellipse", ["control.duration=0.5", "pointing.alpha_d=35",
                                "faults=[{kind='overrun', at=0.1, duration=0.1, takes=1.0}]"])
    run = Run(scenario.with_resolver("hqp:backend=osqp"), "hqp:backend=osqp", "hqp osqp")
    command = shlex.split(run_command(run, "runs/a"))
    assert command == ["hierarchy", "run", f"runs/a/{run.folder}/scenario.toml"]
    unchanged = Run(load("ellipse").with_resolver("hcod"), "hcod", "hcod")
    assert run_command(unchanged, "runs/a") == "hierarchy run ellipse --resolver hcod"


def test_a_page_in_a_browser_fits_its_window_and_has_no_complaints(tmp_path):
    """Of real runs, two of which are the same motion."""
    short = load("ellipse", ["control.duration=0.3"])
    asked = {spec: short.with_resolver(spec) for spec in (LETTER, "recursive", "augmented")}
    runs = [Run(one, spec, spec, simulate(one)) for spec, one in asked.items()]
    (tmp_path / "index.html").write_text(page(comparison(*runs)), encoding="utf-8")
    with chromium() as tab:
        for width, dark in itertools.product((360, 1400), (False, True)):
            tab.look_at((tmp_path / "index.html").as_uri(), width=width, dark=dark)
            assert tab.run("document.documentElement.scrollWidth") <= width
            assert not tab.run("document.querySelector('iframe').srcdoc") or width == 1400
            tab.run("document.querySelector('iframe').scrollIntoView()")
            tab.wait("document.querySelector('iframe').srcdoc.length > 1000")
            tab.wait("document.querySelector('iframe').contentDocument?.readyState === 'complete'")
            tab.run("document.querySelectorAll('details').forEach(one => { one.open = true; })")
            assert tab.run("document.documentElement.scrollWidth") <= width
        tab.run("document.querySelector('.command button').click()")
        tab.wait("/copied|selected/.test(document.querySelector('.command button').textContent)")
        assert tab.complaints == []


def test_figures_drawn_anew_take_the_place_of_those_in_the_run_folder(tmp_path, monkeypatch):
    run_folder = save(recording(), tmp_path / "run")
    for text in ("old", "new"):
        monkeypatch.setattr(letter, "write_all", lambda recording, folder, text=text: [
            (folder / name).write_text(text) for name in ("a.svg", "b.svg")])
        assert letter.redraw([run_folder]) == [run_folder / "a.svg", run_folder / "b.svg"]
    assert (run_folder / "b.svg").read_text() == "new"
    assert (run_folder / "run.npz").exists()
    assert not [path for path in run_folder.iterdir() if path.name.startswith(".")]


def test_the_letters_pairs_are_made_of_its_runs_in_its_order(tmp_path):
    names = ("ellipse-35deg-equality", "ellipse", "ellipse-velocity", "ellipse-35deg", "ellipse-3d")
    runs = [recording(load(name), v=np.full((5, 7), float(i)),
                      active_control_point=np.full(5, 2)) for i, name in enumerate(names)]
    drawn = dict(letter.figures(runs))
    assert list(drawn) == ["figure-4-joint-velocities", "figure-5-distances",
                           "figure-6-velocities-and-distance", "figure-7-pointing-error"]
    headings = [ax.get_title(loc="left")[:4] for ax in drawn["figure-5-distances"].axes]
    assert headings == ["(a) ", "(b) ", "Body"]
    speeds = [ax.lines[0].get_ydata()[0] for ax in drawn["figure-4-joint-velocities"].axes]
    assert speeds == [2.0, 1.0]  # the velocity level is (a)
    assert "figure-4a-joint-velocities" in dict(letter.figures([runs[2]]))
    assert "picture" in dict(letter.figures([recording(t=[0.0, 1.0])]))
    blind = recording(minimal_distance=[2.0, np.nan, 1.0, 2.0, 2.0])
    assert picture._nearest(blind) == 2
    letter.write_all([recording(t=[0.0])], tmp_path)  # a run of one tick has no figure
    assert timeline.timeline(recording(t=[2.0])).axes[0].get_xlim() == (2.0, 3.0)


@pytest.mark.parametrize("obstacle", [
    Obstacle("point", (0.3, 0.0, 0.2)), Obstacle("sphere", (0.3, 0.0, 0.2), (0.1,)),
    Obstacle("capsule", (0.3, 0.0, 0.2), (0.1, 0.4), TURNED),
    Obstacle("box", (0.3, 0.0, 0.2), (0.1, 0.2, 0.3), TURNED)], ids=lambda one: one.shape)
def test_an_obstacle_is_drawn_as_far_as_distances_say_that_it_reaches(obstacle):
    balls, radius = picture.hull(obstacle)
    for direction in np.random.default_rng(1).normal(size=(20, 3)):
        u, far = direction / np.linalg.norm(direction), 1e5
        seen, there = Measurement(0), np.r_[np.eye(3).ravel(), obstacle.centre + far * u][None]
        measure_exactly(there, np.zeros(1, int), np.zeros((1, 3)), obstacle.packed()[None],
                        packed_laws(), np.zeros(2), seen.arrays)
        assert (balls @ u).max() + radius == pytest.approx(far - seen.distance[0], abs=1e-5)


def test_a_joint_has_one_colour_in_a_figure_of_two_runs():
    run = simulate(load("humanoid-reach", {"control.duration": 0.01}))
    other = dataclasses.replace(run, signals={**run.signals, "v": np.roll(run["v"], 9, axis=1)})
    fig = letter.stacked([(one, [letter.PANEL["joint-velocities"]]) for one in (run, other)], "")
    first, second = ({line.get_label(): line.get_color() for line in ax.lines
                      if line.get_color() in drawing.JOINTS} for ax in fig.axes)
    assert first == second
    assert len(first) == 8


@pytest.mark.parametrize("name", ["_{}", r"${}\q$"])
def test_a_joint_is_in_the_legend_whatever_its_name(name):
    """matplotlib leaves labels with an underscore out of its own, and reads others as formulas."""
    run = recording()
    robot = dataclasses.replace(run.facts.robot, velocity_names=tuple(map(name.format, range(7))))
    run = dataclasses.replace(run, facts=dataclasses.replace(run.facts, robot=robot))
    fig = letter.stacked([(run, [letter.PANEL["joint-velocities"]])], "")
    fig.draw_without_rendering()
    assert [text.get_text() for text in fig.legends[0].texts] == [*robot.velocity_names]
    found = sections.multiples("", motions([Run(run.scenario, "own", "own", run)]), looks(["own"]))
    assert any({*robot.velocity_names} <= {*key} for _, key, _ in found["cards"])


def test_a_picture_links_the_body_with_the_surface_and_shows_where_listed_tasks_are_to_go(
        tmp_path):
    scenario = load("wipe", {"control.duration": 0.02, "avoidance": {
        "kind": "separation", "obstacles": [
            {"shape": "box", "centre": [0.0, 0.9, 0.5], "half_lengths": [0.3, 0.1, 0.3]}]}})
    run = simulate(scenario)
    lines = picture.picture({"hcod": run}).axes[0].lines
    link = next(line for line in lines if line.get_color() == drawing.ALERT
                and len(line.get_xdata()) == 2)
    seen = scene(run)
    frame = int(np.argmin(seen.distance[:, :-1].min(axis=1)))
    k = int(np.argmin(seen.distance[frame, :-1]))
    ends = drawing.project(np.array([seen.points[frame, k], seen.nearest[frame, k]]))
    np.testing.assert_allclose(link.get_xydata(), ends, atol=1e-3)
    assert [line.get_linestyle() for line in lines].count("--") == 1  # the path of `wipe`
    assert not letter.PANEL["active-point"].shows(run)  # rows push all points at once


def test_curves_and_pictures_are_those_of_the_true_arm():
    """They were of what was measured, beside a true arm and a table of true errors."""
    run = simulate(load("ellipse", {"control.duration": 0.02,
                                    "plant.measurement": {"position_noise": 0.003}}))
    shown = {one.name: one.value for one in scene(run, ticks=np.arange(run.ticks)).series}
    off = np.linalg.norm(run["desired_position"] - run["true_ee_position"], axis=1)
    angle = run.scenario.pointing.angle(run["true_pointing_error"])
    for name, true in (("Distance from the path", 1e3 * off), ("Angle to the cone's axis", angle),
                       ("Joint speeds", run["true_v"])):
        np.testing.assert_allclose(shown[name], true.reshape(run.ticks, -1), rtol=1e-12)
    lines = [line.get_xydata() for line in picture.picture({"hcod": run}).axes[0].lines]
    walked = drawing.project(run["true_ee_position"])
    assert any(line.shape == walked.shape and np.allclose(line, walked) for line in lines)
    fig = letter.stacked([(run, [letter.PANEL[name] for name in (
        "joint-velocities", "position-components")])], "")
    drawn = [line.get_ydata() for ax in fig.axes for line in ax.lines]
    apart = 1e3 * (run["desired_position"] - run["true_ee_position"])
    for true in (*run["true_v"].T, *apart.T):
        assert any(line.shape == true.shape and np.allclose(line, true) for line in drawn)


def test_a_replay_that_would_be_too_large_has_fewer_frames_a_second_but_five(monkeypatch):
    monkeypatch.setattr(results_page, "html", lambda *_, rate, **__: int(100 * rate) * "x")
    found = motions([made(LETTER)])
    for most, rate in ((3000, 30), (2999, 29), (1000, 10), (100, 5)):
        shown = results_page.replay("hand-made", found, most)
        assert f"{rate} frames per second" in shown["said"]
        assert shown["document"] == 100 * rate * "x"
    monkeypatch.setattr(results_page, "html", mock.Mock(side_effect=HierarchyError("no frames")))
    shown = results_page.replay("hand-made", found, 3000)
    assert shown == {"problem": "no frames", "said": ""}


@pytest.mark.parametrize(("pixels", "u", "v"), [
    ([[50.0, 40.0], [70.0, 50.0]], (29.5, 89.5), (59.5, 29.5)),  # its height is the larger share
    ([[20.0, 40.0], [80.0, 44.0]], (9.5, 89.5), (61.5, 21.5)),  # its width
    ([[2.0, 3.0], [4.0, 5.0]], (-0.5, 43.5), (21.5, -0.5)),
    ([[190.0, 90.0], [199.0, 99.0]], (141.5, 199.5), (99.5, 70.5)),
    ([[-50.0, 0.0], [300.0, 300.0]], (-0.5, 199.5), (99.5, -0.5))],
    ids=["high", "wide", "in a corner", "in the other", "beyond the image"])
def test_a_depth_image_is_cut_to_the_surroundings_of_points_in_its_own_proportions(pixels, u, v):
    ax = drawing.figure(width=4.0, height=3.0)[1][0]
    letter._show_around(ax, np.array(pixels), 10.0, (100, 200))
    assert ax.get_xlim() == pytest.approx(u)
    assert ax.get_ylim() == pytest.approx(v)
