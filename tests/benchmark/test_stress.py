"""Generated problems, every answer certified or proved; problems that once failed."""

import os
from pathlib import Path

import numpy as np
import pytest

from benchmark import stress
from hierarchy import Hierarchy
from solvers import Resolution, Resolver, Status, certify, make, names, problems

REGRESSIONS = sorted((Path(__file__).parents[1] / "data" / "regressions").glob("*.npz"))
JUDGED = [name for name in ("hcod", "tpm", "recursive") if name in names()]
COUNT = 100 if os.environ.get("NUMBA_DISABLE_JIT") == "1" else 400
PARTS = 2  # so that cores can share them
FIRST = 10_000_000  # seeds that nothing was tuned on


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("name", JUDGED[:1])
def test_generated_problems_are_solved_and_certified(name, part):
    each = COUNT // PARTS
    found = stress.tally((name, range(FIRST + part * each, FIRST + (part + 1) * each), "recipe"))
    assert not found.failing
    assert found.counts[stress.CERTIFIED] >= 0.999 * each, "the rest says that it is not sure"


@pytest.mark.parametrize("kind", problems.KINDS)
@pytest.mark.parametrize("name", JUDGED[:2])
def test_structured_problems_end_certified_or_with_a_status(name, kind):
    assert not stress.tally((name, range(FIRST, FIRST + 12), kind)).failing


ONCE_FAILED = [(file, name) for file in REGRESSIONS for name in JUDGED
               if make(name).handles == "inequalities" or problems.load(file).is_equality]


@pytest.mark.parametrize(("file", "name"), ONCE_FAILED,
                         ids=[f"{file.stem}-{name}" for file, name in ONCE_FAILED])
def test_what_once_failed_is_solved_or_said_to_be_doubtful(file, name):
    h = problems.load(file)
    res = make(name).solve(h)
    verdict = certify(h, res.x)
    assert verdict.certified or res.status is Status.INACCURATE, str(verdict)


class Wrong(Resolver):
    """Fails on hierarchies in which the third unknown is asked to be above 1."""

    __module__ = "solvers.wrong"  # as one of ours: what a plugin returns is looked at by `Resolver`
    name = "wrong"
    handles = "inequalities"

    def __init__(self, way):
        self.way = way

    def solve(self, h, memory=None):
        triggered = h.n > 2 and bool(((h.A[:, 2] != 0.0) & (h.lower > 1.0)).any())
        if triggered and self.way == stress.RAISED:
            raise ZeroDivisionError
        x = np.full(h.n, np.nan if triggered and self.way == stress.NOT_FINITE else 0.0)
        solved = triggered and self.way == stress.WRONG
        return Resolution(x, Status.SOLVED if solved else Status.ITERATION_LIMIT)


def problem():
    levels = [(np.eye(5), np.full(5, -9.0), np.full(5, 9.0)),
              (np.ones((3, 5)), [0.0, 5.0, 0.0]), (np.eye(5), np.zeros(5))]
    return Hierarchy.from_levels(levels, reference=np.ones(5))


@pytest.mark.parametrize("way", [stress.RAISED, stress.NOT_FINITE, stress.WRONG])
def test_each_way_to_fail_is_told_from_the_others_and_shrunk_to_its_core(way):
    def fails(h):
        return stress.outcome(Wrong(way), h)[0] == way

    assert fails(problem())
    smallest = stress.shrunk(problem(), fails)
    assert smallest.sizes.tolist() == [1]
    assert smallest.n == 3
    assert not smallest.reference.any()


def test_what_the_certificate_refuses_is_proved_right_or_wrong(monkeypatch):
    monkeypatch.setattr(stress, "certify", lambda h, x: certify(h, np.full(h.n, 9.0)))
    assert stress.outcome(make("hcod"), problem())[0] == stress.PROVED
    assert stress.PROVED not in stress.FAILURES
    assert stress.outcome(Wrong(stress.WRONG), problem())[0] == stress.WRONG


def test_failing_problems_are_listed_and_saved(tmp_path, monkeypatch):
    monkeypatch.setattr(stress, "make", lambda name: Wrong(stress.WRONG))
    monkeypatch.setattr(stress, "_TRIALS", 3)  # every trial is proved wrong, in 120 digits
    found = stress.tally(("wrong", range(1, 2), "recipe"))
    told = stress.report("wrong", {stress.RECIPE: found}, tmp_path)
    assert told.failed
    assert f"recipe, seed {found.failing[0][0]}, {stress.WRONG}" in told.sections[0].text
    kept = problems.load(next(tmp_path.glob("wrong-*.npz")))
    assert stress.outcome(Wrong(stress.WRONG), kept)[0] == stress.WRONG
