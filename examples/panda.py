"""A Panda carries a full glass to a place that is too far away: the glass must not tilt.

Levels: joint limits > the glass is upright > the hand follows its path > posture.
Beside it: upright and path as one level, as one task for the pose asks for them.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Waypoints
from hierarchy.tasks import LookAt, Position, Posture, Together
from solvers import solve_ik

DT = 0.01
ROBOT = Robot.load(Path(__file__).parent / "robots" / "panda.urdf")
HAND = ROBOT.frame("panda_hand_tcp")
START = np.array([0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.8])
HERE, FAR = (0.364, 0.0, 0.501), (0.85, -0.35, 0.55)
UPRIGHT = LookAt(HAND, (0.0, 0.0, -1e4))  # straight down, as far as a glass can tell
CARRY = Position(HAND, Waypoints((0.0, 2.0, 3.0, 5.0), (HERE, FAR, FAR, HERE)))
TASKS = {"strict": [UPRIGHT, CARRY, Posture(START)],
         "one level": [Together([UPRIGHT, CARRY]), Posture(START)]}


def run(kind, duration):
    """Return the joint positions (T, 7) and the tilt of the glass (T,) [deg]."""
    q, memory, qs, tilt = START, None, [], []
    for t in np.arange(0.0, duration, DT):
        step = solve_ik(ROBOT, q, TASKS[kind], dt=DT, t=t, memory=memory)
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        down = -State.at(ROBOT, q).rotation(HAND)[2, 2]
        tilt.append(np.degrees(np.arccos(min(down, 1.0))))
        qs.append(q)
    return np.array(qs), np.array(tilt)


def main(duration=5.0):
    """Carry the glass both ways and print how far it tilts."""
    strict, one = (run(kind, duration)[1].max() for kind in TASKS)
    print(f"the glass tilts by {strict:.2f} deg with strict levels, by {one:.0f} deg in one level")
    return strict, one


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
