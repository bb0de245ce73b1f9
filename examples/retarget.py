"""The motion of a BVH file on a humanoid: feet first, so that they stay where they step.

Levels: joint limits > feet > chest > hands > posture. The figure walks 1.70 m tall, the robot 1.45.
Beside it: weights 10 : 1, and one level in which all weigh the same. The walk is made by formula,
by motions/make_walk.py; any BVH file with these joints does.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Recorded, read_bvh
from hierarchy.tasks import Pose, Position, Posture, Together
from solvers import make, solve_ik

DT, GAIN, SCALE = 1.0 / 300.0, 300.0, 0.0088  # [s], [1/s], [m of the robot per cm of the figure]
ROBOT = Robot.load("humanoid")
MOTION = read_bvh(Path(__file__).parent / "motions" / "walk.bvh")


def path(joint, offset=(0.0, 0.0, 0.0)):
    """Return the path of a joint of the figure; its axes are x left, y up, z ahead."""
    return Recorded(MOTION.times, SCALE * MOTION.positions[joint][:, [2, 0, 1]] + offset)


SOLES = {side: path(f"{side.title()}Foot", (0.0, 0.0, -8.0 * SCALE)) for side in ("left", "right")}
FEET = Together([Pose(ROBOT.frame(f"{side}_foot"), sole, np.eye(3), gain=GAIN, name=side)
                 for side, sole in SOLES.items()])
HANDS = Together([Position(ROBOT.frame(f"{side}_hand"), path(f"{side.title()}ForeArm end"),
                           gain=GAIN, name=side) for side in SOLES], "hands")
CHEST = Position(ROBOT.frame("chest"), path("Chest"), gain=GAIN, name="chest")
POSTURE = Posture(ROBOT.values(ROBOT.rest))
LEVELS = [FEET, CHEST, HANDS, POSTURE]
WAYS = {"strict": (LEVELS, {}),
        "weights 10:1": (LEVELS, {"resolver": make("weighted", ratio=10.0), "damping": 0.0}),
        "one level": ([Together(LEVELS[:3], "all"), POSTURE], {})}
START = ROBOT.rest + np.r_[path("Hips")(0.0)[0] - ROBOT.rest[:3], np.zeros(ROBOT.nq - 3)]


def run(kind, duration):
    """Return the positions (T, 37) and how far a standing foot slides (T,) [mm]."""
    (tasks, options), landed = WAYS[kind], {}
    q, memory, qs, slip = START, None, [], []
    for t in np.arange(-0.3, duration, DT):  # 0.3 s to take up the first pose
        now = max(t, 0.0)
        step = solve_ik(ROBOT, q, tasks, dt=DT, t=now, memory=memory, **options)
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        state = State.at(ROBOT, q)
        slip.append(0.0)
        for side, sole in SOLES.items():
            here, still = state.position(f"{side}_foot"), np.linalg.norm(sole(now)[1]) < 1e-3
            if t > 0.0 and still:
                slid = 1e3 * np.linalg.norm(here - landed.setdefault(side, here))
                slip[-1] = max(slip[-1], slid)
            else:
                landed.pop(side, None)
        qs.append(q)
    return np.array(qs), np.array(slip)


def main(duration=2.4):
    """Walk each way and print how far the feet slide."""
    strict, weighted, one = (run(kind, duration)[1].max() for kind in WAYS)
    print(f"a standing foot slides by {strict:.2f} mm with strict levels, by {weighted:.1f} mm "
          f"with weights 10:1, by {one:.0f} mm in one level")
    return strict, one


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
