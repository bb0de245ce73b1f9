"""Reference problems, stored and fresh, and problems of closed loops: windows of consecutive ticks.

DYN60 is recorded from `stand-push` (extra `sim`): the stored set with seed 60, before the plant and
the stack became what they are; `hierarchy problems export DYN60 --seed 61` makes a fresh one.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from hierarchy.problem import Array, Hierarchy
from scenarios.config import Scenario, ScenarioError, load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import uninterrupted
from solvers import certify, make
from solvers.problems import family as make_problem
from solvers.problems.files import read
from solvers.proof import Proof
from solvers.qp.backends import BACKENDS, installed

EQUALITIES = ("EQ7", "EQ7over", "EQ7sing", "EQ30L8", "EQ30L10")
INEQUALITIES = ("INEQ7", "HUM38", "DEGEN7")
RECORDED = ("DYN60",)
FAMILIES = EQUALITIES + INEQUALITIES + RECORDED
DATA = Path(__file__).parent / "data"
SCENARIO = "stand-push"
TOGETHER = 10                        # ticks in a row of one run
LEFT_OUT = "joint limits"            # a level of the scenario that the family lacks
_FIRST, _LAST = 0.3, 1.0             # [s] between which the ticks lie: the push begins at 0.3 s
_NEAREST = 1e-9                      # tolerance of `certify`
_AGREE = 1e-6                        # of answers, relative to 1 + |x|


def ticks(seed: int) -> Iterator[tuple[Hierarchy, Array]]:
    """Yield TOGETHER consecutive ticks of one sampled run after another, with certified answers.

    A run that falls before its ticks is left out, and one with a tick that has no certified answer,
    or two.
    """
    base, run = load(SCENARIO).with_changes(
        {"limits.horizon": 0.0, "plant.stops": False, "plant.joint_friction": 0.0,
         "plant.joint_damping": 0.0, "plant.armature": 0.0}), 0  # as the set was recorded
    while True:
        values = base.drawn(seed, run)
        chance = np.random.default_rng([seed, run])
        first = int(chance.uniform(_FIRST, _LAST) / base.control.period)
        found = [_without(h, LEFT_OUT)
                 for h in window(base.with_drawn(values, "DYN60"), first, TOGETHER)]
        some = [(h, x) for h in found if (x := answer(h)) is not None]
        if len(some) == TOGETHER:
            yield from some
        run += 1


def _without(h: Hierarchy, name: str) -> Hierarchy:
    """Return a copy of h without a level."""
    kept = {own: level for own, level in zip(h.names, h.levels(), strict=True) if own != name}
    return Hierarchy.from_levels([*kept.values()], h.reference, [*kept])


def answer(h: Hierarchy) -> Array | None:
    """Return the certified answer of hcod and the backends of hqp, None without one they agree on.

    Where rows are parallel up to the angle at which they count as dependent, there are two.
    """
    tried = [make("hcod"), *(make("hqp", backend=name) for name in BACKENDS if installed(name))]
    found = [x for x in (resolver.solve(h).x for resolver in tried)
             if certify(h, x, _NEAREST).certified]
    if not found or any(np.abs(x - found[0]).max() > _AGREE * (1.0 + np.abs(x).max())
                        for x in found):
        return None
    return found[0]


SCENARIOS = {
    "ellipse-hqp": "an arm on a path, with joint limits, distances and a cone as inequalities",
    "ellipse-limits": "an arm on a path inside its joint limits, with Algorithm 1",
    "human-hqp": "an arm beside a moving hand, seen by a camera",
    "humanoid-reach": "a humanoid asked to reach farther than it can",
    "stand-push": "a pushed humanoid, torque motors: dynamics, contacts, friction (extra `sim`)"}
"""Scenarios that are recorded, by name."""
_WITHIN = (0.1, 0.7)  # share of a run at which a window begins
_PUBLIC = 0.4         # the same for the public set
_RUNS = 20            # sampled runs tried until one lasts to the end of its window


def recorded(name: str, seed: int, count: int) -> list[Hierarchy]:
    """Return the problems of `count` consecutive ticks of a scenario's closed loop.

    seed : 0 for the scenario as shipped; any other samples its start from its [variation], and the
        tick at which the window begins.

    Raises
    ------
    ScenarioError : no run lasts to the end of its window.
    """
    shipped, begin = load(name), _PUBLIC
    if seed:
        begin = float(np.random.default_rng([seed, 3]).uniform(*_WITHIN))
    first = int(begin * shipped.control.ticks)
    for run in range(_RUNS if seed else 1):
        values = shipped.drawn(seed, run) if seed else {}
        found = window(shipped.with_drawn(values, name), first, count)
        if len(found) == count:
            return found
    raise ScenarioError(f"{name}: no run with seed {seed} has {count} problems from tick {first} "
                        "on")


def window(scenario: Scenario, first: int, count: int) -> list[Hierarchy]:
    """Return the problems of `count` ticks of a run from tick `first` on, fewer if it ends."""
    kept: list[Hierarchy] = []

    def keep(tick: int, controller: Controller) -> dict[str, Any]:
        if tick >= first:
            kept.append(controller.hierarchy.copy())
        return {}  # no signals

    lasting = {"control.duration": (first + count) * scenario.control.period}
    uninterrupted(scenario.with_changes(lasting), audits=[keep])
    return kept[:count]


@dataclass(frozen=True)
class Problem:
    """A hierarchy with its answer, None if unknown.

    `before` is the problem of the tick before, of a recorded sequence, or None.
    """

    h: Hierarchy
    proof: Proof | None
    before: Hierarchy | None = None


def certified(h: Hierarchy, x: Array) -> Proof:
    """Return a certified answer x (n,) in the form of a proved one."""
    count = len(h.sizes) + 1
    return Proof(x, h.violations(x), count, count, 0.0, 0.0)


def family(name: str) -> list[Problem]:
    """Read the problems of one reference family; raises HierarchyError if there is no file."""
    one = read(DATA / f"{name}.npz")
    return _in_sequence(name, zip(one.problems, one.answers or (), strict=True))


def _in_sequence(name: str, pairs: Iterable[tuple[Hierarchy, Proof | None]]) -> list[Problem]:
    """Return problems of a family with those before them, where they are consecutive ticks."""
    found, together = list(pairs), TOGETHER if name in RECORDED else 1
    return [Problem(h, proof, found[p - 1][0] if p % together else None)
            for p, (h, proof) in enumerate(found)]


def fresh(name: str, seed: int, count: int) -> list[Problem]:
    """Generate problems of a family with seeds `seed`, `seed` + 1, ..., not used for tuning.

    Those of DYN60 are recorded from runs sampled with `seed`, which needs the extra `sim`, with the
    answers with which they were kept; of the others no answer is known.
    """
    return _in_sequence(name, (
        ((h, certified(h, x)) for h, x in islice(ticks(seed), count)) if name in RECORDED else
        ((make_problem(name, seed + i), None) for i in range(count))))
