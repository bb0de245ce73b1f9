"""The staircase of `tpm` in jax, for large batches on any device of jax (extra `jax`).

    answer = solve(Batch(A, lower, upper, sizes), make("tpm"))

`staircase` resolves one problem as a pure function, for your own use of `jax.vmap` and `jax.jit`
with 64 bits enabled. Shapes must not depend on the data, so each row has a slot: the direction that
it adds to the rows before it (largest first), or zero if it adds none. Each level is a
least-squares problem (5), (13) in y, the coordinates along these directions.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from hierarchy.errors import HierarchyError
from solvers.batch import Batch, BatchResolution
from solvers.kernels.tolerances import CANCELLED
from solvers.resolver import Resolver, make, refuse_inequality
from solvers.resolvers.tpm import Tpm
from solvers.status import NUMERICAL_FAILURE, SOLVED

try:
    import jax
    import jax.numpy as jnp
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "solvers.batch.on_jax needs jax: pip install 'task-hierarchy[jax]'") from error


def solve(batch: Batch, resolver: Resolver | None = None) -> BatchResolution:
    """Resolve all problems of a batch of equalities with the staircase form of `tpm`.

    The answers agree with those of `solvers.batch.solve` up to rounding. Compiled once for each
    shape and each combination of settings.

    Raises HierarchyError: another resolver; an inequality (names problem, level and row).
    """
    resolver = make("tpm") if resolver is None else resolver
    if not isinstance(resolver, Tpm) or not resolver.strict:
        raise HierarchyError(f"{resolver.label} is not available in jax; tpm is")
    batch = replace(batch)  # as `solvers.batch.solve` does
    for p, row in np.argwhere(batch.lower < batch.upper)[:1]:
        refuse_inequality(make("tpm-published"), batch[p], int(row))
    with jax.enable_x64(True):
        b = np.where(batch.lower == batch.upper, batch.lower, np.nan)
        x, solved = _staircases(batch.A, b, batch.reference, tuple(batch.sizes.tolist()),
                                resolver.damping, resolver.threshold, resolver.rank_tolerance)
        status = np.where(np.asarray(solved), SOLVED, NUMERICAL_FAILURE)
        return BatchResolution(np.array(x), status, np.ones_like(status), None)


def staircase(A: jax.Array, b: jax.Array, reference: jax.Array, sizes: tuple[int, ...],
              damping: float = 0.0, threshold: float = 0.1, rank_tolerance: float = 1e-8
              ) -> tuple[jax.Array, jax.Array]:
    """Return the answer (n,) of one problem, zero if it failed, and whether it is solved.

    A (m, n), b (m,), reference (n,). The sizes of the levels and damping are fixed at compile time;
    the settings are those of `Resolver`.
    """
    square, least = jnp.sum(A * A, axis=1), jnp.maximum(rank_tolerance, CANCELLED)
    x, Q = jnp.zeros_like(reference), jnp.zeros_like(A[:0])
    first = 0
    for size in sizes:
        if size:
            rows = slice(first, first + size)
            L, new = _factor(_outside(A[rows], Q), least**2 * square[rows])
            lambda_ = _damping(L, new, damping, threshold) if damping > 0.0 else None
            y = _least_squares(L, b[rows] - A[rows] @ x, lambda_)  # p_i - J_i x_{i-1}, in (13)
            x, Q = x + y @ new, jnp.concatenate([Q, new])
            first += size
    x += _outside(reference[None], Q)[0]  # (14)
    sane = jnp.isfinite(square).all() & jnp.isfinite(b).all() & jnp.isfinite(reference).all()
    solved = sane & jnp.isfinite(x).all()
    return jnp.where(solved, x, 0.0), solved


@partial(jax.jit, static_argnums=(3, 4, 5, 6))
def _staircases(A: jax.Array, b: jax.Array, reference: jax.Array, sizes: tuple[int, ...],
                damping: float, threshold: float, rank_tolerance: float
                ) -> tuple[jax.Array, jax.Array]:
    one = partial(staircase, sizes=sizes, damping=damping, threshold=threshold,
                  rank_tolerance=rank_tolerance)
    answers: tuple[jax.Array, jax.Array] = jax.vmap(one)(A, b, reference)
    return answers


def _outside(rows: jax.Array, Q: jax.Array) -> jax.Array:
    """Return rows (k, n) outside the span of the slots Q; projected twice for accuracy."""
    for _ in range(2):
        rows = rows - (rows @ Q.T) @ Q
    return rows


def _factor(rows: jax.Array, zero: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Return L (k, k) and slots Q (k, n) with rows = L Q, largest remaining row first.

    zero (k,): squared norm at or below which the remainder of a row counts as zero.
    """
    columns, Q = [], jnp.zeros_like(rows[:0])
    left = rows
    for _ in range(rows.shape[0]):
        square = jnp.sum(left * left, axis=1)
        square = jnp.where(square > zero, square, 0.0)
        pivot = jnp.argmax(square)
        q = _outside(left[pivot][None], Q)[0]
        q = jnp.where(square[pivot] > 0.0, q / jnp.sqrt(jnp.sum(q * q)), 0.0)
        column = left @ q
        left = (left - jnp.outer(column, q)).at[pivot].set(0.0)
        Q = jnp.concatenate([Q, q[None]])
        columns.append(column)
    return jnp.stack(columns, axis=1), Q


def _damping(L: jax.Array, Q: jax.Array, damping: float, threshold: float) -> jax.Array:
    """Return lambda from the smallest singular value of L; the full damping if rank < rows."""
    smallest = jnp.linalg.svd(L, compute_uv=False)[-1]
    full = jnp.any(Q != 0.0, axis=1).all()
    ratio = jnp.where(full, jnp.minimum(smallest / threshold, 1.0), 0.0)
    return damping * jnp.sqrt(1.0 - ratio**2)


def _least_squares(L: jax.Array, r: jax.Array, lambda_: jax.Array | None) -> jax.Array:
    """Return the y that minimises |L y - r|^2 + lambda^2 |y|^2, zero for empty columns of L.

    Modified Gram-Schmidt of [L r]: as accurate as reflections if r is orthogonalised with L.
    """
    k = L.shape[1]
    T = jnp.concatenate([L, r[:, None]], axis=1)
    if lambda_ is not None:
        T = jnp.concatenate([T, lambda_ * jnp.eye(k, k + 1)])
    U = []
    for j in range(k):
        size = jnp.sqrt(jnp.sum(T[:, j] ** 2))
        q = jnp.where(size > 0.0, T[:, j] / size, 0.0)
        products = q @ T
        U.append(products.at[j].set(jnp.where(size > 0.0, size, 1.0)))
        T -= jnp.outer(q, products)
    y = jnp.zeros(k)
    for j in range(k - 1, -1, -1):
        y = y.at[j].set((U[j][k] - U[j][j + 1:k] @ y[j + 1:]) / U[j][j])
    return y
