"""A call from C: addresses are checked as far as they can be, then become arrays.

The structs are those of `task_hierarchy.h`; every field of them has 8 bytes.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from hierarchy.jit import as_matrix, compiled, inlined
from hierarchy.jit.exporting import integers_at, numbers_at
from solvers.kernels.exact import work_size as exact_size
from solvers.kernels.merged import BY_RULE, OWN, merged_size
from solvers.kernels.merged import record_size as merged_record
from solvers.kernels.rows import ZERO
from solvers.kernels.space import View
from solvers.resolvers.hcod import Hcod
from solvers.resolvers.merged import Merged
from solvers.status import INACCURATE, ITERATION_LIMIT, SOLVED, TOO_SMALL

MOST = 1 << 20  # unknowns, rows or levels: with more the sizes could overflow
SETTINGS = 6    # of a kernel
REFUSED = 11  # a row of a kind that the resolver does not handle
INVALID = 12  # sizes that do not add up, a missing pointer, a setting out of range

# Fields of th_problem and th_record.
N, M, LEVELS, A, LOWER, UPPER, SIZES, REFERENCE, PROBLEM = range(9)
VALUES, SIZE, USED, WARM, ITERATIONS, ROW, RECORD = range(7)

REALS, COUNTS = 10, 6  # fields of th_settings: numbers, then integers and an address
DAMPING, THRESHOLD, RANK_TOLERANCE = Hcod.damping, Hcod.threshold, Hcod.rank_tolerance
TOLERANCE, MAX_ITERATIONS = Hcod.tolerance, Hcod.max_iterations
LARGEST_TOLERANCE, MOST_ITERATIONS, METHODS, LARGEST_RATIO = 1e-3, 2**31, 4, 1e6


class Given(NamedTuple):
    """The fields of th_settings, in their order."""

    damping: View
    threshold: View
    rank_tolerance: View
    tolerance: View
    isotropic: View
    largest: View
    ratio: View
    cap: View
    step: View
    regularisation: View
    max_iterations: View
    optimal: View
    miss: View
    method: View
    strict_levels: View
    scales: View


DEFAULTS = Given(DAMPING, THRESHOLD, RANK_TOLERANCE, TOLERANCE, 0.0, inf, Merged.ratio, Merged.cap,
                 Merged.step, Merged.regularisation, MAX_ITERATIONS, 0, 0, 0, int(BY_RULE), 0)


class Call(NamedTuple):
    """The arrays of a call.

    A (m, n), lower, upper (m,), sizes (L,): see `Hierarchy`. reference (n,), or empty for zero.
    x (n,). values: the numbers of the record. state (6,) int64: the fields of th_record.
    settings (6,): those of a kernel, not yet written. work: the rest of the work space.
    """

    A: View
    lower: View
    upper: View
    sizes: View
    reference: View
    x: View
    values: View
    state: View
    settings: View
    work: View


@compiled
def can_open(problem, settings, record, x, work, size):
    """Return SOLVED if a call can be opened, else INVALID or TOO_SMALL."""
    code = judged_problem(problem)
    if code == SOLVED and (record == 0 or x == 0 or work == 0 or not _in_range(settings)):
        code = INVALID
    if code == SOLVED:
        words, state = integers_at(problem, PROBLEM), integers_at(record, RECORD)
        n, m, levels = words[N], words[M], words[LEVELS]
        if size < work_size(n, m, levels) or state[SIZE] < record_size(n, m, levels):
            code = TOO_SMALL
        elif state[VALUES] == 0:
            code = INVALID
    return ZERO + code


@inlined
def judged_problem(problem):
    """Return SOLVED, or INVALID for sizes that do not add up or a missing array."""
    if problem == 0:
        return INVALID
    words = integers_at(problem, PROBLEM)
    n, m, levels = words[N], words[M], words[LEVELS]
    if not in_range(n, m, levels) or (levels > 0 and words[SIZES] == 0):
        return INVALID
    if m > 0 and (words[A] == 0 or words[LOWER] == 0 or words[UPPER] == 0):
        return INVALID
    sizes, rows, sane = integers_at(words[SIZES], levels), ZERO, True
    for k in range(levels):
        sane &= 0 <= sizes[k] <= m
        rows += sizes[k]
    return SOLVED if sane and rows == m else INVALID


@inlined
def _in_range(settings):
    """Whether all settings are in the range of those in Python."""
    s = given(settings)
    return (0.0 <= s.damping < np.inf and 0.0 < s.threshold < np.inf
            and 0.0 <= s.rank_tolerance < 1.0 and 0.0 < s.tolerance < LARGEST_TOLERANCE
            and 0.0 <= s.isotropic < np.inf and s.largest > 0.0
            and 1 <= s.max_iterations < MOST_ITERATIONS
            and 0 <= s.optimal <= 1 and 0 <= s.miss <= 1 and 0 <= s.method < METHODS
            and 1.0 <= s.ratio < LARGEST_RATIO and 0.0 <= s.cap < np.inf and 0.0 < s.step <= 1.0
            and 0.0 <= s.regularisation < np.inf and -1 <= s.strict_levels < MOST_ITERATIONS)


@compiled
def reset(problem, record, x):
    """Write x = 0 and a record without content, as far as they are there."""
    if record != 0:
        state = integers_at(record, RECORD)
        state[USED], state[WARM], state[ITERATIONS], state[ROW] = 0, 0, 0, -1
    if problem != 0 and x != 0:
        n = integers_at(problem, PROBLEM)[N]
        if in_range(n, 0, 0):
            answer = numbers_at(x, n)
            for c in range(n):
                answer[c] = 0.0


@inlined
def given(settings):
    """Return the settings at an address; the defaults at 0."""
    if settings == 0:
        return DEFAULTS
    a, b = numbers_at(settings, REALS), integers_at(settings + 8 * REALS, COUNTS)
    return Given(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], b[0], b[1], b[2],
                 b[3], b[4], b[5])


@inlined
def opened(problem, record, x, work, size):
    """Return the Call of addresses that were judged."""
    words, state = integers_at(problem, PROBLEM), integers_at(record, RECORD)
    room, reference = numbers_at(work, size), words[REFERENCE]
    n, m, levels = words[N], words[M], words[LEVELS]
    return Call(as_matrix(numbers_at(words[A], m * n), m, n), numbers_at(words[LOWER], m),
                numbers_at(words[UPPER], m), integers_at(words[SIZES], levels),
                numbers_at(reference, n if reference != 0 else ZERO), numbers_at(x, n),
                numbers_at(state[VALUES], record_size(n, m, levels)), state,
                room[:SETTINGS], room[SETTINGS:])


@inlined
def begun(call, size):
    """Write x = reference and the record that a cold or warm solve of `size` numbers starts from.

    Returns whether the record continues an earlier solve.
    """
    state, warm = call.state, call.state[WARM] == 1 and call.state[USED] == size
    for c in range(call.x.size):
        call.x[c] = call.reference[c] if call.reference.size > 0 else 0.0
    if not warm or call.settings[0] > 0.0:
        warm = False
        for i in range(size):
            call.values[i] = 0.0
    state[USED], state[WARM], state[ITERATIONS], state[ROW] = size, 0, 1, -1
    return warm


@inlined
def closed(call, code):
    """Return the status of a kernel's code; x is zero unless it is an answer."""
    if code < 0:
        call.state[ROW], code = -code - 1, REFUSED
    answered = code in (SOLVED, ITERATION_LIMIT, INACCURATE)
    if not answered:
        for c in range(call.x.size):
            call.x[c] = 0.0
    return np.int32(code)


@compiled
def violations(problem, x, norms):
    """Write the Euclidean norm of each level's violation at x; return whether all are finite."""
    words, row, finite = integers_at(problem, PROBLEM), ZERO, True
    n, m, levels = words[N], words[M], words[LEVELS]
    rows, x = as_matrix(numbers_at(words[A], m * n), m, n), numbers_at(x, n)
    lower, upper = numbers_at(words[LOWER], m), numbers_at(words[UPPER], m)
    sizes, norms = integers_at(words[SIZES], levels), numbers_at(norms, levels)
    for k in range(levels):
        total = 0.0
        for _ in range(sizes[k]):
            total += squared_violation(rows[row], lower[row], upper[row], x)
            row += 1
        norms[k] = np.sqrt(total) if total < np.inf else np.inf
        finite &= norms[k] < np.inf
    return finite


@inlined
def squared_violation(a, lower, upper, x):
    """Return the square of the violation of lower <= a x <= upper; NaN or inf for spoilt data."""
    value = 0.0
    for c in range(x.size):
        value += a[c] * x[c]
    over, under, squared = value - upper, lower - value, 0.0
    if not over <= 0.0:  # NaN too
        squared = over * over
    if not under <= 0.0:
        squared += under * under
    return squared if lower <= upper else np.inf


@inlined
def in_range(n, m, levels):
    """Whether these numbers of unknowns, rows and levels are in range."""
    return 1 <= n <= MOST and 0 <= m <= MOST and 0 <= levels <= MOST


@inlined
def record_size(n, m, levels):
    """Return the size of the largest record, which is that of `tpm` or of `merged`."""
    return max(n + levels + 3 * m + 3, merged_record(n, m))


@inlined
def work_size(n, m, levels):
    """Return the size of a work space that is enough for every resolver.

    What a kernel carves out of it is written in its own file, and a kernel for which it is too
    small says so. Here are the same sizes as formulas, which tests hold against the kernels.
    """
    return SETTINGS + max(exact_size(n, m, levels, True), recursive(n, m), saturation(n, m),
                          OWN + 3 * levels + merged_size(n, m, levels, False))


@inlined
def recursive(n, m):
    """Return what the kernel of `recursive` needs."""
    return 2 * m * n + 2 * n * n + 2 * m + 2 * n + 2 * block(n, m)


@inlined
def saturation(n, m):
    """Return what the kernel of `sns` needs; the staircase, also below bounds, needs less."""
    return 3 * n * n + 13 * n + m * (2 * n + 5) + block(n, m)


@inlined
def block(n, m):
    """Return what the least squares of one level need."""
    return (m + n) * (n + 1)
