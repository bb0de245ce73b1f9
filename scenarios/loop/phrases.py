"""What became of a level in words: the same on every page and list."""

from __future__ import annotations

from scenarios.loop.fate import Fate

PHRASES = {Fate.MET: "met", Fate.FREE: "inactive", Fate.MISSED: "missed",
           Fate.UNKNOWN: "in the stack, not judged", Fate.ABSENT: "not in the stack"}


def phrase(fate: Fate, violation: float) -> str:
    """Return a fate in words, with the violation where the level is missed."""
    return f"missed by {violation:.2g}" if fate is Fate.MISSED else PHRASES[fate]
