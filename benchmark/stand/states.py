"""The humanoid, what is asked of it, and the states at which all are asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmark.stand.ours import robot_of
from benchmark.stand.scene import Circle, Stand, write_stand
from benchmark.urdf import urdf
from hierarchy import Robot, Stack, State
from hierarchy.paths import Ellipse, Still
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.tasks import CentreOfMass, Pose, Position, Posture, Together
from solvers import make

TICKS = 1000
_SWAY = 0.01, 0.04    # [m] of the centre of mass, forward and sideways
_HAND = 0.05          # [m]
_RATE = 2 * np.pi     # [rad/s]
_SOLE = 0.055         # [m] from the foot's frame forward to the middle of the sole
_NOISE = 1e-4, 1e-3   # standard deviation of q [rad, m] and v [rad/s, m/s], as from sensors
_SEED = 16


def make_stand(folder: Path, ticks: int = TICKS) -> tuple[Stand, dict[str, Array]]:
    """Write the robot, the scene and the states into a folder; return the scene and the states.

    The states are those of a robot that follows the circles, with noise, whether its soles can push
    as they would have to or not: no entrant is asked where the answers of another led.
    """
    scene = _scene(folder)
    states = _followed(scene, ticks)
    write_stand(scene, folder / "scene.json")
    np.savez(folder / "states.npz", allow_pickle=False, **states)
    return scene, states


def _scene(folder: Path) -> Stand:
    table = Robot.named("humanoid")
    feet = [table.frame(f"{side}_foot") for side in ("left", "right")]
    soles = [Frame(f"{foot.name[:-5]}_sole", foot.joint,
                   foot.offset + foot.rotation @ [_SOLE, 0.0, 0.0], foot.rotation) for foot in feet]
    hands = [table.frame(f"{side}_hand") for side in ("left", "right")]
    file = folder / "humanoid.urdf"
    file.write_text(urdf(table, [*soles, *hands]))
    names = tuple(frame.name for frame in hands)
    robot = Robot.from_file(file, names[1], base="floating", shapes=False)
    order = [table.coordinate(name) for name in robot.joint_names[1:]]
    rest = np.concatenate([table.rest[:7], table.rest[order]])
    state = State.at(robot, rest)
    com = CentreOfMass(robot, Still((0.0, 0.0, 0.0))).position(state)
    return Stand(str(file), robot.joint_names[1:], tuple(sole.name for sole in soles), names,
                 tuple(rest.tolist()), tuple(rest[7:].tolist()),
                 tuple(robot.effort_limit[6:].tolist()),
                 (_circle(com, (_SWAY[0], 0.0, 0.0), (0.0, _SWAY[1], 0.0)),
                  *(_circle(state.position(robot.frame(name)), (_HAND, 0.0, 0.0),
                            (0.0, 0.0, _HAND)) for name in names)))


def _circle(start: Array, cosine: tuple[float, ...], sine: tuple[float, ...]) -> Circle:
    """Return the circle through `start` about a point behind it."""
    return tuple((start - cosine).tolist()), cosine, sine, _RATE


def _followed(scene: Stand, ticks: int) -> dict[str, Array]:
    """Return t, q, v of each tick: inverse kinematics along the circles, feet where they are."""
    robot = robot_of(scene)
    state, resolver = State.at(robot, scene.rest), make("hcod")
    com, *hands = (Ellipse(*circle) for circle in scene.circles)
    feet = [Pose(frame, Still(tuple(state.position(frame))), state.rotation(frame), name=frame.name)
            for frame in map(robot.frame, scene.soles)]
    tasks = [Position(robot.frame(name), path, name=name)
             for name, path in zip(scene.hands, hands, strict=True)]
    stack = Stack([Together(feet, "feet"), CentreOfMass(robot, com), *tasks,
                   Posture(scene.posture)], "velocity")
    kept: dict[str, list[Array]] = {"t": [], "q": [], "v": []}
    for k in range(ticks):
        v = resolver.solve(stack.hierarchy(state)).x
        for key, value in zip(kept, (np.array(state.t), state.q.copy(), v), strict=True):
            kept[key].append(value)
        state.move((k + 1) * scene.period, robot.integrate(state.q, scene.period * v), v)
    rng, (positions, speeds) = np.random.default_rng(_SEED), _NOISE
    noise = rng.normal(size=(2, ticks, robot.n))
    return {"t": np.array(kept["t"]), "v": np.array(kept["v"]) + speeds * noise[1],
            "q": np.array([robot.integrate(q, positions * step)
                           for q, step in zip(kept["q"], noise[0], strict=True)])}
