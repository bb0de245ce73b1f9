"""Which constraint blocks which task, in words."""

from __future__ import annotations

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.resolver import Resolution
from solvers.resolvers.hcod import ActiveSetResolution

_MATTERS = 1e-6  # share of a level's pull below which a level above is not worth naming


def explain(h: Hierarchy, resolution: Resolution, tolerance: float = 1e-9) -> str:
    """Say of every level whether it is met, and if not what holds it back.

    One line a level, under its name in `h.names`. A level counts as met where its violation is at
    most `tolerance` times the size of its terms. Raises a HierarchyError unless the resolution is
    one of `hcod`, which alone knows what each row does.
    """
    if not isinstance(resolution, ActiveSetResolution):
        raise HierarchyError("explain needs a resolution of hcod: others do not say which rows act")
    lines = [_level(h, resolution, k, tolerance) for k in range(len(h.sizes))]
    if resolution.unfinished is not None:
        lines.append(f"The iterations ended while {h.names[resolution.unfinished]!r} was worked "
                     "on: it and what is below may still be improved.")
    return "\n".join(lines)


def _level(h: Hierarchy, resolution: ActiveSetResolution, k: int, tolerance: float) -> str:
    rows = slice(h.offsets[k], h.offsets[k + 1])
    w = h.slacks(resolution.x)[rows]
    size = np.linalg.norm(h.A[rows]) * np.linalg.norm(resolution.x) + 1e-300
    missed = float(np.linalg.norm(w))
    held_by = [_row(h, resolution, int(i)) for i in np.flatnonzero(resolution.holds_back == k)
               if i < h.offsets[k]]
    equalities = _equalities_in_the_way(h, resolution, k, w)
    if missed <= tolerance * size:
        return f"{h.names[k]} is met." if len(w) else f"{h.names[k]} asks for nothing."
    text = f"{h.names[k]} is missed by {missed:.3g}"
    if held_by or equalities:
        return f"{text}: held back by {_and([*held_by, *equalities])}."
    return f"{text}: its own rows disagree."


def _row(h: Hierarchy, resolution: ActiveSetResolution, i: int) -> str:
    level = int((h.offsets[1:] <= i).sum())
    name = h.names[level]
    if h.sizes[level] > 1:
        name = f"{name} row {i - h.offsets[level]}"
    return f"{name} at its {'upper' if resolution.active[i] > 0 else 'lower'} side"


def _equalities_in_the_way(h: Hierarchy, resolution: ActiveSetResolution, k: int,
                           w: Array) -> list[str]:
    """Names of the levels above whose equality rows carry a part of level k's pull."""
    first = h.offsets[k]
    acting = np.flatnonzero(resolution.active[:first] != 0)
    pull = h.A[first:h.offsets[k + 1]].T @ w
    if not len(acting) or not pull.any():
        return []
    forces = np.linalg.lstsq(h.A[acting].T, -pull, rcond=1e-10)[0]
    shares = np.abs(forces) * np.linalg.norm(h.A[acting], axis=1) / np.linalg.norm(pull)
    matters = (resolution.active[acting] == 2) & (shares > _MATTERS)
    levels = np.searchsorted(h.offsets, acting[matters], side="right") - 1
    return [h.names[level] for level in np.unique(levels)]


def _and(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
