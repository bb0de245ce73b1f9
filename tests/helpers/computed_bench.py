"""What benchmarks make of rows by hand: verdicts, summaries, tables, for tests/helpers/seen.py."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from benchmark import start
from benchmark.process import CRASHED, HUNG, LEFT_OUT
from benchmark.reproduce import fronts, pages, protocol, verdicts
from benchmark.solve import judge, resolvers, views
from benchmark.start import Case
from benchmark.studies import saturation, smooth
from hierarchy import Hierarchy
from scenarios.measure.statistics import holm
from scenarios.problems import recorded
from scenarios.results.sampled import Workers
from solvers.problems.files import Collection, Head
from solvers.proof import prove


def simple(side):
    """x1 = side, then x2 <= 1 against x2 = 2: the least violations are 0, 0 and 1."""
    return Hierarchy.from_levels([([[1.0, 0.0]], [side]), ([[0.0, 1.0]], [-np.inf], [1.0]),
                                  ([[0.0, 2.0]], [4.0])])


def collection(problems, sequence=False):
    answers = tuple(prove(h, [np.linalg.lstsq(h.A, np.where(np.isfinite(h.lower), h.lower, 0.0))[0],
                              [h.lower[0], 1.0]]) for h in problems)
    return Collection(Head("simple", "for tests", "fresh", 7, sequence, 0.001 * sequence),
                      tuple(problems), answers)


def answers():
    """Answers to simple problems judged and summed up: only x decides."""
    one = collection([simple(3.0), simple(1.0)], sequence=True)

    def row(x, problem=0, solved=True, **more):
        return {"entrant": "one", "version": "1", "family": "simple", "half": "fresh", "seed": 7,
                "sha256": one.digest, "problem": problem, "solved": solved, "same": True,
                "x": x, "cold_ns": [1000, 3000, 2000], "start_kib": 1000, **more}

    def found(*rows):
        return judge.judge(rows, {one.digest: one})

    def total(entrant, asked, right, family=""):
        return {"entrant": entrant, "family": family, "asked": asked, "right": right,
                "median_us": 1.0}

    step = [np.array([np.inf]), np.array([np.inf]), None, np.zeros(1), np.ones(1), np.ones(2)]
    both, left = [total("best", 100, 1.0), total("other", 102, 0.5)], [
        total("best", 100, 1.0, "a"), total("other", 100, 0.5, "a"), total("other", 2, 0.5, "b")]
    late = [found(row([3.0, 1.0], entrant=name))[0] for name in ("one", "later")]
    sections = [views.section("a", rows, {}, at)[0] for rows, at in (
        (found(row(None, refused="no")), {}), *((late, {border: [
            one for one in late if one["entrant"] in asked] for border in (1e-9, 1e-8)})
            for asked in ([], ["one"])))]
    return {"verdicts": [[found(given)[0][key] for key in ("verdict", "level", "absolute",
                                                           "relative")] for given in (
                *(row(x, solved=solved) for x, solved in (
                    ([3.0, 1.0], True), ([3.0, 1.0], False), ([3.0 + 1e-7, 1.0], True),
                    ([3.1, 1.0], True), ([3.0, 1.5], True), ([3.0, 0.5], True),
                    ([3.0, 0.5], False), ([np.nan, 1.0], True), ([3.0], True))),
                *(row(None, **more) for more in (
                    {"ended": CRASHED}, {"ended": HUNG}, {"ended": LEFT_OUT}, {"refused": "no"},
                    {"raised": "Error"})))],
            "shapes": [str([one["verdict"], judge.summary(rows, {"simple": 2.0})["moved"]])
                       for x in ([3.0], [[3.0], [1.0]], 3.0) for rows in [found(*(
                           row(x, p, without=[3.0]) for p in (0, 1)))] for one in rows],
            "summaries": [[f"{key} {value}" for key, value in judge.summary(
                found(*rows), {"simple": 2.0}).items()] for rows in (
                    [row([3.0, 1.0]), row([1.5, 1.0], 1)], [row(None, refused="no")])],
            "steps": [judge._step(points) for points in (step, step[::-1], step[:4])],
            "leads": [views.lead("", total_, rows) for total_, rows in (
                (both, left), (both, [*left, total("best", 0, np.nan, "b")]),
                (both, (total("equalities", 0, np.nan, "a"), total("best", 100, 0.9, "a"),
                        total("other", 100, 1.0, "a"))))],
            "sections": [str([*sections[0].tables[0].cells()[:1],
                              *(sorted(one.figures) for one in sections)])]}


def claims():
    """Verdicts on claims of the protocol, tests in blocks, and fronts."""
    size, chance = 100, np.random.default_rng(5)

    def rows(**columns):
        values = [{name: {"speed_max": [float(one) if np.isfinite(one) else None for one in some],
                          "reached_end": list(np.isfinite(some).astype(float))}
                   for name, some in columns.items()}] * 2
        about = {"speed_max": {"label": "Joint speed, max", "unit": "rad/s", "lower": True}}
        return protocol.Rows(["a", "b"], [1, 2], 25, about, values, [{}, {}])

    y = chance.uniform(1.0, 2.0, size)
    x, one = 0.8 * y * np.exp(0.05 * chance.standard_normal(size)), np.ones(size)
    same, never = np.where(np.arange(size) < size // 2, y, y - 10.0), np.full(size, np.inf)
    judged = []
    for given, claim in (
            *(({"x": x, "y": y}, {"below": "y", "percent": True, "matters": matters})
              for matters in (5.0, 20.0, 40.0)),
            ({"x": x, "y": y}, {"above": "y", "percent": True, "matters": 5.0}),
            *(({"x": same, "y": y}, {side: "y", "matters": 0.0}) for side in ("below", "above")),
            *(({"x": never, "y": of}, {"above": "y", "matters": 0.1}) for of in (one, never)),
            ({"x": never}, {"most": 5.0}), ({"x": one}, {"most": 5.0})):
        of, given = protocol.Claim("one", "own", "a text", "x", "speed_max", **claim), rows(**given)
        found = verdicts.judged(replace(protocol.PROTOCOL, claims=(of,)), given, "own")[0]
        judged.append([found.decided, found.p, str(found.effect and verdicts.shown(
            found.claim, given, found.effect))])
    none = verdicts.blocked(np.array([-np.inf, -np.inf, np.inf, np.inf]), np.zeros(4, dtype=int))
    scores = np.array([[1.0, 4.0], [2.0, 2.0], [2.0, 3.0], [np.inf, np.inf]])
    tried = np.array([[[3.0, 1.0], [1.0, 2.0], [2.0, np.inf], *[[8.0, np.inf]] * 2, [4.0, 9.0]]])
    front = fronts.Front("ellipse", ["x", "y"], {"strict": {"resolver": "hcod"}})
    with (patch.object(fronts, "FRONTS", {"one": front}),
          patch.object(fronts, "_trained", lambda *_: tried[:, 0]),
          patch.object(fronts, "_scores", lambda *_: (tried, ["m", "m"]))):
        points = fronts.run(Path(), Workers())
    return {"claims": judged, "of both signs": [[none.estimate, none.low, none.high]],
            "holm": [holm([0.01, 0.04, 0.03])], "dominated": [fronts.dominated(scores, k)
                                                              for k in range(4)],
            "points": [str((one.test, one.kept)) for one in points],
            "empty": [fronts.table([], next(iter(fronts.FRONTS)))[0],
                      pages._median("EQ7\nhcod – –\n", "EQ7", "hcod")]}


def studies():
    """Rows of studies: a warm start by its own answer, what is not answered, what was measured."""
    one, found = recorded.family("EQ7")[0], []
    for off, solved in ((0.0, True), (1.0, True), (1.0, False)):
        warm = resolvers._warm({
            "entrant": "one", "solved": True, "x": one.proof.x, "warm_ns": [1],
            "warm_iterations": 1, "warm_x": one.proof.x + off, "warm_solved": solved}, one)
        found.append([warm["verdict"], warm["relative"]])
    h = Hierarchy.from_levels([(np.eye(1), [-1.0], [1.0]), (np.eye(1), [1.0])])
    unanswered = judge.judged({"entrant": "one", "family": "f", "raised": "no"}, h, None)
    fallen = SimpleNamespace(values=["torque_step_max"], compared=lambda *_: np.array([np.nan]),
                             shares=lambda: {"Reached the end": {"one": "0 of 1"}})
    events = [[0.0, True, "solvers.kernels.a.b"], [2.0, False, "solvers.kernels.a.b"]]
    cases = [Case("help", 0.5, ["a"]), Case("first", None, [start._COMPILE]),
             Case("library", 10.0, ["b"])]
    said = {"help": (0.1, 0.09, None), "first": (20.0, 19.0, events), "library": (11.0, 8.0, None),
            "memory": (1.0, 1.0, [301.0]), "memory of a worker": (1.0, 1.0, [250.0] * 20)}
    with (patch.object(start, "_cases", lambda folder: cases),
          patch.object(start, "_measured", lambda case: said[case.what])):
        measured = start.run()
    return {"warm": found, "rows": [str(saturation._row([unanswered], 1)), str(
                smooth._row(fallen, "one", "torque_step"))],
            "started": [*map(str, measured.rows["start"]), *map(
                str, measured.rows["compilation"]), measured.sections[0].text]}


COMPUTED = {"answers to simple problems": answers, "claims": claims, "studies": studies}
