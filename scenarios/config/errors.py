"""The error of an invalid scenario, and what it names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from hierarchy.errors import HierarchyError


class ScenarioError(HierarchyError):
    """An invalid scenario file or change; the message names the file and the key."""


@contextmanager
def naming(what: str) -> Iterator[None]:
    """Put a key or a file in front of the errors raised within, which become ScenarioErrors."""
    try:
        yield
    except HierarchyError as error:
        raise ScenarioError(f"{what}: {error}") from error
