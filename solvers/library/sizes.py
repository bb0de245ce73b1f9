"""The numbers that a call from C needs: of its record, and of its work space.

What a kernel carves out of its work space is written in its own file; here are the same sizes as
formulas. The tests hold them against the kernels, and a kernel whose work space is too small says
so.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.jit import inlined
from solvers.kernels.exact import work_size as exact_size
from solvers.kernels.merged import OWN, merged_size
from solvers.kernels.merged import record_size as merged_record

MOST = 1 << 20  # unknowns, rows or levels: with more the sizes could overflow
SETTINGS = 6    # of a kernel


@inlined
def in_range(n, m, levels):
    """Whether these numbers of unknowns, rows and levels are in range."""
    return 1 <= n <= MOST and 0 <= m <= MOST and 0 <= levels <= MOST


@inlined
def record_size(n, m, levels):
    """Return the size of the largest record, which is that of `tpm` or of `merged`."""
    return max(n + levels + 3 * m + 3, merged_record(n, m))


@inlined
def work_size(n, m, levels):
    """Return the size of a work space that is enough for every resolver."""
    return SETTINGS + max(exact_size(n, m, levels, True), recursive(n, m), saturation(n, m),
                          OWN + 3 * levels + merged_size(n, m, levels, False))


@inlined
def recursive(n, m):
    """Return what the kernel of `recursive` needs."""
    return 2 * m * n + 2 * n * n + 2 * m + 2 * n + 2 * block(n, m)


@inlined
def saturation(n, m):
    """Return what the kernel of `sns` needs; the staircase, also below bounds, needs less."""
    return 3 * n * n + 13 * n + m * (2 * n + 5) + block(n, m)


@inlined
def block(n, m):
    """Return what the least squares of one level need."""
    return (m + n) * (n + 1)
