"""Run pink's own examples, and ask our `solve_ik` at each tick what pink is asked.

Takes the folder `examples` of a checkout of pink. Those run whose robot lies beside them or in
`example_robot_data` (extra `robots`), without viewer and clock. All tasks share one level; the
answers are compared with the proved minimum of pink's cost. Prints a table.
"""

import contextlib
import io
import runpy
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock, patch

import numpy as np
import pink
import typer

from hierarchy.problem import Array, Hierarchy
from hierarchy.robots.names import file_of
from solvers.adapters.for_pink import solve_ik
from solvers.proof import prove

STUBBED = ("meshcat", "meshcat.geometry", "meshcat.transformations", "meshcat_shapes",
           "pink.visualization", "loop_rate_limiters", "robot_descriptions",
           "robot_descriptions.loaders", "robot_descriptions.loaders.pinocchio", "viser",
           "viser.uplot", "trimesh", "pinocchio.visualize")
ROBOTS = {"ur3_official": "ur3_robot", "ur5_official": "ur5_robot", "ur10_official": "ur10_robot",
          "gen2": "kinova", "panda": "panda", "z1": "z1", "g1": "g1_29dof_rev_1_0", "go2": "go2"}
PINK: Callable[..., Array] = pink.solve_ik


class Enough(Exception):  # noqa: N818 - not an error
    """The example has run for as many ticks as were asked."""


def least_squares(tasks: Iterable[Any], barriers: Iterable[Any], configuration: Any,
                  damping: float) -> tuple[Array, Array]:
    """Return A, b such that |A dq - b|^2 is pink's cost, with its damping as rows."""
    n = configuration.model.nv
    rows, sides, weights = [], [], [(damping, np.zeros(n))]
    for task in tasks:
        if not hasattr(task, "compute_error"):  # the kinetic energy of mink
            rows.append(np.linalg.cholesky(task.compute_qp_objective(configuration)[0]).T)
            sides.append(np.zeros(n))
            continue
        e = task.compute_error(configuration)
        J = task.compute_jacobian(configuration).reshape(-1, n)  # pinocchio's of one joint is (k,)
        cost = np.broadcast_to(1.0 if task.cost is None else task.cost, len(e))
        rows.append(cost[:, None] * J)
        sides.append(-task.gain * cost * e)
        weights.append((task.lm_damping * sides[-1] @ sides[-1], np.zeros(n)))
    for barrier in barriers:
        H, c = barrier.compute_qp_objective(configuration)
        if H[0, 0] > 0.0:
            weights.append((H[0, 0], -c / H[0, 0]))
    for weight, centre in weights:
        rows.append(np.sqrt(weight) * np.eye(n))
        sides.append(np.sqrt(weight) * centre)
    return np.vstack(rows), np.concatenate(sides)


def exact(A: Array, b: Array, G: Array, h: Array, C: Array, d: Array, near: Array) -> Array:
    """Return the shortest x of least |A x - b| with G x <= h, C x = d, proved from the rows that
    act at `near`; ArithmeticError where that proves nothing.
    """
    kept = (np.vstack([G, C]), np.concatenate([np.full(len(h), -np.inf), d]), np.append(h, d))
    found = prove(Hierarchy.from_levels([kept, (A, b)]), [near])
    if not found.complete:
        raise ArithmeticError("the minimum could not be proved")
    return found.x


@dataclass
class Asked:
    """What was asked in the ticks of one example: times [us] and differences [rad/s]."""

    ticks: int
    every: int
    theirs: list[float] = field(default_factory=list)
    ours: list[float] = field(default_factory=list)
    off: list[tuple[float, float, float]] = field(default_factory=list)
    failed: str = ""

    def solve_ik(self, configuration: Any, tasks: Sequence[Any], dt: float, solver: str = "daqp",
                 damping: float = 1e-12, limits: Any = None, barriers: Any = None,
                 constraints: Any = None, safety_break: bool = True, **rest: Any) -> Array:
        """Answer as pink with daqp, and compare with ours."""
        tasks = list(tasks)
        given = damping, limits, barriers, constraints, safety_break
        calls = {"theirs": lambda: PINK(configuration, tasks, dt, "daqp", *given),
                 "ours": lambda: solve_ik(configuration, [tasks], dt, "hcod", *given)}
        order = list(calls)[::1 if len(self.ours) % 2 else -1]
        answers = {}
        if not self.ours:  # it compiles
            calls["ours"]()
        for name in order:
            start = perf_counter()
            answers[name] = calls[name]()
            getattr(self, name).append(1e6 * (perf_counter() - start))
        if len(self.ours) % self.every == 1:
            self.compare(configuration, tasks, dt, given, answers)
        if len(self.ours) >= self.ticks:
            raise Enough
        return np.asarray(answers["theirs"])

    def compare(self, configuration: Any, tasks: list[Any], dt: float, given: Any,
                answers: dict[str, Array]) -> None:
        """Note how far ours and pink's answer are from the minimum, and what rounding may do."""
        damping, limits, barriers, constraints, _ = given
        problem = pink.build_ik(configuration, tasks, dt, damping, limits, barriers, constraints)
        A, b = least_squares(tasks, barriers or (), configuration, damping)
        n = A.shape[1]
        G, h = (problem.G, problem.h) if problem.G is not None else (np.empty((0, n)), np.empty(0))
        C, d = (problem.A, problem.b) if problem.A is not None else (np.empty((0, n)), np.empty(0))
        x = exact(A, b, G, h, C, d, dt * answers["ours"]) / dt
        values = np.linalg.svd(A, compute_uv=False)
        doubt = 2e-16 * (values[0] / values[-1]) ** 2 * np.abs(x).max()
        self.off.append((float(np.abs(answers["ours"] - x).max()),
                         float(np.abs(answers["theirs"] - x).max()), float(doubt)))


def _robot(name: str, root_joint: Any = None, **_: Any) -> Any:
    """Stand in for robot_descriptions: the robot of example_robot_data."""
    import pinocchio as pin

    path = str(file_of(f"example_robot_data:{ROBOTS[name.removesuffix('_description')]}"))
    model = pin.buildModelFromUrdf(path, *([] if root_joint is None else [root_joint]))
    return pin.RobotWrapper(model, pin.GeometryModel(), pin.GeometryModel())


def run(path: Path, ticks: int, every: int) -> Asked:
    """Run one example."""
    asked = Asked(ticks, every)
    with patch.object(pink, "solve_ik", asked.solve_ik), contextlib.redirect_stdout(io.StringIO()):
        try:
            runpy.run_path(str(path), run_name="__main__")
        except Enough:
            pass
        except (Exception, SystemExit) as error:
            asked.failed = f"{type(error).__name__}: {error}".splitlines()[0]
    return asked


def _stub() -> None:
    """Take viewers, clocks and downloads out of the way of the examples."""
    import coal

    stubs = {name: MagicMock() for name in STUBBED} | {"hppfcl": coal}  # coal's former name
    stubs["loop_rate_limiters"].RateLimiter = lambda frequency=200.0, **_: SimpleNamespace(
        period=1.0 / frequency, dt=1.0 / frequency, sleep=lambda: None)
    stubs["robot_descriptions.loaders.pinocchio"].load_robot_description = _robot
    sys.modules.update(stubs)


def main(examples: Path, ticks: int = 300, every: int = 10, only: str = "") -> None:
    """Print the table; every : ticks between two exact minima; only : part of a path."""
    _stub()
    sys.argv[1:] = []
    warnings.simplefilter("ignore")
    print("| example | pink [us] | ours [us] | ours off | pink off | rounding of P |")
    print("|---|---|---|---|---|---|")
    for path in sorted(path for path in examples.rglob("*.py") if only in str(path)):
        asked, name = run(path, ticks, every), path.relative_to(examples)
        if not asked.off:
            print(f"{name}: not run: {asked.failed}", file=sys.stderr)
            continue
        cells = [f"{np.median(t):.0f} ({np.percentile(t, 95):.0f})"
                 for t in (asked.theirs, asked.ours)]
        cells += [f"{worst:.0e}" for worst in np.max(asked.off, axis=0)]
        print(f"| {name} | {' | '.join(cells)} | {asked.failed}", flush=True)


if __name__ == "__main__":
    typer.run(main)
