"""The error of an invalid scenario."""

from __future__ import annotations

from hierarchy.errors import HierarchyError


class ScenarioError(HierarchyError):
    """An invalid scenario file or change; the message names the file and the key."""
