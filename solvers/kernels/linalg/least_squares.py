"""Least squares by Householder reflections.

T (r, s) has the columns of the problem as its rows. With the equations in pivot order, the heaviest
first, each residual is as accurate as its own equation (Cox, Higham 1998).
"""

import numpy as np

from hierarchy.jit import inlined, internal
from solvers.kernels.linalg.rows import length_of, reflect_by
from solvers.kernels.linalg.space import fill


@internal
def least_squares(T, b, y):
    """Write the minimiser of |T^T y - b| into y[:r]; b (s,) is the residual on return."""
    r = T.shape[0]
    triangularise(T, y)
    turn(T, b, False)
    substitute_back(T, b, y)
    fill(b[:r], 0.0)
    turn(T, b, True)


@internal
def triangularise(T, diagonal):
    """Reflect the equations so that column k ends at entry k, which becomes diagonal[k].

    Column k keeps its entries above that one, and then the vector of reflector k.
    """
    for k in range(T.shape[0]):
        v = T[k, k:]
        norm = length_of(v)
        diagonal[k] = -norm if v[0] > 0.0 else norm
        v[0] -= diagonal[k]
        scale = 1.0 / np.sqrt(norm * abs(v[0]))
        for i in range(v.size):
            v[i] *= scale
        for j in range(k + 1, T.shape[0]):
            reflect_by(v, T[j, k:])


@inlined
def turn(T, b, back):
    """Apply the reflections of the equations to b, or undo them."""
    for k in range(T.shape[0]):
        j = T.shape[0] - 1 - k if back else k
        reflect_by(T[j, j:], b[j:])


@inlined
def substitute_back(T, b, y):
    """Replace y, the diagonal on entry, by the solution of the upper triangle for b."""
    for k in range(T.shape[0] - 1, -1, -1):
        rest = b[k]
        for j in range(k + 1, T.shape[0]):
            rest -= T[j, k] * y[j]
        y[k] = rest / y[k]
