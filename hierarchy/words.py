"""Names and numbers as they stand in a sentence, and things by name."""

from collections.abc import Hashable, Iterable, Sequence
from typing import TypeVar

_Key = TypeVar("_Key", bound=Hashable)
_Thing = TypeVar("_Thing")

_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def gathered(pairs: Iterable[tuple[_Key, _Thing]]) -> dict[_Key, list[_Thing]]:
    """Return the things of each key, in the order in which they come."""
    found: dict[_Key, list[_Thing]] = {}
    for key, thing in pairs:
        found.setdefault(key, []).append(thing)
    return found


def listed(names: Sequence[str], last_by: str = "and") -> str:
    """Return names, at least one, as a list in a sentence: "a", "a and b", "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} {last_by} {last}" if first else last


def some(names: Sequence[str], most: int = 12) -> str:
    """Return the first names, and how many more there are; one more is named."""
    if len(names) <= most + 1:
        return ", ".join(names)
    return f"{', '.join(names[:most])} and {len(names) - most} more"


def each(*told: tuple[str, Sequence[str]]) -> list[str]:
    """Return "what: names" for each what that has names."""
    return [f"{what}: {some(names)}" for what, names in told if names]


def counted(count: int, what: str) -> str:
    """Return a number of things: "1 column", "2 columns"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def in_words(count: int) -> str:
    """Return a small number as a word, a larger one in digits."""
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)
