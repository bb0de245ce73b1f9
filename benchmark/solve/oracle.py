"""Slow, obvious, independent: what a strict resolver of equalities has to answer.

Null spaces and least squares straight from numpy's SVD, level after level; no code shared with
what it judges.
"""

import numpy as np

from hierarchy.problem import Array, Hierarchy

_RANK = 1e-9  # of rows of length 1
_THRESHOLD = 0.1


def solve(h: Hierarchy, damping: float = 0.0, threshold: float = _THRESHOLD) -> Array:
    """Return x (n,) of a hierarchy of equalities, with the damping that `Resolver` describes."""
    x, N = np.zeros(h.n), np.eye(h.n)
    for A, b, _ in h.levels():
        if len(b) == 0 or N.shape[1] == 0:
            continue
        B = A @ N
        size = np.linalg.norm(A, axis=1)
        _, s, Vt = np.linalg.svd(B / np.where(size > 0, size, 1.0)[:, None])
        rank = int(np.count_nonzero(s > _RANK))
        V = Vt[:rank].T  # directions of the null space that these rows can see
        M, missing = B @ V, b - A @ x
        smallest = np.linalg.svd(B, compute_uv=False)[-1] if rank == len(B) else 0.0
        lam2 = damping**2 * max(0.0, 1.0 - (smallest / threshold) ** 2)
        if lam2 > 0.0:
            y = np.linalg.solve(M.T @ M + lam2 * np.eye(rank), M.T @ missing)
        else:
            y = np.linalg.pinv(M) @ missing
        x = x + N @ V @ y
        N = N @ Vt[rank:].T
    return np.asarray(x + N @ (N.T @ h.reference))


def published(h: Hierarchy, damping: float = 0.0) -> tuple[Array, Array]:
    """Return x and F of the published Task Priority Matrix: eqs. (8)-(10), (14)."""
    A, b, (m, n) = h.A, h.lower, h.A.shape
    F = np.linalg.qr(np.hstack([A, np.zeros((m, max(0, m - n)))]).T)[1]
    tolerance = _RANK * np.linalg.norm(A, axis=1).max()
    for i, j in zip(h.offsets[:-1], h.offsets[1:], strict=True):
        U, s, Vt = np.linalg.svd(F[i:j, i:j])
        lam2 = damping**2 * max(0.0, 1.0 - (s.min(initial=np.inf) / _THRESHOLD) ** 2)
        gain = [v / (v * v + lam2) if lam2 > 0.0 or v > tolerance else 0.0 for v in s]
        F[i:j] = Vt.T @ np.diag(gain) @ U.T @ F[i:j]
        F[:i] -= F[:i, i:j] @ F[i:j]
    F = F.T
    return np.linalg.pinv(A, rcond=_RANK) @ (F @ b - A @ h.reference) + h.reference, F
