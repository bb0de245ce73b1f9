"""Fronts of methods that are tuned with one budget on training scenes, and tested on others."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmark.reproduce.protocol import made, planned
from hierarchy.problem import Array
from scenarios.config import load
from scenarios.draw.figures.palette import looks
from scenarios.measure.metric import Metric, finite, shown
from scenarios.results.plan import Outcome
from scenarios.results.sampled import Progress, Workers

GIVEN = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Method:
    """A resolver with settings, and bounds of those that are free, at dotted keys."""

    resolver: str
    set: Mapping[str, Any] = field(default_factory=dict)
    free: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def trials(self, count: int, seed: int) -> list[dict[str, float]]:
        """Return the settings to try: Sobol's points, evenly in the logarithm of each."""
        if not self.free:
            return [{}]
        from scipy.stats.qmc import Sobol

        points = Sobol(len(self.free), seed=seed).random(count)
        low, high = np.log(np.array(list(self.free.values()), dtype=float)).T
        values = np.exp(low + points * (high - low))
        return [{key: float(f"{x:.3g}") for key, x in zip(self.free, row, strict=True)}
                for row in values]


@dataclass(frozen=True)
class Front:
    """What is run, minimised and needed, and the methods; see fronts.toml."""

    scenario: str
    minimised: Sequence[str]
    method: Mapping[str, Mapping[str, Any]]
    needs: str = ""
    plant: str = ""
    trials: int = GIVEN["trials"]


@dataclass(frozen=True)
class Point:
    """Settings of a method on the front of its training, and what came of them.

    training : worst of each metric over scenes, None where one fails; test : their median, None
    where half of them fail; kept : test scenes that did not fail, of so many `scenes`.
    """

    front: str
    method: str
    settings: dict[str, float]
    training: list[float | None]
    test: list[float | None]
    kept: int
    scenes: int
    units: list[str]


_COLUMNS = 3  # of the figure
_ROWS = 3  # of a method in a table
FRONTS = {name: Front(**given) for name, given in GIVEN["front"].items()}


def run(out: Path, workers: Workers, progress: Progress | None = None) -> list[Point]:
    """Tune and test the methods of each front; return the points. Runs that `out` has are kept."""
    found = []
    for name, label in ((name, label) for name, front in FRONTS.items() for label in front.method):
        method, where = Method(**FRONTS[name].method[label]), (out / name, workers, progress)
        trials = method.trials(FRONTS[name].trials, GIVEN["seed"])
        training = _trained(name, method, trials, where)
        best = spread([k for k in range(len(trials)) if not dominated(training, k)],
                      training[:, 0], GIVEN["tested"])
        scores, units = _scores(name, method, [trials[k] for k in best],
                                (GIVEN["seed"] + 1, GIVEN["test"]), where)
        kept = np.isfinite(scores).all(axis=2).sum(axis=1).tolist()
        test = np.median(scores, axis=1)
        found += [Point(name, label, trials[k], [*map(finite, training[k])],
                        [*map(finite, test[i])], kept[i], GIVEN["test"], units)
                  for i, k in enumerate(best)]
    return found


def _trained(name: str, method: Method, trials: Sequence[Mapping[str, float]],
             where: tuple[Path, Workers, Progress | None]) -> Array:
    """Return the worst of the training scenes in each metric, of each trial.

    A trial that is worse than another on the first scene alone is not run on more: infinite.
    """
    seed, count = GIVEN["seed"], GIVEN["training"]
    first = _scores(name, method, trials, (seed, 1), where)[0][:, 0]
    worst, waiting = np.full_like(first, np.inf), list(range(len(trials)))
    while waiting := [k for k in waiting if not dominated(np.vstack([worst, first[k]]), -1)]:
        now = [k for i, k in enumerate(waiting) if not dominated(first[waiting], i)]
        worst[now] = _scores(name, method, [trials[k] for k in now], (seed, count), where)[0].max(
            axis=1)
        waiting = [k for k in waiting if k not in now]
    return worst


def _scores(name: str, method: Method, trials: Sequence[Mapping[str, float]],
            scenes: tuple[int, int], where: tuple[Path, Workers, Progress | None]
            ) -> tuple[Array, list[str]]:
    """Return the metrics (trials, scenes, metrics), infinite in a scene that fails, and units."""
    front, (seed, count), runs = FRONTS[name], scenes, []
    for settings in trials:
        scenario = load(front.scenario, GIVEN["plant"].get(front.plant, {})).with_resolver(
            method.resolver).with_changes({**method.set, **settings})
        text = scenario.to_toml()
        runs += [planned(scenario, text, start, scenario.drawn(seed, start))
                 for start in range(count)]
    kept = made(runs, *where)
    outcomes = [kept[one.key] for one in runs]
    values = np.array([_values(front, one) for one in outcomes]).reshape(len(trials), count, -1)
    units = {one.name: one.unit for outcome in outcomes for one in outcome.metrics}
    return values, [units.get(name, "") for name in front.minimised]


def _values(front: Front, outcome: Outcome) -> list[float]:
    found = {one.name: one.value for one in outcome.metrics}
    if outcome.reason is not None or (front.needs and not found.get(front.needs)):
        return [np.inf] * len(front.minimised)
    return [np.inf if (value := found.get(name)) is None else float(f"{value:.6g}")
            for name in front.minimised]


def dominated(scores: Array, k: int) -> bool:
    """Return whether another row of scores (N, m) is nowhere worse than row k, once better."""
    better = (scores <= scores[k]).all(axis=1) & (scores < scores[k]).any(axis=1)
    return bool(better.any())


def spread(best: Sequence[int], first: Array, count: int) -> list[int]:
    """Return at most `count` rows of `best`, evenly in the order of their first metric."""
    ordered = sorted(best, key=lambda k: (first[k], k))
    at = np.linspace(0, len(ordered) - 1, min(count, len(ordered)))
    return [ordered[int(k)] for k in at]


def table(points: Sequence[Point], name: str) -> list[str]:
    """Return the table of a front: settings, scenes that did not fail, medians of the test.

    Of a method it shows at most `_ROWS` settings, evenly of those that no other one beats in the
    test, and in one line how many failed.
    """
    own = [one for one in points if one.front == name]
    if not own:
        return ["Not run yet: `hierarchy reproduce fronts`."]
    units = [Metric("", "", None, unit).shown_unit for unit in own[0].units]
    heads = [f"{metric} [{unit}]" if unit else metric
             for metric, unit in zip(FRONTS[name].minimised, units, strict=True)]
    lines = [[name, f"of {own[0].scenes}", *heads]]
    for method in dict.fromkeys(one.method for one in own):
        lines += _rows([one for one in own if one.method == method], units)
    wide = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["```", *("  ".join([one[0].ljust(wide[0]), *map(str.rjust, one[1:], wide[1:])])
                     for one in lines), "```"]


def _rows(tried: Sequence[Point], units: Sequence[str]) -> Iterator[list[str]]:
    """Yield the rows of a method."""
    stood = [one for one in tried if None not in one.test]
    scores = np.array([one.test for one in stood], dtype=float).reshape(len(stood), len(units))
    best = [k for k in range(len(stood)) if not dominated(scores, k)]
    for one in (stood[k] for k in spread(best, scores[:, 0], _ROWS)):
        settings = (f"{'.'.join(key.split('.')[-2:]).removeprefix('options.')}={x:g}"
                    for key, x in one.settings.items())
        values = (shown(x or 0.0, unit).removesuffix(short).strip()
                  for x, unit, short in zip(one.test, one.units, units, strict=True))
        yield [" ".join([one.method, *settings]), str(one.kept), *values]
    if failed := [one.kept for one in tried if None in one.test]:
        yield [f"{tried[0].method}: {len(failed)} failed", f"≤{max(failed)}", *("–" for _ in units)]


def figure(points: Sequence[Point]) -> Figure:
    """Return the fronts as tested: second metric over first, the third as the mark's size."""
    names = list(dict.fromkeys(one.front for one in points))
    columns = min(_COLUMNS, len(names))
    rows = -(-len(names) // columns)
    fig = Figure(figsize=(4.0 * columns, 3.4 * rows), layout="constrained")
    axes = fig.subplots(rows, columns, squeeze=False).ravel()
    style = looks(dict.fromkeys(one.method for one in points))
    for ax in axes[len(names):]:
        ax.axis("off")
    for ax, name in zip(axes, names, strict=False):
        for method in dict.fromkeys(one.method for one in points if one.front == name):
            own = [one.test for one in points if (one.front, one.method) == (name, method)
                   and None not in one.test]
            if own:
                x, y, z = np.array(own).T[:3]
                ax.scatter(x, y, s=20.0 + 40.0 * np.log1p(z), label=method, alpha=0.7,
                           color=style[method].colour)
        first, second, third = FRONTS[name].minimised[:3]
        shares = [None not in one.test for one in points if one.front == name]
        ax.set(title=f"{name}: {sum(shares)} of {len(shares)} settings did not fail", xlabel=first,
               ylabel=second)
        ax.title.set_fontsize(9)
        ax.locator_params(nbins=4)
        ax.ticklabel_format(useOffset=False, scilimits=(-3, 4))
        if any(shares):
            ax.legend(title=f"size: {third}", fontsize=7, title_fontsize=7)
    return fig
