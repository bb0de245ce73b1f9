"""Reference problems with stored certified answers, and fresh problems of the same families."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.archives import read_arrays
from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from scenarios.problems.recorded import TOGETHER, sequences
from solvers.problems import family as make_problem

EQUALITIES = ("EQ7", "EQ7over", "EQ7sing", "EQ30L8", "EQ30L10")
INEQUALITIES = ("INEQ7", "HUM38", "DEGEN7")
RECORDED = ("DYN60",)
FAMILIES = EQUALITIES + INEQUALITIES + RECORDED
DATA = Path(__file__).parent / "data"
_MISSING = 1e9  # marks a missing side in the data


@dataclass(frozen=True)
class Problem:
    """A hierarchy with its certified answer x (n,) and violations, norms (L,); NaN if unknown.

    `before` is the problem of the tick before, of a recorded sequence, or None.
    """

    h: Hierarchy
    x: Array
    norms: Array
    before: Hierarchy | None = None

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
        raise HierarchyError(f"there are no reference problems at {file}")
    data, problems = read_arrays(file), []
    for p in range(len(data["x"])):
        levels = []
        for k in range(int(data["L"])):
            lower, upper = data[f"lb{k}"][p], data[f"ub{k}"][p]
            levels.append((data[f"A{k}"][p], np.where(lower <= -_MISSING, -np.inf, lower),
                           np.where(upper >= _MISSING, np.inf, upper)))
        problems.append(Problem(Hierarchy.from_levels(levels), data["x"][p], data["norms"][p]))
    return _in_sequence(problems, data.get("sequence"))


def _in_sequence(problems: list[Problem], sequence: NDArray[Any] | None) -> list[Problem]:
    """Return problems with those before them, where neighbours are of one sequence."""
    if sequence is None:
        return problems
    return [replace(one, before=problems[p - 1].h) if p and sequence[p] == sequence[p - 1] else one
            for p, one in enumerate(problems)]


def fresh(name: str, seed: int, count: int) -> list[Problem]:
    """Generate problems of a family with seeds `seed`, `seed` + 1, ..., not used for tuning.

    Those of DYN60 are recorded from runs sampled with `seed`, which needs the extra `sim`, with the
    answers with which they were kept; of the others no answer is known.
    """
    problems: list[Problem] = []
    for some in sequences(seed) if name in RECORDED else ():
        problems += [Problem(h, x, h.violations(x)) for h, x in some]
        if len(problems) >= count:
            return _in_sequence(problems[:count], np.arange(count) // TOGETHER)
    made = (make_problem(name, seed + i) for i in range(count))
    return [Problem(h, np.full(h.n, np.nan), np.full(len(h.sizes), np.nan)) for h in made]
