"""A control loop for your hardware: fixed period, overruns, watchdog, and a log of every tick.

No robot interface is assumed: the user provides functions that compute the command, send it and
stop safely. This is Python on an ordinary operating system: the log shows how well the period is
kept, and the robot's own controller must be able to stop it.
"""

from hierarchy.loop.fixed_period import Loop
from hierarchy.loop.log import Log
from hierarchy.loop.watchdog import Watchdog

__all__ = ["Log", "Loop", "Watchdog"]
