"""Does a lower task disturb an upper one while velocity limits are active?

A KUKA LWR tracks a step of its end effector that is too fast for its joints, and with lower
priority another posture. Every tick is resolved twice at the same state, with and without the
posture: a strict resolver moves the end effector identically in both. A resolver whose answer is
clipped at the limits shows what a lack of strictness looks like.
`hierarchy bench strictness`, or `strictness(make("hcod"))`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np
from rich.console import Console

from hierarchy import Hierarchy, Robot, State
from hierarchy.kinematics import write_point_jacobian
from hierarchy.problem import Array
from hierarchy.words import listed
from scenarios.bench.machine import on_all_cores
from scenarios.bench.rows import table_of_numbers, write_rows
from solvers import Resolution, Resolver, Status, make, names
from solvers.qp.backends import BACKENDS, installed
from solvers.resolver import Handles

AIM = 1e-9                       # [m per tick] of the end effector
RATIOS = (10.0, 100.0, 1000.0)   # of weights of successive levels
_FORMS = {"sns": ("optimal",)}   # besides the default
START = (0.923, -0.854, 0.903, 1.195, 0.971, 1.796, 0.0)   # [rad] start of the letter's run
STEP = (-0.3, 0.15, -0.25)      # [m]
POSTURE = (1.2, 0.6, -1.0, -1.2, 1.0, -0.9, 1.0)           # [rad] from the start
_GAIN, _POSTURE_GAIN = 20.0, 5.0  # [1/s]
_AT_LIMIT = 1e-9                 # [rad/s]


@final
@dataclass(frozen=True)
class Strictness:
    """The result of one resolver.

    Attributes
    ----------
    label, strict : the resolver's name, and whether it claims to be strict.
    ticks, limited : simulated ticks, and those with a joint at its velocity limit.
    failed : ticks in which a solve, with or without the posture, failed.
    largest, final, total : [m] motion of the end effector due to the posture: the largest in one
        tick, that of the last tick, and the sum. Failed ticks are excluded.
    missed : [m] largest motion in one tick that the limits prevent.
    excess : [rad/s] largest joint velocity beyond its limit.
    error, error_alone : [m] final position error with and without the posture.
    """

    label: str
    strict: bool
    ticks: int
    limited: int
    failed: int
    largest: float
    final: float
    total: float
    missed: float
    excess: float
    error: float
    error_alone: float

    @property
    def met(self) -> bool:
        """Whether the motion is below AIM and every tick was solved."""
        return self.largest <= AIM and not self.failed


def strictness(resolver: Resolver, duration: float = 2.0, period: float = 1e-3) -> Strictness:
    """Run the step for `duration` [s], one tick every `period` [s], with one resolver.

    Raises
    ------
    HierarchyError : the resolver does not handle bounds.
    """
    ticks = round(duration / period)
    with_posture, alone = _Step(period), _Step(period)
    moved, missed, excess = np.zeros((3, ticks))
    limited = failed = 0
    memory = memory_without = memory_alone = None
    for k in range(ticks):
        both, upper = with_posture.hierarchies()
        res, without = resolver.solve(both, memory), resolver.solve(upper, memory_without)
        memory, memory_without = res.memory, without.memory
        if res.status is Status.SOLVED and without.status is Status.SOLVED:
            moved[k] = np.linalg.norm(with_posture.jacobian @ (res.x - without.x)) * period
        else:
            failed += 1
        missed[k] = upper.violations(without.x)[1] * period
        excess[k] = (abs(res.x) - with_posture.limit).max()
        limited += bool(excess[k] > -_AT_LIMIT)
        with_posture.move(res.x)
        own = resolver.solve(alone.hierarchies()[1], memory_alone)
        memory_alone = own.memory
        alone.move(own.x)
    return Strictness(resolver.label, resolver.strict, ticks, limited, failed, float(moved.max()),
                      float(moved[-1]), float(moved.sum()), float(missed.max()),
                      float(max(excess.max(), 0.0)), with_posture.error(), alone.error())


@final
@dataclass(frozen=True, kw_only=True)
class CutOff(Resolver):
    """`tpm` on all levels but the first, whose bounds clip its answer. Not strict."""

    name: ClassVar[str] = "tpm, cut off"
    handles: ClassVar[Handles] = "bounds"

    @property
    def strict(self) -> bool:
        """Never: clipping affects every level."""
        return False

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h, whose first level bounds every unknown."""
        n = h.n
        rest = h.changed(A=h.A[n:], lower=h.lower[n:], upper=h.upper[n:], sizes=h.sizes[1:],
                         names=h.names[1:])
        res = make("tpm").solve(rest)
        return Resolution(np.clip(res.x, h.lower[:n], h.upper[:n]), res.status)


def able() -> list[Resolver]:
    """Return every resolver that handles bounds, with each backend and ratio."""
    found: list[Resolver] = []
    for name in names():
        if name == "hqp":
            found += [make(name, backend=backend) for backend in BACKENDS if installed(backend)]
        elif name == "weighted":
            found += [make(name, ratio=ratio) for ratio in RATIOS]
        else:
            found += [make(name), *(make(name, form=form) for form in _FORMS.get(name, ()))]
    return [resolver for resolver in found if resolver.handles != "equalities"]


def run(out: Path | None = None, resolvers: Iterable[Resolver] | None = None,
        duration: float = 2.0) -> list[Strictness]:
    """Measure resolvers, by default all that handle bounds; print and return the results.

    Writes strictness.csv into the folder `out` if given.
    """
    chosen = [*able(), CutOff()] if resolvers is None else list(resolvers)
    found = on_all_cores(strictness, [(resolver, duration) for resolver in chosen])
    _print(found)
    if out is not None:
        write_rows([asdict(one) for one in found], out / "strictness.csv")
    return found


class _Step:
    """The arm with velocity limits, the end effector's position and the posture as levels."""

    def __init__(self, period: float) -> None:
        self.robot, self.period = Robot.named("kuka_lwr"), period
        self.frame, self.limit = self.robot.frame("end_effector"), self.robot.velocity_limit
        n = self.robot.n
        self.state: State = State.at(self.robot, START)
        self.goal = self.state.position(self.frame) + STEP
        self.posture = np.add(START, POSTURE)
        self.A = np.vstack([np.eye(n), np.zeros((3, n)), np.eye(n)])
        self.lower = np.concatenate([-self.limit, np.zeros(3 + n)])
        self.upper = np.concatenate([self.limit, np.zeros(3 + n)])

    @property
    def jacobian(self) -> Array:
        """Jacobian (3, n) of the end effector at the last `hierarchies`."""
        return self.A[self.robot.n:self.robot.n + 3]

    def hierarchies(self) -> tuple[Hierarchy, Hierarchy]:
        """Return the stack at the current state with and without the posture."""
        n, state, frame = self.robot.n, self.state, self.frame
        write_point_jacobian(state.J, state.placements, state.supports, frame.joint, frame.offset,
                             self.A, n)
        wanted = np.concatenate([_GAIN * (self.goal - state.position(frame)),
                                 _POSTURE_GAIN * (self.posture - state.q)])
        self.lower[n:] = self.upper[n:] = wanted
        levels = [slice(0, n), slice(n, n + 3), slice(n + 3, None)]
        stack = [(self.A[rows], self.lower[rows], self.upper[rows]) for rows in levels]
        known = ("velocity limits", "position", "posture")
        return (Hierarchy.from_levels(stack, names=known),
                Hierarchy.from_levels(stack[:2], names=known[:2]))

    def move(self, v: Array) -> None:
        """Move by one period with joint velocities v."""
        state = self.state
        state.move(state.t + self.period, state.q + self.period * v, v)

    def error(self) -> float:
        """Distance [m] of the end effector from its goal."""
        return float(np.linalg.norm(self.goal - self.state.position(self.frame)))


def _print(found: list[Strictness]) -> None:
    console = Console(highlight=False, markup=False)
    console.print("Motion of the end effector due to the posture, which has lower priority [m]")
    table = table_of_numbers((
        "max per\ntick", "last\ntick", "limits\nprevent", "final\nerror", "without\nposture",
        "at\nlimit", "over\n[rad/s]", "fail", "strict"))
    for one in found:
        lengths = (one.largest, one.final, one.missed, one.error, one.error_alone)
        table.add_row(one.label, *(f"{value:.0e}" for value in lengths), str(one.limited),
                      f"{one.excess:.0e}", str(one.failed), "yes" if one.met else "no")
    console.print(table)
    console.print(said(found))


def said(found: list[Strictness]) -> str:
    """Return in a sentence which resolvers are strict."""
    met = [one.label for one in found if one.met]
    missed = [f"{one.label} ({one.largest:.0e} m)" for one in found if not one.met]
    parts = [f"with {listed(met)} the posture moves the end effector by at most {AIM:g} m per "
             "tick"] if met else []
    parts += [f"not with {listed(missed)}"] if missed else []
    return f"Result: {'; '.join(parts)}."
