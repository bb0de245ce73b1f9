"""Every door for arrays: what would let a kernel read foreign memory is refused, and named.

What once ended the process (SIGBUS, SIGSEGV) is tried in another one.
"""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest
from refusals import refused

from hierarchy import Hierarchy
from solvers import make
from solvers.batch import Batch

HUGE = 2**63 - 1
SIZES = [([HUGE, HUGE, 5], f"level 1: size {HUGE}"), ([2**62] * 4 + [3], "level 1: size 4611"),
         ([10**9], "level 1: size 1000000000, expected a whole number of rows from 0 to 3"),
         ([4, -1], "level 1: size 4"), ([1, 1], "sizes sum to 2, but A has 3 rows"),
         ([3.0], "sizes: expected a whole number of rows for each level"),
         ([True, True, True], "sizes: expected"), ([[3]], "sizes: expected"),
         (3, "sizes: expected"),
         (np.array([2**64 - 3, 6], dtype=np.uint64), "level 1: size 1844")]


def plain(**other):
    """Return a hierarchy of three rows in two unknowns, with other arguments than the usual."""
    given = {"A": [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], "lower": [1.0, 2.0, -np.inf],
             "upper": [1.0, 2.0, 9.0], "sizes": [2, 1], "names": ["hand", "elbow"]}
    return Hierarchy(**given | other)


def stacked(**other):
    given = {"A": np.ones((2, 3, 2)), "lower": np.zeros((2, 3)), "upper": np.ones((2, 3)),
             "sizes": [2, 1]}
    return Batch(**given | other)


@pytest.mark.parametrize(("sizes", "said"), SIZES, ids=str)
@pytest.mark.parametrize("door", [plain, stacked])
def test_sizes_that_do_not_add_up_are_refused_without_wrapping(door, sizes, said):
    refused(said, door, sizes=sizes, **({"names": None} if door is plain else {}))


@pytest.mark.parametrize(("other", "said"), [
    ({"lower": np.zeros(2)}, "lower has shape (2,), expected (3,)"),
    ({"reference": np.zeros(3)}, "reference has shape (3,), expected (2,)"),
    ({"A": np.zeros(6)}, "A has shape (6,), expected (rows, n)"),
    ({"metric": np.eye(3)}, "metric has shape (3, 3), expected (2, 2)"),
    ({"give": np.zeros(2)}, "give has shape (2,), expected (3,)"),
    ({"names": ["hand"]}, "1 names for 2 levels"),
    ({"A": [[1, 0], [0, 1], [1, np.nan]]}, "elbow, row 0: A[0, 1] is nan"),
    ({"lower": [1.0, 5.0, 0.0]}, "hand, row 1: no value lies between lower 5.0 and upper 2.0"),
    ({"reference": [0.0, np.inf]}, "reference, entry 1: inf is not finite"),
    ({"metric": -np.eye(2)}, "metric is not positive definite: its smallest eigenvalue is -1"),
    ({"metric": [[1.0, np.nan], [0.0, 1.0]]}, "metric[0, 1] is nan"),
    ({"metric": [[1.0, 0.5], [0.0, 1.0]]}, "metric is not symmetric: [0, 1] is 0.5 and [1, 0] is"),
    ({"give": [0.0, 0.0, -1.0]}, "elbow, row 0: give is -1.0")])
def test_a_hierarchy_that_is_made_or_changed_with_a_wrong_array_is_refused(other, said):
    refused(said, plain, **other)
    h = plain()
    for name, value in other.items():
        if name not in ("names", "lower"):
            refused(said, setattr, h, name, value)
    np.testing.assert_array_equal(make("hcod").solve(h).x, [1, 2])


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, Hierarchy.copy,
                                   lambda h: pickle.loads(pickle.dumps(h))])
def test_a_copy_and_a_pickle_pass_the_gate_too(again):
    h = plain(metric=2 * np.eye(2), give=[0.0, 0.0, 1.0])
    other = again(h)
    for name in ("A", "lower", "upper", "sizes", "reference", "metric", "give"):
        np.testing.assert_array_equal(getattr(h, name), getattr(other, name))
        if again is not copy.copy and name != "sizes":
            assert not np.shares_memory(getattr(h, name), getattr(other, name))
    assert (other.names, make("hcod").solve(other).status.name) == (h.names, "SOLVED")


@pytest.mark.parametrize(("levels", "give", "said"), [
    ([([[np.inf, 0]], [1])], None, "A[0, 0] is inf"),
    ([(np.eye(2), [1, np.inf])], None, "level 1, row 1"),
    ([([[1, 0]], [np.inf], [np.inf])], None, "level 1, row 0"),
    ([([[1, 0]], [-np.inf], [-np.inf])], None, "level 1, row 0"),
    ([(np.eye(2), [1])], None, "b has shape (1,), expected (2,)"),
    ([(np.eye(2), [1, 2]), (np.eye(3), [1, 2, 3])], None, "level 2: A has 3 columns"),
    ([(np.zeros((0, 0)), [])], None, "n = 0"), ([], None, "no levels"),
    ([(np.eye(2),)], None, "expected (A, b) or (A, lower, upper)"),
    ([("abc", [1])], None, "level 1: A is not an array of numbers"),
    ([(np.eye(2), [1, 2])] * 2, [0.1], "give has 1 entries for 2 levels"),
    ([(np.eye(2), [1, 2])] * 2, [0.1, np.inf], "level 2, row 0: give is inf"),
    ([(np.eye(3), np.ones(3))], [[0.1, 0.2]],
     "level 1: give has shape (2,), expected one number or (3,)")])
def test_wrong_levels_are_named(levels, give, said):
    refused(said, Hierarchy.from_levels, levels, give=give)


def test_no_way_of_breaking_an_array_ends_the_process():
    program = '''
import contextlib
import numpy as np
from hierarchy import Hierarchy, HierarchyError
from solvers import make
from solvers.batch import Batch, solve

A, b = np.random.default_rng(0).normal(size=(6, 7)), np.ones(6)

def resolve(thing):
    if isinstance(thing, Batch):
        return solve(thing, make("hcod"))
    for name in ("hcod", "tpm", "recursive", "sns", "weighted", "reverse", "augmented"):
        make(name).solve(thing)

for made, broken in [
        *((lambda: Hierarchy.from_levels([(A[:4], b[:4]), (A[4:], b[4:])]), broken) for broken in (
            "h.lower = np.zeros(2)", "h.A = np.ones((2, 7))", "h.sizes = [4, 3000000]",
            "h.sizes[:] = 3000000", "h.reference = np.zeros(2)", "h.A.shape = (42, 1)", "h.m = 1",
            "h.lower.shape = (1, 1, 1, 1, 1, 1, 1, 6)", "h.lower.dtype = np.float32",
            "h.A.shape = (7, 6)", "object.__setattr__(h, 'lower', np.zeros(2))")),
        *((lambda: Batch(np.stack([A] * 9), np.ones((9, 6)), np.ones((9, 6)), [4, 2]), broken)
          for broken in ("h.sizes[:] = 10**9", "h.lower.shape = (6, 9)", "h.A.shape = (9, 7, 6)",
                         "h.reference.shape = (63,)", "object.__setattr__(h, 'upper', b[:3])"))]:
    h = made()
    with contextlib.suppress(HierarchyError, ValueError, AttributeError):  # of numpy: read-only
        exec(broken)
    try:
        resolve(h)
    except HierarchyError as error:
        print(error)
print("alive")
'''
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", program], text=True,
                          capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert said[-1] == "alive"
    assert "level 1: size 1000000000, expected a whole number of rows from 0 to 6" in said
    assert "lower has shape (6, 9), expected (9, 6)" in said
