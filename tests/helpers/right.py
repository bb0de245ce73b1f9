"""Whether an answer is right: certified, or proved in 120 digits."""

import numpy as np

from solvers import certify
from solvers.proof import prove

TURNED = 1e-6  # x may differ by this where rows that agree to 1e-8 rad count as dependent


def is_right(h, x):
    """Judge by the certificate, and by a proof where it refuses an answer near such rows."""
    if certify(h, x).certified:
        return True
    proof = prove(h, [x])
    return bool(proof.complete and np.abs(proof.x - x).max() <= TURNED * (1 + np.abs(x).max()))
