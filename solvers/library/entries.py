"""The functions of the C library: each does what the resolver of its name does in Python.

They differ from Python in two points. An answer in doubt that its multipliers do not prove is not
judged by `certify`: its status is INACCURATE. A work space that is too small is reported, not made
larger.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.jit import compiled, inlined
from hierarchy.jit.exporting import INTEGER, STATUS, Entry
from solvers.kernels.bounds import name_saturation, solve_without_bounds
from solvers.kernels.damped import damped_recursion
from solvers.kernels.guess import solve_by_guesses
from solvers.kernels.levels import solve_by_levels
from solvers.kernels.recursion import recursion
from solvers.kernels.rows import ZERO
from solvers.kernels.sns import sns
from solvers.kernels.staircase import solve_by_staircase, solve_equalities
from solvers.library.calls import (
    INVALID,
    ITERATIONS,
    ROW,
    USED,
    WARM,
    begin_again,
    begun,
    closed,
    given,
    judged,
    judged_problem,
    opened,
    violations,
)
from solvers.library.sizes import in_range, record_size, work_size
from solvers.status import (
    CONTRADICTION,
    EQUAL,
    NO_LIMITS,
    NUMERICAL_FAILURE,
    SOLVED,
    TOO_SMALL,
    UNPROVED,
)


def solve_hcod(problem, settings, record, x, work, size):
    """Solve like `Hcod`."""
    code = judged(problem, settings, record, x, work, size)
    if code != SOLVED:
        return np.int32(code)
    call = opened(problem, record, x, work, size)
    _write_exact(call.settings, given(settings))
    return closed(call, _hcod(call))


def solve_tpm(problem, settings, record, x, work, size):
    """Solve like `Tpm` in its staircase form."""
    code = judged(problem, settings, record, x, work, size)
    if code != SOLVED:
        return np.int32(code)
    call = opened(problem, record, x, work, size)
    _write_exact(call.settings, given(settings))
    return closed(call, _tpm(call))


def solve_recursive(problem, settings, record, x, work, size):
    """Solve like `Recursive`."""
    code = judged(problem, settings, record, x, work, size)
    if code != SOLVED:
        return np.int32(code)
    call, s = opened(problem, record, x, work, size), given(settings)
    _write_shared(call.settings, s)
    call.settings[3], call.settings[4], call.settings[5] = s.method, s.isotropic, s.largest
    begun(call, ZERO)
    if s.method == 0:
        code = recursion(call.A, call.lower, call.upper, call.sizes, call.x, call.settings,
                         call.work)
    else:
        code = damped_recursion(call.A, call.lower, call.upper, call.sizes, call.x, call.settings,
                                call.work)
    return closed(call, code)


def solve_sns(problem, settings, record, x, work, size):
    """Solve like `Sns`."""
    code = judged(problem, settings, record, x, work, size)
    if code != SOLVED:
        return np.int32(code)
    call, s = opened(problem, record, x, work, size), given(settings)
    _write_shared(call.settings, s)
    call.settings[3], call.settings[4] = s.optimal, s.miss
    begun(call, call.x.size + call.sizes.size + 1)
    values = call.values[:call.state[USED]]
    code = sns(call.A, call.lower, call.upper, call.sizes, call.x, values, call.settings, call.work)
    last = np.int64(values[values.size - 1])
    if code == CONTRADICTION:
        call.state[ROW] = last
    else:
        call.state[ITERATIONS] = last
    return closed(call, code)


def violations_at(problem, x, norms):
    """Write like `Hierarchy.violations`; infinity where that is not finite."""
    code = judged_problem(problem)
    if code == SOLVED and (x == 0 or norms == 0):
        code = INVALID
    if code == SOLVED and not violations(problem, x, norms):
        code = NUMERICAL_FAILURE
    return np.int32(code)


def size_of_work(n, m, levels):
    """Return the numbers that a work space needs, -1 for sizes out of range."""
    return work_size(n, m, levels) if in_range(n, m, levels) else -1


def size_of_record(n, m, levels):
    """Return the numbers that a record needs, -1 for sizes out of range."""
    return record_size(n, m, levels) if in_range(n, m, levels) else -1


@inlined
def _write_shared(settings, s):
    settings[0], settings[1], settings[2] = s.damping, s.threshold, s.rank_tolerance


@inlined
def _write_exact(settings, s):
    _write_shared(settings, s)
    settings[3], settings[4], settings[5] = s.tolerance, s.guesses, s.max_iterations


@inlined
def _hcod(call):
    """Solve like `Hcod.solve`."""
    size = 3 * call.lower.size + 3
    warm, code = begun(call, size), ZERO + UNPROVED
    record = call.values[:size]
    if call.settings[0] > 0.0:
        code = solve_without_bounds(call.A, call.lower, call.upper, call.sizes, call.x, record,
                                    call.settings, call.work)
    if code == SOLVED:
        _write_unbounded(call, record)
    else:
        begin_again(call)
        code = exactly(call, record, warm)
    call.state[ITERATIONS] = np.int64(record[size - 3] + record[size - 2])
    call.state[WARM] = 1
    return code


@inlined
def _write_unbounded(call, record):
    """Write the record of an answer that no bound holds back."""
    m = call.lower.size
    for i in range(m):
        record[i] = EQUAL if call.lower[i] == call.upper[i] else 0.0
        record[m + i], record[2 * m + i] = -1.0, 0.0
    record[3 * m], record[3 * m + 1], record[3 * m + 2] = 1.0, 0.0, -1.0


@compiled
def exactly(call, record, warm):
    """Call the kernels in turn until one finds an answer, like `solve_exactly` of `hcod`."""
    code = ZERO + NO_LIMITS
    while code == NO_LIMITS:
        code = ZERO + UNPROVED
        if not warm or record[0] == EQUAL:
            code = solve_equalities(call.A, call.lower, call.upper, call.sizes, call.x, record,
                                    call.settings, call.work)
        if code == UNPROVED and warm:
            code = solve_by_guesses(call.A, call.lower, call.upper, call.sizes, call.x, record,
                                    call.settings, call.work)
        if code == UNPROVED:
            code = solve_by_levels(call.A, call.lower, call.upper, call.sizes, call.x, record,
                                   call.settings, call.work)
        warm = False
    return code


@inlined
def _tpm(call):
    """Solve like `Tpm.solve`: warm from the active bounds, cold if none is active any more."""
    size = call.x.size + call.sizes.size + 3 * call.lower.size + 3
    warm = begun(call, size)
    if warm:
        code = _within_bounds(call, call.values[:size], True)
        if code == NUMERICAL_FAILURE or call.state[WARM] == 1:
            return code
        begun(call, size)
    code = solve_by_staircase(call.A, call.lower, call.upper, call.sizes, call.x, call.settings,
                              call.work)
    if code < 0:
        begin_again(call)
        return _within_bounds(call, call.values[:size], False)
    call.state[USED] = 0
    return code


@compiled
def _within_bounds(call, record, warm):
    """Solve with bounds in the first level, like `Tpm`; the state is warm if one is active."""
    inner, code = record[call.x.size + call.sizes.size:], ZERO + UNPROVED
    if not warm:
        code = solve_without_bounds(call.A, call.lower, call.upper, call.sizes, call.x, record,
                                    call.settings, call.work)
    if code == UNPROVED:
        code = exactly(call, inner, warm)
    if code < 0 or code in (NUMERICAL_FAILURE, TOO_SMALL):
        return code
    call.state[ITERATIONS] = np.int64(inner[inner.size - 3] + inner[inner.size - 2])
    named = name_saturation(call.A, call.lower, call.upper, call.sizes, call.x, record, call.work)
    call.state[WARM] = 1 if named == SOLVED else 0
    return code


RESOLVERS = {
    "hcod": Entry(solve_hcod, 6, STATUS, NUMERICAL_FAILURE),
    "tpm": Entry(solve_tpm, 6, STATUS, NUMERICAL_FAILURE),
    "recursive": Entry(solve_recursive, 6, STATUS, NUMERICAL_FAILURE),
    "sns": Entry(solve_sns, 6, STATUS, NUMERICAL_FAILURE),
}
ALWAYS = {"th_work_size": Entry(size_of_work, 3, INTEGER, -1),
          "th_record_size": Entry(size_of_record, 3, INTEGER, -1),
          "th_violations": Entry(violations_at, 3, STATUS, NUMERICAL_FAILURE)}
