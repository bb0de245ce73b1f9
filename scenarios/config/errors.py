"""What is raised for a scenario that cannot be used."""

from __future__ import annotations

from hierarchy.errors import HierarchyError


class ScenarioError(HierarchyError):
    """A scenario file, or a change to one, that cannot be used; names file and key."""
