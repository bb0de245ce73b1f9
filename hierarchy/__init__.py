from hierarchy.errors import HierarchyError
from hierarchy.problem import Hierarchy

__all__ = ["Hierarchy", "HierarchyError"]
