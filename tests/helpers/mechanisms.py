"""A closed chain with joints that follow others."""

import numpy as np
import pinocchio as pin

from hierarchy import Robot
from hierarchy.robots.found import Coupled, Loop


def four_bar(rigid=False, ground=None, rocker=None):
    """A crank that turns on, a coupler and a rocker that are pinned together, two fingers on it.

    The ground may be turned (3, 3), and the rocker turn in another joint where it meets it.
    """
    model, numbers = pin.Model(), {"base": 0}
    for name, parent, x in (("crank", "base", 0.0), ("coupler", "crank", 0.2),
                            ("finger", "coupler", 0.1), ("thumb", "coupler", 0.2),
                            ("rocker", "base", 0.5)):
        kind = {"crank": pin.JointModelRUBY(), "rocker": rocker}.get(name) or pin.JointModelRY()
        turn = np.eye(3) if ground is None or parent != "base" else ground
        joint = numbers[name] = model.addJoint(numbers[parent], kind,
                                               pin.SE3(turn, turn @ np.array([x, 0, 0])), name)
        model.appendBodyToJoint(joint, pin.Inertia(1.0, np.array([0.1, 0.0, 0.0]),
                                                   0.01 * np.eye(3)), pin.SE3.Identity())
    model.effortLimit[:], model.upperVelocityLimit[:] = 100.0, 5.0
    for name, joint, x in (("end", "coupler", 0.4), ("tip", "rocker", 0.3)):
        model.addFrame(pin.Frame(name, numbers[joint], 0, pin.SE3(np.eye(3), np.array([x, 0, 0])),
                                 pin.FrameType.OP_FRAME))
    robot = Robot(model, "four-bar", "end")
    robot.loops = (Loop("pin", ("end", "tip"), rigid),)
    robot.coupled = (Coupled("thumb", "finger", (0.1, -1.0, 0.5)),)
    return robot
