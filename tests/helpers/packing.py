"""What the page of a replay reads out of an array that was packed."""

import base64

import numpy as np

from scenarios.draw.replay.page import NOTHING


def unpacked(array):
    """The array given to `packed`, to its precision; with steps, infinite becomes NaN."""
    kind = {"f4": "<f4", "i2": "<i2", "u2": "<u2", "i1": "|i1"}[array["kind"]]
    values = np.frombuffer(base64.b64decode(array["data"]), kind).reshape(array["shape"])
    if "step" not in array:
        return values
    return np.where(values == NOTHING, np.nan, array["low"] + values * array["step"])
