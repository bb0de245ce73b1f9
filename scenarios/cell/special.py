"""Make the tasks of `[[tasks]]` that no section of their own has, and those of plugins."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from hierarchy import HierarchyError, State, Task
from hierarchy.avoidance import Barrier
from hierarchy.errors import UnknownNameError, brief
from hierarchy.tasks import (
    JointCoupling,
    LookAt,
    Manipulability,
    Momentum,
    RelativePose,
    SelfSeparation,
)
from scenarios.cell.avoidance import separable_pairs
from scenarios.cell.own import make_own
from scenarios.config import ScenarioError
from scenarios.config.listed import (
    Listed,
    ListedCoupling,
    ListedLookAt,
    ListedManipulability,
    ListedMomentum,
    ListedRelative,
    ListedSelfCollision,
    OwnTask,
)


def special_task(section: Listed, start: State) -> Task:
    """Make a task that needs more than a frame; raises ScenarioError, naming the task."""
    for kind, make in _MAKERS.items():
        if isinstance(section, kind):
            try:
                made: Task = make(section, start)
            except UnknownNameError:
                raise
            except HierarchyError as error:
                raise ScenarioError(f"task {section.title!r}: {error}") from error
            return made
    raise AssertionError(f"no task is made of {section!r}")


def _relative(section: ListedRelative, start: State) -> Task:
    frame, to = start.robot.frame(section.frame), start.robot.frame(section.to)
    axes = start.rotation(to).T
    position = (axes @ (start.position(frame) - start.position(to)) if section.position is None
                else section.position)
    rotation = axes @ start.rotation(frame) if section.rotation is None else section.rotation
    return RelativePose(frame, to, position, rotation if section.orientation else None,
                        section.stiffness, section.damping, section.gain, section.title)


def _coupling(section: ListedCoupling, start: State) -> Task:
    return JointCoupling(start.robot, section.joints, section.value, section.stiffness,
                         section.damping, section.gain, section.title)


def _look_at(section: ListedLookAt, start: State) -> Task:
    return LookAt(start.robot.frame(section.frame), section.target, section.stiffness,
                  section.damping, section.gain, section.title)


def _manipulability(section: ListedManipulability, start: State) -> Task:
    task = Manipulability(start.robot.frame(section.frame), section.least, section.part,
                          section.rows, name=section.title)
    task.jacobian(start)  # refuses a robot that it is not for
    return replace(task, stiffness=section.stiffness, damping=section.damping, gain=section.gain)


def _momentum(section: ListedMomentum, start: State) -> Task:
    return Momentum(section.part, damping=section.damping, name=section.title)


def _self_collision(section: ListedSelfCollision, start: State) -> Task:
    robot = start.robot
    pairs = separable_pairs(robot, section.distance)
    if not pairs:
        raise ScenarioError(f"robot {robot.name!r} has no capsules that could be kept apart; list "
                            "them in robot.capsules")
    barrier = Barrier(section.distance, section.rate, section.influence, section.recovery,
                      section.limit)
    return SelfSeparation(robot.capsules, barrier, pairs, name=section.title)


def _own(section: OwnTask, start: State) -> Task:
    task = make_own(section, start.robot, state=start, name=section.title)
    if not isinstance(task, Task):
        raise ScenarioError(f"the plugin made {brief(task)}, not a Task")
    if task.name != section.title:
        raise ScenarioError(f"its name is {task.name!r}; take the name as the parameter `name`, or "
                            "give the section this name")
    return task


_MAKERS: dict[type[Listed], Any] = {
    ListedRelative: _relative, ListedCoupling: _coupling, ListedLookAt: _look_at,
    ListedManipulability: _manipulability, ListedMomentum: _momentum,
    ListedSelfCollision: _self_collision, OwnTask: _own}
