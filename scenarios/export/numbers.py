"""Arrays as JSON values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def plain(values: ArrayLike) -> Any:
    """Return numbers as nested lists, with None for those that are not finite."""
    array = np.asarray(values)
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return array.tolist()
    objects = array.astype(object)
    objects[~np.isfinite(array)] = None
    return objects.tolist()
