"""Of recordings by hand: goals, statistics, causes, texts, for tests/helpers/seen.py."""

from dataclasses import astuple, replace
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
from hand_made import asked, recording

from hierarchy import Hierarchy
from scenarios import load
from scenarios.measure.causes import Tick, causes
from scenarios.measure.goals import Goal, goals, percent
from scenarios.measure.happenings import happened
from scenarios.measure.metrics import Metric, as_plain_data, measure
from scenarios.measure.runs import Run
from scenarios.measure.statistics import best, paired, wilson
from scenarios.measure.verdict import Verdict, lines, verdicts
from scenarios.recording import listed
from solvers import make


def signals():
    """Goals and metrics of five ticks with some signals."""
    def at(x):  # errors of position along one axis [mm], as the signals of a path at rest
        desired = np.outer(1e-3 * np.asarray(x, float), (1.0, 0.0, 0.0))
        return {"desired_position": desired, "position_error": desired}

    far, path = load("ellipse-hqp", {"avoidance.distance": 0.2, "avoidance.influence": 0.3}), [
        SimpleNamespace(path=SimpleNamespace(out_of_reach=spans)) for spans in (
            ((1.0, 2.0), (3.0, 3.5)), ((1.0, 2.0),), ((3.0, 4.0),))]
    step = {"v": np.diag([0, 0, 0, 0, 1.0, 0, 0])[:5],
            "a": np.outer([0.0, 1.0, 3.0, 3.0, 3.0], np.eye(7)[2]), **at([0, 1e3, 1.5e3, 2e3, 3e3])}
    limited, speed = np.full(7, 3.0), np.diag([0, 0, 4.0, 0, 0, 0, 0])[:5]
    moved = [measure(recording(asked(position=one), **step)) for one in path]
    return [[*map(astuple, one.values())] for one in moved] + [
        [*map(astuple, goals(run)), *map(astuple, measure(run).values())] for run in (
        *(recording(**at(x)) for x in ([90, 0, 0.5, 4, 3], [0.25, 0.5, 0.25, 0.25, 1.0],
                                       [90, 1.0, 0.5, 0.25, 0.5], [437] * 5)),
        # It came back; after more; and out again; it stayed; it left on both sides.
        *(recording(q=np.outer(q, np.eye(7)[0])) for q in (
            [0.0] * 5, [2.5, 2.2, 1.9, 1.9, 1.9], [2.5, 2.7, 1.9, 1.9, 1.9],
            [2.5, 1.9, 2.1, 1.9, 1.9], [2.5, 2.4, 2.4, 2.4, 2.4], [0.0, 2.3, -2.1, 0.0, 0.0])),
        recording(pointing_error=0.5 - np.cos(np.radians([60.0, 58.0, 76.0, 60.0, 60.0]))),
        *(recording(v=v, velocity_limit=limited) for v in (speed, 0.750125 * speed)),
        recording(contact_depth=[0, 2e-3, 0, 0, 0], contacts=np.zeros(5),
                  contact_force=np.zeros(5)),
        recording(a=np.full((5, 2), np.nan), fault="diverged at tick 5"),
        # Distances are judged by the true ones where a sensor measured others.
        recording(far, minimal_distance=[1, 0.05, 1, 1, 1], ee_distance=[1, 1, 1, 0.02, 1],
                  true_minimal_distance=[1, 0.4, 0.3, 1, 1], true_ee_distance=[1, 1, 0.35, 1, 1]),
        recording(far, minimal_distance=np.zeros(5), ee_distance=np.zeros(5),
                  true_minimal_distance=[0.2, 0.19995, 0.1998, 0.1, 1.0],  # 0.05 mm is rounding
                  true_ee_distance=[0.2, 0.4, 0.1, 0.4, np.nan]))]


def told():
    """Texts of verdicts, numbers and files."""
    hand = Goal("hand", "", "m", False, 1e-3, 0.02, 0.02, 0.5, 0.0, 0.0)
    short = load("ellipse", {"control.period": 0.3, "control.duration": 1.0})
    steps = [np.outer(np.arange(5) > 2, by * np.eye(7)[3]) for by in (50.0 * (1.0 + 1e-14), 50.1)]
    listed_ = [SimpleNamespace(kind="position", title=title) for title in ("hand", "elbow")]
    errors = [(one, "m", np.array(x)) for one, x in zip(listed_, (  # 1e-9 counts, what is less not
        [0.0, 9e-10, 1e-12, 5e-10, 9e-10], [0.0, 0.0, 0.0, 0.0, 1e-9]), strict=True)]
    with patch.object(listed, "errors", lambda run: errors):
        of_listed = measure(recording(asked(tasks=tuple(listed_))))
    return {
        "shares": [percent(share) for share in (0.5, 0.994, 0.9951, 0.99999, 1.0)],
        "units": lines([Verdict(unit, 1.0, 1.0, None, False, (replace(hand, unit=unit),))
                        for unit in ("m", "deg")]),  # which are not weighed against each other
        "end": [one.end for one in verdicts([Run(short, "a", "a", recording(
            short, t=[0.0, 0.3, 0.6]))])],
        "decimals": [Metric("", "", value, unit).shown() for value, unit in (
            *((12.3456789, unit) for unit in ("m", "s", "deg", "share", "rad", "rad/s", "rad/s^2",
                                              "rad/s^3", "N", "")),
            *((value, "rad") for value in (0.0123, 0.00649, 0.0004, 1e3, 1e5)),
            *((value, "") for value in (0.0, 0.25, 1.5, 3.0, 12.5, 4e-3, 0.01, 10.0)))],
        "file": [str(as_plain_data(recording(a=np.full((5, 2), np.nan), fault="diverged")))],
        "steps": [[len([*happened(run)]), measure(run)["acceleration_step_ticks"].value]
                  for run in (recording(command=by, a=by) for by in steps)],
        "listed": [[one.label, one.value] for key, one in of_listed.items() if key[:4] == "task"],
        "readers": [str(listed._error_reader(one, None)()) for one in (SimpleNamespace(
            error_reader=lambda state: lambda: 3.0), SimpleNamespace())]}


def statistics():
    """Pairs, the best of several, the interval of a share (Wilson 1927: 18 of 24)."""
    low, normal = np.linspace(1.0, 1.5, 16), np.random.default_rng(2).normal(size=(2, 16))
    # One pair of 8 against the trend: p = 0.016 alone, too much for ten rivals after Holm.
    apart = np.array([1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, -0.5])
    holes, first = np.where(np.arange(16) < 3, np.nan, 0.0), np.array([1.0, 2, 3, 4, np.nan, 6])
    columns = ([low, low + 1.0, low * (1.0 + 1e-10), low + 2.0], [low, low.copy()], [low],
               [normal[0], normal[0] + normal[1], normal[0] + 5.0], [low, np.full(16, np.nan)],
               [low, low + np.r_[np.full(12, 1.0), np.full(4, -50.0)]], [np.zeros(8), apart],
               [low * (1.0 + 1e-12), low + 1.0, low], [1e-12 * low, 2e-12 * low],
               [low, np.where(low < 1.2, low + 1.0, low)], [low, low + 1.0 + holes],
               [low + holes, low + 1.0], [low, low + 1.0, low + holes],
               [np.full(16, 2.0), np.repeat([2.0, 3.0], [9, 7])],
               [np.repeat([2.0, 3.0], [9, 7]), np.full(16, 2.0)],  # the medians are equal
               [np.zeros(8), *(apart * (1.0 + 0.01 * i) for i in range(10))])
    pairs = [paired(*both) for both in (
        (first, np.array([1.0, 1.0, 5.0, 4.0 * (1 + 1e-4), 5.0, np.inf])),
        (np.zeros(5), np.ones(5)), (np.zeros(6), np.arange(1.0, 7.0)),
        (np.full(3, np.nan), np.ones(3)), (np.zeros(9), np.full(9, 1e-10)),  # rounding
        (np.zeros(50), np.r_[np.full(26, -1.0), np.full(24, 2.0)]))]  # more are lower, by less
    pairs += [replace(pairs[0], p=p, higher=2, ranks=0.1) for p in (0.0499, 0.05)]
    return {"best": [str([best({i: sign * x for i, x in enumerate(one)}, lower_is_better=lower)
                          for sign in (1.0, -1.0) for lower in (True, False)]) for one in columns],
            "pairs": [[str(one), one.distinguishable, *astuple(one)] for one in pairs],
            "shares": [wilson(*one) for one in ((18, 24), (0, 10), (5, 10), (81, 263), (0, 0))]}


def answers():
    """Why an answer to a box, a task and a last level changed from one tick to the next."""
    def answer(h):
        return make("hcod").solve(h).x

    def tick(upper, row, target, reference=(0.0, 0.0), names=("box", "task", "rest")):
        h = Hierarchy.from_levels([(np.eye(2), [-1.0, -1.0], upper), ([row], [target]),
                                   (np.zeros((1, 2)), [0.0])], reference, names)
        return Tick(h, answer(h), np.hstack([np.eye(2), np.zeros((2, 1))]))

    wide, one, met = (1.0, 1.0), tick((1.0, 1.0), (1, 0), 3.0), tick((1.0, 1.0), (1, 0), 0.5)
    return [[f"{kind}: {text}" for kind, text in causes(*both, answer)] for both in (
        (tick(wide, (1.0, -1e-6), 10.0), tick(wide, (1.0, 1e-6), 10.0)),  # which end of x2
        (one, tick((2.0, 1.0), (1, 0), 3.0)),
        [tick(wide, (0.7, -1.0), by, (0.3, 0.7)) for by in (0.0, 3.0)],
        (tick(wide, (1, 0), 0.0), tick(wide, (1, 0), 0.0, (0.0, 0.5))),
        (one, tick(wide, (1, 0), 3.0, names=("box", "hand", "rest"))),
        (one, tick((np.inf, 1.0), (1, 0), 3.0)),
        (met, met._replace(x=np.array([-0.9, 0.0]))))]  # not what the resolver gives


COMPUTED = {"signals": signals, "told": told, "statistics": statistics, "causes": answers}
