"""Robots of MJCF files: compiled by MuJoCo (extra `sim`), rebuilt for pinocchio, and compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from numpy.typing import ArrayLike

from hierarchy.robots.found import Found, neutral_within_limits, proposed_end_effector
from hierarchy.robots.mjcf.constraints import (
    couplings,
    effort_limits,
    left_out,
    loops,
    pairs_apart,
    refuse,
    set_limits,
)
from hierarchy.robots.mjcf.geometry import shapes_of
from hierarchy.robots.mjcf.model import build, compare, configuration
from hierarchy.robots.mjcf.part import compiled, part_of
from hierarchy.robots.shapes import capsules_of
from hierarchy.robots.table import Base


def read(path: Path, base: Base | None, shapes: bool, locked: Mapping[str, ArrayLike],
         root: Sequence[str]) -> Found:
    """Read a robot as `read_file` does; `root` names the bodies that it begins at, () for all.

    Raises RobotError where MuJoCo is missing or refuses the file, where no robot can be made of it,
    and where kinematics or inertia differ from MuJoCo's; UnknownNameError for a joint or body.
    """
    file = compiled(path)
    refuse(file)
    part = part_of(file, base, locked, root)
    built = build(part)
    said = (*part.said, *set_limits(built), *effort_limits(built))
    compare(built)
    end_effector = proposed_end_effector(built.model)  # before the loops add frames
    coupled, unkept = couplings(part)
    closed, unclosed = loops(built)
    found = Found(
        built.model, end_effector, coupled=coupled, loops=closed, apart=pairs_apart(built),
        rest=neutral_within_limits(built.model, configuration(built, file.model.qpos0)),
        starts={name: configuration(built, qpos)
                for name, qpos in zip(file.keys, file.model.key_qpos, strict=True)},
        missing=(*file.missing, *said, *unkept, *unclosed, *left_out(part)))
    if not shapes:
        return found
    geometries, without = shapes_of(built)
    capsules, shapeless = capsules_of(geometries)
    return replace(found, capsules=capsules, missing=(*found.missing, *without, *shapeless))
