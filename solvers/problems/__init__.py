"""Hierarchies for tests and benchmarks: random, structured, and like the reference families."""

from solvers.problems.families import FAMILIES, family
from solvers.problems.generated import ANY, Recipe, generate, load, save, strategy, written
from solvers.problems.kinds import KINDS, bounded, structured

__all__ = ["ANY", "FAMILIES", "KINDS", "Recipe", "bounded", "family", "generate", "load", "save",
           "strategy", "structured", "written"]
