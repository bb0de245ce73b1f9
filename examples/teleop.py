"""Teleoperation: targets arrive at 30 Hz from a hand that shakes and jumps, late and irregularly.

Levels: limits of position, speed and acceleration > hand to the newest target > posture.
Beside it: the same stream without the limits of acceleration. Put your device in place of `stream`.
"""

import sys
from pathlib import Path

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Still
from hierarchy.tasks import JointLimits, Position, Posture
from solvers import solve_ik

DT, MOST = 0.005, 15.0  # [s], [rad/s^2]
ROBOT = Robot.load(Path(__file__).parent / "robots" / "panda.urdf")
HAND = ROBOT.frame("panda_hand_tcp")
START = np.array([0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.8])
HOME = State.at(ROBOT, START).position(HAND)


def stream(duration):
    """Yield (time of arrival [s], target (3,) [m]); after 1 s it jumps by 30 cm."""
    random, t = np.random.default_rng(1), 0.0
    while t < duration:
        jump = [0.0, 0.3, 0.0] if t > 1.0 else [0.0, 0.0, 0.0]
        circle = 0.1 * np.array([0.0, np.sin(2.0 * t), 1.0 - np.cos(2.0 * t)])
        yield t, HOME + circle + jump + random.normal(0.0, 0.002, 3)
        t += 1.0 / 30.0 + random.exponential(0.01)


def run(kind, duration):
    """Return the joint positions (T, 7) and the largest acceleration (T,) [rad/s^2]."""
    limits = JointLimits(ROBOT, MOST, DT) if kind == "limits" else True
    messages, target = iter([*stream(duration), (np.inf, HOME)]), np.array(HOME)
    tasks = [Position(HAND, Still(target), gain=8.0), Posture(START)]
    message = next(messages)
    q, v, memory, qs, most = START, np.zeros(7), None, [], []
    for t in np.arange(0.0, duration, DT):
        while message[0] <= t:  # only the newest counts
            target[:], message = message[1], next(messages)
        step = solve_ik(ROBOT, q, tasks, limits=limits, dt=DT, v=v, memory=memory)
        most.append(np.abs(step.v - v).max() / DT)
        q, v, memory = ROBOT.integrate(q, DT * step.v), step.v, step.memory
        qs.append(q)
    return np.array(qs), np.array(most)


def main(duration=4.0):
    """Follow the stream both ways and print the largest acceleration of a joint."""
    strict, free = (run(kind, duration)[1].max() for kind in ("limits", "without"))
    print(f"largest joint acceleration: {strict:.2f} rad/s^2 where {MOST:g} are allowed, "
          f"{free:.0f} without that limit")
    return strict, free


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
