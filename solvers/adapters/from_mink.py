"""Tasks and limits of mink (extra `adapters`) as a Hierarchy."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hierarchy.problem import Hierarchy
from solvers.adapters.displacements import Packed, Pull, Solve, Task, Tasks

if TYPE_CHECKING:
    from mink import Configuration, Limit
    from mujoco import MjModel


def hierarchy(configuration: Configuration, tasks: Tasks, dt: float,
              limits: Iterable[Limit] | None = None,
              constraints: Iterable[Task] | None = None, damping: float | None = None,
              solve: Solve | None = None) -> Hierarchy:
    """Return the problem of `mink.build_ik` as levels: limits, constraints, then the tasks.

    The unknown is the velocity (nv,); dt [s]. The order of `tasks` is their priority; an entry may
    be a sequence of tasks that share a level, weighted by their costs. Without `limits` the joint
    ranges of the model are used, as in mink.

    damping, solve : as `solvers.adapters.from_pink.hierarchy` takes them.

    Raises HierarchyError: limits of a joint that contradict each other (ContradictionError), as
    when it is further outside its range than its velocity limit makes good in dt; lm_damping
    without `damping`, or a task that has neither rows nor a cost that is positive definite.
    """
    return packed(configuration, tasks, dt, limits, constraints, damping, solve).hierarchy()


def packed(configuration: Configuration, tasks: Tasks, dt: float,
           limits: Iterable[Limit] | None, constraints: Iterable[Task] | None,
           damping: float | None, solve: Solve | None) -> Packed:
    """Return the levels of `hierarchy`, which takes the same arguments, as they were packed."""
    if limits is None:
        from mink import ConfigurationLimit

        limits = [ConfigurationLimit(configuration.model)]
    found = [(type(limit).__name__, limit.compute_qp_inequalities(configuration, dt))
             for limit in limits]
    given = [(name, one.G, one.h) for name, one in found if not one.inactive]
    n = configuration.model.nv
    pull = None if damping is None else Pull(damping, np.zeros(n))
    return Packed(configuration, partial(_joints, configuration.model), n, dt, given,
                  list(constraints or ()), tasks, pull, solve=solve)


def _joints(model: MjModel) -> list[str]:
    """Return the joint of each velocity (nv,), numbered where it has several."""
    joints = [int(model.dof_jntid[i]) for i in range(model.nv)]
    return [f"{model.joint(j).name or f'joint {j}'}"
            + (f" {i - int(model.jnt_dofadr[j]) + 1}" if joints.count(j) > 1 else "")
            for i, j in enumerate(joints)]
