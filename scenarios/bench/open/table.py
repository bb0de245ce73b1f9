"""The table of entrants: one row each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

from hierarchy.errors import HierarchyError, UnknownNameError
from scenarios.bench.peers.entrants import DAQP, EMBODIK, Package
from solvers import names
from solvers.qp.backends import BACKENDS

_HERE = "scenarios.bench.open.entrants"


@final
@dataclass(frozen=True)
class Row:
    """An entrant, where it comes from, and what is known of its limits.

    Attributes
    ----------
    label : what tables call it.
    package : what pip is asked for, into an environment of its own; see `Package`.
    adapter : MODULE:CLASS of an `Entrant`, or FILE.py:CLASS.
    limits : one sentence, printed beside its numbers.
    options : arguments of the class.
    python : interpreter to run it with, in place of the package's environment.
    """

    label: str
    package: Package
    adapter: str
    limits: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    python: str = ""


OWN = Package("task-hierarchy", "hierarchy")
PACKAGES = (EMBODIK,)
"""Those that need an environment of their own."""

_BACKENDS = ("quadprog", "daqp", "proxqp", "osqp", "piqp", "clarabel")
_LIMITS = {
    "augmented": "Not strict: levels share one damped system.",
    "weighted": "Weights in place of levels, to a finite ratio.",
    "tpm-published": "Equalities; not strict where upper levels lose rank.",
    "recursive": "Equalities only.", "tpm": "Bounds of single unknowns in the first level only.",
    "reverse": "Equalities; strict in the first level only.",
    "sns": "Bounds of single unknowns in the first level only; scales what they do not allow."}
_QP = "Levels above are kept to the backend's tolerance."
_EMBODIK = ("Scales a task that limits do not allow, and damps near singularities; the first level "
            "holds as hard limits, the others are equalities.")
_CASCADE = "Programs written by hand, in floating point"


def _ours() -> list[Row]:
    ours = f"{_HERE}.ours:Ours"
    rows = [Row(name, OWN, ours, _LIMITS.get(name, ""), {"resolver": name})
            for name in (*names(), "tpm-published") if name != "hqp"]
    return rows + [Row(f"hqp {name}", OWN, ours, _QP, {"resolver": "hqp", "backend": name})
                   for name in BACKENDS]


def _cascades() -> list[Row]:
    cascade = f"{_HERE}.cascade:Cascade"
    exact = [Row(f"cascade {name}", OWN, cascade, f"{_CASCADE}; rows above are kept exactly.",
                 {"backend": name}) for name in _BACKENDS]
    return exact + [Row(f"cascade {name}, slack", OWN, cascade,
                        f"{_CASCADE}; rows above may move by 1e-7.",
                        {"backend": name, "slack": 1e-7}) for name in _BACKENDS[:2]]


ENTRANTS = (
    *_ours(),
    Row("DAQP hierarchical", DAQP, f"{_HERE}.with_daqp:Daqp",
        "Minimises violations divided by the norms of rows, with a finite weight; rows of zeros "
        "are infeasible to it."),
    *_cascades(),
    Row("embodiK", EMBODIK, f"{_HERE}.with_embodik:Embodik", _EMBODIK),
    Row("embodiK refined", EMBODIK, f"{_HERE}.with_embodik:Embodik", _EMBODIK, {"refine": True}),
)
"""The entrants, in the order of tables."""


def chosen(labels: Sequence[str], python: str = "", more: Sequence[Row] = ()) -> list[Row]:
    """Return the rows of these labels; FILE.py:CLASS makes a row of the user's own.

    labels : all of the table, and of `more`, if empty.
    python : interpreter of the user's own entrants.

    Raises
    ------
    UnknownNameError : a label that is not in the table.
    HierarchyError : a file that does not exist.
    """
    known = {row.label: row for row in (*ENTRANTS, *more)}
    found = []
    for label in labels or known:
        file, _, kind = label.rpartition(":")
        if file.endswith(".py"):
            if not Path(file).is_file():
                raise HierarchyError(f"entrant {label!r}: {file} does not exist")
            found.append(Row(kind, OWN, f"{Path(file).resolve()}:{kind}", "Not of the table.",
                             python=python))
        elif label not in known:
            raise UnknownNameError("entrant", label, list(known))
        else:
            found.append(known[label])
    return found
