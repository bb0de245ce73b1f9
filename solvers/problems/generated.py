"""Random hierarchies with every known difficulty, for tests of resolvers.

    for seed in range(1000):
        h = generate(seed)
        assert certify(h, make("hcod").solve(h).x).certified

`family` generates fresh problems like those of the reference families; `structured` generates
singular arms, tied boxes, contacts, nested levels and mixed units.

All rows of a hierarchy start as unit rows around one point x*, so that sides can pass through the
same vertex; then they are scaled. `strategy` provides the same problems to hypothesis.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.linalg import norm

from hierarchy.archives import read_arrays
from hierarchy.errors import SEEDS, HierarchyError, expect, file_path, finite_numbers, number, whole
from hierarchy.problem import Array, Hierarchy
from solvers.problems.kinds import Random, happens

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy


@final
@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Distribution of generated problems: ranges are (least, most), chances are per level.

    Sizes are log-uniform in joints, levels and rows, norms in scales; `spread` is the ratio of the
    largest to the smallest norm in a level, `angles` [rad] those of `near_parallel` rows. Chances
    of a structure: empty, rank_lost, linked (rows in the span of levels above), simple_bounds,
    zero_rows, duplicates, near_parallel; of a whole problem: conflicting, reference. Shares of the
    inequalities: ties (a side exactly at x*), one_sided, sideless.

    Raises HierarchyError for an empty range, a chance outside 0..1, or another type.
    """

    joints: tuple[int, int] = (1, 60)
    levels: tuple[int, int] = (1, 12)
    rows: tuple[int, int] = (0, 40)
    equalities_only: bool = False
    empty: float = 0.03
    rank_lost: float = 0.2
    linked: float = 0.3
    simple_bounds: float = 0.15
    conflicting: float = 0.6
    ties: float = 0.4
    one_sided: float = 0.4
    sideless: float = 0.02
    zero_rows: float = 0.05
    duplicates: float = 0.1
    near_parallel: float = 0.03
    angles: tuple[float, float] = (1e-6, 1e-1)
    scales: tuple[float, float] = (1e-6, 1e6)
    spread: float = 100.0
    reference: float = 0.5

    def __post_init__(self) -> None:
        least = {"joints": 1, "levels": 1, "rows": 0, "angles": 0.0, "scales": 0.0}
        for field in dataclasses.fields(self):
            what, value = f"recipe: {field.name}", getattr(self, field.name)
            if field.name in least:
                low, high = finite_numbers(what, value, 2)
                if not least[field.name] <= low <= high:
                    raise HierarchyError(f"{what} = {value!r} is out of range")
            elif field.name == "equalities_only":
                expect(what, value, bool, "give True or False")
            elif field.name == "spread":
                number(what, value, 1.0)
            else:
                number(what, value, 0.0, 1.0)


ANY = Recipe()
_MORE = ("metric", "give")  # what a file has of the hierarchies that have it


def generate(seed: int, recipe: Recipe = ANY) -> Hierarchy:
    """Return the hierarchy of a seed, reproducibly."""
    expect("generate: recipe", recipe, Recipe, "give Recipe()")
    rng = np.random.default_rng(whole("generate: seed", seed, largest=SEEDS))
    n = _whole(rng, recipe.joints)
    count = _whole(rng, recipe.levels)
    rows = (max(recipe.rows[0], min(1, recipe.rows[1])), recipe.rows[1])
    sizes = [recipe.rows[0] if happens(rng, recipe.empty) else _whole(rng, rows)
             for _ in range(count)]
    return written(rng, n, sizes, recipe)


def strategy(recipe: Recipe = ANY) -> SearchStrategy[Hierarchy]:
    """Return a hypothesis strategy for hierarchies that shrinks unknowns, levels and rows."""
    from hypothesis import strategies as st

    def build(n: int, sizes: list[int], seed: int) -> Hierarchy:
        return written(np.random.default_rng(seed), n, sizes, recipe)

    return st.builds(build, st.integers(*recipe.joints),
                     st.lists(st.integers(*recipe.rows), min_size=recipe.levels[0],
                              max_size=recipe.levels[1]),
                     st.integers(0, 2**32 - 1))


def written(rng: Random, n: int, sizes: Sequence[int], recipe: Recipe = ANY) -> Hierarchy:
    """Return a hierarchy with n unknowns and levels of these sizes."""
    through = rng.normal(size=n)
    conflicts = recipe.conflicting * happens(rng, recipe.conflicting)
    above, levels = np.empty((0, n)), []
    for size in sizes:
        unit = _directions(rng, size, above, recipe)
        _repeat_a_row(rng, unit, above, recipe)
        if size and happens(rng, recipe.zero_rows):
            unit[rng.integers(size)] = 0.0
        sides = _sides(rng, unit @ through, happens(rng, conflicts), recipe)
        scale = _scale(rng, size, recipe)
        levels.append((unit * scale[:, None], *(scale * side for side in sides)))
        above = np.vstack([above, unit])
    reference = rng.normal(size=n) if happens(rng, recipe.reference) else np.zeros(n)
    return Hierarchy.from_levels(levels, reference)


def save(h: Hierarchy, path: str | Path) -> None:
    """Write a hierarchy as a small .npz file."""
    expect("save: h", h, Hierarchy, "make one with Hierarchy.from_levels")
    more = {name: getattr(h, name) for name in _MORE if getattr(h, name) is not None}
    np.savez_compressed(file_path("save", path), A=h.A, lower=h.lower, upper=h.upper,
                        sizes=h.sizes, reference=h.reference,
                        names=np.array(h.names, dtype=np.str_), **more)


def load(path: str | Path) -> Hierarchy:
    """Read a hierarchy written by `save`; names, metric and give are optional in the file.

    Raises HierarchyError, naming the file, if it is damaged or what it holds is no hierarchy.
    """
    try:
        file = read_arrays(file_path("load", path))
        return Hierarchy(file["A"], file["lower"], file["upper"], file["sizes"], file["reference"],
                         file["names"].tolist() if "names" in file else None,
                         **{name: file.get(name) for name in _MORE})
    except KeyError as error:
        raise HierarchyError(f"{path} has no array {error}") from error
    except HierarchyError as error:
        raise HierarchyError(f"{path} cannot be read as a hierarchy: {error}") from error


def _directions(rng: Random, size: int, above: Array, recipe: Recipe) -> Array:
    """Return unit rows (size, n): simple bounds, or of a random rank and link to levels above."""
    n = above.shape[1]
    if happens(rng, recipe.simple_bounds):
        order = np.resize(rng.permutation(n), size)
        return np.asarray(np.eye(n)[order])
    lost = size > 1 and happens(rng, recipe.rank_lost)
    rank = int(rng.integers(1, size)) if lost else size
    basis = rng.normal(size=(rank, n))
    if len(above) and rank and happens(rng, recipe.linked):
        taken = int(rng.integers(1, rank + 1))
        chosen = above[rng.integers(len(above), size=min(taken + 2, 8))]
        basis[:taken] = rng.normal(size=(taken, len(chosen))) @ chosen
    rows = np.vstack([basis, rng.normal(size=(size - rank, rank)) @ basis])
    length = norm(rows, axis=1, keepdims=True)
    return np.asarray(rng.permutation(rows / np.where(length > 0.0, length, 1.0)))


def _repeat_a_row(rng: Random, unit: Array, above: Array, recipe: Recipe) -> None:
    """Replace one row by a copy of another row of the hierarchy, exact or at an angle."""
    size, n = unit.shape
    choices = np.vstack([above, unit])
    duplicate, parallel = (happens(rng, recipe.duplicates), happens(rng, recipe.near_parallel))
    if not size or len(choices) < 2 or not (duplicate or parallel):
        return
    last, other = int(rng.integers(size)), int(rng.integers(len(choices)))
    copied = choices[other] * rng.choice([1.0, -1.0])
    if parallel and n > 1 and copied.any():
        aside = rng.normal(size=n)
        aside -= copied * (copied @ aside)
        angle = _between(rng, recipe.angles)
        copied = np.cos(angle) * copied + np.sin(angle) * aside / norm(aside)
    unit[last] = copied


def _sides(rng: Random, value: Array, conflict: bool, recipe: Recipe) -> tuple[Array, Array]:
    """Return sides (m_k,) around the value of unit rows at x*, feasible without a conflict."""
    m = len(value)
    equal = np.full(m, recipe.equalities_only)
    if not recipe.equalities_only:
        equal |= rng.random(m) < rng.choice([0.0, 1.0, 0.3])
    moved = value + conflict * rng.normal(size=m) * (rng.random(m) < 0.7)
    lower = moved - rng.exponential(size=m)
    upper = moved + rng.exponential(size=m)
    tied = rng.random((2, m)) < recipe.ties / 2.0
    lower, upper = np.where(tied[0], value, lower), np.where(tied[1], value, upper)
    missing = rng.random(m)
    alone = missing < recipe.one_sided
    lower[alone & (missing < recipe.one_sided / 2.0)] = -np.inf
    upper[alone & (missing >= recipe.one_sided / 2.0)] = np.inf
    none = rng.random(m) < recipe.sideless
    lower[none], upper[none] = -np.inf, np.inf
    lower, upper = np.minimum(lower, upper), np.maximum(lower, upper)
    return np.where(equal, moved, lower), np.where(equal, moved, upper)


def _scale(rng: Random, size: int, recipe: Recipe) -> Array:
    """Return norms of the rows of a level: all one, with a chance of one half, where allowed."""
    low, high = recipe.scales
    if happens(rng, 0.5) and low <= 1.0 <= high:
        return np.ones(size)
    half = np.sqrt(recipe.spread)
    middle = _between(rng, (low, high))
    around = (1.0 / half, half)
    return np.clip([middle * _between(rng, around) for _ in range(size)], low, high).reshape(size)


def _between(rng: Random, ends: tuple[float, float]) -> float:
    """Return a log-uniform number."""
    return float(np.exp(rng.uniform(*np.log(np.maximum(ends, 1e-300)))))


def _whole(rng: Random, ends: tuple[int, int]) -> int:
    """Return a log-uniform whole number, both ends included."""
    return min(int(_between(rng, (ends[0] or 0.5, ends[1] + 1))), ends[1])
