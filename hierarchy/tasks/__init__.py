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

__all__ = ["TASKS", "Along", "Avoidance", "BaseDynamics", "CentreOfMass", "CentreOfPressure",
           "ContactForce", "ContactMotion", "CumulatedRepulsion", "DangerBounds", "FrameLog",
           "Friction", "JointCoupling", "JointDamping", "JointLimits", "LeastForce", "LookAt",
           "Manipulability", "Mechanism", "Momentum", "Orientation", "Pointing", "Pose", "Position",
           "Posture", "RelativePose", "SelfSeparation", "Separation", "Together", "TorqueLimits",
           "TorqueStep", "model_rows"]

TASKS: dict[str, type[Task]] = dict(sorted(
    (kind.name, kind) for kind in map(globals().get, __all__)
    if isinstance(kind, type) and issubclass(kind, Task)))
