"""The tasks that are shipped; `TASKS` lists them by name."""

from hierarchy.task import Task
from hierarchy.tasks.avoidance import Avoidance, CumulatedRepulsion, DangerBounds
from hierarchy.tasks.com import CentreOfMass, Momentum
from hierarchy.tasks.contacts.contact_motion import ContactMotion
from hierarchy.tasks.contacts.forces import (
    BaseDynamics,
    ContactForce,
    LeastForce,
    TorqueLimits,
    TorqueStep,
)
from hierarchy.tasks.contacts.friction import CentreOfPressure, Friction
from hierarchy.tasks.joints.coupling import JointCoupling
from hierarchy.tasks.joints.joint_limits import JointLimits
from hierarchy.tasks.joints.mechanism import Mechanism, model_rows
from hierarchy.tasks.joints.posture import JointDamping, Posture
from hierarchy.tasks.manipulability import Manipulability
from hierarchy.tasks.pointing import LookAt, Pointing
from hierarchy.tasks.pose import FrameLog, Orientation, Pose, RelativePose
from hierarchy.tasks.position import Along, Position
from hierarchy.tasks.separation import SelfSeparation, Separation
from hierarchy.tasks.together import Together

TASKS: dict[str, type[Task]] = {
    "along": Along, "avoidance": Avoidance, "base dynamics": BaseDynamics,
    "centre of mass": CentreOfMass,
    "centre of pressure": CentreOfPressure, "contact force": ContactForce,
    "contact motion": ContactMotion, "coupling": JointCoupling,
    "cumulated repulsion": CumulatedRepulsion, "damping": JointDamping,
    "danger bounds": DangerBounds, "frame": FrameLog, "friction": Friction,
    "joint limits": JointLimits,
    "least force": LeastForce, "look-at": LookAt, "manipulability": Manipulability,
    "momentum": Momentum, "orientation": Orientation, "pointing": Pointing, "pose": Pose,
    "position": Position,
    "posture": Posture, "relative pose": RelativePose, "self-separation": SelfSeparation,
    "separation": Separation, "together": Together, "torque limits": TorqueLimits,
    "torque step": TorqueStep,
}

__all__ = ["TASKS", "Along", "Avoidance", "BaseDynamics", "CentreOfMass", "CentreOfPressure",
           "ContactForce", "ContactMotion", "CumulatedRepulsion", "DangerBounds", "FrameLog",
           "Friction", "JointCoupling", "JointDamping", "JointLimits", "LeastForce", "LookAt",
           "Manipulability", "Mechanism", "Momentum", "Orientation", "Pointing", "Pose", "Position",
           "Posture", "RelativePose", "SelfSeparation", "Separation", "Together", "TorqueLimits",
           "TorqueStep", "model_rows"]
