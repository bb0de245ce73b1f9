"""What a depth camera may read, worked out from its settings."""

import numpy as np


def deproject(pinhole, pixels):
    """World points (..., 3) [m] of u, v [px] and depth [m] (..., 3)."""
    u, v, depth = np.moveaxis(np.asarray(pixels, dtype=float), -1, 0)
    seen = [(u - pinhole.cx) / pinhole.fx * depth, (v - pinhole.cy) / pinhole.fy * depth, depth]
    return np.stack(seen, axis=-1) @ np.asarray(pinhole.rotation).T + np.asarray(pinhole.position)


def bound(errors, depth):
    """Largest error [m] of a reading at a depth [m] that is not an outlier."""
    noise = 3.5 * (errors.noise_floor + errors.noise_growth * (depth - errors.noise_from) ** 2)
    if errors.rounding == "step":
        return noise + errors.step / 2
    return (depth + noise) / (1.0 - (depth + noise) * errors.step / 2) - depth
