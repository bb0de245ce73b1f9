"""The tasks that are shipped, one per file; `TASKS` lists them by name."""

from hierarchy.task import Task
from hierarchy.tasks.along import Along
from hierarchy.tasks.avoidance import Avoidance
from hierarchy.tasks.base_dynamics import BaseDynamics
from hierarchy.tasks.centre_of_pressure import CentreOfPressure
from hierarchy.tasks.com import CentreOfMass
from hierarchy.tasks.contact_force import ContactForce
from hierarchy.tasks.contact_motion import ContactMotion
from hierarchy.tasks.coupling import JointCoupling
from hierarchy.tasks.cumulated_repulsion import CumulatedRepulsion
from hierarchy.tasks.danger_bounds import DangerBounds
from hierarchy.tasks.frame_log import FrameLog
from hierarchy.tasks.friction import Friction
from hierarchy.tasks.joint_limits import JointLimits
from hierarchy.tasks.least_force import LeastForce
from hierarchy.tasks.look_at import LookAt
from hierarchy.tasks.manipulability import Manipulability
from hierarchy.tasks.mechanism import Mechanism, model_rows
from hierarchy.tasks.momentum import Momentum
from hierarchy.tasks.pointing import Pointing
from hierarchy.tasks.pose import Pose
from hierarchy.tasks.position import Position
from hierarchy.tasks.posture import JointDamping, Posture
from hierarchy.tasks.relative import RelativePose
from hierarchy.tasks.self_separation import SelfSeparation
from hierarchy.tasks.separation import Separation
from hierarchy.tasks.together import Together
from hierarchy.tasks.torque_limits import TorqueLimits

TASKS: dict[str, type[Task]] = {
    "along": Along, "avoidance": Avoidance, "base dynamics": BaseDynamics,
    "centre of mass": CentreOfMass,
    "centre of pressure": CentreOfPressure, "contact force": ContactForce,
    "contact motion": ContactMotion, "coupling": JointCoupling,
    "cumulated repulsion": CumulatedRepulsion, "damping": JointDamping,
    "danger bounds": DangerBounds, "frame": FrameLog, "friction": Friction,
    "joint limits": JointLimits,
    "least force": LeastForce, "look-at": LookAt, "manipulability": Manipulability,
    "momentum": Momentum, "pointing": Pointing, "pose": Pose, "position": Position,
    "posture": Posture, "relative pose": RelativePose, "self-separation": SelfSeparation,
    "separation": Separation, "together": Together, "torque limits": TorqueLimits,
}

__all__ = ["TASKS", "Along", "Avoidance", "BaseDynamics", "CentreOfMass", "CentreOfPressure",
           "ContactForce", "ContactMotion", "CumulatedRepulsion", "DangerBounds", "FrameLog",
           "Friction", "JointCoupling", "JointDamping", "JointLimits", "LeastForce", "LookAt",
           "Manipulability", "Mechanism", "Momentum", "Pointing", "Pose", "Position", "Posture",
           "RelativePose", "SelfSeparation", "Separation", "Together", "TorqueLimits",
           "model_rows"]
