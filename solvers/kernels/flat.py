"""Reflections in the form that hcod.py, stages.py and saturation.py take, until they are replaced.

V is where the reflectors begin in W, the matrix of the rows.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.rows import largest_row, swap_rows


@inlined
def reflect_rows(W, beta, V, k0, k1, i0, i1):
    """Apply reflectors k0 .. k1 - 1 to rows i0 .. i1 - 1 of W, one after the other.

    Reflector k is I - beta[k] v v^T, its v in row V + k of W, zero before column k.
    """
    for k in range(k0, k1):
        v = W[V + k, k:]
        for i in range(i0, i1):
            w = W[i, k:]
            s = 0.0
            for c in range(v.size):
                s += w[c] * v[c]
            s *= beta[k]
            for c in range(v.size):
                w[c] -= s * v[c]


@inlined
def make_reflector(W, beta, V, k, i, square):
    """Make reflector k (see `reflect_rows`) map row i of W onto unit vector k; apply it to no row.

    square is the squared norm of the row from column k on.
    """
    for c in range(k, W.shape[1]):
        W[V + k, c] = W[i, c]
    norm = np.sqrt(square)
    W[V + k, k] += norm if W[V + k, k] >= 0.0 else -norm
    beta[k] = 1.0 / (norm * abs(W[V + k, k]))


@compiled
def factor_level(W, row, zero, miss, beta, V, begin, end, rank):
    """Give the rows begin .. end - 1, already reflected, columns of their own; return the rank.

    The rows are brought into pivot order, and row, zero and miss with them.
    """
    for i in range(begin, end):
        pivot, square = largest_row(W, zero, i, end, rank)
        if pivot < 0:
            break
        if pivot != i:
            swap_rows(W, i, pivot)
            row[i], row[pivot] = row[pivot], row[i]
            zero[i], zero[pivot] = zero[pivot], zero[i]
            miss[i], miss[pivot] = miss[pivot], miss[i]
        make_reflector(W, beta, V, rank, i, square)
        reflect_rows(W, beta, V, rank, rank + 1, i, end)
        rank += 1
    return rank
