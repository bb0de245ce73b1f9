"""Tasks and limits of mink (extra `adapters`) as a Hierarchy."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hierarchy.problem import Hierarchy
from solvers.adapters import displacements


def hierarchy(configuration: Any, tasks: Iterable[Any], dt: float,
              limits: Iterable[Any] | None = None,
              constraints: Iterable[Any] | None = None) -> Hierarchy:
    """Return what `mink.build_ik` would weigh, as levels: limits, constraints, then the tasks.

    Unknown is the velocity (nv,). The order of `tasks` is their priority; an entry may be a list of
    tasks, which share a level and are weighted by their costs. Without `limits` the joint ranges of
    the model are taken, as in mink.

    Raises
    ------
    HierarchyError : lm_damping, or a task without error and Jacobian (the regularisation by kinetic
        energy), which weigh against all else and have no place in a strict order.
    """
    if limits is None:
        from mink import ConfigurationLimit

        limits = [ConfigurationLimit(configuration.model)]
    found = [limit.compute_qp_inequalities(configuration, dt) for limit in limits]
    pairs = [(one.G, one.h) for one in found if not one.inactive]
    return displacements.hierarchy(configuration, configuration.model.nv, dt, pairs,
                                   list(constraints or ()), tasks)
