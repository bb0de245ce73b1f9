"""The experiments of the first TPM paper: errors on random arms, and growth of the time of a solve.

F. Flacco, "The Tasks Priority Matrix: a new tool for hierarchical redundancy resolution" (2016).
The arms are regular, near-singular, damped, conflicting; errors are those of tasks and of x.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import nan
from typing import Any, final

import numpy as np
from scipy.spatial.transform import Rotation

from benchmark import figures, report
from benchmark.packages import OWN, Entrant
from benchmark.report import Column, Report, Row, Section, Table, percent, power, short, whole, wide
from benchmark.solve import oracle
from benchmark.solve.entrants import ENTRANTS, NUMPY
from benchmark.solve.interface import Solver
from benchmark.timing import take_turns
from benchmark.worker import load
from hierarchy.problem import Array, Hierarchy
from scenarios.problems.families import answer
from solvers import certify

REGULAR = 0.05           # smallest singular value [m or 1] of a regular Jacobian
NEAREST = 1e-7           # smallest singular value [m or 1] that is accepted near a singularity
_LENGTH = 0.5            # [m] the longest a and d of a link
_STEPS = (1e-6, 1e-2)    # [rad] from a singular configuration
_BISECTIONS = 60
_BATCHES = 1000          # largest number of draws
DAMPING, THRESHOLD = 0.05, 0.1  # the letter's code
_TARGETS = 1.0                  # [m/s or rad/s] the largest target of a row
_SEED = 0
_REST, _CROSSED, _FULL = ((0, 1), (2, 3), (4, 5)), ((0, 1), (1, 2), (3, 4)), (
    (0, 1), (1, 2), (3, 4), (5, 0))
_NOTES = """\
Errors: norm of a task's violation [m/s and rad/s], over the least that it can have; x: distance \
to the proved answer over 1 + |x|, on a sample; for damped cases to that of numpy's SVD. cert: \
share of the sample that `certify` accepts. fail: not called solved. Arms: random \
Denavit-Hartenberg tables, alpha of -90, 0, 90 deg in one half and any in the other, a and d up \
to 0.5 m; targets up to 1 m/s or rad/s."""


def jacobians(arms: Array, q: Array) -> Array:
    """Jacobians (N, 6, 6) of the end effectors at q (N, 6) [rad]: position, then rotation.

    arms : (N, 3, 6) standard Denavit-Hartenberg a, d [m] and alpha [rad] of their joints.
    """
    (a, d, alpha), (count, n) = arms.swapaxes(0, 1), q.shape
    R, p = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    axes, origins = np.empty((count, n, 3)), np.empty((count, n, 3))
    for i in range(n):
        axes[:, i], origins[:, i] = R[:, :, 2], p
        R = R @ Rotation.from_euler("z", q[:, i, None]).as_matrix()
        p = p + a[:, i, None] * R[:, :, 0] + d[:, i, None] * R[:, :, 2]
        R = R @ Rotation.from_euler("x", alpha[:, i, None]).as_matrix()
    return np.concatenate([np.cross(axes, p[:, None] - origins), axes], axis=2).swapaxes(1, 2)


def regular(count: int, rng: np.random.Generator) -> Array:
    """Return Jacobians (N <= count, 6, 6) with no singular value below REGULAR."""
    J = jacobians(draw(count, rng), rng.uniform(-np.pi, np.pi, (count, 6)))
    return J[np.linalg.svdvals(J)[:, -1] >= REGULAR]


def near_singular(count: int, rng: np.random.Generator) -> Array:
    """Return Jacobians (N <= count, 6, 6) between 1e-6 and 1e-2 rad from a singular configuration.

    Bisection finds a singular configuration between two whose determinants differ in sign; a step
    of log-uniform length leads away from it. The smallest singular value stays above NEAREST, the
    others above REGULAR.
    """
    arms, (low, high) = draw(count, rng), rng.uniform(-np.pi, np.pi, (2, count, 6))
    J = jacobians(arms, low)
    begin = np.linalg.det(J)
    apart = begin * np.linalg.det(jacobians(arms, high)) < 0.0
    apart &= np.linalg.svdvals(J)[:, -1] >= REGULAR  # some arms are singular everywhere
    arms, low, high, begin = arms[apart], low[apart], high[apart], begin[apart]
    along = (high - low) / np.linalg.norm(high - low, axis=1, keepdims=True)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        before = (np.sign(np.linalg.det(jacobians(arms, middle))) == np.sign(begin))[:, None]
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    step = np.exp(rng.uniform(np.log(_STEPS[0]), np.log(_STEPS[1]), (len(low), 1)))
    J = jacobians(arms, low + step * along)
    s = np.linalg.svdvals(J)
    return J[(s[:, -2] >= REGULAR) & (s[:, -1] >= NEAREST)]


def draw(count: int, rng: np.random.Generator) -> Array:
    """Draw arms (N, 3, 6): a, d up to 0.5 m; alpha of -90, 0, 90 deg in a half, any in the rest."""
    square = rng.choice([-0.5 * np.pi, 0.0, 0.5 * np.pi], (count, 6))
    alpha = np.where(rng.random((count, 1)) < 0.5, square, rng.uniform(-np.pi, np.pi, (count, 6)))
    a, d = rng.uniform(0.0, _LENGTH, (2, count, 6))
    return np.stack([a, d, alpha], axis=1)


@final
@dataclass(frozen=True)
class Case:
    """One kind of arm and of tasks.

    tasks : for each task, rows of the end effector's Jacobian: 0 to 2 position, 3 to 5 rotation. A
        row that an upper task has too conflicts with it, since the targets differ.
    jacobians : draws Jacobians (N, 6, 6), up to a count.
    """

    name: str
    title: str
    tasks: tuple[tuple[int, ...], ...]
    jacobians: Callable[[int, np.random.Generator], Array]
    damping: float = 0.0


CASES = (
    Case("regular", "Regular arms, three tasks of two rows", _REST, regular),
    Case("near-singular", "Near a singularity, undamped", _REST, near_singular),
    Case("damped", f"Near a singularity, damped by {DAMPING:g} below {THRESHOLD:g}", _REST,
         near_singular, DAMPING),
    Case("conflict", "Task 2 conflicts with a row of task 1", _CROSSED, regular),
    Case("crowded", "The same with a fourth task: eight rows, no redundancy left", _FULL, regular),
)


def entrants(damping: float = 0.0) -> list[Entrant]:
    """Return every resolver in each form that differs for equalities; numpy, without damping."""
    settings = {"damping": damping, "threshold": THRESHOLD}
    ours = [one for one in ENTRANTS if one.adapter.endswith("ours:Ours")
            and one.options.get("backend", "proxqp") == "proxqp"]
    return [*(one for one in ENTRANTS if one.label == NUMPY and not damping),
            *(Entrant(one.label, OWN, one.adapter, {**one.options, **settings}) for one in ours),
            Entrant("reverse in-order", OWN, ours[0].adapter,
                    {"resolver": "reverse", "form": "in-order", **settings})]


def accuracy(arms: int = 10_000, checked: int = 300) -> Report:
    """Resolve `arms` of every case with all resolvers.

    `checked` of the arms are also compared with the proved x, and certified.
    """
    rows, tables = list[Row](), []
    for case in CASES:
        report.tell(f"{case.title} ...")
        problems, least = hierarchies(case, arms)
        right = [oracle.solve(h, case.damping, THRESHOLD) if case.damping else answer(h).x
                 for h in problems[:max(1, min(checked, arms))]]
        found = [{"case": case.name, "entrant": one.label, "arms": arms, "checked": len(right),
                  **_errors(load(one.adapter)(**one.options), case, problems, least, right)}
                 for one in entrants(case.damping)]
        columns = [Column(f"{over}\n{key}", f"task_{k + 1}_{key}", power)
                   for k in range(len(case.tasks))
                   for key, over in (("mean", f"task {k + 1}"), ("max", ""))]
        tables.append(Table(f"{case.title}; {arms} arms", found, (
            *columns, Column("x\nmax", "x_max", power), Column("cert", "certified", percent),
            *([Column("fail", "failed", whole)] if any(row["failed"] for row in found) else []))))
        rows += found
    return Report("Errors on random arms", [Section("Errors", tables, _NOTES)], {"errors": rows})


def hierarchies(case: Case, count: int) -> tuple[list[Hierarchy], Array]:
    """Return the problems of a case, and the smallest possible violation (count, L) of each task.

    Rows of upper tasks are always met, and all other rows can be met, so a repeated row is missed
    by the difference of its targets.
    """
    order = [row for task in case.tasks for row in task]
    sizes = np.array([len(task) for task in case.tasks])
    rng, J = np.random.default_rng(_SEED), np.empty((0, 6, 6))
    for _ in range(_BATCHES):
        J = np.concatenate([J, case.jacobians(count, rng)])
        if len(J) >= count:
            break
    A = np.ascontiguousarray(J[:count, order])
    b = np.random.default_rng(_SEED + 1).uniform(-_TARGETS, _TARGETS, (count, len(order)))
    off = b - b[:, [order.index(row) for row in order]]
    least = np.sqrt(np.add.reduceat(off**2, np.cumsum(sizes) - sizes, axis=1))
    return [Hierarchy(A[i], b[i], b[i], sizes) for i in range(count)], least


def _errors(solver: Solver, case: Case, problems: Sequence[Hierarchy], least: Array,
            right: Sequence[Array]) -> Row:
    """Solve every problem; return errors of tasks and x, and the shares certified and failed."""
    answered = [solver.read(solver.solve(solver.prepare(h))) for h in problems]
    solved = np.array([one.solved for one in answered])
    errors = np.array([abs(h.violations(one.x) - lowest) for h, one, lowest in zip(
        problems, answered, least, strict=True)])[solved]
    sample = [(h, one.x, x) for h, one, x in zip(problems, answered, right, strict=False)
              if one.solved]
    columns = {f"task_{k + 1}": errors[:, k] for k in range(len(case.tasks))} | {"x": [
        np.linalg.norm(x - best) / (1.0 + np.linalg.norm(best)) for _, x, best in sample]}
    certified = sum(certify(h, x).certified for h, x, _ in sample)
    return {"failed": int((~solved).sum()),
            **{f"{name}_{key}": float(of(values)) if len(values) else nan
               for name, values in columns.items()
               for key, of in (("mean", np.mean), ("median", np.median), ("max", np.max))},
            "certified": nan if case.damping else certified / len(right)}


Size = tuple[int, int, int]  # joints, tasks, rows of each
FIRST_PAPER: dict[str, tuple[Size, ...]] = {
    "tasks": tuple((30, count, 3) for count in range(1, 11)),
    "joints": tuple((n, 5, 3) for n in (20, 30, 45, 70, 100, 150, 200, 300))}
LARGER: dict[str, tuple[Size, ...]] = {
    "tasks": tuple((70, count, 3) for count in (1, 2, 3, 4, 5, 7, 10, 14, 20)),
    "rows": tuple((100, 5, each) for each in (1, 2, 3, 4, 6, 9, 14, 20)),
    "joints": tuple((n, 5, 3) for n in (6, 7, 10, 15, 20, 30, 45, 70, 100, 150, 200, 300))}
LEVEL_LESS = ("augmented", "merged", "weighted")  # not timed: no priorities
_GROWTH_NOTES = """\
Times: one call from Python, one core, all resolvers in turns; power: slope of the upper half of \
sizes, log over log."""


def growth(seconds: float = 40.0, larger: bool = False) -> Report:
    """Time all resolvers with priorities at every size for `seconds` [s] in total.

    The sizes are those of the first paper, or `larger`.
    """
    sizes = LARGER if larger else FIRST_PAPER
    rows = take_turns([one for i, figure in enumerate(sizes)
                       for one in _field(figure, sizes[figure], i)], seconds)
    panels, tables = {}, []
    for figure, ((joints, tasks, each), *_) in sizes.items():
        words = {"joints": f"{joints} joints", "tasks": f"{tasks} tasks",
                 "rows": f"{each} rows a task"}
        fixed = ", ".join(text for key, text in words.items() if key != figure)
        some = [row for row in rows if row["figure"] == figure]
        made, columns = wide(some, "entrant", figure, {"": "median_us"}, short)
        powers = figures.exponents(some, figure)
        tables.append(Table(
            f"Median time of a solve [us], {fixed}, over the number of {figure}",
            [{**row, "power": powers[row["entrant"]]} for row in made],
            [*columns, Column("power", "power")]))
        panels[figure] = f"number of {figure}", figure[0], fixed
    return Report("Growth of the time of a solve", [Section(
        "Median times", tables, _GROWTH_NOTES, {"growth": figures.over_sizes(rows, panels)})],
        {"growth": rows})


def _field(figure: str, sizes: Sequence[Size], seed: int) -> list[tuple[Row, Callable[[], Any]]]:
    solvers = {one.label: load(one.adapter)(**one.options) for one in entrants()
               if one.label not in LEVEL_LESS}
    found: list[tuple[Row, Callable[[], Any]]] = []
    for i, (joints, tasks, each) in enumerate(sizes):
        rng = np.random.default_rng(seed + i)  # almost surely of full rank, with joints enough
        b = rng.normal(size=each * tasks)
        h = Hierarchy(rng.normal(size=(each * tasks, joints)), b, b, np.full(tasks, each))
        found += [({"figure": figure, "entrant": label, "joints": joints, "tasks": tasks,
                    "rows": each if figure == "rows" else each * tasks},
                   partial(solver.solve, solver.prepare(h)))
                  for label, solver in solvers.items()]
    return found
