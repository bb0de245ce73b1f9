"""A humanoid reaches for something that is too far away, and neither slides nor falls.

Levels: joint limits > feet > centre of mass above the feet > left hand to its target > posture.
Beside it: feet, balance and hand as one level, all of the same weight.
"""

import sys

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Still, line
from hierarchy.tasks import CentreOfMass, Pose, Position, Posture, Together
from solvers import solve_ik

DT = 0.01
ROBOT = Robot.load("humanoid")
HOME = State.at(ROBOT, ROBOT.rest)
FEET = Together([Pose(ROBOT.frame(f"{side}_foot"), Still(HOME.position(f"{side}_foot")),
                      HOME.rotation(f"{side}_foot"), name=side) for side in ("left", "right")])
HAND = Position(ROBOT.frame("left_hand"), line(HOME.position("left_hand"), (1.6, 0.5, 1.1), 4.0))
MIDDLE = (HOME.position("left_foot") + HOME.position("right_foot")) / 2 + [0.05, 0.0, 0.0]
BALANCE = CentreOfMass(ROBOT, Still(MIDDLE), axes=(0, 1), gain=2.0)
POSTURE = Posture(ROBOT.values(ROBOT.rest))
TASKS = {"strict": [FEET, BALANCE, HAND, POSTURE],
         "one level": [Together([FEET, BALANCE, HAND], name="all"), POSTURE]}


def run(kind, duration):
    """Return the positions (T, 37) and how far a foot slides (T,) [mm]."""
    q, memory, qs, slip = ROBOT.rest, None, [], []
    for t in np.arange(0.0, duration, DT):
        step = solve_ik(ROBOT, q, TASKS[kind], dt=DT, t=t, memory=memory)
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        error = FEET.error(State.at(ROBOT, q)).reshape(2, 6)[:, :3]
        slip.append(1e3 * np.linalg.norm(error, axis=1).max())
        qs.append(q)
    return np.array(qs), np.array(slip)


def main(duration=5.0):
    """Reach both ways and print how far a foot slides."""
    strict, one = (run(kind, duration)[1].max() for kind in TASKS)
    print(f"a foot slides by {strict:.2f} mm with strict levels, "
          f"by {one:.0f} mm in one level")
    return strict, one


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
