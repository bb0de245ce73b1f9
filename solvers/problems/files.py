"""Problems as files that any language can read: docs/problem-files.md describes the format.

A file is an .npz archive: a zip of .npy arrays, not compressed, and of `head.json`. `numpy.load`
reads it; examples/problems has readers in C++ and Octave. The problems of a file may have
different sizes, so each array holds those of all problems, one after the other.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.archives import array_in, read_members
from hierarchy.errors import HierarchyError, file_path, naming
from hierarchy.problem import Hierarchy
from solvers.proof import Proof

FORMAT, VERSION = "hierarchical least-squares problems", 1
PUBLIC, FRESH = "public", "fresh"
_HEAD = "head.json"
_DATA = {"n": "i8", "levels": "i8", "sizes": "i8", "A": "f8", "lower": "f8", "upper": "f8",
         "reference": "f8"}
_ANSWERS = {"x": "f8", "least": "f8", "proved": "i8", "posed": "i8", "shift": "f8", "turn": "f8"}
_STAMP = (1980, 1, 1, 0, 0, 0)  # of every member, so that equal content makes equal files

Arrays = dict[str, NDArray[Any]]


class ProblemFileError(HierarchyError):
    """A file that is not one of problems, or is damaged; names the file and what is wrong."""


@final
@dataclass(frozen=True)
class Head:
    """What a file says of its problems.

    family, what : name, and one sentence.
    half : PUBLIC or FRESH.
    seed : from which they were made; 0 for the public half.
    sequence : whether they are consecutive ticks of a closed loop.
    period : [s] between two ticks; 0 without a sequence.
    source : where they come from, or what made them.
    """

    family: str
    what: str
    half: str
    seed: int
    sequence: bool = False
    period: float = 0.0
    source: str = ""


@final
@dataclass(frozen=True)
class Collection:
    """Problems of one family, with what is proved of each, or without."""

    head: Head
    problems: tuple[Hierarchy, ...]
    answers: tuple[Proof, ...] | None = None

    @property
    def digest(self) -> str:
        """SHA-256 of the problems, in hexadecimal, without answers and head."""
        return _digest(_packed(_DATA, self.problems))

    def save(self, path: str | Path) -> None:
        """Write a file; the same content makes the same bytes.

        Raises ProblemFileError, and leaves a file that is there, for what `read` would refuse.
        """
        for p, h in enumerate(self.problems):
            h.refuse_extras(f"problem {p}", f"version {VERSION} of the format")
        arrays = _packed(_DATA, self.problems)
        head = {"format": FORMAT, "version": VERSION, **asdict(self.head),
                "count": len(self.problems), "answers": self.answers is not None,
                "sha256": _digest(arrays)}
        if self.answers is not None:
            arrays |= _packed(_ANSWERS, self.answers)
        with naming(str(path), ProblemFileError, ValueError):
            _content(_head(head), arrays)
            said = json.dumps(head, indent=1, allow_nan=False)
        with zipfile.ZipFile(file_path("save", path), "w", zipfile.ZIP_STORED) as archive:
            archive.writestr(zipfile.ZipInfo(_HEAD, _STAMP), said)
            for name, values in arrays.items():
                stream = io.BytesIO()
                np.lib.format.write_array(stream, values, version=(1, 0), allow_pickle=False)
                archive.writestr(zipfile.ZipInfo(f"{name}.npy", _STAMP), stream.getvalue())


def read(path: str | Path) -> Collection:
    """Read a file of problems.

    Raises ProblemFileError: it does not exist, has another format or version, lacks an array, or
    has one of a wrong type or length; its problems are not those that were written, or not valid.
    """
    head, arrays = _opened(file_path("read", path))
    with naming(str(path), ProblemFileError, ValueError):
        problems, answers = _content(head, arrays)
    if len(problems) != head["count"]:
        raise ProblemFileError(f"{path}: {len(problems)} problems where its {_HEAD} says "
                               f"{head['count']}")
    if _digest(arrays) != head.get("sha256"):
        raise ProblemFileError(f"{path}: the problems are not those that were written: their "
                               "SHA-256 is another")
    return Collection(Head(**{key: head[key] for key in Head.__dataclass_fields__}), problems,
                      answers)


def _opened(path: Path) -> tuple[dict[str, Any], Arrays]:
    """Return head and arrays of a file of the right format."""
    if not path.exists():
        raise ProblemFileError(f"{path} does not exist")
    try:
        members = read_members(path)
        head = _head(json.loads(members[_HEAD]))
        names = {**_DATA, **(_ANSWERS if head["answers"] else {})}
        arrays = {name: array_in(name, members[f"{name}.npy"]) for name in names}
    except (ValueError, KeyError, RecursionError) as error:
        raise ProblemFileError(f"{path} is not a file of problems: {_reason(error)}") from error
    for name, kind in names.items():
        if arrays[name].ndim != 1 or arrays[name].dtype != np.dtype(f"<{kind}"):
            raise ProblemFileError(f"{path}: {name} is {arrays[name].dtype} {arrays[name].shape}; "
                                   f"expected one dimension of <{kind}")
    return head, arrays


def _head(said: Any) -> dict[str, Any]:
    """Return the head; raises ValueError unless it is of this format and version."""
    head: dict[str, Any] = said if isinstance(said, dict) else {}
    if head.get("format") != FORMAT:
        raise ValueError(f"its {_HEAD} does not say \"format\": {FORMAT!r}")
    if head.get("version") != VERSION:
        raise ValueError(f"version {head.get('version')!r} of the format; known is {VERSION}")
    kinds = {key: type(value) for key, value in asdict(Head("", "", "", 0)).items()}
    for key, kind in {**kinds, "count": int, "answers": bool}.items():
        if key not in head:
            raise ValueError(f"{key} is missing in its {_HEAD}")
        if not isinstance(head[key], (int, float) if kind is float else kind):
            raise ValueError(f"{key} is {head[key]!r} in its {_HEAD}; expected {kind.__name__}")
    return head


def _reason(error: Exception) -> str:
    if isinstance(error, json.JSONDecodeError):
        return f"its {_HEAD} is not JSON: {error}"
    if isinstance(error, RecursionError):
        return f"its {_HEAD} is nested too deep"
    return f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)


def _packed(kinds: dict[str, str], things: Sequence[Any]) -> Arrays:
    """Return what each of the problems or answers has of each name, one after the other."""
    return {name: np.concatenate([np.empty(0), *(
        np.ravel(len(one.sizes) if name == "levels" else getattr(one, name)) for one in things)]
        ).astype(f"<{kind}") for name, kind in kinds.items()}


def _content(head: dict[str, Any], arrays: Arrays
             ) -> tuple[tuple[Hierarchy, ...], tuple[Proof, ...] | None]:
    """Return problems and answers; raises ValueError as `_unpacked`."""
    problems = tuple(_unpacked(arrays))
    if not head["answers"]:
        return problems, None
    counts = {"x": [h.n for h in problems], "least": [len(h.sizes) for h in problems]}
    columns = [_parts(arrays, name, counts.get(name, [1] * len(problems))) for name in _ANSWERS]
    return problems, tuple(Proof(x, least, *(number.item() for number in numbers))
                           for x, least, *numbers in zip(*columns, strict=True))


def _unpacked(arrays: Arrays) -> Iterable[Hierarchy]:
    """Yield the problems; raises ValueError where lengths do not fit or a row is not valid."""
    n, levels = arrays["n"].tolist(), arrays["levels"].tolist()
    if len(n) != len(levels):
        raise ValueError(f"n is of {len(n)} problems and levels of {len(levels)}")
    sizes = [one.tolist() for one in _parts(arrays, "sizes", levels)]
    for p, own in enumerate(sizes):
        if n[p] < 1 or min(own, default=0) < 0:
            raise ValueError(f"problem {p}: n = {n[p]}, sizes = {own}")
    m = [sum(own) for own in sizes]
    entries = [a * b for a, b in zip(m, n, strict=True)]
    numbers = (_parts(arrays, name, counts) for name, counts in (
        ("reference", n), ("A", entries), ("lower", m), ("upper", m)))
    for p, (reference, A, lower, upper) in enumerate(zip(*numbers, strict=True)):
        try:
            yield Hierarchy(A.reshape(m[p], n[p]), lower, upper, sizes[p], reference)
        except HierarchyError as error:
            raise ValueError(f"problem {p}, {error}") from error


def _parts(arrays: Arrays, name: str, counts: Sequence[int]) -> list[NDArray[Any]]:
    """Return the numbers of each problem in an array, of which there must be as many."""
    rest, parts = arrays[name], []
    for p, count in enumerate(counts):
        if not 0 <= count <= len(rest):
            raise ValueError(f"{name} is too short: problem {p} needs {count} more numbers, there "
                             f"are {len(rest)}")
        parts.append(rest[:count].copy())
        rest = rest[count:]
    if len(rest):
        raise ValueError(f"{name} has {len(rest)} numbers more than the problems need")
    return parts


def _digest(arrays: Arrays) -> str:
    made = hashlib.sha256()
    for name in _DATA:
        made.update(arrays[name].tobytes())
    return made.hexdigest()
