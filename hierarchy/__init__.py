"""What is asked of a robot, in which order: tasks, stacks and the problem they make."""

from hierarchy.errors import HierarchyError
from hierarchy.problem import Hierarchy
from hierarchy.robot import Robot, State
from hierarchy.stack import Stack
from hierarchy.task import Task

__all__ = ["Hierarchy", "HierarchyError", "Robot", "Stack", "State", "Task"]
