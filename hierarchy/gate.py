"""Checks of arrays before they reach kernels, which check nothing."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import HierarchyError, brief, finite_numbers, refuse

Array = NDArray[np.float64]
Sizes = NDArray[np.int64]
_TURNED = 1e-6       # of R R^T from the identity
_ROUNDED = 1e-2      # the same, of a rotation that was written with few digits
_NUMBERS = "biufO"  # kinds of numpy's types that are real numbers, or may be


def array_of(what: str, value: Any) -> Array:
    """Return numbers as a new array; raises a HierarchyError for anything else."""
    try:
        given = np.asarray(value)
        missing = given.dtype.kind == "O" and any(one is None for one in given.flat)
        if given.dtype.kind in _NUMBERS and not missing and not np.ma.is_masked(value):
            return np.array(given, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        raise HierarchyError(f"{what} is not an array of numbers: {brief(value)}") from error
    kind = "real numbers: it is complex," if given.dtype.kind == "c" else "numbers:"
    raise HierarchyError(f"{what} is not an array of {kind} {brief(value)}")


def check_rotation(what: str, rotation: ArrayLike) -> Array:
    """Return a rotation (3, 3) as a new array; HierarchyError, with how far it is off, for none."""
    try:
        R = array_of(what, rotation)
    except HierarchyError:
        R = np.empty(0)
    if R.shape != (3, 3) or not np.isfinite(R).all():
        raise HierarchyError(f"{what}: expected a rotation matrix (3, 3), got {brief(rotation)}")
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    if off > _TURNED or np.linalg.det(R) < 0.0:
        rounded = ": write it with 8 digits" if off < _ROUNDED else ""
        why = (f"R R^T is {off:.2g} from the identity, at most {_TURNED:g} is allowed{rounded}"
               if off > _TURNED else "it is a reflection, of determinant -1")
        raise HierarchyError(f"{what}: expected a rotation matrix (3, 3), but {why}; got "
                             f"{brief(R.tolist())}")
    return R


Rotation = Annotated[ArrayLike, check_rotation]  # (3, 3), of a field; see `records`


def direction(what: str, value: ArrayLike) -> Array:
    """Return a direction (3,) at length one; raises a HierarchyError for numbers that are none."""
    given = finite_numbers(what, value, 3)
    length = float(np.linalg.norm(given))
    refuse(not 1e-9 < length < np.inf, f"{what}: {brief(value)} is no direction")
    return given / length


def axes_along(what: str, z: ArrayLike) -> Array:
    """Return axes as rows (3, 3), of which the third is a direction; see `direction`.

    The first is x as seen across it, or y where it is along x.
    """
    third = direction(what, z)
    toward = np.eye(3)[0 if abs(third[0]) < 0.9 else 1]
    first = toward - (toward @ third) * third
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(third, first), third])


def readable(what: str, value: Any) -> Array:
    """Return numbers as kernels read them: float64, C-contiguous, aligned and writeable.

    The same memory if it is like that, through a view of its own: a caller who then gives his array
    another shape or type does not change this one.
    """
    if type(value) is np.ndarray and value.dtype == np.float64 and value.flags.carray:
        return value.view()
    return array_of(what, value).view()  # whose `base` is another array


def shaped(what: str, value: Any, shape: tuple[int, ...]) -> Array:
    """Return numbers of this shape as kernels read them; raises a HierarchyError for another."""
    array = readable(what, value)
    if array.shape != shape:
        raise HierarchyError(f"{what} has shape {array.shape}, expected {shape}")
    return array


def level_names(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    """Return one name for each level; None for "level 1", "level 2", ...

    Raises HierarchyError unless they are texts, as many, and all different.
    """
    if names is None:
        return tuple(f"level {k + 1}" for k in range(count))
    if (not isinstance(names, str | tuple) and isinstance(names, Iterable)
            and getattr(names, "shape", None) != ()):
        names = tuple(names)
    if not isinstance(names, tuple) or not all(isinstance(name, str) for name in names):
        raise HierarchyError(f"names: expected a list of texts, got {brief(names)}")
    if len(names) != count:
        raise HierarchyError(f"{len(names)} names for {count} levels")
    if len(set(names)) < count:
        name, times = Counter(names).most_common(1)[0]
        raise HierarchyError(f"{times} levels are named {name!r}; give each its own name")
    return names


def checked_sizes(sizes: ArrayLike, rows: int) -> Sizes:
    """Return a copy of the level sizes (L,), which must add up to the number of rows.

    Raises HierarchyError, naming the level, unless they are whole numbers >= 0 of this sum.
    """
    try:
        found = np.asarray(sizes)
    except ValueError:
        found = np.asarray(None)
    if found.ndim != 1 or (found.size and found.dtype.kind not in "iu"):
        raise HierarchyError(f"sizes: expected a whole number of rows for each level, got "
                             f"{brief(sizes)}")
    numbers = found.tolist()  # those of Python have no largest, so their sum cannot wrap
    for k, size in enumerate(numbers):
        if not 0 <= size <= rows:
            raise HierarchyError(f"level {k + 1}: size {size}, expected a whole number of rows "
                                 f"from 0 to {rows}")
    if sum(numbers) != rows:
        raise HierarchyError(f"sizes sum to {sum(numbers)}, but A has {rows} rows")
    return found.astype(np.int64)


def check_rows(name: str, A: Array, lower: Array, upper: Array) -> None:
    """Raise a HierarchyError that names the first bad row of a level, or return None.

    Shapes: A (m_k, n), lower and upper (m_k,).
    """
    for row, column in np.argwhere(~np.isfinite(A))[:1]:
        raise HierarchyError(f"{name}, row {row}: A[{row}, {column}] is {A[row, column]}")
    for (row,) in np.argwhere(~_met_by_some(lower, upper))[:1]:
        for side, value in (("lower", lower[row]), ("upper", upper[row])):
            refuse(np.isnan(value), f"{name}, row {row}: {side} is nan")
        raise HierarchyError(
            f"{name}, row {row}: no value lies between lower {lower[row]} and upper {upper[row]}")


def sound_rows(A: Array, lower: Array, upper: Array) -> bool:
    """Whether A is finite and a value lies between the sides of every row."""
    return bool(np.isfinite(A).all() and _met_by_some(lower, upper).all())


def _met_by_some(lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Whether a value lies between the sides of a row (m,); not if one is NaN."""
    return (lower <= upper) & (lower < np.inf) & (upper > -np.inf)


def check_finite(what: str, values: Array) -> None:
    """Raise a HierarchyError that names the first entry of (n,) that is not finite."""
    for i in np.flatnonzero(~np.isfinite(values))[:1]:
        raise HierarchyError(f"{what}, entry {i}: {values[i]} is not finite")


def checked_metric(metric: ArrayLike) -> Array:
    """Return a metric (n, n), n being any number.

    Raises HierarchyError if it has another shape, an entry that is not finite, or is not symmetric
    or not positive definite, up to rounding.
    """
    W = array_of("metric", metric)
    size = len(W) if W.ndim else 0
    W = shaped("metric", W, (size, size))
    for i, j in np.argwhere(~np.isfinite(W))[:1]:
        raise HierarchyError(f"metric[{i}, {j}] is {W[i, j]}")
    rounding = size * float(np.finfo(float).eps) * abs(W).max(initial=0.0)
    for i, j in np.argwhere(abs(W - W.T) > rounding)[:1]:
        raise HierarchyError(f"metric is not symmetric: [{i}, {j}] is {W[i, j]} and [{j}, {i}] is "
                             f"{W[j, i]}")
    smallest = np.linalg.eigvalsh(W).min(initial=np.inf)
    if not smallest > rounding:
        raise HierarchyError("metric is not positive definite: its smallest eigenvalue is "
                             f"{smallest:.3g}")
    return W


def checked_give(name: str, give: ArrayLike, size: int) -> Array:
    """Return the `give` of each row of a level (size,), from one number or as many.

    Raises HierarchyError, naming the level, for another shape or a number that is not finite and at
    least zero.
    """
    rows = array_of(f"{name}: give", give)
    if rows.shape not in ((), (size,)):
        raise HierarchyError(f"{name}: give has shape {rows.shape}, expected one number or "
                             f"({size},)")
    rows = np.broadcast_to(rows, (size,)).copy()
    for i in np.flatnonzero(~(np.isfinite(rows) & (rows >= 0.0)))[:1]:
        raise HierarchyError(f"{name}, row {i}: give is {rows[i]}, expected a number >= 0")
    return rows


def checked_level(name: str, level: Sequence[ArrayLike]) -> tuple[Array, Array, Array]:
    """Return A (m_k, n), lower and upper (m_k,) of a level (A, b) or (A, lower, upper).

    Raises HierarchyError, naming the level, for a wrong type or shape; values are not looked at.
    """
    if not isinstance(level, (tuple, list)) or len(level) not in (2, 3):
        raise HierarchyError(f"{name}: expected (A, b) or (A, lower, upper), got {brief(level)}")
    A = readable(f"{name}: A", level[0])
    if A.ndim != 2:
        raise HierarchyError(f"{name}: A has shape {A.shape}, expected (rows, n)")
    first = "lower" if len(level) == 3 else "b"
    return (A, shaped(f"{name}: {first}", level[1], A.shape[:1]),
            shaped(f"{name}: {first if len(level) == 2 else 'upper'}", level[-1], A.shape[:1]))
