"""Many hierarchies of one shape, resolved in one call over all cores; on accelerators: `on_jax`.

    answer = solve(Batch(A, lower, upper, sizes), make("tpm"))

For learning, sampling and parameter sweeps. Each answer is that of `resolver.solve`, to the last
bit; a batch saves the overhead around each solve and uses all cores.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, expect, whole
from hierarchy.gate import checked_sizes, readable, shaped
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.kernels.batch import EXACT, MERGED, WITHIN_BOUNDS, solve_batch
from solvers.kernels.merged import record_size
from solvers.resolver import Resolver, make, refuse_inequality
from solvers.resolvers.hcod import Hcod
from solvers.resolvers.merged import Merged, refuse_safety_alone
from solvers.resolvers.tpm import Tpm
from solvers.status import Status
from solvers.workspace import run

__all__ = ["Batch", "BatchResolution", "cores", "solve"]

Indices = NDArray[np.int64]
ENOUGH = 2**15  # entries of A (at least 0.5 ms of work) that justify a thread
PARTS = 4       # per thread, since some problems take longer than others


@final
@dataclass(frozen=True, eq=False)
class Batch:
    """B hierarchies of L levels, m rows and n unknowns, as stacked arrays.

    Contiguous float64 arrays are used as they are, others are copied. Values are not checked here:
    a problem with numbers that are not finite, or lower > upper, gets Status.NUMERICAL_FAILURE.

    A : (B, m, n) the rows of all levels, top level first.
    lower, upper : (B, m) their sides; an equality has lower == upper, a missing side is infinite.
    sizes : (L,) rows of each level, the same for all problems.
    reference : (B, n) as in `Hierarchy`; None for zero.

    Raises HierarchyError, naming the array, for a wrong shape or entries that are not numbers.
    """

    A: Array
    lower: Array
    upper: Array
    sizes: Indices
    reference: Array = None  # type: ignore[assignment]  # zeros of the shape of A

    def __post_init__(self) -> None:
        A = readable("A", self.A)
        if A.ndim != 3 or A.shape[2] == 0:
            raise HierarchyError(f"A has shape {A.shape}, expected (problems, rows, unknowns)")
        sides = A.shape[:2]
        reference = (np.zeros(A.shape[::2]) if self.reference is None
                     else shaped("reference", self.reference, A.shape[::2]))
        set_frozen(self, A=A, lower=shaped("lower", self.lower, sides),
                   upper=shaped("upper", self.upper, sides),
                   sizes=checked_sizes(self.sizes, A.shape[1]), reference=reference)

    @classmethod
    def of(cls, hierarchies: Iterable[Hierarchy]) -> Batch:
        """Stack hierarchies of one shape.

        Raises HierarchyError: no hierarchies, one with other sizes or unknowns than the first, or
        one with a metric or levels that give.
        """
        expect("Batch.of: hierarchies", hierarchies, Iterable, "give a list of them")
        hierarchies = list(hierarchies)
        if not hierarchies:
            raise HierarchyError("a batch of no hierarchies has no shape; pass arrays instead")
        first = hierarchies[0]
        for p, h in enumerate(hierarchies):
            expect(f"problem {p}", h, Hierarchy, "make one with Hierarchy.from_levels")
            if h.n != first.n or h.sizes.tolist() != first.sizes.tolist():
                raise HierarchyError(f"problem {p} is {h}, where problem 0 is {first}")
            h.refuse_extras(f"problem {p}", "a batch")
        stacked = (np.stack([getattr(h, name) for h in hierarchies])
                   for name in ("A", "lower", "upper", "reference"))
        A, lower, upper, reference = stacked
        return cls(A, lower, upper, first.sizes, reference)

    def __len__(self) -> int:
        return len(self.A)

    def __getitem__(self, p: int) -> Hierarchy:
        """Return problem p as a `Hierarchy`, a view of these arrays."""
        names = tuple(f"problem {p}, level {k + 1}" for k in range(len(self.sizes)))
        return Hierarchy.trusted(self.A[p], self.lower[p], self.upper[p], self.sizes,
                                 self.reference[p], names)


@final
@dataclass(frozen=True, eq=False)
class BatchResolution:
    """The result of a batch.

    x : (B, n) the answers, always finite.
    status : (B,) int, values of `Status`.
    iterations : (B,) int, as in `Resolution`.
    memory : (B, ...) warm start for the next solve of the same shape, zeros for a problem without
        one; None if no problem has one.
    """

    x: Array
    status: Indices
    iterations: Indices
    memory: Array | None

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Which problems are solved: (B,)."""
        solved: NDArray[np.bool_] = self.status == Status.SOLVED
        return solved


def solve(batch: Batch, resolver: Resolver | None = None, threads: int | None = None,
          memory: Array | None = None) -> BatchResolution:
    """Resolve all problems of a batch with `tpm` (the default), `hcod` or `merged`.

    Scales of `merged` name levels "level 1" and so on.

    threads : most threads to use; None for the number of available cores.
    memory : (B, ...) of an earlier resolution by this resolver, or None; ignored if its shape does
        not match.

    Raises HierarchyError: another resolver; threads below 1; a row that the resolver cannot handle
    (names problem, level and row).
    """
    expect("solve: batch", batch, Batch, "make one with Batch.of([h, ...])")
    resolver = make("tpm") if resolver is None else resolver
    expect("solve: resolver", resolver, Resolver, "give make('tpm') or make('hcod')")
    if not isinstance(resolver, Merged) and not (
            isinstance(resolver, (Tpm, Hcod)) and resolver.strict):
        raise HierarchyError(f"{resolver.label} resolves no batches; tpm, hcod and merged do")
    threads = cores() if threads is None else whole("threads", threads, 1)
    batch = replace(batch)  # numpy lets its holder change the shape of an array: through the gate
    _, m, n = batch.A.shape
    way, settings, size, warm = _way(resolver, m, n, len(batch.sizes))
    x, codes = batch.reference.copy(), np.zeros(len(batch), dtype=np.int64)
    record = np.zeros((len(batch), size))
    before = None if memory is None else readable("memory", memory)
    if before is not None and before.shape == record.shape and warm:
        record[:] = before
    problems = batch.A, batch.lower, batch.upper, batch.sizes
    _in_parallel(partial(run, solve_batch, way, problems, x, codes, record, settings), batch,
                 threads)
    for p in np.flatnonzero(codes < 0)[:1]:
        if isinstance(resolver, Merged):
            refuse_safety_alone(resolver, batch[int(p)])
        refuse_inequality(resolver, batch[int(p)], -int(codes[p]) - 1)
    steps = record[:, m] if way == MERGED else record[:, -3] + record[:, -2]
    if way == WITHIN_BOUNDS:  # only an unknown at a bound is worth a memory
        saturated = (record[:, :n] != 0.0).any(axis=1)
        record[~saturated], steps = 0.0, np.maximum(steps, 1.0)
    kept = record if way != WITHIN_BOUNDS or record.any() else None
    return BatchResolution(x, codes, steps.astype(np.int64), kept)


def _way(resolver: Tpm | Hcod | Merged, m: int, n: int, levels: int
         ) -> tuple[int, Array, int, bool]:
    """Return the way and settings of a resolver, the size of a memory, and whether it is read."""
    if isinstance(resolver, Merged):
        names = tuple(f"level {k + 1}" for k in range(levels))
        return MERGED, resolver._settings_for(names), record_size(n, m), True
    size, warm = 3 * m + 3, resolver.damping == 0.0
    if isinstance(resolver, Tpm):
        return WITHIN_BOUNDS, resolver._settings, n + levels + size, warm
    return EXACT, resolver._settings, size, warm


def _in_parallel(call: Callable[[Indices], int], batch: Batch, threads: int) -> None:
    """Run a call over all problems, in parts on several threads if there are many."""
    which, threads = np.arange(len(batch)), min(threads, batch.A.size // ENOUGH)
    if threads < 2:
        call(which)
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(call, np.array_split(which, PARTS * threads)))


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
