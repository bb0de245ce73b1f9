"""Time pink's `solve_ik` and ours beside it, on scenes like those of pink's own examples.

Both answer the same call at each tick of a closed loop that follows pink, and take turns at being
first. Needs the extras `adapters`, `qp` and `robots`. Prints a table.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
import pink
import typer
from pink.barriers import PositionBarrier
from pink.tasks import FrameTask, PostureTask

from hierarchy import Robot
from solvers.adapters.for_pink import solve_ik

PERIOD = 1.0 / 200.0  # [s]
ANSWERS = 1e-3        # [rad/s] a difference above this is another answer


@dataclass
class Example:
    """A configuration, its tasks, arguments of `solve_ik`, and how the targets move."""

    configuration: pink.Configuration
    tasks: list[Any]
    arguments: dict[str, Any]
    move: Callable[[float], None]


def arm(model: str, tip: str, q: list[float], lm_damping: float = 0.0,
        barriers: bool = False) -> Example:
    """One hand follows a circle, with a weak posture: pink's examples of arms."""
    robot = Robot.load(f"example_robot_data:{model}")
    configuration = pink.Configuration(robot.model, robot.model.createData(), np.array(q))
    hand = FrameTask(tip, position_cost=1.0, orientation_cost=1.0, lm_damping=lm_damping)
    posture = PostureTask(cost=1e-3)
    for task in (hand, posture):
        task.set_target_from_configuration(configuration)
    first = hand.transform_target_to_world.translation.copy()

    def move(t: float) -> None:
        turn = 0.1 * np.array([np.sin(t), 0.5 * np.sin(2.0 * t), 0.0])
        hand.transform_target_to_world.translation[:] = first + turn

    walls = [PositionBarrier(tip, indices=[1], p_min=np.array([first[1] - 0.02]),
                             p_max=np.array([0.6]), gain=np.array([100.0]),
                             safe_displacement_gain=1.0)]
    return Example(configuration, [hand, posture], {"barriers": walls} if barriers else {}, move)


def humanoid() -> Example:
    """Feet stay, hands and pelvis move: pink's example of a humanoid."""
    robot = Robot.load("example_robot_data:talos_reduced", base="floating")
    q = robot.rest.copy()
    for side in ("left", "right"):
        for joint, angle in ((3, -0.45), (4, 0.9), (5, -0.45)):  # bent hip, knee and ankle
            q[robot.coordinate(f"leg_{side}_{joint}_joint")] = angle
        q[robot.coordinate(f"arm_{side}_4_joint")] = -1.0
        q[robot.coordinate(f"arm_{side}_2_joint")] = 0.4 if side == "left" else -0.4
    configuration = pink.Configuration(robot.model, robot.model.createData(), q)
    tasks = [FrameTask(frame, position_cost=1.0, orientation_cost=1.0, lm_damping=1.0)
             for frame in ("left_sole_link", "right_sole_link", "base_link",
                           "wrist_left_ft_link", "wrist_right_ft_link")]
    for task in (*tasks, posture := PostureTask(cost=1e-1)):
        task.set_target_from_configuration(configuration)
    first = tasks[2].transform_target_to_world.translation.copy()

    def move(t: float) -> None:
        tasks[2].transform_target_to_world.translation[:] = first + 0.03 * np.sin(t) * UP

    return Example(configuration, [*tasks, posture], {"safety_break": False}, move)


UP = np.array([0.0, 0.0, 1.0])
UR5, PANDA = [0.0, -1.2, 1.6, -1.9, -1.57, 0.0], [0.0, -0.6, 0.0, -2.2, 0.0, 1.7, 0.8, 0.01, 0.01]
EXAMPLES: dict[str, Callable[[], Example]] = {
    "arm": lambda: arm("panda", "panda_hand_tcp", PANDA),
    "arm, lm_damping": lambda: arm("ur5_robot", "tool0", UR5, lm_damping=1.0),
    "arm, barrier": lambda: arm("ur5_robot", "tool0", UR5, barriers=True),
    "humanoid": humanoid}


def timed(example: Example, ticks: int, solver: str) -> tuple[np.ndarray, float]:
    """Return times (ticks, 3) [us] of pink, of ours strict and in one level, and the difference.

    The difference [rad/s] is that of the last from pink's answer, the largest of all ticks.
    """
    configuration, tasks, arguments = example.configuration, example.tasks, example.arguments
    calls = (lambda: pink.solve_ik(configuration, tasks, PERIOD, solver, **arguments),
             lambda: solve_ik(configuration, tasks, PERIOD, solver, **arguments),
             lambda: solve_ik(configuration, [tasks], PERIOD, solver, **arguments))
    times, apart = np.empty((ticks, 3)), 0.0
    for call in calls:
        call()
    for k in range(ticks):
        example.move(k * PERIOD)
        answers: dict[int, Any] = {}
        for i in np.roll(range(3), k).tolist():
            start = perf_counter()
            answers[i] = calls[i]()
            times[k, i] = 1e6 * (perf_counter() - start)
        apart = max(apart, float(np.abs(answers[2] - answers[0]).max()))
        configuration.integrate_inplace(answers[0], PERIOD)
    return times, apart


def main(ticks: int = 1000, solver: str = "daqp") -> None:
    """Print the table; solver : of pink, a name of qpsolvers."""
    warnings.simplefilter("ignore")  # that hcod answers for a solver of qpsolvers
    print("| example | pink [us] | strict [us] | one level [us] | ours in one level - pink |")
    print("|---|---|---|---|---|")
    for name, make in EXAMPLES.items():
        times, apart = timed(make(), ticks, solver)
        median, tail = np.median(times, axis=0), np.percentile(times, 95, axis=0)
        cells = " | ".join(f"{m:.0f} ({t:.0f})" for m, t in zip(median, tail, strict=True))
        said = f"{apart:.0e} rad/s" if apart < ANSWERS else f"{apart:.2g} rad/s"
        print(f"| {name} | {cells} | {said} |")


if __name__ == "__main__":
    typer.run(main)
