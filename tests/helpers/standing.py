"""The humanoid of our own tables on two feet, for tests of whole-body dynamics."""

import numpy as np
import pinocchio as pin

from hierarchy import Robot, Stack, State, tasks
from hierarchy.contacts import Contact, Contacts
from hierarchy.paths import Still
from hierarchy.task import Rows

# Drives of `plant.kind = "torque"` without what the controller does not know.
IDEAL = {"joint_friction": 0.0, "joint_damping": 0.0, "armature": 0.0}
ROBOT = Robot.named("humanoid")
WEIGHT = 9.81 * ROBOT.masses.sum()  # [N]


def feet(friction=0.7, robot=ROBOT):
    """Both soles as contacts."""
    return Contacts(robot, [Contact.rectangle(robot.frame(f"{side}_foot"), (-0.05, 0.16),
                                              (-0.04, 0.04), friction)
                            for side in ("left", "right")])


def opening(ramp=0.2):
    """The left foot stays; the right one is open from 1 to 2 s."""
    return Contacts(ROBOT, [LEFT, Contact(RIGHT.frame, RIGHT.points, open=((1.0, 2.0),),
                                          ramp=ramp)])


PALM = Contact(ROBOT.frame("left_hand"), [(0.01, 0.02, 0.03)], 0.4, (-1.0, 0.2, 0.1))
LEFT, RIGHT = feet().contacts
# A sole, a point of a hand on a wall, and the other sole: every kind of contact.
CONTACTS = Contacts(ROBOT, [LEFT, PALM, RIGHT])


def moving_state(seed):
    """A state near the rest posture that moves in all joints."""
    rng = np.random.default_rng(seed)
    q = pin.integrate(ROBOT.model, ROBOT.rest, 0.3 * rng.normal(size=ROBOT.n))
    return State.at(ROBOT, q, rng.normal(size=ROBOT.n))


def standing_stack(state, contacts, shift=(0.0, 0.0, 0.0), fraction=1.0, faces=4):
    """Seven levels: the centre of mass is asked `shift` [m] beside where it is."""
    com = state.centre_of_mass()
    hands = [tasks.Position(ROBOT.frame(hand), Still(state.position(ROBOT.frame(hand))), name=hand)
             for hand in ("left_hand", "right_hand")]
    return Stack([
        tasks.Together([tasks.BaseDynamics(contacts), tasks.ContactMotion(contacts)], "physics"),
        tasks.Together([tasks.TorqueLimits(ROBOT, fraction, contacts=contacts),
                        tasks.Friction(contacts, faces)], "limits"),
        tasks.CentreOfMass(ROBOT, Still(com + shift)), *hands,
        tasks.Posture(tuple(state.q[7:])), tasks.LeastForce(contacts)], "torque", contacts=contacts)


def wrenches_of(state, contacts, forces):
    """Contact forces (p, 3) as pinocchio takes them: a wrench on each joint, in its own frame."""
    wrenches = [pin.Force.Zero() for _ in range(ROBOT.model.njoints)]
    for joint, offset, force in zip(*contacts.points, forces, strict=True):
        local = state._placement(joint)[0].T @ force
        wrenches[joint] += pin.Force(local, np.cross(offset, local))
    return wrenches


def drift_of(contacts, state):
    """Accelerations (3 p,) of the contact points with a = 0, by pinocchio."""
    model = contacts.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, state.q, state.v, np.zeros(model.nv))
    return np.concatenate([pin.getFrameClassicalAcceleration(
        model, data, int(joint), pin.SE3(np.eye(3), offset), pin.LOCAL_WORLD_ALIGNED).linear
        for joint, offset in zip(*contacts.points, strict=True)])


def written(task, state, level="acceleration", n=ROBOT.n):
    """Return the rows A (dimension, n), lower and upper that a task writes."""
    rows = Rows.empty(task.dimension, n)
    task.writer(state, level, rows)()
    return rows


def accelerations(plant, torques):
    """Accelerations (n,) of a TorqueRobot under torques, now, in the robot's convention."""
    import mujoco

    plant.data.ctrl[:] = torques
    mujoco.mj_forward(plant.model, plant.data)
    a = plant.data.qacc[plant._rates]
    R = plant.data.xmat[1].reshape(3, 3)  # of the base; d(R^T p')/dt
    a[:3] = R.T @ a[:3] - np.cross(plant.v[3:6], plant.v[:3])
    return a
