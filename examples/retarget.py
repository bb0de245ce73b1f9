"""The motion of a BVH file on a humanoid: feet first, so that they stay where they step.

Levels: joint limits > feet > chest > hands > posture. The figure walks 1.70 m tall, the robot 1.45.
Beside it: the same tasks with weights 10 : 1, as retargeting mostly is. motions/make_walk.py made
the walk, by formula; any BVH file with these joints does.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Recorded, read_bvh
from hierarchy.tasks import Pose, Position, Posture, Together
from solvers import make, solve_ik

DT, SCALE = 1.0 / 240.0, 0.0088  # [s]; metres of the robot for a centimetre of the figure
ROBOT = Robot.load("humanoid")
MOTION = read_bvh(Path(__file__).parent / "motions" / "walk.bvh")
SOLVE = {"strict": {}, "weights 10:1": {"resolver": make("weighted", ratio=10.0), "damping": 0.0}}


def path(joint, offset=(0.0, 0.0, 0.0)):
    """Return the path of a joint of the figure; its axes are x left, y up, z ahead."""
    return Recorded(MOTION.times, SCALE * MOTION.positions[joint][:, [2, 0, 1]] + offset)


SOLES = {side: path(f"{side.title()}Foot", (0.0, 0.0, -8.0 * SCALE)) for side in ("left", "right")}
FEET = Together([Pose(ROBOT.frame(f"{side}_foot"), sole, np.eye(3), gain=1.0 / DT, name=side)
                 for side, sole in SOLES.items()])
HANDS = Together([Position(ROBOT.frame(f"{side}_hand"), path(f"{side.title()}ForeArm end"),
                           name=side) for side in SOLES], "hands")
CHEST = Position(ROBOT.frame("chest"), path("Chest"), name="chest")
TASKS = [FEET, CHEST, HANDS, Posture(ROBOT.values(ROBOT.rest))]
START = ROBOT.rest + np.r_[path("Hips")(0.0)[0] - ROBOT.rest[:3], np.zeros(ROBOT.nq - 3)]


def run(kind, duration):
    """Return the positions (T, 37) and the farthest that a foot slides while it stands [mm]."""
    q, memory, qs, slip, landed = START, None, [], 0.0, {}
    for t in np.arange(-0.5, duration, DT):  # half a second to take up the first pose
        now = max(t, 0.0)
        step = solve_ik(ROBOT, q, TASKS, dt=DT, t=now, memory=memory, **SOLVE[kind])
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        state = State.at(ROBOT, q)
        for side, sole in SOLES.items():
            here, still = state.position(f"{side}_foot"), np.linalg.norm(sole(now)[1]) < 1e-3
            if t > 0.0 and still:
                slip = max(slip, 1e3 * np.linalg.norm(here - landed.setdefault(side, here)))
            else:
                landed.pop(side, None)
        qs.append(q)
    return np.array(qs), float(slip)


def main(duration=2.4):
    """Walk both ways and print how far the feet slide."""
    strict, weighted = (run(kind, duration)[1] for kind in SOLVE)
    print(f"a standing foot slides by {strict:.2f} mm with strict levels, "
          f"by {weighted:.1f} mm with weights 10:1")
    return strict, weighted


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
