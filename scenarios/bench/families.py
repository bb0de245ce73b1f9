"""The reference problems: lexicographic least squares with certified answers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy

EQUALITIES = ("EQ7", "EQ7over", "EQ7sing", "EQ30L8", "EQ30L10")
INEQUALITIES = ("INEQ7", "HUM38", "DEGEN7")
FAMILIES = EQUALITIES + INEQUALITIES
DATA = Path(__file__).parents[2] / "tests" / "data" / "hlsp"
_MISSING = 1e9  # the data's sign for a missing side


@dataclass(frozen=True)
class Problem:
    """A reference hierarchy with its certified answer x (n,) and violations, norms (L,)."""

    h: Hierarchy
    x: Array
    norms: Array


def family(name: str, folder: Path = DATA) -> list[Problem]:
    """Read the problems of one reference family.

    Raises
    ------
    HierarchyError : the family's file is not in the folder.
    """
    file = Path(folder) / f"{name}.npz"
    if not file.is_file():
        raise HierarchyError(f"no reference problems at {file}; they are in tests/data/hlsp of a "
                             "source checkout, and another folder can be given")
    with np.load(file) as opened:
        data = dict(opened)
    return [_problem(data, p) for p in range(len(data["x"]))]


def _problem(data: dict[str, Array], p: int) -> Problem:
    levels = []
    for k in range(int(data["L"])):
        lower, upper = data[f"lb{k}"][p], data[f"ub{k}"][p]
        levels.append((data[f"A{k}"][p], np.where(lower <= -_MISSING, -np.inf, lower),
                       np.where(upper >= _MISSING, np.inf, upper)))
    return Problem(Hierarchy.from_levels(levels), data["x"][p], data["norms"][p])


def well_posed_levels(h: Hierarchy, x: Array, parallel: tuple[float, float] = (1e-12, 1e-7)
                      ) -> int:
    """Return for how many levels, from the top, the violations are well-posed, x being the answer.

    Two rows at an angle between `parallel`, both equalities or violated, fix a direction that they
    hardly tell from rounding: what lies below the level of the second is anybody's.
    """
    fixed = (h.lower == h.upper) | (np.abs(h.slacks(x)) > 1e-9)
    level = np.repeat(np.arange(len(h.sizes)), h.sizes)
    size = np.linalg.norm(h.A, axis=1)
    rows = np.flatnonzero(fixed & (size > 0.0))
    U = h.A[rows] / size[rows, None]
    sine = np.minimum(*(np.linalg.norm(U[:, None] - sign * U[None], axis=2) for sign in (1, -1)))
    close = (sine > parallel[0]) & (sine < parallel[1])
    pairs = np.maximum(level[rows][:, None], level[rows][None])[close]
    return int(pairs.min()) + 1 if pairs.size else len(h.sizes)
