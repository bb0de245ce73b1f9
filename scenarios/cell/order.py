"""The selection and order of the tasks in the stack of a tick."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import product
from math import inf, nan
from typing import Protocol, final

from hierarchy import Task
from hierarchy.allocation import POINTING, POSITION, Allocation, allocate
from hierarchy.avoidance import Measurement, SurveillanceAreas
from scenarios.config import Scenario
from scenarios.config.avoidance import AvoidanceSection


class Order(Protocol):
    """The selection and order of the tasks in the stack of a tick."""

    @property
    def possible(self) -> Iterable[tuple[str, ...]]:
        """Every possible order."""

    def __call__(self, seen: Measurement | None, cone_error: float) -> Allocation:
        """Return the order for measured distances and the cone error cos(alpha_d) - cos(alpha)."""


@final
class Hierarchical:
    """All tasks in every tick."""

    def __init__(self, names: Sequence[str]) -> None:
        self._allocation = Allocation(tuple(names), repulsion=False)
        self.possible = [self._allocation.order]

    def __call__(self, seen: Measurement | None, cone_error: float) -> Allocation:
        """Return the order, regardless of measurement and cone error."""
        return self._allocation


@final
class Switched:
    """Algorithm 1, below the tasks named `first`; without `areas` only the cone is switched.

    Without areas `tip` [m] is the distance within which the position has the repulsion of (30).
    With `always_point` the cone is an equality that is always in the stack.
    """

    def __init__(self, areas: SurveillanceAreas | None, always_point: bool,
                 first: Sequence[str] = (), position: bool = True, tip: float = -inf) -> None:
        self._areas, self._always_point, self._tip = areas, always_point, tip
        self._first, self._position = tuple(first), position
        self._behind_first = cache(self._put_behind)
        distances = (inf,) if areas is None else (areas.near, areas.far, inf)
        self.possible = {self._choose(body, end, cone).order for body, end, cone in product(
            distances, (0.0, inf), (1.0, nan))}

    def __call__(self, seen: Measurement | None, cone_error: float) -> Allocation:
        """Return the order for measured distances and the cone error cos(alpha_d) - cos(alpha)."""
        if seen is None:
            return self._choose(inf, inf, cone_error)
        return self._choose(seen.minimal_distance, seen.end_effector_distance, cone_error)

    def _choose(self, body: float, end: float, cone_error: float) -> Allocation:
        if self._areas is None:
            point = cone_error > 0.0 or self._always_point
            chosen = Allocation((POSITION,) * self._position + (POINTING,) * point,
                                repulsion=end <= self._tip)
        else:
            chosen = allocate(body, end, cone_error, self._areas, self._always_point)
        return self._behind_first(chosen) if self._first else chosen

    def _put_behind(self, chosen: Allocation) -> Allocation:
        return Allocation((*self._first, *chosen.order), chosen.repulsion)


def order_of(scenario: Scenario, areas: SurveillanceAreas | None, first: Sequence[Task],
             tasks: Sequence[Task]) -> Order:
    """Return the order of a scenario's tasks; those of `first` are always at the top."""
    if scenario.control.stack != "switched":
        return Hierarchical([task.name for task in tasks])
    always_point = bool(scenario.pointing and scenario.pointing.rows == "equality")
    section = scenario.avoidance
    tip = section.end_effector if isinstance(section, AvoidanceSection) else -inf
    return Switched(areas, always_point, [task.name for task in first],
                    scenario.position is not None, tip)
