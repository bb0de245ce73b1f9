"""A run for Foxglove's 3D panel: joint frames, links, obstacles and paths.

Foxglove recognizes what it can draw by the schema's name; the fields are those of its published
message types, as far as they are used here. Its reader takes one type per field, so a number that
may be null is declared as a number.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from hierarchy.avoidance.obstacles import Obstacle
from hierarchy.problem import Array
from scenarios.scene.drawn import Scene

WORLD = "world"
Message = dict[str, Any]

_ARM, _OBSTACLE, _TRACE, _ASKED = (dict(zip("rgba", colour, strict=True)) for colour in (
    (0.35, 0.42, 0.5, 1.0), (0.83, 0.23, 0.17, 0.9), (0.0, 0.45, 0.7, 1.0), (0.6, 0.6, 0.6, 1.0)))
_POINT = 0.01      # [m] radius of a point obstacle as drawn
_THICK = 2.0       # [px] of lines
_STRIP = 0         # a type of line
_WARNING = 3       # a level of a log message


def transforms(scene: Scene, frame: int) -> Message:
    """Return the placements of the joints, the end effector and the desired point in the world.

    The desired point has no rotation of its own and is given that of the world.
    """
    robot, t = scene.robot, float(scene.t[frame])
    rows, tip = scene.placements[frame], scene.robot.points[-1]
    placed = [(name, rows[i, 9:], rows[i, :9].reshape(3, 3).T)
              for i, name in enumerate(robot.joint_names, 1)]
    turned = rows[tip.joint, :9].reshape(3, 3).T @ np.array(robot.tool)
    placed.append(("end_effector", scene.points[frame, -1], turned))
    if scene.desired is not None:
        placed.append(("desired", scene.desired[frame], np.eye(3)))
    return {"transforms": [_transform(t, *one) for one in placed]}


def _transform(t: float, name: str, place: Array, rotation: Array) -> Message:
    translation, rotation_of = _pose(place, rotation).values()
    return {"timestamp": _time(t), "parent_frame_id": WORLD, "child_frame_id": name,
            "translation": translation, "rotation": rotation_of}


def scene_updates(scene: Scene, every: int) -> Iterator[tuple[int, Message]]:
    """Yield frames with the entities that change there; obstacles only if they have moved.

    Links are attached to the frames of their joints and are sent once. The path taken is sent in
    pieces of `every` frames.
    """
    for frame in range(len(scene.t)):
        t, entities = float(scene.t[frame]), []
        if frame == 0:
            names = (WORLD, *scene.robot.joint_names)
            entities += [_entity(t, f"body {one.name}", names[one.joint], **_capsule(
                             np.array(one.start), np.array(one.end), one.radius, _ARM))
                         for one in scene.robot.capsules]
            if scene.desired is not None:
                entities.append(_line(t, "path asked for", scene.desired, _ASKED))
        moved = (scene.centres[frame] != scene.centres[frame - 1]).any(axis=1)
        entities += [obstacle(t, h, body, scene.centres[frame, h])
                     for h, body in enumerate(scene.obstacles.obstacles)
                     if frame == 0 or moved[h]]
        if np.isfinite(scene.nearest[frame]).all() and scene.nearest.size:
            k = int(scene.linked[frame])
            pair = np.array([scene.points[frame, k], scene.nearest[frame, k]])
            entities.append(_line(t, "nearest", pair, _OBSTACLE))
        if frame and (frame % every == 0 or frame == len(scene.t) - 1):
            first = (frame - 1) // every * every
            entities.append(_line(t, f"path taken {first // every + 1}",
                                 scene.points[first:frame + 1, -1], _TRACE))
        if entities:
            yield frame, {"deletions": [], "entities": entities}


def obstacle(t: float, number: int, body: Obstacle, centre: Array) -> Message:
    """Return an obstacle at its present place."""
    turned = np.asarray(body.rotation, dtype=float)
    if body.shape == "box":
        parts = {"cubes": [_body(centre, 2.0 * np.array(body.size), _OBSTACLE, turned)]}
    elif body.shape == "capsule":
        radius, half = body.size
        along = half * turned[:, 2]
        parts = _capsule(centre - along, centre + along, radius, _OBSTACLE)
    else:
        radius = body.size[0] if body.size else _POINT
        parts = {"spheres": [_body(centre, 2.0 * radius, _OBSTACLE)]}
    return _entity(t, f"obstacle {number + 1}", WORLD, **parts)


def _capsule(start: Array, end: Array, radius: float, colour: Message) -> dict[str, list[Message]]:
    """Return a cylinder between two places, if they are apart, and two balls."""
    balls = [_body(place, 2.0 * radius, colour) for place in (start, end)]
    length = np.linalg.norm(end - start)
    if length == 0.0:
        return {"spheres": balls}
    turned = Rotation.align_vectors([end - start], [[0.0, 0.0, 1.0]])[0].as_matrix()
    size = np.array([2.0 * radius, 2.0 * radius, length])
    cylinder = _body((start + end) / 2, size, colour, turned)
    return {"cylinders": [cylinder | {"bottom_scale": 1.0, "top_scale": 1.0}], "spheres": balls}


def _line(t: float, name: str, points: Array, colour: Message) -> Message:
    """Return a line through points (P, 3) [m] in the world, without those that are not finite."""
    return _entity(t, name, WORLD, lines=[_strip(points[np.isfinite(points).all(axis=1)], colour)])


def _strip(points: Array, colour: Message) -> Message:
    return {"type": _STRIP, "pose": _pose(np.zeros(3), np.eye(3)), "thickness": _THICK,
            "scale_invariant": True, "points": [_xyz(point) for point in points],
            "color": colour, "colors": [], "indices": []}


def log(t: float, message: str, tick: int) -> Message:
    """Return a warning of the policy in a tick."""
    return {"timestamp": _time(t), "level": _WARNING, "message": message, "name": "policy",
            "file": "", "line": tick}


def _entity(t: float, name: str, frame: str, **parts: list[Message]) -> Message:
    """Return an entity that stays until another one of its name arrives."""
    kinds = ("metadata", "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts",
             "models")
    return {"timestamp": _time(t), "frame_id": frame, "id": name, "lifetime": _time(0.0),
            "frame_locked": True, **{kind: parts.get(kind, []) for kind in kinds}}


def _time(t: float) -> Message:
    return dict(zip(("sec", "nsec"), divmod(nanoseconds(t), 10**9), strict=True))


def nanoseconds(t: float) -> int:
    """Return a time [s] in [ns]."""
    return round(t * 1e9)


def _pose(place: Array, rotation: Array) -> Message:
    turn = Rotation.from_matrix(rotation).as_quat(canonical=True)  # w >= 0
    return {"position": _xyz(place), "orientation": dict(zip("xyzw", turn.tolist(), strict=True))}


def _xyz(vector: Array) -> Message:
    return dict(zip("xyz", np.asarray(vector, dtype=float).tolist(), strict=True))


def _body(centre: Array, size: float | Array, colour: Message, rotation: Array | None = None
          ) -> Message:
    return {"pose": _pose(centre, np.eye(3) if rotation is None else rotation),
            "size": _xyz(np.broadcast_to(size, 3)), "color": colour}


def schema(example: Any) -> dict[str, Any]:
    """Return the JSON schema of all that is like an example; a list is like its first entry."""
    if isinstance(example, dict):
        return {"type": "object",
                "properties": {name: schema(value) for name, value in example.items()}}
    if isinstance(example, list):
        return {"type": "array", "items": schema(example[0] if example else {})}
    return {"type": _KINDS[type(example)]}


_KINDS = {float: "number", int: "integer", str: "string", bool: "boolean"}
_PARTS = {**_capsule(np.zeros(3), np.ones(3), 1.0, _ARM), "cubes": [_body(np.zeros(3), 1.0, _ARM)],
          "lines": [{**_strip(np.zeros((1, 3)), _ARM), "colors": [_ARM], "indices": [0]}],
          "metadata": [{"key": "", "value": ""}]}
FOXGLOVE = {name: schema(example) for name, example in {
    "foxglove.FrameTransforms": {"transforms": [_transform(0.0, "", np.zeros(3), np.eye(3))]},
    "foxglove.SceneUpdate": {"deletions": [{"timestamp": _time(0.0), "type": 0, "id": ""}],
                             "entities": [_entity(0.0, "", "", **_PARTS)]},
    "foxglove.Log": log(0.0, "", 0)}.items()}
"""The schemas of the messages, by the names that Foxglove knows."""
