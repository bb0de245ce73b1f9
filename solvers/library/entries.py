"""The functions of the C library: each does what the resolver of its name does in Python.

They differ from Python in one point: a work space that is too small is reported, not made larger.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hierarchy.jit import compiled, inlined
from hierarchy.jit.exporting import INTEGER, STATUS, Entry, numbers_at
from solvers.kernels.bounds import solve_within_bounds
from solvers.kernels.exact import solve, verify_answer
from solvers.kernels.merged import OWN, merged, write_levels
from solvers.kernels.merged import record_size as merged_record
from solvers.kernels.recursion import recursion
from solvers.kernels.rows import ZERO
from solvers.kernels.sns import sns
from solvers.library.calls import (
    INVALID,
    ITERATIONS,
    ROW,
    USED,
    WARM,
    begun,
    can_open,
    closed,
    given,
    in_range,
    judged_problem,
    opened,
    record_size,
    reset,
    violations,
    work_size,
)
from solvers.status import (
    CONTRADICTION,
    NUMERICAL_FAILURE,
    SOLVED,
)


def entry(solve: Callable[..., int]) -> Entry:
    """Return the function of C around a solver of a Call and its settings, which returns a code."""
    def entered(problem, settings, record, x, work, size):
        code = can_open(problem, settings, record, x, work, size)
        if code != SOLVED:
            reset(problem, record, x)
            return np.int32(code)
        call, s = opened(problem, record, x, work, size), given(settings)
        write_exact(call.settings, s)
        return closed(call, solve(call, s))

    return Entry(entered, 6, STATUS, NUMERICAL_FAILURE)


@inlined
def write_exact(settings, s):
    """Write the settings of the exact kernels, of which the first three are those of all."""
    settings[0], settings[1], settings[2] = s.damping, s.threshold, s.rank_tolerance
    settings[3], settings[4] = s.tolerance, s.max_iterations


@compiled
def solve_hcod(call, s):
    """Solve like `Hcod`."""
    size = 3 * call.lower.size + 3
    begun(call, size)
    code = solve(call.A, call.lower, call.upper, call.sizes, call.x, call.values[:size],
                 call.settings, call.work)
    call.state[ITERATIONS] = np.int64(call.values[size - 3] + call.values[size - 2])
    call.state[WARM] = 1
    return code


@compiled
def solve_recursive(call, s):
    """Solve like `Recursive`."""
    call.settings[3], call.settings[4], call.settings[5] = s.method, s.isotropic, s.largest
    begun(call, ZERO)
    return recursion(call.A, call.lower, call.upper, call.sizes, call.x, call.settings, call.work)


@compiled
def solve_sns(call, s):
    """Solve like `Sns`."""
    call.settings[3], call.settings[4] = s.optimal, s.miss
    begun(call, call.x.size + call.sizes.size + 1)
    values = call.values[:call.state[USED]]
    code = sns(call.A, call.lower, call.upper, call.sizes, call.x, values, call.settings, call.work)
    call.state[ROW if code == CONTRADICTION else ITERATIONS] = np.int64(values[values.size - 1])
    return code


@compiled
def solve_merged(call, s):
    """Solve like `Merged`; INVALID with damping, or a scale that is not positive."""
    (m, n), levels = call.A.shape, call.sizes.size
    own, scale = call.work[:OWN + 2 * levels], call.work[OWN + 2 * levels:OWN + 3 * levels]
    begun(call, merged_record(n, m))
    given_scale = numbers_at(s.scales, levels if s.scales != 0 else ZERO)
    for k in range(levels):
        scale[k] = given_scale[k] if s.scales != 0 else 1.0
        if not 0.0 < scale[k] < np.inf:
            return ZERO + INVALID
    if s.damping > 0.0:
        return ZERO + INVALID
    write_exact(own, s)
    own[5], own[6], own[7] = s.strict_levels, s.regularisation, s.step
    write_levels(own, s.ratio, s.cap, scale)
    record = call.values[:call.state[USED]]
    code = merged(call.A, call.lower, call.upper, call.sizes, call.x, record, own,
                  call.work[OWN + 3 * levels:])
    call.state[ITERATIONS], call.state[WARM] = np.int64(record[m]), 1
    return code


@compiled
def solve_tpm(call, s):
    """Solve like `Tpm`."""
    n, size = call.x.size, call.x.size + call.sizes.size + 3 * call.lower.size + 3
    begun(call, size)
    record = call.values[:size]
    code = solve_within_bounds(call.A, call.lower, call.upper, call.sizes, call.reference, call.x,
                               record, call.settings, call.work)
    steps = np.int64(record[size - 3] + record[size - 2])
    call.state[USED], call.state[ITERATIONS] = size if steps > 0 else 0, max(steps, 1)
    for c in range(n if steps > 0 else 0):
        call.state[WARM] = 1 if record[c] != 0.0 else call.state[WARM]
    return code


def violations_at(problem, x, norms):
    """Write like `Hierarchy.violations`; infinity where that is not finite."""
    code = judged_problem(problem)
    if code == SOLVED and (x == 0 or norms == 0):
        code = INVALID
    if code == SOLVED and not violations(problem, x, norms):
        code = NUMERICAL_FAILURE
    return np.int32(code)


def verify_x(problem, settings, record, x, work, size):
    """Verify like `Resolution.verified`; x and the record are only read."""
    code = can_open(problem, settings, record, x, work, size)
    if code != SOLVED:
        return np.int32(code)
    call, s = opened(problem, record, x, work, size), given(settings)
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


def size_of_work(n, m, levels):
    """Return the numbers that a work space needs, -1 for sizes out of range."""
    return work_size(n, m, levels) if in_range(n, m, levels) else -1


def size_of_record(n, m, levels):
    """Return the numbers that a record needs, -1 for sizes out of range."""
    return record_size(n, m, levels) if in_range(n, m, levels) else -1


RESOLVERS = {"hcod": entry(solve_hcod), "tpm": entry(solve_tpm),
             "recursive": entry(solve_recursive), "sns": entry(solve_sns),
             "merged": entry(solve_merged)}
ALWAYS = {"th_work_size": Entry(size_of_work, 3, INTEGER, -1),
          "th_record_size": Entry(size_of_record, 3, INTEGER, -1),
          "th_verify": Entry(verify_x, 6, STATUS, NUMERICAL_FAILURE),
          "th_violations": Entry(violations_at, 3, STATUS, NUMERICAL_FAILURE)}
