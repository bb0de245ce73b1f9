"""A quadruped looks around and bows with its feet on the ground, farther than its legs can.

Levels: joint limits > all feet stay where they are > the head goes where it is sent > posture.
Beside it: the same tasks with weights 10 : 1, and the feet slide.
"""

import sys

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Ellipse, Still
from hierarchy.tasks import Position, Posture, Together
from solvers import make, solve_ik

DT = 0.005
ROBOT = Robot.load("quadruped")
FEET = [ROBOT.frame(name) for name in ROBOT.frame_names if name.endswith("_foot")]
HEAD, HOME = ROBOT.frame("head"), State.at(ROBOT, ROBOT.rest)
STAND = Together([Position(foot, Still(HOME.position(foot)), name=foot.name) for foot in FEET])
LOOK = Ellipse(HOME.position(HEAD), (0.0, 0.0, 0.0), (0.0, 0.6, -0.3), 1.0)
TASKS = [STAND, Position(HEAD, LOOK, name="head"), Posture(ROBOT.values(ROBOT.rest))]
SOLVE = {"strict": {}, "weights 10:1": {"resolver": make("weighted", ratio=10.0), "damping": 0.0}}


def run(kind, duration):
    """Return the positions (T, 19) and how far a foot slides (T,) [mm]."""
    q, memory, qs, slip = ROBOT.rest, None, [], []
    for t in np.arange(0.0, duration, DT):
        step = solve_ik(ROBOT, q, TASKS, dt=DT, t=t, memory=memory, **SOLVE[kind])
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        slip.append(1e3 * np.abs(STAND.error(State.at(ROBOT, q))).max())
        qs.append(q)
    return np.array(qs), np.array(slip)


def main(duration=6.3):
    """Look around both ways and print how far the feet slide."""
    strict, weighted = (run(kind, duration)[1].max() for kind in SOLVE)
    print(f"a foot slides by {strict:.2f} mm with strict levels, "
          f"by {weighted:.1f} mm with weights 10:1")
    return strict, weighted


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
