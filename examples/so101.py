"""An SO-101 has five joints, so it cannot meet a whole pose: position first, then orientation.

Levels: joint limits > the tip of the gripper follows a circle > it points down and keeps its turn.
Beside it: the pose as one level of six rows, as most IK asks for it.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import circle
from hierarchy.tasks import Pose, Position
from solvers import solve_ik

DT = 0.005
ROBOT = Robot.load(Path(__file__).parent / "robots" / "so101.urdf")
TIP, START = ROBOT.frame("gripper_frame"), np.array([0.0, -0.2, 0.3, 1.4, 0.0])
HOME = State.at(ROBOT, START)
PATH = circle(HOME.position(TIP) + np.array([0.05, 0.0, 0.0]), 0.05, rate=2.0, phase=np.pi)
POSE = Pose(TIP, PATH, HOME.rotation(TIP))
TASKS = {"strict": [Position(TIP, PATH), POSE], "one level": [POSE]}


def run(kind, duration):
    """Return the joint positions (T, 5) and how far the tip is from its path (T,) [mm]."""
    q, memory, qs, error = START, None, [], []
    for t in np.arange(0.0, duration, DT):
        step = solve_ik(ROBOT, q, TASKS[kind], dt=DT, t=t, memory=memory)
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        missed = PATH(t + DT)[0] - State.at(ROBOT, q).position(TIP)
        error.append(1e3 * np.linalg.norm(missed))
        qs.append(q)
    return np.array(qs), np.array(error)


def main(duration=3.2):
    """Draw the circle both ways and print how far the tip is from it."""
    strict, one = (run(kind, duration)[1].max() for kind in TASKS)
    print(f"the tip leaves its circle by {strict:.2f} mm with position first, "
          f"by {one:.0f} mm with the pose as one level")
    return strict, one


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
