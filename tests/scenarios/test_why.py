"""`hierarchy why`: what makes an answer jump, on hierarchies whose answers are known by hand."""

import json

import numpy as np
import pytest

from hierarchy import Hierarchy
from scenarios import load, simulate
from scenarios.cli.main import run_command
from scenarios.measure.causes import Tick, causes
from scenarios.measure.jumps import jumps
from scenarios.measure.run_folder import save
from solvers import make

NAMES = ("box", "task", "rest")


def tick(box, task, rest=((0.0, 0.0), 0.0), reference=(0.0, 0.0), names=NAMES):
    """A box of two unknowns (2, 2), a task and a last row, each (row, target), answered."""
    levels = [(np.eye(2), *np.array(box, dtype=float)),
              *((np.array([row], dtype=float), [target]) for row, target in (task, rest))]
    h = Hierarchy.from_levels(levels, reference, names)
    return Tick(h, answer(h), np.hstack([np.eye(2), np.zeros((2, 1))]))


def answer(h):
    return make("hcod").solve(h).x


def said(before, after):
    return [f"{kind}: {text}" for kind, text in causes(before, after, answer)]


WIDE = ((-1.0, -1.0), (1.0, 1.0))


def test_a_level_that_gains_nothing_by_another_corner_sits_at_a_vertex():
    """x1 is at 1; the least weight of x2 in the task decides which of its ends is chosen."""
    (text,) = said(tick(WIDE, ((1.0, -1e-6), 10.0)), tick(WIDE, ((1.0, 1e-6), 10.0)))
    assert text.startswith("vertex: task, missed by 9, sits at a vertex: it gains ")
    assert text.endswith("by another answer to the same data, 1 of the 2 apart")


def test_what_moved_is_named_with_what_is_left_without_it():
    before, after = (tick(((-1.0, -1.0), (upper, 1.0)), ((1.0, 0.0), 3.0)) for upper in (1.0, 2.0))
    assert said(before, after) == [
        "side: upper side of row 0 in box moved by 1, from 1 to 2; without that the change is 0"]
    assert said(tick(WIDE, ((1.0, 0.0), 0.0)), tick(WIDE, ((1.0, 0.0), 3.0))) == [
        "side: target of row 0 in task moved by 3, from 0 to 3; without that the change is 0",
        "miss: task changed from met to missed by 2"]
    (text,) = said(tick(WIDE, ((1.0, 0.0), 0.0)),
                   tick(WIDE, ((1.0, 0.0), 0.0), reference=(0.0, 0.5)))
    assert text == "reference: the reference moved; without that the change is 0"


def test_levels_and_sides_that_come_and_go_are_all_that_is_said():
    one = tick(WIDE, ((1.0, 0.0), 3.0))
    other = tick(WIDE, ((1.0, 0.0), 3.0), names=("box", "hand", "rest"))
    assert said(one, other) == ["stack: the levels were box, task, rest and are box, hand, rest"]
    opened = tick(((-1.0, -1.0), (np.inf, 1.0)), ((1.0, 0.0), 3.0))
    assert said(one, opened) == ["stack: the upper side of row 0 in box vanished"]


def test_an_answer_that_the_resolver_does_not_give_is_not_blamed_on_the_rows():
    before = tick(WIDE, ((1.0, 0.0), 0.5))
    (text,) = said(before, before._replace(x=np.array([-0.9, 0.0])))
    assert text.startswith("other: one of two answers to the same data was not sent as it is")


def test_what_a_resolver_carries_from_tick_to_tick_is_no_cause():
    run = simulate(load("reach-torque-smooth").with_changes({"control.duration": 0.05}))
    assert [cause.kind for cause in jumps(run, 30)[0].causes] == ["side"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return save(simulate(load("ellipse-hqp").with_changes({"control.duration": 0.05})),
                tmp_path_factory.mktemp("why") / "run")


def test_the_command_names_the_largest_changes_of_a_run(folder, capsys):
    assert run_command(["why", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["jumps"]
    sizes = [one["size"] for one in found]
    assert len(found) == 3
    assert sizes == sorted(sizes, reverse=True)
    assert run_command(["why", str(folder), "--tick", str(found[0]["tick"])]) == 0
    assert f"tick {found[0]['tick']} (t = " in capsys.readouterr().out
    assert run_command(["why", str(folder), "--tick", "999"]) == 2
    assert "tick 999: the run has ticks 0 to 49" in capsys.readouterr().err
