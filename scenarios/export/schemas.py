"""JSON Schemas of the messages in an MCAP file.

Foxglove recognizes what it can draw by the schema's name; the fields are those of its published
message types, as far as they are used here. Its reader takes one type per field, so a number that
may be null is declared as a number.
"""

from __future__ import annotations

from typing import Any

NUMBER: dict[str, Any] = {"type": "number"}
INTEGER: dict[str, Any] = {"type": "integer"}
TEXT: dict[str, Any] = {"type": "string"}
TRUTH: dict[str, Any] = {"type": "boolean"}


def an_object(**properties: Any) -> dict[str, Any]:
    """Return the schema of an object with these properties."""
    return {"type": "object", "properties": properties}


def a_list(items: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of an array."""
    return {"type": "array", "items": items}


_TIME = an_object(sec=INTEGER, nsec=INTEGER)
_XYZ = an_object(x=NUMBER, y=NUMBER, z=NUMBER)
_XYZW = an_object(x=NUMBER, y=NUMBER, z=NUMBER, w=NUMBER)
_POSE = an_object(position=_XYZ, orientation=_XYZW)
_COLOUR = an_object(r=NUMBER, g=NUMBER, b=NUMBER, a=NUMBER)
_BODY = an_object(pose=_POSE, size=_XYZ, color=_COLOUR)
_CYLINDER = an_object(pose=_POSE, size=_XYZ, bottom_scale=NUMBER, top_scale=NUMBER, color=_COLOUR)
_LINE = an_object(type=INTEGER, pose=_POSE, thickness=NUMBER, scale_invariant=TRUTH,
                  points=a_list(_XYZ), color=_COLOUR, colors=a_list(_COLOUR),
                  indices=a_list(INTEGER))
_ENTITY = an_object(
    timestamp=_TIME, frame_id=TEXT, id=TEXT, lifetime=_TIME, frame_locked=TRUTH,
    metadata=a_list(an_object(key=TEXT, value=TEXT)), arrows=a_list(an_object()),
    cubes=a_list(_BODY), spheres=a_list(_BODY), cylinders=a_list(_CYLINDER), lines=a_list(_LINE),
    triangles=a_list(an_object()), texts=a_list(an_object()), models=a_list(an_object()))
_TRANSFORM = an_object(timestamp=_TIME, parent_frame_id=TEXT, child_frame_id=TEXT,
                       translation=_XYZ, rotation=_XYZW)

FOXGLOVE: dict[str, dict[str, Any]] = {
    "foxglove.FrameTransforms": an_object(transforms=a_list(_TRANSFORM)),
    "foxglove.SceneUpdate": an_object(
        deletions=a_list(an_object(timestamp=_TIME, type=INTEGER, id=TEXT)),
        entities=a_list(_ENTITY)),
    "foxglove.Log": an_object(timestamp=_TIME, level=INTEGER, message=TEXT, name=TEXT, file=TEXT,
                              line=INTEGER),
}
