"""Named views of one array: how kernels divide their work space.

    V, at = matrix(work, 0, n, n)
    rows, at = carve_rows(work, at, m, n)
    if at > work.size:
        return TOO_SMALL

A carver keeps counting beyond the end of the work space but returns empty views there, so a kernel
learns how much it needs before it uses any of it. Such a tuple of views, made inside a kernel and
passed to inlined helpers, costs nothing.
"""

from collections import namedtuple

from hierarchy.jit import as_integers, as_matrix, inlined
from solvers.kernels.tolerances import CANCELLED

Rows = namedtuple("Rows", "W row zero miss")
"""Rows during a factorisation, each level in pivot order.

W (m, n): the rows. row (m,) int64: their indices in the problem. zero (m,): squared norm at or
below which the remainder of a row counts as zero. miss (m,): the residual of each row.
"""

Block = namedtuple("Block", "i0 i1 k0 k1")
"""One level's part of a staircase: rows i0 .. i1 - 1, and the columns k0 .. k1 - 1 it adds."""

Settings = namedtuple("Settings", "damping threshold rank_tolerance")
"""The settings that all resolvers share, see `Resolver`; first in the array of settings."""


@inlined
def shared(settings):
    """Return the Settings at the start of an array of settings; remainders may be rounding."""
    return Settings(settings[0], settings[1], max(settings[2], CANCELLED))


@inlined
def vector(work, at, size):
    """Return the next `size` numbers, none if they do not fit, and where they end."""
    end = at + size
    return work[at:end if end <= work.size else at], end


@inlined
def integers(work, at, size):
    """Like `vector`, as int64."""
    numbers, end = vector(work, at, size)
    return as_integers(numbers), end


@inlined
def matrix(work, at, rows, columns):
    """Like `vector`, as (rows, columns); no rows if they do not fit."""
    numbers, end = vector(work, at, rows * columns)
    return as_matrix(numbers, rows if end <= work.size else 0, columns), end


@inlined
def carve_rows(work, at, m, n):
    """Return Rows for m rows of n unknowns, and where they end."""
    W, at = matrix(work, at, m, n)
    row, at = integers(work, at, m)
    zero, at = vector(work, at, m)
    miss, at = vector(work, at, m)
    return Rows(W, row, zero, miss), at


@inlined
def fill(x, value):
    """Write this value into every entry."""
    for c in range(x.size):
        x[c] = value


@inlined
def assign(x, source):
    """Write the source into x, which has the size."""
    for c in range(x.size):
        x[c] = source[c]
