"""An inequality of your own: the elbow of an arm stays on its side of a wall.

Levels: joint limits > `Behind`, written here > the hand follows a circle that draws the elbow out.
Beside it: the same circle without the wall.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hierarchy import Robot, State, Task
from hierarchy.paths import circle
from hierarchy.tasks import Position
from solvers import solve_ik


@dataclass(frozen=True)
class Behind(Task):
    """Keep the point of a position task where normal . p <= limit [m] (m = 1)."""

    point: Position
    normal: tuple[float, float, float]
    limit: float
    gain: float = 10.0
    name: str = "wall"
    kind: str = "inequality"  # J v >= gain error, of p = -normal . point
    dimension = 1

    def error(self, state):
        """How far the point is beyond the limit (1,) [m]."""
        return [np.dot(self.normal, state.position(self.point.frame)) - self.limit]

    def jacobian(self, state):
        """Of -normal . p (1, n)."""
        return -np.dot([self.normal], self.point.jacobian(state))

    def jacobian_derivative(self, state):
        """Its derivative (1, n), for control by accelerations."""
        return -np.dot([self.normal], self.point.jacobian_derivative(state))


DT, WALL = 0.01, -0.05
ROBOT = Robot.load(Path(__file__).parent / "robots" / "iiwa14.urdf")
START = np.array([0.0, 0.6, 0.0, -1.6, 0.0, 0.9, 0.0])
HAND, ELBOW = ROBOT.frame("tool0"), ROBOT.frame("iiwa_joint_4")
PATH = circle(State.at(ROBOT, START).position(HAND) - [0.0, 0.3, 0.0], 0.3, (1.0, 0.0, 0.0), 2.0)
CIRCLE = Position(HAND, PATH)
TASKS = {"strict": [Behind(Position(ELBOW, PATH), (0.0, -1.0, 0.0), -WALL), CIRCLE],
         "without": [CIRCLE]}


def run(kind, duration):
    """Return the joint positions (T, 7) and how far the elbow passes the wall (T,) [mm]."""
    q, memory, qs, beyond = START, None, [], []
    for t in np.arange(0.0, duration, DT):
        step = solve_ik(ROBOT, q, TASKS[kind], dt=DT, t=t, memory=memory)
        q, memory = ROBOT.integrate(q, DT * step.v), step.memory
        beyond.append(1e3 * (WALL - State.at(ROBOT, q).position(ELBOW)[1]))
        qs.append(q)
    return np.array(qs), np.array(beyond)


def main(duration=3.2):
    """Follow the circle both ways and print how far the elbow passes the wall."""
    strict, without = (run(kind, duration)[1].max() for kind in TASKS)
    print(f"the elbow passes the wall by {max(strict, 0.0):.2f} mm with the inequality above the "
          f"hand, by {without:.0f} mm without it")
    return strict, without


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
