"""Random arms of six revolute joints, in batches, and configurations near a singularity."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from hierarchy.problem import Array

REGULAR = 0.05           # smallest singular value [m or 1] of a regular Jacobian
NEAREST = 1e-7           # smallest singular value [m or 1] that is accepted near a singularity
_LENGTH = 0.5            # [m] the longest a and d of a link
_STEPS = (1e-6, 1e-2)    # [rad] from a singular configuration
_BISECTIONS = 60
_BATCHES = 1000          # largest number of draws


def jacobians(arms: Array, q: Array) -> Array:
    """Jacobians (N, 6, 6) of the end effectors at q (N, 6) [rad]: position, then rotation.

    arms : (N, 3, 6) standard Denavit-Hartenberg a, d [m] and alpha [rad] of their joints.
    """
    (a, d, alpha), (count, n) = arms.swapaxes(0, 1), q.shape
    R, p = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    axes, origins = np.empty((count, n, 3)), np.empty((count, n, 3))
    for i in range(n):
        axes[:, i], origins[:, i] = R[:, :, 2], p
        R = R @ Rotation.from_euler("z", q[:, i, None]).as_matrix()
        p = p + a[:, i, None] * R[:, :, 0] + d[:, i, None] * R[:, :, 2]
        R = R @ Rotation.from_euler("x", alpha[:, i, None]).as_matrix()
    return np.concatenate([np.cross(axes, p[:, None] - origins), axes], axis=2).swapaxes(1, 2)


def regular(count: int, seed: int = 0) -> Array:
    """Return Jacobians (count, 6, 6) with no singular value below REGULAR."""
    def some(rng: np.random.Generator) -> Array:
        J = jacobians(draw(count, rng), _configurations(count, rng))
        return J[_singular_values(J)[:, -1] >= REGULAR]

    return _collect(some, count, seed)


def near_singular(count: int, seed: int = 0) -> Array:
    """Return Jacobians (count, 6, 6) between 1e-6 and 1e-2 rad away from a singular configuration.

    Bisection finds a singular configuration between two whose determinants differ in sign; a step
    of log-uniform length leads away from it. The smallest singular value stays above NEAREST, the
    others above REGULAR.
    """
    def some(rng: np.random.Generator) -> Array:
        arms, low, high = draw(count, rng), _configurations(count, rng), _configurations(count, rng)
        J_low, J_high = jacobians(arms, low), jacobians(arms, high)
        apart = np.linalg.det(J_low) * np.linalg.det(J_high) < 0.0
        apart &= _singular_values(J_low)[:, -1] >= REGULAR  # some arms are singular everywhere
        arms, low, high = arms[apart], low[apart], high[apart]
        along = (high - low) / np.linalg.norm(high - low, axis=1, keepdims=True)
        singular = _bisected(arms, low, high)
        step = np.exp(rng.uniform(np.log(_STEPS[0]), np.log(_STEPS[1]), (len(singular), 1)))
        J = jacobians(arms, singular + step * along)
        s = _singular_values(J)
        return J[(s[:, -2] >= REGULAR) & (s[:, -1] >= NEAREST)]

    return _collect(some, count, seed)


def draw(count: int, rng: np.random.Generator) -> Array:
    """Draw arms (N, 3, 6): a, d up to 0.5 m; alpha of -90, 0, 90 deg in a half, any in the rest."""
    square = rng.choice([-0.5 * np.pi, 0.0, 0.5 * np.pi], (count, 6))
    alpha = np.where(rng.random((count, 1)) < 0.5, square, rng.uniform(-np.pi, np.pi, (count, 6)))
    a, d = rng.uniform(0.0, _LENGTH, (2, count, 6))
    return np.stack([a, d, alpha], axis=1)


def _configurations(count: int, rng: np.random.Generator) -> Array:
    return rng.uniform(-np.pi, np.pi, (count, 6))


def _bisected(arms: Array, low: Array, high: Array) -> Array:
    """Return configurations (N, 6) between low and high at which the determinant changes sign."""
    sign = np.sign(np.linalg.det(jacobians(arms, low)))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        before = (np.sign(np.linalg.det(jacobians(arms, middle))) == sign)[:, None]
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return low


def _collect(some: Callable[[np.random.Generator], Array], count: int, seed: int) -> Array:
    rng, found = np.random.default_rng(seed), np.empty((0, 6, 6))
    for _ in range(_BATCHES):
        if len(found) >= count:
            break
        found = np.concatenate([found, some(rng)])
    return found[:count]


def _singular_values(J: Array) -> Array:
    return np.asarray(np.linalg.svd(J, compute_uv=False))
