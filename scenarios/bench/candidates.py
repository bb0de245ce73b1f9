"""The candidates: the resolvers, plain numpy, and DAQP's hierarchical call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from hierarchy.errors import UnknownNameError
from hierarchy.problem import Array, Hierarchy
from solvers import Resolution, Resolver, Status, make, names
from solvers.qp.backends import BACKENDS, installed

NUMPY, DAQP = "plain numpy", "DAQP by hand"
_MOVED = 0.01       # relative change of the targets between a warm start's tick and the one before
_UNBOUNDED = 1e30   # how DAQP writes a missing side

Call = Callable[[], Any]


@final
@dataclass(frozen=True)
class Candidate:
    """One to be timed.

    prepare : makes of a hierarchy, and of that of the tick before or None, the call that is timed;
        what it does itself is not.
    read : what the call returned, as a Resolution.
    """

    label: str
    inequalities: bool
    prepare: Callable[[Hierarchy, Hierarchy | None], Call]
    read: Callable[[Any], Resolution] = lambda answer: answer


def candidates(wanted: Sequence[str] | None = None) -> tuple[list[Candidate], dict[str, str]]:
    """Return the available candidates, and why others are missing, by name.

    wanted : names of resolvers, with all their variants and backends; None for all. The yardsticks
        are always there. Raises UnknownNameError.
    """
    for name in wanted or ():
        if name not in names():
            raise UnknownNameError("resolver", name, names())
    missing = {f"hqp {name}": "pip install 'task-hierarchy[qp]'"
               for name in BACKENDS if not installed(name) and (wanted is None or "hqp" in wanted)}
    field = [Candidate(NUMPY, False, lambda h, _: lambda: plain_numpy(h))]
    if installed("daqp"):
        field.append(Candidate(DAQP, True, _daqp, _read_daqp))
    else:
        missing[DAQP] = "pip install 'task-hierarchy[qp]'"
    every = [*(make(name) for name in names() if name != "hqp"), make("tpm-published"),
             *(make("hqp", backend=name) for name in BACKENDS if installed(name))]
    cold = [resolver for resolver in every if wanted is None or resolver.name in wanted]
    warm = [resolver for resolver in cold if _starts(resolver)]
    field += [Candidate(r.label, r.handles == "inequalities", _cold(r)) for r in cold]
    field += [Candidate(f"{r.label} warm", r.handles == "inequalities", _warm(r)) for r in warm]
    return field, missing


def plain_numpy(h: Hierarchy) -> Resolution:
    """Solve by the recursion (5), (6), (14) with np.linalg.pinv."""
    x, P = np.zeros(h.n), np.eye(h.n)
    for first, last in zip(h.offsets[:-1], h.offsets[1:], strict=True):
        J, b = h.A[first:last], h.lower[first:last]
        inverse = np.linalg.pinv(J @ P, rcond=1e-9)
        x = x + inverse @ (b - J @ x)
        P = P - inverse @ (J @ P)
    return Resolution(x + P @ h.reference)


def moved(h: Hierarchy, seed: int = 0) -> Hierarchy:
    """Return h with both sides of every row scaled by one factor within 1 % of 1."""
    factor = 1.0 + _MOVED * np.random.default_rng(seed).uniform(-1.0, 1.0, h.m)
    return h.changed(lower=h.lower * factor, upper=h.upper * factor)


def _starts(resolver: Resolver) -> bool:
    """Whether the resolver benefits from the memory of the previous tick."""
    if resolver.name == "hqp":
        return BACKENDS[getattr(resolver, "backend", "")].starts
    h = Hierarchy.from_levels([(np.eye(2), [1.0, 2.0])])
    return resolver.solve(h).memory is not None


def _cold(resolver: Resolver) -> Callable[[Hierarchy, Hierarchy | None], Call]:
    return lambda h, _: lambda: resolver.solve(h)


def _warm(resolver: Resolver) -> Callable[[Hierarchy, Hierarchy | None], Call]:
    def prepare(h: Hierarchy, before: Hierarchy | None) -> Call:
        memory = resolver.solve(moved(h) if before is None else before).memory
        return lambda: resolver.solve(h, memory)

    return prepare


def _daqp(h: Hierarchy, before: Hierarchy | None = None) -> Call:
    """Convert h for DAQP: leading identity rows as bounds, large numbers for missing sides."""
    import daqp

    n = h.n
    bounds = n if len(h.sizes) and h.sizes[0] == n and (h.A[:n] == np.eye(n)).all() else 0
    arguments = (np.eye(n), -h.reference, np.ascontiguousarray(h.A[bounds:]),
                 np.minimum(h.upper, _UNBOUNDED), np.maximum(h.lower, -_UNBOUNDED),
                 np.zeros(h.m, dtype=np.int32), np.cumsum(h.sizes).astype(np.int32))
    return lambda: daqp.solve(*arguments)


def _read_daqp(answer: tuple[Array, float, int, dict[str, Any]]) -> Resolution:
    x, _, flag, info = answer
    right = flag > 0 and np.isfinite(x).all()  # otherwise its x is uninitialised
    return Resolution(np.array(x) if right else np.zeros(len(x)),
                      Status.SOLVED if right else Status.BACKEND_FAILURE, int(info["iterations"]))
