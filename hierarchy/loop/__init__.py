"""A loop for hardware of one's own: fixed period, overruns, watchdog, a log of every tick.

No robot's interface is assumed: what to compute, how to send it and how to stop safely are the
user's functions. This is Python on an ordinary operating system: the period is kept as well as the
log says, and a stop by the robot's own controller is still needed.
"""

from hierarchy.loop.fixed_period import Loop
from hierarchy.loop.log import Log
from hierarchy.loop.watchdog import Watchdog

__all__ = ["Log", "Loop", "Watchdog"]
