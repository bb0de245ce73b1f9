"""An iiwa swings its elbow while its tool keeps its pose: what a seventh joint is for.

Levels: joint limits > pose of the tool > the elbow goes from side to side.
Beside it: the same tasks with weights 10 : 1 in place of levels.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Ellipse, Still
from hierarchy.tasks import Pose, Position
from solvers import make, solve_ik

DT = 0.005
ROBOT = Robot.load(Path(__file__).parent / "robots" / "iiwa14.urdf")
TOOL, ELBOW = ROBOT.frame("tool0"), ROBOT.frame("iiwa_joint_4")
START = np.array([0.0, 0.6, 0.0, -1.6, 0.0, 0.9, 0.0])
HOME = State.at(ROBOT, START)
POINT, MIDDLE = HOME.position(TOOL), HOME.position(ELBOW)
TASKS = [Pose(TOOL, Still(POINT), HOME.rotation(TOOL)),
         Position(ELBOW, Ellipse(MIDDLE, (0.0, 0.0, 0.0), (0.0, 0.35, 0.0), 1.0), name="elbow")]
SOLVE = {"strict": {}, "weights 10:1": {"resolver": make("weighted", ratio=10.0), "damping": 0.0}}


def run(kind, duration):
    """Return the joint positions (T, 7) and how far the tool moves (T,) [mm]."""
    q, memory, qs, moved = START, None, [], []
    for t in np.arange(0.0, duration, DT):
        step = solve_ik(ROBOT, q, TASKS, dt=DT, t=t, memory=memory, **SOLVE[kind])
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        moved.append(1e3 * np.linalg.norm(State.at(ROBOT, q).position(TOOL) - POINT))
        qs.append(q)
    return np.array(qs), np.array(moved)


def main(duration=6.3):
    """Swing the elbow both ways and print how far the tool moves."""
    strict, weighted = (run(kind, duration)[1].max() for kind in SOLVE)
    print(f"the tool moves by {strict:.2f} mm with strict levels, "
          f"by {weighted:.1f} mm with weights 10:1")
    return strict, weighted


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
