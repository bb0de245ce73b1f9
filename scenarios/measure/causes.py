"""Why a command jumped from one tick to the next: what lies between their hierarchies.

All data are interpolated between the two ticks, and the interval is bisected toward the larger
change of the answer.

- vertex: the change stays however small the interval. The strict optimum itself jumps: on almost
  the same data, a level that is missed gains next to nothing by another answer far away.
- side, data, reference: with those of one level as they were before, most of the change is gone.
- miss: a level changed between met and missed, a steep but continuous stretch.
- stack, status, other: the levels or rows are others, a tick was not solved, or the command was not
  the resolver's answer.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.explain import is_missed

Solve = Callable[[Hierarchy], Array]

_NARROW = 2.0**-33  # width of the interval at which the bisection ends
_STAYS = 0.1        # share of the change that stays in it if the optimum jumps
_MAIN = 0.3         # the same if it jumps for no other reason; it may jump twice on the way
_EXPLAINS = 0.5     # share of the change that is left, at most, without what explains it
_MISSED = 1e-7      # of the size of its terms: a level beyond counts as missed
_SAME = 1e-3        # of a miss: two answers that differ by more are not both optimal


class Tick(NamedTuple):
    """A hierarchy, the answer x (n,), and the command effect[:, :n] @ x + effect[:, n]."""

    h: Hierarchy
    x: Array
    effect: Array

    def command(self, x: Array) -> Array:
        """Return the command of an answer."""
        return np.asarray(self.effect[:, :-1] @ x + self.effect[:, -1])


class Cause(NamedTuple):
    """A kind, see the module, and what is to be said."""

    kind: str
    text: str


def causes(before: Tick, after: Tick, solve: Solve) -> Iterator[Cause]:
    """Yield why the command changed from one tick to the next, most telling first."""
    if changed := list(_others(before.h, after.h)):
        yield from changed
        return
    total = _apart(before.command(before.x), after.command(after.x))
    at, low, high = _bisected(before, after, solve)
    left = _apart(at.command(low), at.command(high))
    if left <= _MAIN * total:
        yield from _moved(before, after, solve, total)
        for k, name in enumerate(before.h.names):
            missed = [is_missed(one.h, one.x, k, _MISSED) for one in (before, after)]
            if missed[0] != missed[1]:
                by = (before, after)[missed[1]]
                how = "from met to missed by {:.3g}" if missed[1] else (
                    "from missed by {:.3g} to met")
                yield Cause("miss", f"{name} changed " + how.format(by.h.violations(by.x)[k]))
    if left > _STAYS * total:
        kind, text = _vertex(before, after, at.h, low, high)
        yield Cause(kind, f"{text}, {left:.3g} of the {total:.3g} apart")


def _others(h: Hierarchy, other: Hierarchy) -> Iterator[Cause]:
    """Yield what makes two hierarchies incomparable: levels, rows, or sides that come and go."""
    if h.names != other.names:
        yield Cause("stack", f"the levels were {', '.join(h.names)} and are "
                             f"{', '.join(other.names)}")
    elif h.m != other.m or (h.sizes != other.sizes).any():
        yield Cause("stack", f"the levels had {h.sizes.tolist()} rows and have "
                             f"{other.sizes.tolist()}")
    else:
        for side in ("lower", "upper"):
            came = np.isfinite(getattr(other, side)).astype(int) - np.isfinite(getattr(h, side))
            for i in np.flatnonzero(came)[:3].tolist():
                yield Cause("stack", f"the {side} side of {_row(h, i)} "
                                     f"{'appeared' if came[i] > 0 else 'vanished'}")


def _apart(command: Array, other: Array) -> float:
    return float(np.abs(command - other).max(initial=0.0))


def _between(before: Tick, after: Tick, share: float) -> Tick:
    """Return what lies between two ticks with the same rows; the answer is that before."""
    def mixed(old: Array, new: Array) -> Array:
        return np.where(np.isinf(new), new, (1.0 - share) * old + share * np.nan_to_num(new))

    h, other = before.h, after.h
    return Tick(h.changed(**{part: mixed(getattr(h, part), getattr(other, part))
                             for part in ("A", "lower", "upper", "reference")}),
                before.x, mixed(before.effect, after.effect))


def _bisected(before: Tick, after: Tick, solve: Solve) -> tuple[Tick, Array, Array]:
    """Return a narrow interval in which the command changes much, and the answers at its ends.

    The answers at the ends of the whole are those of the run.
    """
    low, high, x_low, x_high = 0.0, 1.0, before.x, after.x
    command_low, command_high = before.command(x_low), after.command(x_high)
    while high - low > _NARROW:
        middle = 0.5 * (low + high)
        tick = _between(before, after, middle)
        x = solve(tick.h)
        command = tick.command(x)
        if _apart(command_low, command) >= _apart(command, command_high):
            high, x_high, command_high = middle, x, command
        else:
            low, x_low, command_low = middle, x, command
    return _between(before, after, low), x_low, x_high


def _vertex(before: Tick, after: Tick, h: Hierarchy, low: Array, high: Array) -> Cause:
    """Say which level gains how little by jumping from one answer to the other."""
    miss = h.violations(low)
    gain, noise = np.abs(miss - h.violations(high)), 1e-12 * miss + 100.0 * _NARROW * np.abs(
        after.h.violations(after.x) - before.h.violations(before.x))
    missed = [k for k in range(len(h.names)) if is_missed(h, low, k, _MISSED)]
    pays = next((k for k in missed if gain[k] > _SAME * miss[k]), len(h.names))
    alike = [k for k in missed if k < pays]
    if not alike:
        return Cause("other", "one of two answers to the same data was not sent as it is, or "
                              "depends on the tick before: they are not alike")
    k = next((k for k in alike if gain[k] > noise[k]), alike[-1])
    return Cause("vertex", f"{h.names[k]}, missed by {miss[k]:.3g}, sits at a vertex: it gains "
                           f"{gain[k]:.1g} by another answer to the same data")


def _moved(before: Tick, after: Tick, solve: Solve, total: float) -> Iterator[Cause]:
    """Yield the level, or the reference, without whose change most of the step is gone."""
    h, other, start = before.h, after.h, before.command(solve(before.h))
    left = {}
    for k in range(len(h.sizes)):
        rows = slice(h.offsets[k], h.offsets[k + 1])
        old = {part: getattr(other, part).copy() for part in ("A", "lower", "upper")}
        for part, values in old.items():
            values[rows] = getattr(h, part)[rows]
        left[k] = _apart(start, after.command(solve(other.changed(**old))))
    left[-1] = _apart(start, after.command(solve(other.changed(reference=h.start()))))
    k = min(left, key=lambda one: left[one])
    if left[k] <= _EXPLAINS * total:
        cause = _largest(before, after, k) if k >= 0 else Cause("reference", "the reference moved")
        yield Cause(cause.kind, f"{cause.text}; without that the change is {left[k]:.2g}")


def _largest(before: Tick, after: Tick, k: int) -> Cause:
    """Return how a level's data moved: the side that did so most of those that act, or its rows."""
    h, other, rows = before.h, after.h, np.arange(before.h.offsets[k], before.h.offsets[k + 1])
    turned = float(np.abs((other.A - h.A)[rows] @ after.x).max(initial=0.0))
    found = []
    for side in ("lower", "upper"):
        old, new = getattr(h, side)[rows], getattr(other, side)[rows]
        acts = [np.abs(one.h.A[rows] @ one.x - values) <= _MISSED * (1.0 + np.abs(values))
                for one, values in ((before, old), (after, new))]
        moved = np.where((acts[0] | acts[1]) & np.isfinite(old),
                         np.abs(np.nan_to_num(new) - np.nan_to_num(old)), 0.0)
        i = int(moved.argmax())
        found.append((float(moved[i]), side, rows[i], float(old[i]), float(new[i])))
    by, side, i, was, now = max(found)
    if by <= turned:
        return Cause("data", f"the rows of {h.names[k]} changed")
    called = "target" if (h.lower[rows] == h.upper[rows]).all() else f"{side} side"
    return Cause("side", f"{called} of {_row(h, i)} moved by {by:.3g}, from {was:.4g} to {now:.4g}")


def _row(h: Hierarchy, i: int) -> str:
    k = int(np.searchsorted(h.offsets, i, side="right")) - 1
    name = f"row {i - h.offsets[k]}" if h.named is None else h.named()[i]
    return f"{name} in {h.names[k]}"
