"""Figures of runs in one style: the letter's panels, the scene in space, the stack over time."""

import os

# No figure is shown in a window, and matplotlib does not start with a backend that is not there.
_backend = os.environ.pop("MPLBACKEND", None)
try:
    import matplotlib  # noqa: F401
finally:
    if _backend is not None:
        os.environ["MPLBACKEND"] = _backend
