"""Transition from one stack to the next without a jump: a convex combination of their answers.

Each answer keeps every row that all stacks share at the same or a higher priority, so a convex
combination keeps it too; the same holds for bounds. Where one equality task enters or leaves, this
is the intermediate desired value approach of Lee, Mansard, Park, "Intermediate desired value
approach for task transition of robots in kinematic control" (T-RO 2012): the answer of the stack
with the task, its target b replaced by h b + (1 - h) J x, where x is the answer without it. This
holds for undamped answers; damping is not linear in b.
"""

from typing import Any, NamedTuple, final

from hierarchy import Stack, State
from hierarchy.allocation import AVOIDANCE
from hierarchy.problem import Array, Hierarchy
from solvers import Resolution, Resolver, Status

_MOST = 6  # stacks that are solved; of one alone the answer would jump
_NO_WEIGHT = 1e-6  # stacks with a smaller weight are not solved


class Key(NamedTuple):
    """Identifies a stack: its order, and the active point if it has an avoidance task."""

    order: tuple[str, ...]
    active: int = -1


@final
class Blend:
    """Weights the stacks of the last `time` [s] and combines their answers.

    The weight of a stack is the integral over its past of the kernel 6 s (1 - s), where s is the
    age over `time`: after a single change the weight of the new stack rises as the smoothstep
    s^2 (3 - 2 s), and overlapping changes add up. Weights have continuous derivatives, are not
    negative and sum to one. The `_MOST` heaviest stacks are solved; their weights, minus the first
    one left out, are scaled to sum to one again, also where a former stack has no answer. `weight`
    is that of the present stack in the last answer.
    """

    def __init__(self, time: float) -> None:
        self.weight, self._time = 1.0, time
        self.visits: list[tuple[Key, float]] = []
        self._memories: dict[Key, Any] = {}

    def resolve(self, resolver: Resolver, stack: Stack, state: State,
                order: tuple[str, ...], hierarchy: Hierarchy) -> tuple[Resolution, Array]:
        """Return the resolution of the present stack and the combined answer x (n,).

        `hierarchy` has the rows of `order` at `state`, before and after the call.
        """
        seen = state.measurement
        active = seen.active if seen is not None and AVOIDANCE in order else -1
        present = Key(order, active)
        shares = self._shares(present, state.t)
        own, former = shares.pop(present, 0.0), {}
        for key in shares:
            former[key] = self._solve(resolver, key, _rows(stack, state, key))
        if former:
            stack.hierarchy(state, order)
        resolution = self._solve(resolver, present, hierarchy)
        solved = [key for key in former if former[key].status is Status.SOLVED]
        total = own + sum(shares[key] for key in solved)
        if not solved or total == 0.0:
            self.weight = 1.0
            return resolution, resolution.x
        self.weight = own / total
        x = self.weight * resolution.x
        for key in solved:
            x += shares[key] / total * former[key].x
        return resolution, x

    def weights(self, t: float, present: Key) -> dict[Key, float]:
        """Return the weight of each stack at time t [s], with `present` active from now on."""
        visits = self.visits
        if not visits or visits[-1][0] != present:
            visits.append((present, t))
        while len(visits) > 1 and t - visits[1][1] >= self._time:
            del visits[0]
        ages = (min((t - since) / self._time, 1.0) for _, since in visits[1:])
        risen = [1.0, *(s * s * (3.0 - 2.0 * s) for s in ages), 0.0]  # the smoothstep
        found: dict[Key, float] = {}
        for (key, _), here, after in zip(visits, risen[:-1], risen[1:], strict=True):
            found[key] = found.get(key, 0.0) + here - after
        return found

    def _shares(self, present: Key, t: float) -> dict[Key, float]:
        """Return the heaviest stacks and their weights, which need not sum to one."""
        if len(self.visits) == 1 and self.visits[0][0] == present:
            return {present: 1.0}
        ranked = sorted(self.weights(t, present).items(), key=lambda item: -item[1])
        # Minus the first weight left out, so that nothing jumps when two stacks change places.
        least = ranked[_MOST][1] if len(ranked) > _MOST else 0.0
        return {key: weight - least for key, weight in ranked[:_MOST]
                if weight - least > _NO_WEIGHT}

    def _solve(self, resolver: Resolver, key: Key, hierarchy: Hierarchy) -> Resolution:
        resolution = resolver.solve(hierarchy, self._memories.get(key))
        self._memories[key] = resolution.memory
        return resolution


def _rows(stack: Stack, state: State, key: Key) -> Hierarchy:
    """Write a former stack's rows at the present state, with its own active point."""
    seen = state.measurement
    if seen is None:
        return stack.hierarchy(state, key.order)
    active, seen.active = seen.active, key.active
    rows = stack.hierarchy(state, key.order)
    seen.active = active
    return rows
