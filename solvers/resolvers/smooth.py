"""Smooth activation: the recursion of Simetti and Casalino, with a weight for every row.

Level k has rows J, references (its lower sides) and the diagonal activation matrix A. With the
pseudoinverse

    X^(#,A,Q) = (X^T A X + eta (I - Q)^T (I - Q) + V^T P V)^# X^T A A                           (a)

the answer is rho after the last level, starting from rho = 0 and Q = I:

    W   = J Q (J Q)^(#,A,Q)                                                                     (b)
    T   = I - Q (J Q)^(#,A,I) W J                                                               (c)
    rho <- T rho + Q (J Q)^(#,A,I) W dx/dt                                                      (d)
    Q   <- Q (I - (J Q)^(#,A,I) J Q)                                                            (e)

The last level is the identity. docs/theory/smooth.md has V and P.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.gate import shaped
from hierarchy.problem import Array, Hierarchy
from solvers.qp.refinement import below_largest
from solvers.resolution import Resolution
from solvers.resolver import Around, Resolver, number, place_of, refuse_inequality, register
from solvers.status import Status


@final
@register
@dataclass(frozen=True, kw_only=True)
class Smooth(Resolver):
    """Task priority with activations between 0 and 1, which come and go without a jump of x.

    With all activations 0 or 1 the answer is that of `recursive` where no singular value is below
    `threshold`; otherwise it is not strict: what a row in transition does not use is left to the
    levels below. Singular values are those of X^T A X, squares of those of the rows, so damping
    means something else than in other resolvers.

    eta : weight of what keeps a level off the directions that levels above use in part.

    `names()` does not list it: the activations come from beside the hierarchy, and
    `control.stack = "smooth"` provides them. Defaults are our own.

    Source: E. Simetti, G. Casalino, "A Novel Practical Technique to Integrate Inequality Control
    Objectives and Task Transitions in Priority Based Control", Journal of Intelligent and Robotic
    Systems (2016).
    """

    name = "smooth"
    handles = "activations"
    strict = False  # rows that act in part share directions with lower levels
    accuracy = 1e-6  # errors grow with the square of the condition number
    damping: float = 1e-4
    threshold: float = 1e-2
    eta: float = number(10.0, open_below=True)

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h with all rows fully active; HierarchyError for an inequality."""
        for (row,) in np.argwhere(h.lower < h.upper)[:1]:
            refuse_inequality(self, h, int(row))
        rate = np.where(h.lower == h.upper, h.lower, np.nan)
        return self.solve_activated(h.changed(lower=rate), np.ones(h.m))

    def solve_activated(self, h: Hierarchy, activation: Array) -> Resolution:
        """Resolve the rows A x -> lower with their activations (m,), upper sides being ignored.

        Raises HierarchyError, naming level, row and value, for an activation outside 0 .. 1, and
        for a metric or levels that give.
        """
        h.refuse_extras("the hierarchy", "solve_activated")
        activation = shaped("smooth: activations", activation, (h.m,))
        for (row,) in np.argwhere(~((activation >= 0.0) & (activation <= 1.0)))[:1]:
            raise HierarchyError(f"{place_of(h, row)}: activation {activation[row]} is outside "
                                 "0 .. 1")
        acting = activation > 0.0
        if not below_largest(h.A, h.lower[acting], h.reference):  # squares would overflow
            return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)
        rho, Q, identity = np.zeros(h.n), np.eye(h.n), np.eye(h.n)
        for first, last in zip(h.offsets[:-1], h.offsets[1:], strict=True):
            rows = np.flatnonzero(acting[first:last]) + first
            if len(rows):  # with A = 0, (c) to (e) change nothing
                rho, Q = self._descend(rho, Q, h.A[rows], activation[rows], h.lower[rows])
        rho, Q = self._descend(rho, Q, identity, np.ones(h.n), h.reference)
        if not np.isfinite(rho).all():
            return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)
        return Resolution(rho)

    @np.errstate(all="ignore")
    def _descend(self, rho: Array, Q: Array, J: Array, A: Array, rate: Array
                 ) -> tuple[Array, Array]:
        """Return rho and Q after a level of rows J (m, n), activations A (m,) and rates (m,)."""
        X, identity = J @ Q, np.eye(len(Q))
        G = self._pseudoinverse(X, A, identity)
        W = X @ self._pseudoinverse(X, A, Q)            # (b)
        rho = rho + Q @ (G @ (W @ (rate - J @ rho)))    # (c), (d)
        return rho, Q @ (identity - G @ X)              # (e)

    def _pseudoinverse(self, X: Array, A: Array, Q: Array) -> Array:
        """Return X^(#,A,Q), (a); its matrix is symmetric, so singular values are eigenvalues."""
        rest = np.eye(len(Q)) - Q
        s, V = np.linalg.eigh((X.T * A) @ X + self.eta * rest.T @ rest)
        s = np.maximum(s, 0.0)
        s += self.damping * (0.5 + 0.5 * np.cos(np.pi * np.minimum(s / self.threshold, 1.0)))
        kept = s > self.rank_tolerance * s[-1]
        inverse = np.divide(1.0, s, out=np.zeros_like(s), where=kept)
        return np.asarray((V * inverse) @ V.T @ (X.T * A**2))


@final
@dataclass(frozen=True, kw_only=True)
class Activated(Around):
    """A `Smooth` resolver with the `activation` (m,) that is called at each solve.

    A hierarchy with fewer levels takes the first of the activations.
    """

    inner: Smooth
    activation: Callable[[], Array]
    name = "smooth"
    handles = "activations"

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h at the present activations."""
        return self.inner.solve_activated(h, self.activation()[:h.m])
