"""A learned policy sends chunks of joint targets; the hand must stay on its line whatever it says.

Levels: joint limits > the tool stays on the seam > the chunk of the policy, as a posture.
Beside it: the chunks sent to the joints as they are. Put your policy in place of `chunk`.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Still
from hierarchy.tasks import Along, Position, Posture
from solvers import solve_ik

DT, CHUNK = 0.01, 20
ROBOT = Robot.load(Path(__file__).parent / "robots" / "panda.urdf")
TOOL = ROBOT.frame("panda_hand_tcp")
START = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 1.9, 0.785])
SEAM = State.at(ROBOT, START).position(TOOL)  # a line along y through this point
ON_SEAM = Along(Position(TOOL, Still(SEAM)), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))


def chunk(t, random):
    """Return the next CHUNK joint targets (CHUNK, 7), as an action chunking policy would."""
    ahead = t + DT * np.arange(CHUNK)
    wave = np.outer(np.sin(1.5 * ahead), [0.5, 0.0, 0.2, 0.0, 0.3, 0.0, 0.0])
    return START + wave + random.normal(0.0, 0.02, 7)  # each chunk is wrong in its own way


def run(kind, duration):
    """Return the joint positions (T, 7) and the distance from the seam (T,) [mm]."""
    q, memory, qs, off, random = START, None, [], [], np.random.default_rng(1)
    action = START.copy()
    wish = Posture(action, gain=20.0)  # what is written into the array moves its target
    tasks = [ON_SEAM, wish] if kind == "strict" else [wish]
    for i, t in enumerate(np.arange(0.0, duration, DT)):
        if i % CHUNK == 0:
            actions = chunk(t, random)
        action[:] = actions[i % CHUNK]
        step = solve_ik(ROBOT, q, tasks, dt=DT, memory=memory)
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        off.append(1e3 * np.linalg.norm(ON_SEAM.error(State.at(ROBOT, q))))
        qs.append(q)
    return np.array(qs), np.array(off)


def main(duration=4.0):
    """Follow the policy both ways and print how far the tool is from the seam."""
    strict, plain = (run(kind, duration)[1].max() for kind in ("strict", "policy alone"))
    print(f"the tool is within {strict:.2f} mm of the seam with the policy below it, "
          f"within {plain:.0f} mm with the policy alone")
    return strict, plain


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
