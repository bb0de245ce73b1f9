"""Slow, obvious, independent: the answer of a tiny hierarchy with inequalities, by trying it all.

Level by level, every choice of rows of the levels above to be on a side, and of rows of the level
to be violated, gives one point: the least-squares solution for that choice. The best of those
points that keep what the levels above have reached is the level's optimum, since the optimum is one
of them. No multiplier, no sign, no step: nothing that could be wrong in the same way as a solver.
"""

from itertools import combinations, product

import numpy as np

KEPT = 1e-9  # a row may move so far from what it has reached


def solve(h):
    """Return x (n,): optimal at every level, and nearest to the reference. For n up to about 3."""
    exact, inside, x = [], [], None
    for A, lower, upper in h.levels():
        x = best_for_level(h.n, exact, inside, A, lower, upper)
        for a, low, up in zip(A, lower, upper, strict=True):
            value = a @ x
            if low == up or value > up + KEPT or value < low - KEPT:
                exact.append((a, value))
            else:
                inside.append((a, low, up))
    points = [x for E, e in on_sides(h.n, exact, inside)
              if keeps(x := nearest(E, e, h.reference), exact, inside)]
    return min(points, key=lambda x: np.linalg.norm(x - h.reference))


def best_for_level(n, exact, inside, A, lower, upper):
    """Return an x that violates a level least."""
    choices = [[low] if low == up else [None, *(side for side in (low, up) if np.isfinite(side))]
               for low, up in zip(lower, upper, strict=True)]
    best, least = None, np.inf
    for E, e in on_sides(n, exact, inside):
        for targets in product(*choices):
            pulled = [i for i, target in enumerate(targets) if target is not None]
            x = least_squares(E, e, A[pulled], np.array([targets[i] for i in pulled]))
            violation = np.linalg.norm(A @ x - np.clip(A @ x, lower, upper))
            if violation < least - 1e-12 and keeps(x, exact, inside):
                best, least = x, violation
    return best


def on_sides(n, exact, inside):
    """Yield rows E x = e: the exact ones, and up to n of the others on one of their sides."""
    sides = [(i, a, side) for i, (a, low, up) in enumerate(inside) for side in {low, up}
             if np.isfinite(side) and a.any()]
    for count in range(n + 1):
        for chosen in combinations(sides, count):
            if len({i for i, _, _ in chosen}) == count:
                rows = [*exact, *((a, side) for _, a, side in chosen)]
                yield (np.array([a for a, _ in rows]).reshape(-1, n),
                       np.array([b for _, b in rows]))


def least_squares(E, e, A, b):
    """Return the x of least norm among those that have E x = e and |A x - b| least."""
    x, free = inverse(E) @ e, freedom(E)
    return x + free @ (inverse(A @ free) @ (b - A @ x))


def nearest(E, e, reference):
    """Return the x nearest to the reference with E x = e."""
    x, free = inverse(E) @ e, freedom(E)
    return x + free @ (free.T @ (reference - x))


def inverse(M):
    """Return the pseudo-inverse of rows of about unit norm: what is below 1e-10 is rounding."""
    U, s, Vt = np.linalg.svd(M, full_matrices=False)
    rank = np.count_nonzero(s > 1e-10)
    return (Vt[:rank].T / s[:rank]) @ U[:, :rank].T


def freedom(E):
    """Return a basis of the null space of rows of about unit norm."""
    _, s, Vt = np.linalg.svd(E)
    return Vt[np.count_nonzero(s > 1e-10):].T


def keeps(x, exact, inside):
    """Return whether the levels above keep what they have reached."""
    return (all(abs(a @ x - value) <= KEPT for a, value in exact)
            and all(low - KEPT <= a @ x <= up + KEPT for a, low, up in inside))
