"""The table of solvers: one row each."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from benchmark.packages import DAQP, EMBODIK, HIGHS, OWN, Entrant
from hierarchy.errors import UnknownNameError, refuse
from scenarios.files import slug
from solvers import names
from solvers.qp.backends import BACKENDS

_HERE, _OURS = "benchmark.solve", "benchmark.solve.ours:Ours"
NUMPY, HIERARCHICAL = "plain numpy", "DAQP hierarchical"
_SLACK = 1e-7
_LIMITS = {
    "augmented": "Not strict: levels share one damped system.",
    "weighted": "Weights in place of levels, to a finite ratio.",
    "merged": "Strict only in levels of limits; the rest is one weighted level.",
    "tpm-published": "Equalities; not strict where upper levels lose rank.",
    "recursive": "Equalities only.", "tpm": "Bounds of single unknowns in the first level only.",
    "reverse": "Equalities; strict in the first level only.",
    "sns": "Bounds of single unknowns in the first level only; scales what they do not allow."}
_QP = "Levels above are kept to the backend's tolerance"
_TIGHTER = 100.0  # times the tolerances of hqp
_EMBODIK = ("Scales a task that limits do not allow, and damps near singularities; the first level "
            "holds as hard limits, the others are equalities.")
_CASCADE = "By hand, in floating point; rows above"
ABSENT = {
    "soth, LexLS": "no package on PyPI; with --library FILE.so --name NAME",
    "eiquadprog": "its wheel has a C++ library and no module of Python; with --library",
    "OpenSoT": "its headers need ROS",
    "pink, mink, placo, tsid, OInK, frax": "they own the robot's model, and are compared on whole "
    "ticks: hierarchy bench peers"}
"""Solvers that no command here can ask, and why."""


def _settings(backend: str) -> dict[str, dict[str, float]]:
    """Return the options of a backend in words: its defaults, those of `hqp`, and tighter ones."""
    own = dict(BACKENDS[backend].options)
    return {"defaults": {}} | ({"as hqp": own, "tight": {
        key: value / _TIGHTER if isinstance(value, float) else value
        for key, value in own.items()}} if own else {})


def _labelled(name: str, words: str) -> str:
    return name if words == "defaults" else f"{name}, {words}"


_TUNED = [(name, words, options) for name in BACKENDS for words, options in _settings(name).items()]
ENTRANTS = (
    *(Entrant(name, OWN, _OURS, {"resolver": name}, _LIMITS.get(name, ""))
      for name in (*names(), "tpm-published") if name != "hqp"),
    *(Entrant(f"hqp {name}", OWN, _OURS, {"resolver": "hqp", "backend": name},
              f"{_QP}, set by hqp.") for name in BACKENDS),
    *(Entrant(f"hqp {name}, {words}", OWN, f"{_HERE}.ours:Hqp", {"backend": name, **options},
              f"{_QP}: {words}.")
      for name, words, options in _TUNED if words != "as hqp" and BACKENDS[name].options),
    Entrant(NUMPY, OWN, f"{_HERE}.ours:Plain", limits="Equalities only, by np.linalg.pinv."),
    *(DAQP.peer("Daqp", _labelled(HIERARCHICAL, words),
                "Minimises violations divided by the norms of rows, with a finite weight; rows of "
                f"zeros are infeasible to it; tolerances: {words}.", **options)
      for words, options in _settings("daqp").items()),
    *(Entrant(_labelled(f"cascade {name}", words), package, f"{_HERE}.cascade:Cascade",
              {"backend": name, **options},
              f"{_CASCADE} are kept exactly; tolerances: {words}.")
      for package, name, words, options in (*((OWN, *one) for one in _TUNED),
                                            (HIGHS, "highs", "defaults", {}))),
    *(Entrant(f"cascade {name}, slack", OWN, f"{_HERE}.cascade:Cascade",
              {"backend": name, "slack": _SLACK}, f"{_CASCADE} may move by {_SLACK:g}.")
      for name in ("quadprog", "daqp")),
    EMBODIK.peer("Embodik", "embodiK", _EMBODIK),
    EMBODIK.peer("Embodik", "embodiK refined", _EMBODIK, refine=True),
)
"""The solvers, in the order of tables."""


def chosen(labels: Sequence[str], python: str = "", more: Sequence[Entrant] = ()) -> list[Entrant]:
    """Return the entrants of these labels; FILE.py:CLASS makes one of the user's own.

    labels : all of the table, and of `more`, if empty.
    python : interpreter of the user's own entrants.

    Raises
    ------
    UnknownNameError : a label that is not in the table.
    HierarchyError : a file that does not exist, a name that another entrant has, or an interpreter
        for nobody.
    """
    known = {one.label: one for one in (*ENTRANTS, *more)}
    found, own = [], []
    for label in dict.fromkeys(labels or known):
        file, _, kind = label.rpartition(":")
        if file.endswith(".py"):
            refuse(not Path(file).is_file(), f"entrant {label!r}: {file} does not exist")
            own.append(Entrant(kind, OWN, f"{Path(file).resolve()}:{kind}", {},
                               "Not of the table.", python))
            found.append(own[-1])
        elif label not in known:
            raise UnknownNameError("entrant", label, list(known))
        else:
            found.append(known[label])
    refuse(python and not own, f"--python {python} is for entrants FILE.py:CLASS; none is asked")
    names = Counter(slug(one.label) for one in (*ENTRANTS, *more, *own))  # of files of rows
    twice = [name for name, count in names.items() if count > 1]
    refuse(twice, f"two entrants are named {', '.join(twice)}; give each a name of its own")
    return found + [one for one in more if labels and one not in found]


def compiled(libraries: Sequence[Path], labels: Sequence[str]) -> list[Entrant]:
    """Return an entrant for each library that has the functions of solver.h; see HierarchyError."""
    refuse(len(libraries) != len(labels), f"{len(libraries)} libraries and {len(labels)} names; "
           "each --library needs a --name")
    for file in libraries:
        refuse(not file.is_file(), f"--library: {file} does not exist")
    return [Entrant(label, OWN, f"{_HERE}.compiled:Compiled",
                    {"library": str(file.resolve()), "name": label}, f"From {file.name}.")
            for file, label in zip(libraries, labels, strict=True)]
