"""The functions of the C library: each does what the resolver of its name does in Python.

They differ from Python in one point: a work space that is too small is reported, not made larger.
Addresses are checked as far as they can be, then become arrays. The structs are those of
`task_hierarchy.h`; every field of them has 8 bytes.
"""

from collections import namedtuple
from collections.abc import Callable
from math import inf

import numpy as np

from hierarchy.jit import as_matrix, inlined, internal
from hierarchy.jit.exporting import INTEGER, STATUS, Entry, integers_at, numbers_at
from solvers.kernels.active_set.exact import keep_staircase, solve, verify_answer
from solvers.kernels.active_set.exact import work_size as exact_size
from solvers.kernels.bounds import solve_within_bounds
from solvers.kernels.linalg.rows import all_equal
from solvers.kernels.linalg.space import fill
from solvers.kernels.merged import BY_RULE, OWN, merged, merged_size, write_levels
from solvers.kernels.merged import record_size as merged_record
from solvers.kernels.recursion import recursion
from solvers.kernels.sns import sns
from solvers.kernels.staircase import solve_by_staircase
from solvers.resolvers.hcod import Hcod
from solvers.resolvers.merged import Merged
from solvers.status import (
    CONTRADICTION,
    INACCURATE,
    ITERATION_LIMIT,
    NUMERICAL_FAILURE,
    SOLVED,
    TOO_SMALL,
)

MOST = 1 << 20  # unknowns, rows or levels: with more the sizes could overflow
SETTINGS = 6    # of a kernel
REFUSED = 11  # a row of a kind that the resolver does not handle
INVALID = 12  # sizes that do not add up, a missing pointer, a setting out of range
OTHER = -1    # a problem for which `fixed` has no code

# Fields of th_problem and th_record.
N, M, LEVELS, A, LOWER, UPPER, SIZES, REFERENCE, PROBLEM = range(9)
VALUES, SIZE, USED, WARM, ITERATIONS, ROW, RECORD = range(7)

REALS, COUNTS = 10, 6  # fields of th_settings: numbers, then integers and an address
LARGEST_TOLERANCE, MOST_ITERATIONS, METHODS, LARGEST_RATIO = 1e-3, 2**31, 4, 1e6

Given = namedtuple(
    "Given", "damping threshold rank_tolerance tolerance isotropic largest ratio cap step"
    " regularisation max_iterations optimal miss method strict_levels scales")
"""The fields of th_settings, in their order."""

DEFAULTS = Given(Hcod.damping, Hcod.threshold, Hcod.rank_tolerance, Hcod.tolerance, 0.0, inf,
                 Merged.ratio, Merged.cap, Merged.step, Merged.regularisation, Hcod.max_iterations,
                 0, 0, 0, int(BY_RULE), 0)

Call = namedtuple("Call", "A lower upper sizes reference x values state settings work")
"""The arrays of a call.

A (m, n), lower, upper (m,), sizes (L,): see `Hierarchy`. reference (n,), or empty for zero.
x (n,). values: the numbers of the record. state (6,) int64: the fields of th_record.
settings (6,): those of a kernel, not yet written. work: the rest of the work space.
"""


@internal
def can_open(problem, settings, record, x, work, size):
    """Return SOLVED if a call can be opened, else INVALID or TOO_SMALL."""
    if not _is_sound(problem) or record == 0 or x == 0 or work == 0 or not _in_range(settings):
        return INVALID
    words, state = integers_at(problem, PROBLEM), integers_at(record, RECORD)
    n, m, levels = words[N], words[M], words[LEVELS]
    if size < work_size(n, m, levels) or state[SIZE] < record_size(n, m, levels):
        return TOO_SMALL
    return SOLVED if state[VALUES] != 0 else INVALID


@inlined
def _is_sound(problem):
    """Whether the sizes of a problem add up and none of its arrays is missing."""
    if problem == 0:
        return False
    words = integers_at(problem, PROBLEM)
    n, m, levels = words[N], words[M], words[LEVELS]
    if not in_range(n, m, levels) or (levels > 0 and words[SIZES] == 0) or (
            m > 0 and (words[A] == 0 or words[LOWER] == 0 or words[UPPER] == 0)):
        return False
    sizes, rows, sane = integers_at(words[SIZES], levels), 0, True
    for k in range(levels):
        sane &= 0 <= sizes[k] <= m
        rows += sizes[k]
    return sane and rows == m


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


@internal
def reset(problem, record, x):
    """Write x = 0 and a record without content, as far as they are there."""
    if record != 0:
        state = integers_at(record, RECORD)
        state[USED], state[WARM], state[ITERATIONS], state[ROW] = 0, 0, 0, -1
    if problem != 0 and x != 0:
        n = integers_at(problem, PROBLEM)[N]
        if in_range(n, 0, 0):
            fill(numbers_at(x, n), 0.0)


@inlined
def given(settings):
    """Return the settings at an address; the defaults at 0."""
    if settings == 0:
        return DEFAULTS
    a, b = numbers_at(settings, REALS), integers_at(settings + 8 * REALS, COUNTS)
    return Given(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], b[0], b[1], b[2],
                 b[3], b[4], b[5])


@inlined
def opened(problem, record, x, work, size, n, m, levels):
    """Return the Call of addresses that were judged."""
    words, state = integers_at(problem, PROBLEM), integers_at(record, RECORD)
    room, reference = numbers_at(work, size), words[REFERENCE]
    return Call(as_matrix(numbers_at(words[A], m * n), m, n), numbers_at(words[LOWER], m),
                numbers_at(words[UPPER], m), integers_at(words[SIZES], levels),
                numbers_at(reference, n if reference != 0 else 0), numbers_at(x, n),
                numbers_at(state[VALUES], record_size(n, m, levels)), state,
                room[:SETTINGS], room[SETTINGS:])


@inlined
def begun(call, size):
    """Write x = reference, and the record of `size` numbers from which a solve starts."""
    state, warm = call.state, call.state[WARM] == 1 and call.state[USED] == size
    _copy_reference(call)
    if not warm or call.settings[0] > 0.0:
        fill(call.values[:size], 0.0)
    begin(state, size)


@inlined
def begin(state, size):
    """Write the state of a record with `size` numbers that no solve has changed."""
    state[USED], state[WARM], state[ITERATIONS], state[ROW] = size, 0, 1, -1


@inlined
def _copy_reference(call):
    for c in range(call.x.size):
        call.x[c] = call.reference[c] if call.reference.size > 0 else 0.0


@inlined
def closed(call, code):
    """Return the status of a kernel's code; x is zero unless it is an answer."""
    if code < 0:
        call.state[ROW], code = -code - 1, REFUSED
    if code not in (SOLVED, ITERATION_LIMIT, INACCURATE):
        fill(call.x, 0.0)
    return np.int32(code)


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
    block = (m + n) * (n + 1)
    recursive = 2 * m * n + 2 * n * n + 2 * m + 2 * n + 2 * block
    saturation = 2 * n * n + 13 * n + 1 + m * (2 * n + 5) + block  # the staircase needs less
    return SETTINGS + max(n + exact_size(n, m, levels, True), recursive, saturation,
                          OWN + 3 * levels + merged_size(n, m, levels, False))


def entry(solve: Callable[..., int]) -> Entry:
    """Return the function of C around a solver of a Call and its settings, which returns a code."""
    def entered(problem, settings, record, x, work, size):
        code = can_open(problem, settings, record, x, work, size)
        if code != SOLVED:
            reset(problem, record, x)
            return np.int32(code)
        words, s = integers_at(problem, PROBLEM), given(settings)
        call = opened(problem, record, x, work, size, words[N], words[M], words[LEVELS])
        write_exact(call.settings, s)
        return closed(call, solve(call, s))

    return Entry(entered, STATUS, NUMERICAL_FAILURE)


def fixed(n: int, m: int, levels: int) -> Entry:
    """Return `th_solve_hcod` for clear equalities of these sizes, without damping; else OTHER."""
    def entered(problem, settings, record, x, work, size):
        words, s = integers_at(problem, PROBLEM), given(settings)
        if (can_open(problem, settings, record, x, work, size) != SOLVED or words[N] != n
                or words[M] != m or words[LEVELS] != levels or s.damping > 0.0):
            return np.int32(OTHER)
        call = opened(problem, record, x, work, size, n, m, levels)
        write_exact(call.settings, s)
        _copy_reference(call)
        if not all_equal(call.lower, call.upper):
            return np.int32(OTHER)
        code = solve_by_staircase(call.A, call.lower, call.upper, call.sizes, call.x,
                                  call.settings, call.work)
        if code == INACCURATE:
            return np.int32(OTHER)
        begin(call.state, 3 * m + 3)
        keep_staircase(call.lower, call.upper, call.values[:3 * m + 3])
        call.state[WARM] = 1
        return closed(call, code)

    return Entry(entered, STATUS, NUMERICAL_FAILURE)


@inlined
def write_exact(settings, s):
    """Write the settings of the exact kernels, of which the first three are those of all."""
    settings[0], settings[1], settings[2] = s.damping, s.threshold, s.rank_tolerance
    settings[3], settings[4] = s.tolerance, s.max_iterations


@internal
def solve_hcod(call, s):
    """Solve like `Hcod`."""
    size = 3 * call.lower.size + 3
    begun(call, size)
    code = solve(call.A, call.lower, call.upper, call.sizes, call.x, call.values[:size],
                 call.settings, call.work)
    call.state[ITERATIONS] = np.int64(call.values[size - 3] + call.values[size - 2])
    call.state[WARM] = 1
    return code


@internal
def solve_recursive(call, s):
    """Solve like `Recursive`."""
    call.settings[3], call.settings[4], call.settings[5] = s.method, s.isotropic, s.largest
    begun(call, 0)
    return recursion(call.A, call.lower, call.upper, call.sizes, call.x, call.settings, call.work)


@internal
def solve_sns(call, s):
    """Solve like `Sns`."""
    call.settings[3], call.settings[4] = s.optimal, s.miss
    begun(call, call.x.size + call.sizes.size + 1)
    values = call.values[:call.state[USED]]
    code = sns(call.A, call.lower, call.upper, call.sizes, call.x, values, call.settings, call.work)
    call.state[ROW if code == CONTRADICTION else ITERATIONS] = np.int64(values[values.size - 1])
    return code


@internal
def solve_merged(call, s):
    """Solve like `Merged`; INVALID with damping, or a scale that is not positive."""
    (m, n), levels = call.A.shape, call.sizes.size
    own, scale = call.work[:OWN + 2 * levels], call.work[OWN + 2 * levels:OWN + 3 * levels]
    begun(call, merged_record(n, m))
    given_scale = numbers_at(s.scales, levels if s.scales != 0 else 0)
    for k in range(levels):
        scale[k] = given_scale[k] if s.scales != 0 else 1.0
        if not 0.0 < scale[k] < np.inf:
            return INVALID
    if s.damping > 0.0:
        return INVALID
    write_exact(own, s)
    own[5], own[6], own[7] = s.strict_levels, s.regularisation, s.step
    write_levels(own, s.ratio, s.cap, scale)
    record = call.values[:call.state[USED]]
    code = merged(call.A, call.lower, call.upper, call.sizes, call.x, record, own,
                  call.work[OWN + 3 * levels:])
    call.state[ITERATIONS], call.state[WARM] = np.int64(record[m]), 1
    return code


@internal
def solve_tpm(call, s):
    """Solve like `Tpm`."""
    n, size = call.x.size, call.x.size + call.sizes.size + 3 * call.lower.size + 3
    begun(call, size)
    record = call.values[:size]
    code = solve_within_bounds(call.A, call.lower, call.upper, call.sizes, call.x, record,
                               call.settings, call.work)
    steps = np.int64(record[size - 3] + record[size - 2])
    call.state[USED], call.state[ITERATIONS] = size if steps > 0 else 0, max(steps, 1)
    for c in range(n if steps > 0 else 0):
        call.state[WARM] = 1 if record[c] != 0.0 else call.state[WARM]
    return code


def violations_at(problem, x, norms):
    """Write like `Hierarchy.violations`; infinity where that is not finite."""
    if not _is_sound(problem) or x == 0 or norms == 0:
        return np.int32(INVALID)
    words, row, finite = integers_at(problem, PROBLEM), 0, True
    n, m, levels = words[N], words[M], words[LEVELS]
    rows, x = as_matrix(numbers_at(words[A], m * n), m, n), numbers_at(x, n)
    lower, upper = numbers_at(words[LOWER], m), numbers_at(words[UPPER], m)
    sizes, norms = integers_at(words[SIZES], levels), numbers_at(norms, levels)
    for k in range(levels):
        total = 0.0
        for _ in range(sizes[k]):
            value = 0.0
            for c in range(n):
                value += rows[row, c] * x[c]
            for miss in (value - upper[row], lower[row] - value):
                if not miss <= 0.0:  # NaN too
                    total += miss * miss
            if not lower[row] <= upper[row]:
                total = np.inf
            row += 1
        norms[k] = np.sqrt(total) if total < np.inf else np.inf
        finite &= norms[k] < np.inf
    return np.int32(SOLVED if finite else NUMERICAL_FAILURE)


def verify_x(problem, settings, record, x, work, size):
    """Verify like `Resolution.verified`; x and the record are only read."""
    code = can_open(problem, settings, record, x, work, size)
    if code != SOLVED:
        return np.int32(code)
    words, s = integers_at(problem, PROBLEM), given(settings)
    call = opened(problem, record, x, work, size, words[N], words[M], words[LEVELS])
    (m, n), used = call.A.shape, call.state[USED]
    write_exact(call.settings, s)
    both = call.work[:2 * n]
    for c in range(n):
        both[c] = call.x[c]
        both[n + c] = call.reference[c] if call.reference.size > 0 else 0.0
    states, first = call.work[2 * n:2 * n + m], used - 3 * m - 3
    known = first == 0 or first == n + call.sizes.size
    for i in range(m):  # without a record of `hcod` or `tpm` no inequality acts
        states[i] = call.values[first + i] if known else 0.0
    return np.int32(verify_answer(call.A, call.lower, call.upper, call.sizes, both, states,
                                  call.settings, call.work[2 * n + m:]))


def sized(size: Callable[[int, int, int], int]) -> Entry:
    """Return the function of C around a size for n, m and levels; -1 where they are no sizes."""
    def entered(n, m, levels):
        return size(n, m, levels) if in_range(n, m, levels) else -1

    return Entry(entered, INTEGER, -1)


FUNCTIONS = {"th_solve_hcod": entry(solve_hcod), "th_solve_tpm": entry(solve_tpm),
             "th_solve_recursive": entry(solve_recursive), "th_solve_sns": entry(solve_sns),
             "th_solve_merged": entry(solve_merged), "th_work_size": sized(work_size),
             "th_record_size": sized(record_size),
             "th_verify": Entry(verify_x, STATUS, NUMERICAL_FAILURE),
             "th_violations": Entry(violations_at, STATUS, NUMERICAL_FAILURE)}
