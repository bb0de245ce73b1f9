"""Problems that change a little from tick to tick."""

import numpy as np


def sequence(h, count, seed=0):
    """A hierarchy as it changes from tick to tick, and back to its beginning.

    Rows with one coefficient, such as bounds, keep it.
    """
    rng = np.random.default_rng(seed)
    size = np.linalg.norm(h.A, axis=1)
    directions = rng.normal(size=(2, h.m)), rng.normal(size=(2, *h.A.shape))
    directions[1][:, np.count_nonzero(h.A, axis=1) == 1] = 0.0
    ticks = []
    for phase in 2.0 * np.pi * np.arange(count) / count:
        turn = np.array([np.sin(phase), np.cos(phase)])
        shift = 0.1 * size * (turn @ directions[0])
        A = h.A * (1.0 + 0.02 * np.einsum("t,tij->ij", turn, directions[1]))
        ticks.append(h.changed(A=A, lower=h.lower + shift, upper=h.upper + shift))
    return ticks


def moved(h, seed=0):
    """h with both sides of every row scaled by one factor within 1 % of 1."""
    factor = 1.0 + 0.01 * np.random.default_rng(seed).uniform(-1.0, 1.0, h.m)
    return h.changed(lower=h.lower * factor, upper=h.upper * factor)
