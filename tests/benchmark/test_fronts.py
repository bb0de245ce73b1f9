"""Fronts: trials within their bounds, what is on a front, and a table and figure of what came."""

import numpy as np

from benchmark.reproduce import fronts
from benchmark.reproduce.fronts import FRONTS, GIVEN, Method, Point, dominated
from scenarios.config import load


def test_trials_lie_within_the_bounds_evenly_in_the_logarithm():
    found = Method("weighted", free={"a": (0.1, 1000.0)}).trials(32, seed=1)
    values = np.array([one["a"] for one in found])
    assert values.min() >= 0.1
    assert values.max() <= 1000.0
    assert 12 <= (values < 10.0).sum() <= 20
    assert Method("hcod").trials(32, seed=1) == [{}]


def test_only_what_nothing_else_improves_is_on_the_front():
    scores = np.array([[1.0, 4.0], [2.0, 2.0], [2.0, 3.0], [np.inf, np.inf]])
    assert [dominated(scores, k) for k in range(4)] == [False, False, True, True]
    assert not dominated(np.full((2, 2), np.inf), 0)


def test_every_method_can_take_its_settings():
    for front in FRONTS.values():
        for given in front.method.values():
            method = Method(**given)
            scenario = load(front.scenario, GIVEN["plant"].get(front.plant, {}))
            for settings in method.trials(2, seed=1):
                scenario.with_resolver(method.resolver).with_changes(
                    {**method.set, **settings}).make_resolver()


def test_points_are_kept_and_shown(tmp_path):
    points = [Point("ellipse-hqp", "strict", {}, [1e-3, 1.0, 10.0], [2e-3, 1.0, 10.0], 4, 4,
                    ["m", "deg", "rad/s^2"]),
              Point("ellipse-hqp", "weighted", {"control.options.ratio": 7.0},
                    [1e-3, 1.0, 10.0], [None] * 3, 1, 4, ["m", "deg", "rad/s^2"])]
    fronts.write(points, tmp_path / "fronts.json")
    assert fronts.read(tmp_path / "fronts.json") == points
    table = fronts.table(points, "ellipse-hqp")
    assert table[2] == "| strict | – | 4 of 4 | 2 mm | 1° | 10 rad/s² |"
    assert table[3] == "| weighted | – | at most 1 of 4 | failed | failed | failed |"
    assert len(fronts.figure(points).axes) == 1
