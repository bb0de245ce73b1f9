"""The keys of `[[tasks]]`: tasks of any frames, in order of priority."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from hierarchy.plugins import Group
from scenarios.config.own import OwnSection
from scenarios.config.sections import (
    PLUGIN,
    Finite,
    Flag,
    NotNegative,
    Positive,
    Rows3,
    Section,
    Vector3,
    kind_or,
)
from scenarios.config.tasks import (
    AlongSection,
    PointingSection,
    PointingTask,
    PositionSection,
    PositionTask,
    PostureSection,
    PostureTask,
    Rows,
    TaskName,
    TaskSection,
)


class Listed(Section):
    """A task of `[[tasks]]`; its name defaults to its kind.

    For the sake of the tasks below, each of its rows may `give` that much beyond its least miss, in
    the unit of the rows: [1/s] or [1/s^2] times that of the task, or [N] of forces.
    """

    name: TaskName | None = None
    give: NotNegative = 0.0

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return False

    @property
    def title(self) -> str:
        """The task's name in stacks, messages and tables."""
        return self.name or str(getattr(self, "kind", ""))


class ListedPosition(Listed, PositionTask):
    """The origin of `frame` along a path, by default its initial position, in some `axes`."""

    kind: Literal["position"]
    frame: str
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"


class ListedPose(Listed, AlongSection):
    """Origin and axes of `frame` (6 rows); `rotation` (rows) defaults to the initial one."""

    kind: Literal["pose"]
    frame: str
    rotation: Rows3 | None = None


class ListedFrame(Listed, AlongSection):
    """As `pose`, with the error log(T^-1 T_d) of SE(3) in the axes of `frame` (6 rows)."""

    kind: Literal["frame"]
    frame: str
    rotation: Rows3 | None = None


class ListedCentreOfMass(Listed, AlongSection):
    """The centre of mass along some of the axes "x", "y", "z" of the world."""

    kind: Literal["com"]
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"


class ListedPointing(PointingTask, Listed):
    """The z axis of `frame` at `alpha_d` [deg] from `axis`, or with "inequality" at most that."""

    kind: Literal["pointing"]
    frame: str


class ListedPosture(Listed, PostureTask):
    """All joints to `target` [rad or m], by default the start; `joints` override it by name."""

    kind: Literal["posture"]


class ListedRelative(Listed, TaskSection):
    """The pose of `frame` in the axes of the frame `to` (6 rows), by default the initial one.

    `position` [m] and `rotation` (rows) are those wanted; without `orientation` only the position
    counts (3 rows).
    """

    kind: Literal["relative"]
    frame: str
    to: str
    position: Vector3 | None = None
    rotation: Rows3 | None = None
    orientation: Flag = True

    @model_validator(mode="after")
    def _counts_its_rotation(self) -> Self:
        if self.rotation is not None and not self.orientation:
            raise ValueError("rotation goes with orientation = true")
        return self


class ListedCoupling(Listed, TaskSection):
    """The sum of factor times position over `joints` at `value` [rad or m] (1 row)."""

    unit: ClassVar[str] = "rad"
    kind: Literal["coupling"]
    joints: Annotated[dict[str, Finite], Field(min_length=1)]
    value: Finite = 0.0
    stiffness: NotNegative = 100.0


class ListedLookAt(Listed, TaskSection):
    """The z axis of `frame` toward the point `target` [m] of the world (2 rows)."""

    kind: Literal["look-at"]
    frame: str
    target: Vector3
    stiffness: NotNegative = 20.0
    damping: NotNegative = 10.0
    gain: NotNegative = 5.0


class ListedManipulability(Listed, TaskSection):
    """The manipulability of `frame` at `least` or more (1 row); rows = "equality": at `least`.

    `part` "position" counts the linear rows of its Jacobian, "pose" all six.
    """

    unit: ClassVar[str] = ""
    kind: Literal["manipulability"]
    frame: str
    least: NotNegative
    part: Literal["position", "pose"] = "position"
    rows: Rows = "inequality"
    stiffness: NotNegative = 20.0
    damping: NotNegative = 10.0
    gain: NotNegative = 5.0

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return self.rows == "inequality"


class ListedMomentum(Listed):
    """The linear or angular momentum of the whole robot to zero, with `damping` [1/s]."""

    kind: Literal["momentum"]
    part: Literal["linear", "angular"] = "angular"
    damping: NotNegative = 10.0

    @property
    def unit(self) -> str:
        """That of its error."""
        return "N s" if self.part == "linear" else "N m s"


class ListedForce(Listed):
    """The force of a contact at `target`: its normal force, its force, or its wrench [N, N m].

    One, three or six numbers, see hierarchy.tasks.ContactForce; at level "torque".
    """

    unit: ClassVar[str] = "N"
    kind: Literal["contact-force"]
    contact: str
    target: tuple[Finite, ...]


class ListedLeastForce(Listed):
    """The smallest contact forces, as a last level; at level "torque"."""

    unit: ClassVar[str] = "N"
    kind: Literal["least-force"]


class _Apart(Listed):
    """A task with one-sided rows between bodies."""

    unit: ClassVar[str] = "m"

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return True


class ListedSelfCollision(_Apart):
    """Links that are not neighbours, kept `distance` [m] apart; other keys as in [avoidance]."""

    kind: Literal["self-collision"]
    distance: NotNegative = 0.03
    rate: Positive = 10.0
    influence: Positive = 0.3
    recovery: NotNegative = 0.2
    limit: Positive = 50.0


class ListedCollision(_Apart):
    """The place in the list of the rows that [avoidance] with kind = "separation" asks for.

    Without this task they are above all tasks.
    """

    kind: Literal["collision"]


class OwnTask(Listed, OwnSection):
    """A task of a plugin; its keys are those of the plugin."""

    group: ClassVar[Group] = "tasks"
    unit: ClassVar[str] = ""

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities, as the plugin's class says with `kind`."""
        return str(getattr(self.maker, "kind", "equality")) == "inequality"


KINDS = ("position", "pose", "frame", "com", "pointing", "posture", "relative", "coupling",
         "look-at", "manipulability", "momentum", "contact-force", "least-force", "self-collision",
         "collision")
OF_FORCES = ("contact-force", "least-force")
ListedTask = Annotated[
    Annotated[ListedPosition, Tag("position")] | Annotated[ListedPose, Tag("pose")]
    | Annotated[ListedFrame, Tag("frame")]
    | Annotated[ListedCentreOfMass, Tag("com")] | Annotated[ListedPointing, Tag("pointing")]
    | Annotated[ListedPosture, Tag("posture")] | Annotated[ListedRelative, Tag("relative")]
    | Annotated[ListedCoupling, Tag("coupling")] | Annotated[ListedLookAt, Tag("look-at")]
    | Annotated[ListedManipulability, Tag("manipulability")]
    | Annotated[ListedMomentum, Tag("momentum")] | Annotated[ListedForce, Tag("contact-force")]
    | Annotated[ListedLeastForce, Tag("least-force")]
    | Annotated[ListedSelfCollision, Tag("self-collision")]
    | Annotated[ListedCollision, Tag("collision")] | Annotated[OwnTask, Tag(PLUGIN)],
    Discriminator(kind_or(None, "tasks", KINDS))]
AnyTask = PositionSection | PointingSection | PostureSection | ListedTask
