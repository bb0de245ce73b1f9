"""One image of a depth camera, with the distances that follow from it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array


class DepthView(NamedTuple):
    """One depth image with the distances that follow from it; P points, the end effector last.

    t [s]; image (h, w) [m], 0 where there is no reading; camera (16,), see `Pinhole.packed`;
    points (P, 3) [m]; distance (P,) [m] of each to the nearest obstacle, infinite without
    one; pixel (P,) of the image, counted row by row, that shows it, or -1; active, the point of
    D_minimal, or -1.
    """

    t: float
    image: NDArray[np.float32]
    camera: Array
    points: Array
    distance: Array
    pixel: NDArray[np.int64]
    active: int
