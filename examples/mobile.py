"""A mobile base with an arm wipes a wall of 2 m: the hand leads, and the base drives as needed.

Levels: joint limits > the pose of the hand, along the wall > arm and base in a good posture.
Beside it: the same tasks with weights 10 : 1, the posture pulls the hand off the wall.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Waypoints
from hierarchy.tasks import Pose, Posture
from solvers import make, solve_ik

DT = 0.005
ROBOT = Robot.load(Path(__file__).parent / "robots" / "mobile.urdf")
HAND = ROBOT.frame("tool0")
START = ROBOT.configuration({"shoulder_lift": 0.0, "elbow": 1.4, "wrist_pitch": 0.171})
HOME = State.at(ROBOT, START)
WALL = HOME.position(HAND)  # where the hand starts
STRIPES = [WALL + np.array([0.0, y, z]) for y, z in ((0, 0), (2, 0), (2, 0.3), (0, 0.3))]
PATH = Waypoints((0.0, 3.0, 4.0, 7.0), STRIPES)
TASKS = [Pose(HAND, PATH, HOME.rotation(HAND)), Posture(START)]
SOLVE = {"strict": {}, "weights 10:1": {"resolver": make("weighted", ratio=10.0), "damping": 0.0}}


def run(kind, duration):
    """Return the joint positions (T, 9) and how far the hand is off its path (T,) [mm]."""
    q, memory, qs, error = START, None, [], []
    for t in np.arange(0.0, duration, DT):
        step = solve_ik(ROBOT, q, TASKS, dt=DT, t=t, memory=memory, **SOLVE[kind])
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        missed = PATH(t + DT)[0] - State.at(ROBOT, q).position(HAND)
        error.append(1e3 * np.linalg.norm(missed))
        qs.append(q)
    return np.array(qs), np.array(error)


def main(duration=7.0):
    """Wipe the wall both ways and print how far the hand is from its path."""
    strict, weighted = (run(kind, duration)[1].max() for kind in SOLVE)
    print(f"the hand is within {strict:.2f} mm of its path with strict levels, "
          f"within {weighted:.1f} mm with weights 10:1")
    return strict, weighted


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
