"""Reference problems with stored certified answers, and fresh problems of the same families."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers import Resolver, Status, certify, make
from solvers.problems import family as make_problem

EQUALITIES = ("EQ7", "EQ7over", "EQ7sing", "EQ30L8", "EQ30L10")
INEQUALITIES = ("INEQ7", "HUM38", "DEGEN7")
FAMILIES = EQUALITIES + INEQUALITIES
DATA = Path(__file__).parents[2] / "tests" / "data" / "hlsp"
CHECKED = 5      # fresh problems of a family with violations from hqp
_MISSING = 1e9  # marks a missing side in the data


@dataclass(frozen=True)
class Problem:
    """A hierarchy with its certified answer x (n,) and violations, norms (L,); NaN if unknown."""

    h: Hierarchy
    x: Array
    norms: Array

    @property
    def known(self) -> bool:
        """Whether a certified answer is known."""
        return not bool(np.isnan(self.norms).any())


def family(name: str, folder: Path = DATA) -> list[Problem]:
    """Read the problems of one reference family.

    Raises
    ------
    HierarchyError : the folder does not have the family's file.
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


def fresh(name: str, seed: int, count: int, checked: int = CHECKED) -> list[Problem]:
    """Generate problems of a family with seeds `seed`, `seed` + 1, ..., not used for tuning.

    checked : number of problems, the first ones, with norms from hqp if its answer is certified.
    """
    made, hqp = [make_problem(name, seed + i) for i in range(count)], make("hqp")
    return [_answered(hqp, h) if i < checked else _unanswered(h) for i, h in enumerate(made)]


def _answered(hqp: Resolver, h: Hierarchy) -> Problem:
    res = hqp.solve(h)
    if res.status is not Status.SOLVED or not certify(h, res.x).certified:
        return _unanswered(h)
    return Problem(h, res.x, h.violations(res.x))


def _unanswered(h: Hierarchy) -> Problem:
    return Problem(h, np.full(h.n, np.nan), np.full(len(h.sizes), np.nan))
