"""Weighted least squares with the active rows as equalities, and the multiplier of each of them.

Minimises sum_i (w_i e_i)^2 + mu^2 ||x - x_0||^2, e_i the miss of soft row i, on the hard rows. In
x = x_0 + Q y, Q comes from an LQ factorisation of the hard rows, then the weighted soft rows, in
pivot order; the hard rows give the first entries of y by substitution, a QR of the soft rows and
mu I the others. Reflections of columns keep the error of each row in proportion to that row, and
the pivot order makes the QR do the same (Powell, Reid 1969; Barlow, Handy 1988; Cox, Higham 1998),
so weights may differ by any ratio. Normal equations would square them.

`Acting` has one entry per row of A; the factorisation, `Factors`, one per active row.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.block import level_damping, stacked
from solvers.kernels.least_squares import least_squares
from solvers.kernels.rows import ZERO, factor_level, length_of, reflect, reflect_back
from solvers.kernels.space import (
    Block,
    Rows,
    View,
    carve_rows,
    matrix,
    vector,
)
from solvers.kernels.tolerances import EXACTLY_DEPENDENT, NEARLY_DEPENDENT, TERMS
from solvers.status import FREE, LOWER


class Problem(NamedTuple):
    """Rows, their sides, and x_0: A (m, n), lower, upper (m,), reference (n,)."""

    A: View
    lower: View
    upper: View
    reference: View


class Acting(NamedTuple):
    """State of each row, (m,) each.

    state: FREE, EQUAL, UPPER or LOWER. weight: infinite for a hard row. norm: of the row. push: its
    multiplier, outward positive. noise: the rounding in it. doubt: 1 if it was released on trial.
    """

    state: View
    weight: View
    norm: View
    push: View
    noise: View
    doubt: View


class Factors(NamedTuple):
    """The factored active rows, hard rows first.

    of_x (1, n), y (n,): the step, and the step in coordinates of Q. force, size (n,): intermediate
    results. of_block: work space.
    """

    rows: Rows
    basis: View
    of_x: View
    y: View
    force: View
    size: View
    of_block: View


@inlined
def carve_factors(work, at, m, n):
    """Return Factors for m rows of n unknowns, and where they end."""
    rows, at = carve_rows(work, at, m, n)
    basis, at = matrix(work, at, n, n)
    of_x, at = matrix(work, at, 1, n)
    y, at = vector(work, at, n)
    force, at = vector(work, at, n)
    size, at = vector(work, at, n)
    of_block, at = vector(work, at, (m + n) * (n + 1))
    return Factors(rows, basis, of_x, y, force, size, of_block), at


@inlined
def carve_acting(record, work, at, m):
    """Return Acting, with state and weight from the record, and where the rest of it ends."""
    norm, at = vector(work, at, m)
    push, at = vector(work, at, m)
    noise, at = vector(work, at, m)
    doubt, at = vector(work, at, m)
    return Acting(record[:m], record[m:2 * m], norm, push, noise, doubt), at


@compiled
def solve_acting(problem, x, acting, factors, settings, regularisation):
    """Write x and the multipliers; return whether rows are nearly parallel."""
    rows, basis, of_x, y, _, _, _ = factors
    hard = _gather(problem, acting, rows, settings.rank_tolerance, ZERO, True)
    end = _gather(problem, acting, rows, settings.rank_tolerance, hard, False)
    p = factor_level(rows, basis, ZERO, hard, ZERO)
    reflect(basis, ZERO, p, rows.W, hard, end)
    for k in range(p):
        y[k] = (rows.miss[k] - inner_product(y[:k], rows.W[k])) / rows.W[k, k]
    rank = factor_level(rows, basis, hard, end, p)
    close = _clean(acting, rows, hard, end, p, rank)
    for i in range(hard, end):
        rows.miss[i] -= inner_product(y[:p], rows.W[i])
    at = Block(hard, end, p, rank)
    _least_squares(factors, at, _mu(rows.W, at, settings, regularisation, factors.of_block))
    for c in range(x.size):
        of_x[0, c] = y[c] if c < rank else 0.0
    reflect_back(basis, rank, of_x, ZERO, ZERO + 1)
    for c in range(x.size):
        x[c] = problem.reference[c] + of_x[0, c]
    _push_of_hard(acting, factors, at, regularisation)
    _push_of_soft(problem, x, acting, rows, at)
    return close


@inlined
def side_of(problem, acting, i):
    """Return the side at which a row is active."""
    return problem.lower[i] if acting.state[i] == LOWER else problem.upper[i]


@compiled
def _gather(problem, acting, rows, rank_tolerance, at, hard):
    """Write the active hard, or soft, rows into W from row `at` on; return where they end."""
    A, reference = problem.A, problem.reference
    for i in range(acting.state.size):
        if acting.state[i] == FREE or (acting.weight[i] == np.inf) != hard:
            continue
        w, miss = 1.0 if hard else acting.weight[i], side_of(problem, acting, i)
        for c in range(reference.size):
            rows.W[at, c] = w * A[i, c]
            miss -= A[i, c] * reference[c]
        rows.row[at], rows.miss[at] = i, w * miss
        rows.zero[at] = (rank_tolerance * w * acting.norm[i]) ** 2
        at += 1
    return at


@inlined
def _clean(acting, rows, hard, end, p, rank):
    """Set entries that are rounding to zero; return whether a row is nearly parallel to others."""
    close = False
    for i in range(end):
        j = rows.row[i]
        norm = acting.norm[j] * (1.0 if i < hard else acting.weight[j])
        own = i if i < hard else p + i - hard
        left = _drop_rounding(rows.W[i], own, rows.zero[i], p if i < hard else rank)
        close |= EXACTLY_DEPENDENT * norm < left < NEARLY_DEPENDENT * norm
    return close


@inlined
def _drop_rounding(w, own, zero, rank):
    """Set the negligible entries at the end of a row to zero: a large weight would amplify them.

    own: its column, if it has one. Returns the remainder of the row there, or when it got none.
    """
    square = 0.0
    for c in range(rank, w.size):
        square += w[c] * w[c]
    for c in range(rank - 1, -1, -1):
        more = square + w[c] * w[c]
        if more > zero:
            return abs(w[c]) if c == own else np.sqrt(square)
        square = more
        w[c] = 0.0
    return np.sqrt(square)


@inlined
def _mu(W, at, settings, regularisation, work):
    """Return mu, combined with lambda if the soft rows are damped as one level."""
    if settings.damping > 0.0 and at.k1 > at.k0:
        return np.sqrt(regularisation ** 2 + level_damping(W, at, settings, work) ** 2)
    return regularisation


@inlined
def _least_squares(factors, at, mu):
    """Write into y the minimiser of ||W y - miss||^2 + mu^2 ||y||^2, over the block `at`.

    miss is the remaining residual on return. It comes from the reflections, so that the small
    residual of a heavy row is as accurate as the rest.
    """
    (W, _, _, miss), rows, q = factors.rows, at.i1 - at.i0, at.k1 - at.k0
    T, _ = stacked(W, miss, at, mu, rows + q, factors.of_block)
    least_squares(T[:q], T[q], factors.y[at.k0:])
    for i in range(rows):
        miss[at.i0 + i] = T[q, i]


@compiled
def _push_of_hard(acting, factors, at, mu):
    """Write the multipliers of the hard rows; zero for a row that adds no column.

    L^T times them is the force of all other rows on y[:p].
    """
    (W, row, _, miss), y, force, size = factors.rows, factors.y, factors.force, factors.size
    hard, p = at.i0, at.k0
    for k in range(p, hard):
        acting.push[row[k]] = acting.noise[row[k]] = 0.0
    for k in range(p - 1, -1, -1):
        force[k] = -mu * mu * y[k]
        size[k] = abs(force[k])
        for i in range(hard, at.i1):
            force[k] += W[i, k] * miss[i]
            size[k] += abs(W[i, k] * miss[i])
        for j in range(k + 1, p):
            force[k] -= W[j, k] * force[j]
            size[k] += abs(W[j, k] * force[j])
        force[k] /= W[k, k]
        acting.push[row[k]] = acting.state[row[k]] * force[k]
        acting.noise[row[k]] = TERMS * size[k] / abs(W[k, k])


@compiled
def _push_of_soft(problem, x, acting, rows, at):
    """Write w_i times the violation of each soft row; inward is negative."""
    length = length_of(x)
    for i in range(at.i0, at.i1):
        j = rows.row[i]
        around = acting.norm[j] * length + abs(side_of(problem, acting, j))
        acting.push[j] = -acting.state[j] * rows.miss[i]
        acting.noise[j] = TERMS * acting.weight[j] * around
