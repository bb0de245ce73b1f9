"""tsid: inverse dynamics, constraints and one level of weighted tasks.

It holds no references of its own: tasks, contacts and samples are kept by what is returned.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
from tsid import tsid_pywrap as tsid  # 1.7.1 has an empty module above it

from benchmark.peers.scenes import Answer, Arm, Array, Gains, RefusedError, Stand, wrench

_LARGEST = 1e4  # [N] of a contact; must be given
_UNTURNED, _STILL = np.eye(3).ravel(), np.zeros(3)  # an orientation has no weight


def _solved(solver: Any, problem: Any) -> Any:
    found = solver.solve(problem)
    if found.status != 0:
        raise RefusedError(f"status {found.status}")
    return found


def _position(robot: Any, frame: str) -> Any:
    task = tsid.TaskSE3Equality(frame, robot, frame)
    task.setMask(np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    task.useLocalFrame(False)
    return task


def arm(scene: Arm, posture: bool, hard: bool = False) -> tuple[Any, Any]:
    """Accelerations that make the velocity right; velocity bounds are constraints.

    With a gain of one over the period on velocities, and none on positions, v + period a is the
    velocity asked for.
    """
    robot = tsid.RobotWrapper(scene.file, [], False)
    n, period = robot.nv, scene.period
    formulation = tsid.InverseDynamicsFormulationAccForce("tsid", robot, False)
    formulation.computeProblemData(0.0, np.array(scene.start), np.zeros(n))
    bounds = tsid.TaskJointBounds("bounds", robot, period)
    bounds.setVelocityBounds(-np.array(scene.limit), np.array(scene.limit))
    formulation.addMotionTask(bounds, 1.0, 0, 0.0)
    position, joints = _position(robot, scene.frame), tsid.TaskJointPosture("posture", robot)
    for task, rows in ((position, 6), (joints, n)):
        task.setKp(np.zeros(rows))
        task.setKd(np.full(rows, 1.0 / period))
    formulation.addMotionTask(position, scene.ratio**2, 0 if hard else 1, 0.0)
    if posture:
        formulation.addMotionTask(joints, 1.0, 1, 0.0)
    wanted, rates = tsid.TrajectorySample(12, 6), tsid.TrajectorySample(n)
    wanted.value(np.append(np.zeros(3), _UNTURNED))
    solver, problem = tsid.SolverHQuadProgFast("solver"), None

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        nonlocal problem
        # The position is needed before computeProblemData, which computes it as well.
        data = formulation.data()
        pin.framesForwardKinematics(robot.model(), data, q)
        p = data.oMf[position.frame_id].translation
        wanted.derivative(np.append(scene.wanted(p, goal, rate), _STILL))
        position.setReference(wanted)
        rates.derivative(scene.still(q))
        joints.setReference(rates)
        sized, problem = problem is not None, formulation.computeProblemData(t, q, v)
        if not sized:
            solver.resize(formulation.nVar, formulation.nEq, formulation.nIn)
        return np.asarray(v + period * formulation.getAccelerations(_solved(solver, problem)))

    velocity.kept = bounds  # type: ignore[attr-defined]
    return velocity, lambda: solver.solve(problem)


def stand(scene: Stand, solver: str) -> tuple[Any, Any]:
    """Physics, contacts, friction and torque limits hard; the tasks weighted below."""
    robot = tsid.RobotWrapper(scene.file, [], pin.JointModelFreeFlyer(), False)
    if list(robot.model().names)[2:] != list(scene.joints):
        raise RefusedError("its joints are in another order")
    formulation = tsid.InverseDynamicsFormulationAccForce("tsid", robot, False)
    formulation.computeProblemData(0.0, np.array(scene.rest), np.zeros(robot.nv))
    soles = [_contact(scene, robot, formulation, sole) for sole in scene.soles]
    limits = tsid.TaskActuationBounds("limits", robot)
    limits.setBounds(-np.array(scene.torque), np.array(scene.torque))
    formulation.addActuationTask(limits, 1.0, 0, 0.0)
    *tasks, joints = _tasks(scene, robot, formulation)
    samples = [tsid.TrajectorySample(3), *(tsid.TrajectorySample(12, 6) for _ in scene.hands)]
    rest = tsid.TrajectorySample(len(scene.joints))
    rest.value(np.array(scene.posture))
    joints.setReference(rest)
    solving, problem = getattr(tsid, solver)("solver"), None
    solving.resize(formulation.nVar, formulation.nEq, formulation.nIn)

    def tick(t: float, q: Array, v: Array, targets: Array) -> Callable[[], Answer]:
        nonlocal problem
        for k, (task, sample, (p, dp, ddp)) in enumerate(zip(tasks, samples, targets, strict=True)):
            sample.value(np.concatenate((p, _UNTURNED)) if k else p)
            sample.derivative(np.concatenate((dp, _STILL)) if k else dp)
            sample.second_derivative(np.concatenate((ddp, _STILL)) if k else ddp)
            task.setReference(sample)
        problem = formulation.computeProblemData(t, q, v)
        found = _solved(solving, problem)
        return partial(answer, found, formulation.getActuatorForces(found),
                       formulation.getAccelerations(found))

    def answer(found: Any, torques: Array, a: Array) -> Answer:
        wrenches = []
        for sole in scene.soles:
            R = robot.framePosition(formulation.data(), robot.model().getFrameId(sole)).rotation
            forces = np.array(formulation.getContactForce(sole, found)).reshape(4, 3)
            wrenches.append(wrench(R, scene.corners, forces))
        return Answer(np.array(a), np.array(torques), np.array(wrenches))

    tick.kept = soles, limits, joints, rest  # type: ignore[attr-defined]
    return tick, lambda: solving.solve(problem)


def _tasks(scene: Stand, robot: Any, formulation: Any) -> list[Any]:
    """Return the tasks of the centre of mass, the hands and the joints."""
    asked: list[tuple[Any, Gains, int]] = [
        (tsid.TaskComEquality("com", robot), scene.com, 3),
        *((_position(robot, hand), scene.hand, 6) for hand in scene.hands),
        (tsid.TaskJointPosture("posture", robot), scene.joint, len(scene.joints))]
    for task, (stiffness, damping, weight), rows in asked:
        task.setKp(np.full(rows, stiffness))
        task.setKd(np.full(rows, damping))
        formulation.addMotionTask(task, weight**2, 1, 0.0)
    return [task for task, _, _ in asked]


def _contact(scene: Stand, robot: Any, formulation: Any, sole: str) -> Any:
    contact = tsid.Contact6d(sole, robot, sole, np.ascontiguousarray(scene.corners.T),
                             np.array([0.0, 0.0, 1.0]), scene.friction, 0.0, _LARGEST)
    contact.setKp(np.full(6, scene.contact[0]))
    contact.setKd(np.full(6, scene.contact[1]))
    frame = robot.model().getFrameId(sole)
    contact.setReference(robot.framePosition(formulation.data(), frame))
    formulation.addRigidContact(contact, scene.force**2, 1.0, 0)
    return contact
