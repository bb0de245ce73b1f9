"""Motions of a skeleton from a BVH file: where each joint is in each frame."""

from collections.abc import Iterator
from math import isfinite
from pathlib import Path as File
from typing import NamedTuple

import numpy as np

from hierarchy.errors import HierarchyError, file_path, naming, refuse
from hierarchy.problem import Array

_CHANNELS = tuple(axis + kind for kind in ("position", "rotation") for axis in "xyz")


class Motion(NamedTuple):
    """F frames of a skeleton: `times` (F,) [s], by joint `positions` (F, 3) in the file's unit.

    Axes are those of the file, in most of them y up. The end of a limb is called "JOINT end".
    """

    times: Array
    positions: dict[str, Array]


class _Joint(NamedTuple):
    name: str
    parent: str
    offset: tuple[float, ...]
    channels: tuple[str, ...]


def read_bvh(file: str | File) -> Motion:
    """Read a BVH file; raises HierarchyError, naming the file, if it is none."""
    with naming(f"{file} cannot be read", of=(OSError, UnicodeDecodeError)):
        words = file_path("read_bvh: file", file).read_text(encoding="utf-8").split()
    try:
        at = words.index("MOTION")
        joints = _skeleton(iter(words[1:at]))
        frames, period = int(words[at + 2]), float(words[at + 5])  # Frames: F Frame Time: s
        count = sum(len(joint.channels) for joint in joints)
        values = np.array(words[at + 6:], dtype=float).reshape(frames, count)
    except (ValueError, IndexError, StopIteration) as error:
        raise HierarchyError(f"{file} is no BVH file: {error or 'it ends early'}") from error
    refuse(not (frames > 0 and period > 0.0 and isfinite(period) and np.isfinite(values).all()),
           f"{file}: expected frames of finite numbers and a positive time of a frame, got "
           f"{frames} frames of {period} s")
    return Motion(np.arange(frames, dtype=np.float64) * period, _positions(joints, values))


def _skeleton(words: Iterator[str]) -> list[_Joint]:
    joints: list[_Joint] = []
    open_: list[str] = []
    for word in words:
        if word in ("ROOT", "JOINT", "End"):
            name, parent = next(words), open_[-1] if open_ else ""
            if word == "End":
                name = f"{open_[-1]} end"
            elif name in [joint.name for joint in joints]:
                raise ValueError(f"joint {name!r} comes twice")
            joints.append(_Joint(name, parent, (0.0, 0.0, 0.0), ()))
        elif word == "{":
            open_.append(joints[-1].name)
        elif word == "}":
            open_.pop()
        elif word == "OFFSET":
            joints[-1] = joints[-1]._replace(offset=tuple(float(next(words)) for _ in range(3)))
        elif word == "CHANNELS":
            channels = tuple(next(words).lower() for _ in range(int(next(words))))
            if wrong := [name for name in channels if name not in _CHANNELS]:
                raise ValueError(f"channel {wrong[0]!r} is unknown")
            joints[-1] = joints[-1]._replace(channels=channels)
        else:
            raise ValueError(f"{word!r} is unknown there")
    return joints


def _positions(joints: list[_Joint], values: Array) -> dict[str, Array]:
    """Return where each joint is, from its channels in the order of the file [deg]."""
    from scipy.spatial.transform import Rotation

    frames, first = len(values), 0
    turns, places = dict[str, Array](), dict[str, Array]()
    for joint in joints:
        turn, place = np.tile(np.eye(3), (frames, 1, 1)), np.tile(joint.offset, (frames, 1))
        for channel in joint.channels:
            value, axis = values[:, first], "xyz".index(channel[0])
            if channel.endswith("position"):
                place[:, axis] += value
            else:
                about = Rotation.from_euler(channel[0], value[:, None], degrees=True)
                turn = turn @ about.as_matrix()
            first += 1
        if joint.parent:
            place = places[joint.parent] + np.einsum("fij,fj->fi", turns[joint.parent], place)
            turn = turns[joint.parent] @ turn
        turns[joint.name], places[joint.name] = turn, place
    return places
