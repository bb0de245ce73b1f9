"""placo: tasks weighted, hard, or hard but scaled, in one quadratic program built in C++."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
import placo

from benchmark.peers.common import PERIOD, iterated
from benchmark.peers.scenes import Answer, Arm, Array, Gains, RefusedError, Stand

_REGULARISED = 1e-12  # as in pink and mink
_BASE = 6             # velocities of the base, which has one coordinate more


def _kinematics(file: str, period: float) -> tuple[Any, Any]:
    robot = placo.RobotWrapper(file, placo.Flags.ignore_collisions)
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.enable_velocity_limits(True)
    solver.dt = period
    return robot, solver


def arm(scene: Arm, posture: bool, priority: str = "soft") -> tuple[Any, None]:
    """A position task and a joints task; targets are those after one period."""
    robot, solver = _kinematics(scene.file, scene.period)
    solver.enable_joint_limits(False)
    for name, limit in zip(scene.joints, scene.limit, strict=True):
        robot.set_velocity_limit(name, limit)
    position = solver.add_position_task(scene.frame, np.zeros(3))
    position.configure("position", priority, scene.ratio**2)
    solver.add_regularization_task(_REGULARISED)
    joints = solver.add_joints_task() if posture else None
    if joints is not None:
        joints.configure("posture", "soft", 1.0)

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        robot.state.q[_BASE + 1:] = q
        robot.update_kinematics()
        p = robot.get_T_world_frame(scene.frame)[:3, 3]
        position.target_world = scene.after(p, goal, rate)
        if joints is not None:
            joints.set_joints(dict(zip(scene.joints, q + scene.period * scene.still(q),
                                       strict=True)))
        return np.asarray(solver.solve(False)[-len(q):] / scene.period)

    return velocity, None


def stand(scene: Stand) -> tuple[Any, None]:
    """Planar contacts and limits hard; a task for the centre of mass, each hand and the joints."""
    robot = placo.RobotWrapper(scene.file, placo.Flags.ignore_collisions)
    to_theirs = [list(robot.joint_names()).index(name) for name in scene.joints]

    def place(q: Array, v: Array) -> None:
        state = robot.state
        state.q[:_BASE + 1], state.qd[:_BASE] = q[:_BASE + 1], v[:_BASE]
        state.q[_BASE + 1:][to_theirs] = q[_BASE + 1:]
        state.qd[_BASE:][to_theirs] = v[_BASE:]
        robot.update_kinematics()

    place(np.array(scene.rest), np.zeros(len(scene.rest) - 1))
    solver = placo.DynamicsSolver(robot)
    solver.dt = scene.period
    solver.enable_joint_limits(False)
    solver.enable_velocity_limits(False)
    solver.enable_torque_limits(True)
    for name, limit in zip(scene.joints, scene.torque, strict=True):
        robot.set_torque_limit(name, limit)
    soles = [_contact(scene, robot, solver, sole) for sole in scene.soles]
    tasks = [_added(solver.add_com_task(np.zeros(3)), "com", scene.com),
             *(_added(solver.add_position_task(hand, np.zeros(3)), hand, scene.hand)
               for hand in scene.hands)]
    joints = _added(solver.add_joints_task(), "posture", scene.joint)
    joints.set_joints(dict(zip(scene.joints, scene.posture, strict=True)))

    def tick(t: float, q: Array, v: Array, targets: Array) -> Callable[[], Answer]:
        place(q, v)
        for task, (p, dp, ddp) in zip(tasks, targets, strict=True):
            task.target_world, task.dtarget_world, task.ddtarget_world = p, dp, ddp
        found = solver.solve(False)
        if not found.success:
            raise RefusedError("no success")
        return partial(answer, found)

    def answer(found: Any) -> Answer:
        a, torques, wrenches = np.array(found.qdd), np.array(found.tau), []
        for contact, sole in zip(soles, scene.soles, strict=True):
            R, w = robot.get_T_world_frame(sole)[:3, :3], np.array(contact.wrench)
            wrenches.append(np.concatenate([R @ w[:3], R @ w[3:]]))
        return Answer(np.concatenate([a[:_BASE], a[_BASE:][to_theirs]]),
                      torques[_BASE:][to_theirs], np.array(wrenches))

    return tick, None


def _contact(scene: Stand, robot: Any, solver: Any, sole: str) -> Any:
    task = solver.add_frame_task(sole, robot.get_T_world_frame(sole))
    task.configure(sole, "hard", 1.0, 1.0)
    for part in (task.position(), task.orientation()):
        part.kp, part.kd = scene.contact[:2]
    contact = solver.add_planar_contact(task)
    contact.length, contact.width = 2 * scene.half[0], 2 * scene.half[1]
    contact.mu = scene.friction
    contact.unilateral = True
    contact.weight_forces = contact.weight_moments = scene.force**2
    contact.weight_tangentials = scene.force**2
    return contact


def _added(task: Any, name: str, gains: Gains) -> Any:
    task.kp, task.kd, weight = gains
    task.configure(name, "soft", weight**2)
    return task


def reach(file: str, frames: list[str], tolerance: float) -> Any:
    """Tasks of poses, weighted alike, with its limits."""
    robot, solver = _kinematics(file, PERIOD)
    tasks = [solver.add_frame_task(name, np.eye(4)) for name in frames]
    for task, name in zip(tasks, frames, strict=True):
        task.configure(name, "soft", 1.0, 1.0)
    solver.add_regularization_task(1e-6)
    goals: list[Array] = []

    def aim(poses: Array) -> None:
        goals[:] = poses
        for task, pose in zip(tasks, poses, strict=True):
            task.T_world_frame = pose

    def at(q: Array) -> float:
        robot.state.q[_BASE + 1:] = q
        robot.update_kinematics()
        return float(np.linalg.norm([
            [pose[:3, 3] - here[:3, 3], pin.log3(pose[:3, :3] @ here[:3, :3].T)]
            for here, pose in zip(map(robot.get_T_world_frame, frames), goals, strict=True)]))

    def step(q: Array) -> Array:
        solver.solve(True)
        return np.array(robot.state.q[_BASE + 1:])

    return iterated(aim, at, step, tolerance)
