"""Errors for a caller's mistakes; each names what was wrong and where."""

import difflib
import os
from collections.abc import Collection, Container, Iterable, Iterator, Sequence
from contextlib import contextmanager
from errno import ENAMETOOLONG
from math import inf, isfinite, isnan, nan
from numbers import Integral, Real
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

_NEAR = 0.6   # similarity of two names, 0 to 1, from which one is suggested
_LARGEST = 2**31 - 1  # whole number, where no other is said
SEEDS = 2**63 - 1     # largest seed of random numbers
OF_PROCESS = Lock()   # held while its filters of warnings, or its standard error, are others
_LISTED = 15  # known names that a message lists; of more it has the nearest


class HierarchyError(ValueError):
    """A caller's mistake; the text names the task or level, the row and the value."""


@contextmanager
def naming(what: str, error: type[HierarchyError] = HierarchyError,
           of: type[Exception] | tuple[type[Exception], ...] = HierarchyError) -> Iterator[None]:
    """Put what is wrong in front of an error raised within, `of` these kinds; raise an `error`."""
    try:
        yield
    except of as found:
        raise error(f"{what}: {found}") from found


@contextmanager
def of_user(what: str, error: type[HierarchyError] = HierarchyError) -> Iterator[None]:
    """Make whatever a user's code raises within an `error` that says `what` it is of."""
    try:
        yield
    except (Exception, SystemExit) as found:
        kind = "" if isinstance(found, HierarchyError) else f"{type(found).__name__}: "
        raise error(f"{what}: {kind}{found}") from found


class UnknownNameError(HierarchyError):
    """An unknown name, with the most similar known ones; `more` is a further sentence.

    `above` stands in front of the name, as the dotted section of a key does.
    """

    def __init__(self, what: str, name: object, known: Iterable[str], more: str = "",
                 above: str = "") -> None:
        known = sorted(known)
        near = nearest(name, known, similarity=_NEAR)
        hint = f"; did you mean {above + near[0]!r}?" if near else "."
        said = (f"Known: {', '.join(known) or 'none'}." if len(known) <= _LISTED else
                f"The nearest of {len(known)}: {', '.join(nearest(name, known))}.")
        super().__init__(f"unknown {what} {f'{above}{name}' if above else name!r}{hint} {said}"
                         + (f" {more}" if more else ""))


def nearest(name: object, known: Iterable[str], most: int = 5, similarity: float = 0.0
            ) -> list[str]:
    """Return the known names nearest to a name: those that contain it, then similar ones.

    similarity : of two names, 0 to 1, from which one counts; upper and lower case are the same.
    """
    asked, by_key = str(name).casefold(), {one.casefold(): one for one in known}
    containing = sorted((one for one in by_key if asked in one), key=len) if len(asked) > 2 else []
    similar = difflib.get_close_matches(asked, by_key, n=most, cutoff=similarity)
    return [by_key[one] for one in dict.fromkeys([*containing, *similar])][:most]


def is_one_of(value: object, known: Container[str]) -> bool:
    """Whether a value is a text, and one of those known; an array or a list is no text."""
    return isinstance(value, str) and value in known


def check_name(what: str, name: object, known: Collection[str]) -> None:
    """Raise an UnknownNameError unless a name is a text, and one of those known."""
    if not is_one_of(name, known):
        raise UnknownNameError(what, name, known)


def refuse(wrong: object, said: str, error: type[HierarchyError] = HierarchyError) -> None:
    """Raise an error with what is said if something is wrong, or return None."""
    if wrong:
        raise error(said)


def expect(what: str, value: object, kind: type, remedy: str) -> None:
    """Raise a HierarchyError that says what was given and what is expected, or return None.

    An array without dimensions, which numpy calls iterable and sized, is neither.
    """
    if not isinstance(value, kind) or (isinstance(value, np.ndarray) and not value.ndim):
        article = "an" if kind.__name__[0] in "AEIOUaeiou" else "a"
        raise HierarchyError(f"{what}: expected {article} {kind.__name__}, got {brief(value)}; "
                             f"{remedy}")


def text(what: str, value: object) -> None:
    """Raise a HierarchyError unless a value is a text, or return None."""
    expect(what, value, str, "give a text")


def expect_each(what: str, values: object, kind: type, remedy: str) -> None:
    """Raise a HierarchyError unless values are a sequence of one kind, or return None."""
    expect(what, values, Sequence, remedy)
    sequence: Sequence[object] = values  # type: ignore[assignment]
    for i, value in enumerate(sequence):
        expect(f"{what}[{i}]", value, kind, remedy)


def number(what: str, value: object, least: float = -inf, largest: float = inf) -> float:
    """Return a finite number from `least` to `largest`; raise a HierarchyError for anything else.

    True and False are no numbers here.
    """
    found = as_float(value)
    if isfinite(found) and least <= found <= largest:
        return found
    shown = repr(value) if isnan(found) else f"{found:g}"
    raise HierarchyError(f"{what} = {shown}: expected a finite number{_between(least, largest)}")


def positive(what: str, value: object, largest: float = inf) -> float:
    """Return a finite number > 0, at most `largest`; raise a HierarchyError for anything else."""
    found, most = number(what, value), "" if largest == inf else f", at most {largest:g}"
    refuse(not 0.0 < found <= largest, f"{what} = {found:g}: expected a number > 0{most}")
    return found


def real(what: str, value: object, least: float = -inf) -> float:
    """Return a number from `least` on, maybe infinite; raise a HierarchyError for anything else."""
    found = as_float(value)
    if found >= least:
        return found
    shown = repr(value) if isnan(found) else f"{found:g}"
    raise HierarchyError(f"{what} = {shown}: expected a number{_between(least, inf)}")


def whole(what: str, value: object, least: int = 0, largest: int = _LARGEST) -> int:
    """Return a whole number from `least` to `largest`; raise a HierarchyError for anything else."""
    given = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if given is not None and least <= given <= largest:
        return given
    bound = inf if largest == _LARGEST and (given is None or given < least) else largest
    raise HierarchyError(f"{what} = {value!r}: expected a whole number{_between(least, bound)}")


def check_choice(what: str, value: object, known: Collection[str | int]) -> None:
    """Raise a HierarchyError unless a text or a whole number is one of those known."""
    refuse(type(value) not in (str, int) or value not in known, f"{what} = {value!r}: expected "
           f"one of {', '.join(map(repr, known))}")


def as_float(value: object) -> float:
    """Return a number, infinite if it is too large for one, and NaN for what is no number."""
    if not isinstance(value, Real) or isinstance(value, bool | np.bool_):
        return nan
    try:
        return float(value)
    except OverflowError:
        return inf if value == abs(value) else -inf


def _between(least: float, largest: float) -> str:
    return (f" from {least:g} to {largest:.12g}" if isfinite(largest) else
            f" from {least:g} on" if isfinite(least) else "")


def finite_numbers(what: str, values: object, size: int | None = None) -> NDArray[np.float64]:
    """Return finite numbers (size,); raise a HierarchyError for anything else.

    Without `size` there may be any number of them, but one.
    """
    try:
        found = np.asarray(values)
    except ValueError:
        found = np.asarray(None)
    count = "" if size is None else f"{size} "
    if (found.dtype.kind not in "iuf" or found.ndim != 1 or not found.size
            or size not in (None, found.size) or not np.isfinite(found).all()
            or np.ma.is_masked(values)):
        raise HierarchyError(f"{what}: expected {count}finite numbers, got {brief(values)}")
    return found.astype(float)


def file_path(what: str, value: object) -> Path:
    """Return a path, ~ as the home folder; refuse all but texts and paths that a file can have."""
    if not isinstance(value, str | os.PathLike) or not str(value).strip():
        raise HierarchyError(f"{what}: expected a path, got {brief(value)}")
    try:
        os.lstat(value)
    except (OSError, ValueError) as error:
        refuse(isinstance(error, ValueError) or getattr(error, "errno", 0) == ENAMETOOLONG,
               f"{what}: no file can be called {str(value)[:60]!r}")
    return Path(os.path.expanduser(value))  # noqa: PTH111 - raises for no user


def missing(error: ModuleNotFoundError, extra: str) -> ModuleNotFoundError:
    """Return an error that also says which line installs a module that is not there.

    Of lines for what it was imported for, the last counts, which installs most.
    """
    ours = str(error.name).partition(".")[0] in ("hierarchy", "solvers", "scenarios")
    remedy = "" if ours else f": pip install 'task-hierarchy[{extra}]'"
    return ModuleNotFoundError(f"{str(error).partition(': pip')[0]}{remedy}", name=error.name)


def brief(value: object) -> str:
    """Return the type of a value and the value itself, in at most 80 characters."""
    text = " ".join(repr(value).split())
    return f"{type(value).__name__} {text if len(text) <= 60 else text[:57] + '...'}"


class RobotError(HierarchyError):
    """A robot model that cannot be read, or a state that does not fit the robot."""


class ReadingError(RobotError):
    """Joint positions or velocities that were read are not finite; a `Loop` then stops."""
