"""One image of a depth camera, with the distances that follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array


@dataclass(frozen=True)
class DepthView:
    """One depth image with the distances that follow from it; P points, the end effector last.

    t [s]; image (h, w) [m], 0 where there is no reading; camera (16,), see `Pinhole.packed`;
    points (P, 3) [m]; distance (P,) [m] of each to what it is nearest to, infinite where that is
    nothing; pixel (P,) of the image, counted row by row, in which that is, or -1; active, the
    point of D_minimal, or -1.
    """

    t: float
    image: NDArray[np.float32]
    camera: Array
    points: Array
    distance: Array
    pixel: NDArray[np.int64]
    active: int

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the fields by name, as arrays."""
        return {name: np.asarray(value) for name, value in vars(self).items()}

    @classmethod
    def of_arrays(cls, arrays: dict[str, NDArray[Any]]) -> DepthView:
        """Return what `arrays` was made of; KeyError names a field that is missing."""
        return cls(float(arrays["t"]), arrays["image"], arrays["camera"], arrays["points"],
                   arrays["distance"], arrays["pixel"], int(arrays["active"]))
