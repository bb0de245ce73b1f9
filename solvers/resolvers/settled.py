"""Tasks out of reach come to rest: the speed that a level may ask for, at velocity level.

A level A x = b of a task takes the x that, within the levels above, minimises

    |b - A x| + alpha |x - x0|^2 / 2,    alpha = softness T |A| / 2                         (a)

x0 being the x of the levels above, a reference none of them, and |A| counting more where these bear
the pull of the residual and turn too: the minimum of |b - A x|^2 + mu |x - x0|^2 with
mu = alpha |b - A x|, or A x = b where mu would be smaller. See docs/theory/settled.md. What the
level reaches is its new right-hand side.
To second order the levels below disturb it although they keep A x: joint j may leave its speed by

    (|x - x0| (|r0| - |r|) + p |r|) / |r'| max_i |A_i| / |A_j|, r = b - A x, r0 = b - A x0    (b)

with the columns A_i of what the levels above leave of A, r' what they do not decide of r, and p a
pace that is always allowed. Likewise, a direction of what is left of A whose singular value s is
rounding beside p may change its speed by p max_i |A_i| / s. At rest the rows above that act hold
the whole pull A' r of the residual: its row depends on theirs, and is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, final

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.kernels.met import ABOVE, plainly_met
from solvers.qp.refinement import below_largest
from solvers.resolver import Around, Resolution, Resolver, number
from solvers.resolvers.hcod import ActiveSetResolution
from solvers.resolvers.merged import OneLevel
from solvers.status import Status

_LEAST = 1e-10    # of |A|^2: the least mu
_FAINT = 1e-10    # of |A|: singular values up to it are rounding
_RANK = 1e-6      # of the largest singular value: a lower one bears no pull
_CLOSE = 1e-8     # accuracy of alpha at which the search for mu ends
_MOST = 20        # its steps; 4 in the mean, at most 8 seen
_NONE = 1e-9      # of the largest column of A: a joint that a level does not use
_TURNING = 1e-3   # weight in |x - x0| of a joint that bends nothing, such as a motor before a gear
_AT_REST = 1e-5   # of the pull of a residual: what rows above that act do not hold of it
_LOST = 1e-8      # of |A|: singular values up to it are left to the pace where rows have no room
_WEAK = 1e-5      # of |A|: singular values up to it hold their directions loosely
_PACE = 1e-5      # [rad/s or m/s] p of (b)


@final
@dataclass(frozen=True, kw_only=True)
class Settled(Around):
    """Resolves as `inner`, but the levels named in `curved` come to rest where they cannot be met.

    period : T [s] for which x, a velocity, will be held.
    softness : factor of the estimate of the curvature; 0 leaves every level as it is.
    curved : names of levels of equalities whose rows, or what levels above leave of them, change
        with the configuration.
    bends : by level, the least |A| that counts in alpha, for rows that vanish together, as that of
        a height does. Inequalities come to rest where it names them.
    geared : whether joints that only other equalities use, such as motors before gears, bend
        nothing; not beside closed chains.

    Theory: the module's docstring.
    """

    period: float = number(open_below=True)
    softness: float = number(1.0)
    curved: frozenset[str] = frozenset()
    bends: Mapping[str, float] = field(default_factory=dict)
    geared: bool = False
    name = "settled"
    handles = "inequalities"

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; where a curved level is not plainly met, some problems of the levels to it."""
        one = self.inner if isinstance(self.inner, OneLevel) else None
        aimed = h if one is None else one.aimed(h, memory)
        above = self._calmed(aimed)
        if above is None:
            return self.inner.solve(h, memory)
        found = above.resolve(aimed)
        if one is not None:
            found.memory = one.carried_on(h, found.x, memory)
        return found

    def asked(self, h: Hierarchy) -> Hierarchy:
        """Return what the answer to h, a plain one, solves: the levels that were calmed as such."""
        above = self._calmed(h)
        return h if above is None else above.written(h)

    @np.errstate(over="ignore", invalid="ignore")  # what is not finite is asked for as it is
    def _calmed(self, h: Hierarchy) -> _Above | None:
        """Return the levels of h with those out of reach calmed, or None if there are none.

        None too for rows in whose singular values LAPACK would fail, or never end.
        """
        half = 0.5 * self.softness * self.period
        bends = np.array([self.bends.get(name, -1.0 + (name in self.curved)) for name in h.names])
        if (half == 0.0 or plainly_met(h.A, h.lower, h.upper, h.offsets, half, bends)
                or not below_largest(h.A)):
            return None
        above = _Above(self.inner, h)
        for (A, lower, upper), name, bend in zip(h.levels(), h.names, bends, strict=True):
            rows, equal = A, bool((lower == upper).all())
            if name in self.curved:
                above.bending.append(A)
            elif self.geared and equal:
                above.turning.append(A)
            if bend >= 0.0 and len(lower) and equal:
                A, lower, upper = above.calm(A, lower, half, bend)
            elif bend > 0.0:
                lower, upper = above.eased(A, lower, upper, half, bend)
            else:
                above.behind |= bool(((A @ above.x < lower) | (A @ above.x > upper)).any())
            above.add(A, lower, upper, rows)
            if bend >= 0.0 and equal:
                above.curved.append((rows, max(_norm(rows), bend)))
        return above if above.calmed else None


class _Reached(NamedTuple):
    """The x for one mu, its residual |b - A x|, and how the solve ended."""

    mu: float
    x: Array
    missed: float
    status: Status

    def over(self, alpha: float) -> float:
        """Return mu / |b - A x| - alpha, which grows with mu."""
        return self.mu / self.missed - alpha if self.missed > 0.0 else np.inf


class _Above:
    """The levels written so far, x down to them, and by how much levels below may change it.

    `strict` resolves levels as strict ones, `inner` all of them, and the pace above them.
    """

    def __init__(self, inner: Resolver, h: Hierarchy) -> None:
        n = h.n
        self.bending, self.turning = list[Array](), list[Array]()  # rows of curved levels, others
        self.curved = list[tuple[Array, float]]()  # those of equalities, and how fast they turn
        self.strict = self.inner = inner
        if isinstance(inner, OneLevel):
            self.strict, self.inner = inner.strictly(), inner.below_one_more(h)
        self.calmed, self.status, self.names = False, Status.SOLVED, h.names
        self.levels: list[tuple[Array, Array, Array]] = []  # as they leave room
        self.asked: list[tuple[Array, Array, Array]] = []  # as `inner` resolves them
        self.x, self._held, self._later = np.zeros(n), np.empty((0, n)), list[Array]()
        self.loose = False  # whether a level holds a direction loosely
        self.behind = False  # whether x misses a level
        self.box = np.full(n, -np.inf), np.full(n, np.inf)
        self.paced = inner.can_resolve("bounds")
        # One that resolves bounds in a first level with rows only needs all of them there.
        self.top = int((h.sizes > 0).argmax())
        self.joined = (self.paced and not inner.can_resolve("inequalities")
                       and bool((h.lower < h.upper)[:h.sizes[self.top]].any()))

    def add(self, A: Array, lower: Array, upper: Array, rows: Array) -> None:
        """Add a level, `rows` being those of h."""
        self.levels.append((A, lower, upper))
        if (lower == upper).all():
            self._later.append(A)
        if A is not rows and isinstance(self.inner, OneLevel):  # its weights count them as they are
            A, lower, upper = rows, rows @ self.x, rows @ self.x
        self.asked.append((A, lower, upper))

    def held(self) -> Array:
        """Return the directions (k, n), orthonormal, that levels of equalities have taken."""
        while self._later:
            A = self._later.pop(0)
            self._held = np.vstack([self._held, _parts(A, _beside(A, self._held))[1]])
        return self._held

    def _catch_up(self) -> None:
        """Bring x down to the last level."""
        if self.behind:
            self.x = self.strict.solve(self.stacked(self.levels, self.x)).x
            self.behind = False

    def eased(self, A: Array, lower: Array, upper: Array, half: float, bend: float
              ) -> tuple[Array, Array]:
        """Return the sides of a level of inequalities that minimises (a), as far as it gets.

        half, bend : alpha = half max(|A|, bend), A being the rows that x0 violates.
        """
        self._catch_up()

        def beyond(x: Array) -> Array:
            return np.maximum(lower - A @ x, 0.0) - np.maximum(A @ x - upper, 0.0)

        missed = beyond(self.x)
        broken, missed = A[missed != 0.0], missed[missed != 0.0]
        size, out = _norm(broken), _norm(missed)
        free = _beside(broken, self.held())
        alpha = half * self._bent(max(size, bend), missed, broken - free)
        least = _LEAST * size * size
        if not 0.0 < least < alpha * out < np.inf:
            return lower, upper
        probe = self._damped(A, lower, upper, lambda x: _norm(beyond(x)), 1.0)
        U, values, _ = np.linalg.svd(free, full_matrices=len(free) > len(self.x))
        found = _settled(probe, self._unlimited(values, missed @ U), least, alpha, alpha * out)
        step, self.x = _norm(found.x - self.x), found.x
        if found.mu == least:
            return lower, upper
        self._note(found)
        self._pace(free, found.missed, step * max(out - found.missed, 0.0) + _PACE * found.missed)
        reached, missed = A @ found.x, beyond(found.x)
        if found.mu * step < _AT_REST * _norm(missed @ A):
            return np.where(missed > 0.0, -np.inf, lower), np.where(missed < 0.0, np.inf, upper)
        room = _PACE * np.linalg.norm(A, axis=1)  # else the pace may leave one point
        return (np.where(missed > 0.0, reached - room, lower),
                np.where(missed < 0.0, reached + room, upper))

    def _bent(self, bend: float, missed: Array, taken: Array) -> float:
        """Return `bend` of a level and, per residual, that of the levels above that bear its pull.

        missed : b - A x0 (m,). taken : what the levels above take of its rows (m, n).
        """
        out = _norm(missed)
        if not self.curved or not 0.0 < out < np.inf:
            return bend
        rows = np.vstack([rows for rows, _ in self.curved])
        forces = np.asarray(np.linalg.lstsq(rows.T, missed @ taken, rcond=_RANK)[0], dtype=float)
        starts = np.cumsum([0, *(len(rows) for rows, _ in self.curved)])
        borne = sum(_norm(forces[begin:begin + len(rows)]) * above
                    for begin, (rows, above) in zip(starts[:-1], self.curved, strict=True))
        return bend + min(borne / out, ABOVE * bend)

    def _note(self, found: _Reached) -> None:
        """Note that a level does not reach what it asks for."""
        self.calmed = True
        if found.status is not Status.SOLVED:
            self.status = found.status

    def calm(self, A: Array, b: Array, half: float, bend: float) -> tuple[Array, Array, Array]:
        """Return the rows of a level A x = b that minimises (a), unchanged where it is met.

        half, bend : alpha = half max(|A|, bend).
        """
        self._catch_up()
        asked, whole = (A, b, b), _norm(A)
        if not whole * _norm(b) < np.inf:
            return asked
        free = _beside(A, self.held())
        U, values, directions = np.linalg.svd(free, full_matrices=len(A) > len(self.x))
        rank = np.count_nonzero(values > _FAINT * whole)
        values, directions = values[:rank], directions[:rank]
        own, aim, missed, taken = A, b, b - A @ self.x, A - free
        if rank < len(A):  # the rest of the residual counts, but nothing that is left changes it
            own, aim, free = (U[:, :rank].T @ part for part in (A, b, free))
        size, out = _norm(own), _norm(missed)
        alpha = half * self._bent(max(whole, bend), missed, taken)
        least = _LEAST * size * size
        if not (_FAINT * whole < size and 0.0 < least < alpha * out < np.inf):
            return asked
        counted = self._counted(free)
        probe = self._damped(own, aim, aim, lambda x: _norm(b - A @ x), counted)
        found = _settled(probe, self._unlimited(values, missed @ U), least, alpha, alpha * out)
        step, self.x = _norm(counted * (found.x - self.x)), found.x
        if found.mu == least:
            return asked
        self._note(found)
        missed = aim - own @ found.x
        self._pace(free, _norm(missed),
                   step * max(out - found.missed, 0.0) + _PACE * found.missed)
        # The first: whether it is worth a closer look.
        if (found.mu * step < _AT_REST * found.missed * size
                and found.mu * step < _AT_REST * _norm(missed @ free)):
            self._later.append(directions)
            unit = missed / np.abs(missed).max()
            unit /= _norm(unit)
            values, directions = _parts(A, free - np.outer(unit, unit @ free))
        rows, room = np.zeros_like(A), np.zeros(len(A))
        rows[:len(values)] = directions
        if self.inner.can_resolve("inequalities"):
            room[:len(values)] = self._room(whole, values, directions, free)
        elif self.paced:  # held exactly, they would become rounding, and then jump
            rows[:len(values)][values <= _LOST * whole] = 0.0
        return rows, rows @ found.x - room, rows @ found.x + room

    def _room(self, whole: float, values: Array, directions: Array, free: Array) -> Array:
        """Return how far levels below may change the speed in directions (k, n) of faint values."""
        weak = np.maximum(1.0 - (values / (_WEAK * whole)) ** 2, 0.0)
        if weak.any():
            self.loose = True
            self._later.append(directions[weak == 0.0])
        return np.asarray(weak * _PACE * _columns(free).max() / values)

    def resolve(self, h: Hierarchy) -> Resolution:
        """Resolve `written`."""
        found = self.inner.solve(self.written(h))
        if found.status is Status.SOLVED:
            found.status = self.status
        return _without_pace(found, h.n, not self.joined) if self.paced else found

    def written(self, h: Hierarchy) -> Hierarchy:
        """Return all levels of h, those that were calmed in their new form.

        Directions that are held loosely keep the speed that their level found, if none below uses
        them.
        """
        keeps = self.loose and self.inner is self.strict and not h.reference.any()
        return self.stacked(self.asked, self.x if keeps else h.reference)

    def _pace(self, free: Array, missed: float, most: float) -> None:
        """Let levels below change the speeds x by (b), `most` over |r'|, and no more."""
        columns = _columns(free)
        room = np.full(len(columns), np.inf)
        np.divide(most * columns.max(), missed * columns, out=room, where=missed * columns > 0.0)
        self.box = np.maximum(self.box[0], self.x - room), np.minimum(self.box[1], self.x + room)

    def _counted(self, free: Array) -> Array | float:
        """Return the weight (n,) of each joint in |x - x0|, or that of all."""
        if not self.turning:
            return 1.0
        turning, bending = (np.any([*map(_columns, rows)], axis=0)
                            for rows in (self.turning, self.bending))
        return np.where(turning & ~bending & (_columns(free) > 0.0), _TURNING, 1.0)

    def _unlimited(self, values: Array, missed: Array) -> Callable[[float], _Reached]:
        """Return, by mu, the residual if only equalities were above, with x0 as x.

        missed : b - A x0 (m,) along the left singular vectors of what these leave of A.
        """
        squares, x0 = (values * values).tolist(), self.x
        parts, rest = missed[:len(values)].tolist(), _norm(missed[len(values):])

        def probe(mu: float) -> _Reached:
            left = [part * mu / (square + mu) for part, square in zip(parts, squares, strict=True)]
            return _Reached(mu, x0, math.hypot(rest, *left), Status.SOLVED)

        return probe

    def _damped(self, A: Array, lower: Array, upper: Array, missed: Callable[[Array], float],
                counted: Array | float) -> Callable[[float], _Reached]:
        """Return, by mu, the x within the levels above of least |A x - sides|^2 + mu |x - x0|^2.

        missed : the residual that counts, of x.
        """
        n, x0 = len(self.x), self.x
        h = self.stacked([*self.levels, (np.vstack([A, np.eye(n)]), np.concatenate([lower, x0]),
                                         np.concatenate([upper, x0]))], np.zeros_like(x0))
        rows, lower, upper, _ = h.rows
        weights, memory = rows[-n:].reshape(-1)[::n + 1], None

        def probe(mu: float) -> _Reached:
            nonlocal memory
            weights[:] = np.sqrt(mu) * counted
            lower[-n:] = upper[-n:] = weights * x0
            found = self.strict.solve(h, memory)
            memory = found.memory
            return _Reached(mu, found.x, missed(found.x), found.status)

        return probe

    def stacked(self, levels: list[tuple[Array, Array, Array]], reference: Array) -> Hierarchy:
        """Return levels as a hierarchy, below how far they may change the speeds of joints."""
        names = self.names[:len(levels)]
        if self.calmed and self.paced:
            pace = np.eye(len(self.x)), *self.box
            if self.joined:
                top = self.top
                A, lower, upper = map(np.concatenate, zip(pace, levels[top], strict=True))
                levels = [*levels[:top], (A, lower, upper), *levels[top + 1:]]
            else:
                levels, names = [pace, *levels], (_another("pace", names), *names)
        sizes = np.array([len(lower) for _, lower, _ in levels], dtype=np.int64)
        A, lower, upper = (np.concatenate(parts) for parts in zip(*levels, strict=True))
        return Hierarchy.trusted(A, lower, upper, sizes, reference, names)


def _another(name: str, names: tuple[str, ...]) -> str:
    return _another(f"{name}'", names) if name in names else name


def _norm(x: Array) -> float:
    """Return the root of the sum of squares, without the detours of np.linalg.norm."""
    return math.sqrt(np.vdot(x, x))


def _beside(A: Array, held: Array) -> Array:
    """Return what directions (k, n), orthonormal, leave of the rows of A."""
    return A - (A @ held.T) @ held


def _columns(A: Array) -> Array:
    """Return the norms of the columns (n,), 0 for a joint that A does not use."""
    columns = np.linalg.norm(A, axis=0)
    return np.asarray(np.where(columns > _NONE * columns.max(initial=0.0), columns, 0.0))


def _parts(A: Array, free: Array) -> tuple[Array, Array]:
    """Return the singular values (k,) and directions (k, n) of what levels above leave of A."""
    _, values, directions = np.linalg.svd(free, full_matrices=False)
    clear = values > _FAINT * _norm(A)
    return values[clear], directions[clear]


def _settled(probe: Callable[[float], _Reached], unlimited: Callable[[float], _Reached],
             least: float, alpha: float, most: float) -> _Reached:
    """Return what is reached for mu = alpha |b - A x|, or for `least` where that leaves less.

    The search starts from the mu that it would be if nothing but equalities were above.
    """
    found = probe(_search(unlimited, unlimited(least), alpha, most).mu)
    if found.mu > least and found.over(alpha) > _CLOSE * alpha:
        found = probe(least)
    return _search(probe, found, alpha, most)


def _search(probe: Callable[[float], _Reached], low: _Reached, alpha: float,
            most: float) -> _Reached:
    """Return what is reached for mu = alpha |b - A x|, between `low` and mu = `most`, or `low`.

    By regula falsi on mu / |b - A x|, which grows with mu, nearly linearly. The end that stays
    counts less, as in Anderson and Bjorck, BIT 13, 1973.
    """
    low_over = low.over(alpha)
    if not low_over < -_CLOSE * alpha:
        return low
    high = best = probe(most)
    high_over = high.over(alpha)
    for _ in range(_MOST):
        if not _CLOSE * alpha < abs(best.over(alpha)) or not 0.0 < high_over < np.inf:
            break
        last, best = best, probe(high.mu - high_over * (high.mu - low.mu) / (high_over - low_over))
        new = best.over(alpha)
        if new > 0.0:
            low_over *= _less(new, high_over) if last is high else 1.0
            high, high_over = best, new
        else:
            high_over *= _less(new, low_over) if last is low else 1.0
            low, low_over = best, new
    return best


def _less(new: float, old: float) -> float:
    return 1.0 - new / old if 0.0 < new / old < 1.0 else 0.5


def _without_pace(found: Resolution, n: int, level: bool) -> Resolution:
    """Return a resolution without its first n rows, which are a level of their own or not."""
    if not isinstance(found, ActiveSetResolution):
        active = None if found.active is None else found.active[n:]
        return Resolution(found.x, found.status, found.iterations, active=active)
    parts = found.memory[:-3].reshape(3, -1)[:, n:].copy()
    parts[1] -= level & (parts[1] >= 0.0)
    last = found.memory[-3:] - [0.0, 0.0, level and found.memory[-1] > 0.0]  # unfinished
    return ActiveSetResolution(found.x, found.status, np.concatenate([parts.ravel(), last]))
