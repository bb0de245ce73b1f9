"""Which constraint blocks which task, in words."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, brief, expect, number, refuse
from hierarchy.gate import shaped
from hierarchy.problem import Array, Hierarchy
from hierarchy.words import listed
from solvers.resolver import Resolution
from solvers.resolvers.hcod import ActiveSetResolution
from solvers.status import EQUAL, Status

_NAMED, _SMALL = 3, 0.1  # missed rows that are named, and the share of the largest that counts
_AXES = ("x", "y", "z")
_SINGULAR = 1e-3  # share of |A| |w| below which A^T w counts as nothing
_ROUNDED = 1e-12  # the same, of a level whose own rows disagree
_MATTERS = 1e-6  # smallest share of a level's pull for which a level above is named


def explain(h: Hierarchy, resolution: Resolution, tolerance: float = 1e-9,
            rows: Sequence[str] | None = None, units: Sequence[str] | None = None) -> str:
    """Say whether each level is met and, if not, which rows hold it back or give way for whom.

    Returns one line per level, under its name in `h.names`. A level counts as met if its violation
    is at most `tolerance` times the size of its terms. `rows` are names of the m rows, None for
    those of h, which a stack and the adapters give; without any rows are numbered within their
    level, with them the largest missed inequalities of a level are named too. `units` of the m rows
    are written behind what a row gives. Of a hierarchy with rows whose sides cross, or of a
    numerical failure, nothing else is said. Raises a HierarchyError unless the resolution is from
    `hcod`, the only resolver that reports which level each row holds back, and if its rows, names
    or units are not m.
    """
    expect("explain: h", h, Hierarchy, "make one with Hierarchy.from_levels([(A, b), ...])")
    number("explain: tolerance", tolerance, 0.0)
    if rows is None and h.named is not None:
        rows = h.named()
    names = [f"row {i}" for size in h.sizes for i in range(size)] if rows is None else rows
    units = [""] * h.m if units is None else units
    for what, called, given in (("rows", "names", names), ("units", "units", units)):
        refuse(isinstance(given, str) or not isinstance(given, Sequence),
               f"explain: {what}: expected a list of names, got {brief(given)}")
        refuse(len(given) != h.m, f"explain: {len(given)} {called} for {h.m} rows")
    if not isinstance(resolution, ActiveSetResolution):
        raise HierarchyError("explain needs a resolution of hcod: other resolvers do not report "
                             "which level each row holds back")
    if h.giving and len(resolution.active) < h.m:  # a witness was not found
        h = h.upper_part(h.giving[-1] + 1)
    shaped("explain: active", resolution.active, (h.m,))
    for i in np.flatnonzero(~(h.lower <= h.upper)).tolist():  # NaN too
        return (f"{h.names[_level_of(h, i)]} {names[i]}: no value lies between lower "
                f"{h.lower[i]:g} and upper {h.upper[i]:g}")
    if resolution.status is Status.NUMERICAL_FAILURE:
        return str(resolution.status)
    lines = [_level(h, resolution, k, tolerance, names, rows is not None)
             for k in range(len(h.sizes))]
    if resolution.witnesses is not None:
        for level, witness in zip(h.giving, resolution.witnesses, strict=False):
            lines[level] = _giving(h, resolution, level, witness, tolerance, names, units)
    if resolution.unfinished is not None:
        lines.append(f"The iteration limit was reached at {h.names[resolution.unfinished]!r}: it "
                     "and the levels below may not be optimal.")
    return "\n".join(lines)


def _level_of(h: Hierarchy, row: int) -> int:
    return int((h.offsets[1:] <= row).sum())


def is_missed(h: Hierarchy, x: Array, k: int, tolerance: float) -> bool:
    """Whether x violates level k by more than `tolerance` times the size of its terms."""
    w = h.slacks(x)[h.offsets[k]:h.offsets[k + 1]]
    return bool(np.linalg.norm(w) > _least_miss(h, x, k, tolerance))


def _least_miss(h: Hierarchy, x: Array, k: int, tolerance: float) -> float:
    rows = h.A[h.offsets[k]:h.offsets[k + 1]]
    return float(tolerance * np.linalg.norm(rows) * np.linalg.norm(x)) + 1e-300


def _level(h: Hierarchy, resolution: ActiveSetResolution, k: int, tolerance: float,
           names: Sequence[str], named: bool) -> str:
    rows = slice(h.offsets[k], h.offsets[k + 1])
    if not h.sizes[k]:
        return f"{h.names[k]} has no rows."
    if not is_missed(h, resolution.x, k, tolerance):
        return f"{h.names[k]} is met."
    missed = float(np.linalg.norm(h.slacks(resolution.x)[rows]))
    blocking = held_back_by(h, resolution, k, names)
    most = most_missed(h, resolution.x, k, names) if named else []
    at = f", at {listed(most)}" if most else ""
    why = (f"held back by {listed(_said_once(blocking, h.names))}" if blocking else
           nowhere(h, k, names[rows], resolution.x) or "its own rows disagree")
    return f"{h.names[k]} is missed by {missed:.3g}{at}: {why}."


def _giving(h: Hierarchy, resolution: ActiveSetResolution, k: int, witness: Array,
            tolerance: float, names: Sequence[str], units: Sequence[str]) -> str:
    """Say by how much a level that gives is missed, and for which levels beyond its least."""
    assert h.give is not None
    if not is_missed(h, resolution.x, k, tolerance):
        return f"{h.names[k]} is met."
    rows, whom = np.arange(h.offsets[k], h.offsets[k + 1]), (*h.names, "the reference")
    w, least = h.slacks(resolution.x)[rows], h.slacks(witness)[rows]
    needed, given = float(np.linalg.norm(least)), []
    size = max(_least_miss(h, resolution.x, k, tolerance), tolerance * needed)
    for i, more in zip(rows.tolist(), (np.abs(w) - np.abs(least)).tolist(), strict=True):
        if more > size:
            unit, level = units[i] and f" {units[i]}", int(resolution.holds_back[i])
            given.append(f"{names[i]} gives {more:.3g} of {h.give[i]:.3g}{unit} for "
                         f"{'the levels below' if level < 0 else whom[level]}")
    at_least = f", of which {needed:.3g} cannot be avoided" if needed > size else ""
    gives = f": {listed(given)}" if given else ""
    return f"{h.names[k]} is missed by {float(np.linalg.norm(w)):.3g}{at_least}{gives}."


def most_missed(h: Hierarchy, x: Array, k: int, names: Sequence[str]) -> list[str]:
    """Return the names of the up to three inequalities of level k that x violates most."""
    rows = np.arange(h.offsets[k], h.offsets[k + 1])
    w = np.abs(h.slacks(x)[rows]) * (h.lower[rows] != h.upper[rows])
    chosen = [i for i in np.argsort(-w, kind="stable")[:_NAMED].tolist()
              if w[i] > _SMALL * w.max()]
    return [names[rows[i]] for i in chosen] if len(rows) > 1 else []


def nowhere(h: Hierarchy, k: int, names: Sequence[str], x: Array) -> str:
    """Say which rows of level k no joint can move, if that is why x misses it; else "".

    Rows that are missed together are a direction if they are axes, by the last letter of their
    names; of others only a row of zeros is one, since the data of two rows that contradict each
    other are the same.
    """
    rows = slice(h.offsets[k], h.offsets[k + 1])
    A, w = h.A[rows], h.slacks(x)[rows]
    size = float(np.linalg.norm(A)) * float(np.linalg.norm(w))
    if not w.any() or not np.linalg.norm(A.T @ w) <= _SINGULAR * size < np.inf:
        return ""
    shares = w / w[np.argmax(np.abs(w))]
    along = [f"{'' if share == 1.0 else f'{share:.2g} '}{name}"
             for name, share in zip(names, shares, strict=True) if abs(share) > _SMALL]
    if len(along) > 1 and not all(name[-1:] in _AXES for name in along):
        return ""
    return f"singular here: no joint moves {h.names[k]} along {listed(along)}"


def held_back_by(h: Hierarchy, resolution: ActiveSetResolution, k: int,
                 rows: Sequence[str]) -> list[str]:
    """Return what holds level k back: rows at a side, by their names, and levels.

    A row that is at its side for another level above stands for that level, and an equality for its
    own, but among inequalities, such as a limit of a joint that is stuck, for itself.
    """
    said, levels = [], set[int]()
    for i in holders(h, resolution, k).tolist():
        level, held = _level_of(h, i), int(resolution.holds_back[i])
        equal = bool(resolution.active[i] == EQUAL)
        among = slice(h.offsets[level], h.offsets[level + 1])
        if held != k and not (equal and (h.lower[among] < h.upper[among]).any()):
            levels.add(level if equal else held)
            continue
        row = f"{h.names[level]} {rows[i]}" if h.sizes[level] > 1 else h.names[level]
        side = " (fixed)" if equal else (
            f" at its {'upper' if resolution.active[i] > 0 else 'lower'} side")
        gives = h.give is not None and h.give[i] > 0.0
        said.append(row + (" (gives no more)" if gives else side))
    return said + [h.names[level] for level in sorted(levels)]


def holders(h: Hierarchy, resolution: ActiveSetResolution, k: int) -> NDArray[np.int64]:
    """Return the rows of levels above whose forces carry the pull of level k.

    These are equalities, and inequalities at a side that hold back this level or, before it,
    another: the latter cannot leave their side without a loss there.
    """
    first, last = h.offsets[k:k + 2]
    state, held = resolution.active[:first], resolution.holds_back[:first]
    sizes = np.linalg.norm(h.A[:first], axis=1)
    own = held == k
    acting = np.flatnonzero(((state == EQUAL) | ((held >= 0) & (held < k))) & (sizes > 0.0))
    A, w = h.A[first:last], h.slacks(resolution.x)[first:last]
    pull, size = A.T @ w, np.linalg.norm(A) * np.linalg.norm(w)
    if len(acting) and np.linalg.norm(pull) > _ROUNDED * size:
        left = pull + h.A[:first][own].T @ resolution.multipliers[:first][own]
        unit = h.A[acting] / sizes[acting, None]
        forces = np.linalg.lstsq(unit.T, left, rcond=1e-10)[0]
        own[acting[np.abs(forces) > _MATTERS * np.linalg.norm(pull)]] = True
    return np.flatnonzero(own)


def _said_once(blocking: Sequence[str], levels: Sequence[str]) -> list[str]:
    """Return names without that of their level where the one before is of the same level."""
    of = [max((f"{level} " for level in levels if name.startswith(f"{level} ")), key=len,
              default=name) for name in blocking]
    return [name.removeprefix(level) if level == before else name
            for name, level, before in zip(blocking, of, ["", *of], strict=False)]
