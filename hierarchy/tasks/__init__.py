"""The tasks that are shipped, one per file; `TASKS` lists them by name."""

from hierarchy.task import Task
from hierarchy.tasks.avoidance import Avoidance
from hierarchy.tasks.com import CentreOfMass
from hierarchy.tasks.coupling import JointCoupling
from hierarchy.tasks.cumulated_repulsion import CumulatedRepulsion
from hierarchy.tasks.danger_bounds import DangerBounds
from hierarchy.tasks.joint_limits import JointLimits
from hierarchy.tasks.look_at import LookAt
from hierarchy.tasks.manipulability import Manipulability
from hierarchy.tasks.pointing import Pointing
from hierarchy.tasks.pose import Pose
from hierarchy.tasks.position import Position
from hierarchy.tasks.posture import JointDamping, Posture
from hierarchy.tasks.relative import RelativePose
from hierarchy.tasks.self_separation import SelfSeparation
from hierarchy.tasks.separation import Separation
from hierarchy.tasks.torque_limits import TorqueLimits

TASKS: dict[str, type[Task]] = {
    "avoidance": Avoidance, "centre of mass": CentreOfMass, "coupling": JointCoupling,
    "cumulated repulsion": CumulatedRepulsion, "damping": JointDamping,
    "danger bounds": DangerBounds, "joint limits": JointLimits, "look-at": LookAt,
    "manipulability": Manipulability, "pointing": Pointing, "pose": Pose,
    "position": Position, "posture": Posture, "relative pose": RelativePose,
    "self-separation": SelfSeparation, "separation": Separation, "torque limits": TorqueLimits,
}

__all__ = ["TASKS", "Avoidance", "CentreOfMass", "CumulatedRepulsion", "DangerBounds",
           "JointCoupling", "JointDamping", "JointLimits", "LookAt", "Manipulability", "Pointing",
           "Pose", "Position", "Posture", "RelativePose", "SelfSeparation", "Separation",
           "TorqueLimits"]
