"""A robot of one's own under hierarchy.loop: here an arm that is only simulated.

    python examples/loop.py --duration 2

Put your robot's interface in place of `Arm`: it has to say where the joints are, take a velocity,
and stop. All else stays.
"""

from __future__ import annotations

import argparse

import numpy as np

from hierarchy.loop import Loop
from hierarchy.paths import Ellipse
from hierarchy.tasks import JointLimits, Position, Posture
from task_hierarchy import Resolution, Robot, Stack, State, make

PERIOD = 0.002
START = np.array([0.0, 0.6, 0.0, -1.4, 0.0, 0.8, 0.0])


class Arm:
    """What a robot's interface has to do; this one follows its commands at once."""

    def __init__(self, q: np.ndarray) -> None:
        self.q, self.v = q.copy(), np.zeros_like(q)

    def read(self) -> np.ndarray:
        """Return the joints' positions [rad]."""
        return self.q

    def send(self, velocity: np.ndarray) -> None:
        """Take a velocity [rad/s] for the next period."""
        self.v = velocity
        self.q = self.q + PERIOD * velocity

    def stop(self) -> None:
        """Bring the robot to rest in the way that is safe for it."""
        self.v = np.zeros_like(self.q)


class Control:
    """The hand goes round an ellipse, within the joints' limits, near a posture."""

    def __init__(self, arm: Arm) -> None:
        self.arm, self.robot = arm, Robot.named("kuka_lwr")
        self.state, self.resolver, self.memory = State.at(self.robot, START), make("hcod"), None
        self.hand = self.robot.frame(self.robot.end_effector)
        centre = self.state.position(self.hand)
        self.path = Ellipse(tuple(centre), (0.0, 0.08, 0.0), (0.0, 0.0, 0.05), 2.0)
        self.stack = Stack([JointLimits(self.robot, 10.0, PERIOD),
                            Position(self.hand, self.path, gain=10.0), Posture(tuple(START))],
                           "velocity")

    def step(self, t: float) -> Resolution:
        """Return the joints' velocities [rad/s] for time t [s], with a status."""
        state, arm = self.state, self.arm
        state.move(t, arm.read(), arm.v)
        state.commanded = arm.v
        resolution = self.resolver.solve(self.stack.hierarchy(state), self.memory)
        self.memory = resolution.memory
        return resolution

    def error(self) -> float:
        """How far the hand is from its path [m]."""
        state = self.state
        return float(np.linalg.norm(self.path(state.t)[0] - state.position(self.hand)))


def main(duration: float) -> None:
    """Rehearse, then run the loop and say how it went."""
    rehearsal = Control(Arm(START))  # loads or compiles what the ticks will call
    for k in range(500):
        rehearsal.arm.send(rehearsal.step(k * PERIOD).x)
    arm = Arm(START)
    control = Control(arm)
    loop = Loop(PERIOD, overrun="skip", watchdog=0.5, spin=200e-6)
    log = loop.run(control.step, arm.stop, duration, arm.send, record=control.robot.n)
    print(log)
    print(f"the hand is {1e3 * control.error():.2g} mm from its path")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=2.0, help="seconds")
    main(parser.parse_args().duration)
