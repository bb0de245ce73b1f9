"""Frames by their names, which need not be unique: a joint and a link may have one name."""

from __future__ import annotations

from collections import Counter
from typing import Any

from hierarchy.words import listed

_SAME_PLACE = 1e-9
_KINDS = {"BODY": "link", "JOINT": "joint", "FIXED_JOINT": "fixed joint"}


def frames_called(model: Any, name: str) -> list[Any]:
    """Return the frames with a name that stand at different places, one for each place."""
    found: list[Any] = []
    for frame in model.frames:
        if frame.name == name and not any(
                one.parentJoint == frame.parentJoint
                and one.placement.isApprox(frame.placement, _SAME_PLACE) for one in found):
            found.append(frame)
    return found


def ambiguous(model: Any) -> list[str]:
    """Return the names that frames at different places share, such as a joint and a link."""
    counts = Counter(str(frame.name) for frame in model.frames)
    return [name for name, count in counts.items()
            if count > 1 and len(frames_called(model, name)) > 1]


def in_words(model: Any, frames: list[Any]) -> str:
    """Say what frames are and where: "a link on the body of joint 'wrist' and ..."."""
    return listed([f"a {_KINDS.get(frame.type.name, 'frame')} "
                   + (f"on the body of joint {model.names[frame.parentJoint]!r}"
                      if frame.parentJoint > 0 else "fixed to the world") for frame in frames])
