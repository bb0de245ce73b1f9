"""Which constraint blocks which task, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.resolver import Resolution
from solvers.resolvers.hcod import ActiveSetResolution
from solvers.status import EQUAL

_MATTERS = 1e-6  # smallest share of a level's pull for which a level above is named


def explain(h: Hierarchy, resolution: Resolution, tolerance: float = 1e-9,
            rows: Sequence[str] | None = None) -> str:
    """Say whether each level is met and, if not, which rows hold it back.

    Returns one line per level, under its name in `h.names`. A level counts as met if its violation
    is at most `tolerance` times the size of its terms. `rows` are names of the m rows, such as
    `Stack.row_names`; without them rows are numbered within their level. Raises a HierarchyError
    unless the resolution is from `hcod`, the only resolver that reports the state of each row, and
    if the names are not m.
    """
    if rows is None:
        rows = [f"row {i}" for size in h.sizes for i in range(size)]
    if len(rows) != h.m:
        raise HierarchyError(f"explain: {len(rows)} names for {h.m} rows")
    if not isinstance(resolution, ActiveSetResolution):
        raise HierarchyError("explain needs a resolution of hcod: other resolvers do not report "
                             "which rows are active")
    lines = [_level(h, resolution, k, tolerance, rows) for k in range(len(h.sizes))]
    if resolution.unfinished is not None:
        lines.append(f"The iteration limit was reached at {h.names[resolution.unfinished]!r}: it "
                     "and the levels below may not be optimal.")
    return "\n".join(lines)


def _level(h: Hierarchy, resolution: ActiveSetResolution, k: int, tolerance: float,
           names: Sequence[str]) -> str:
    rows = slice(h.offsets[k], h.offsets[k + 1])
    w = h.slacks(resolution.x)[rows]
    if not len(w):
        return f"{h.names[k]} has no rows."
    size = np.linalg.norm(h.A[rows]) * np.linalg.norm(resolution.x) + 1e-300
    missed = float(np.linalg.norm(w))
    if missed <= tolerance * size:
        return f"{h.names[k]} is met."
    blocking = _inequalities(h, resolution, k, names) + _equalities(h, resolution, k, w)
    if not blocking:
        return f"{h.names[k]} is missed by {missed:.3g}: its own rows disagree."
    return f"{h.names[k]} is missed by {missed:.3g}: held back by {_and(blocking)}."


def _inequalities(h: Hierarchy, resolution: ActiveSetResolution, k: int,
                  names: Sequence[str]) -> list[str]:
    """Name the inequality rows above level k that hold it back."""
    holding = [int(i) for i in np.flatnonzero(resolution.holds_back == k) if i < h.offsets[k]]
    levels = [int((h.offsets[1:] <= i).sum()) for i in holding]
    said = [-1, *levels][:len(levels)]
    return [_row(h, resolution, i, names[i], "" if level == before else f"{h.names[level]} ")
            for i, level, before in zip(holding, levels, said, strict=True)]


def _row(h: Hierarchy, resolution: ActiveSetResolution, i: int, name: str, level: str) -> str:
    """Name a row and its side; the level's name is said once for the rows of a level."""
    alone = bool(h.sizes[int((h.offsets[1:] <= i).sum())] == 1)
    side = "upper" if resolution.active[i] > 0 else "lower"
    return f"{level.strip() if alone else level + name} at its {side} side"


def _equalities(h: Hierarchy, resolution: ActiveSetResolution, k: int, w: Array) -> list[str]:
    """Name the levels above whose equality rows carry part of level k's pull."""
    first = h.offsets[k]
    acting = np.flatnonzero(resolution.active[:first] != 0)
    pull = h.A[first:h.offsets[k + 1]].T @ w
    if not len(acting) or not pull.any():
        return []
    forces = np.linalg.lstsq(h.A[acting].T, -pull, rcond=1e-10)[0]
    shares = np.abs(forces) * np.linalg.norm(h.A[acting], axis=1) / np.linalg.norm(pull)
    matters = (resolution.active[acting] == EQUAL) & (shares > _MATTERS)
    levels = np.searchsorted(h.offsets, acting[matters], side="right") - 1
    return [h.names[level] for level in np.unique(levels)]


def _and(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
