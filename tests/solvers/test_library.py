"""The resolvers as a C library give the bits of Python, also in warm sequences."""

import sys

import c_library as c
import numpy as np
import pytest
from rank_cases import sequence

from hierarchy import Hierarchy, HierarchyError
from hierarchy.jit import caching
from hierarchy.jit.sources import source_digest
from scenarios.problems.recorded import FAMILIES, family
from solvers import make, problems
from solvers.library import write
from solvers.library.entries import can_open
from solvers.library.folder import _link

if not sys.platform.startswith("linux"):
    pytest.skip("the C library is made on Linux", allow_module_level=True)

# name in both, settings in Python, the same in C
RESOLVERS = [
    *((name, given, given) for name, given in (
        ("hcod", {}), ("hcod", {"damping": 0.1}), ("tpm", {}), ("recursive", {}), ("sns", {}),
        ("merged", {}), ("hcod", {"tolerance": 1e-8, "max_iterations": 3}),
        ("tpm", {"damping": 0.1, "threshold": 0.3}),
        ("merged", {"ratio": 2.0, "step": 1.0, "strict_levels": 1}))),
    ("recursive", {"method": "nakamura", "damping": 0.1}, {"method": 1, "damping": 0.1}),
    ("recursive", {"method": "chiaverini", "damping": 0.1, "isotropic": 0.01},
     {"method": 2, "damping": 0.1, "isotropic": 0.01}),
    ("recursive", {"method": "selective", "largest": 0.3}, {"method": 3, "largest": 0.3}),
    ("sns", {"form": "optimal", "scales": "miss"}, {"optimal": 1, "miss": 1})]


def hierarchies(count):
    """Generated and structured problems, equalities alone and with bounds above them."""
    for seed in range(count):
        equal = problems.structured(seed, equalities_only=True)
        yield from (problems.generate(seed), problems.structured(seed), equal,
                    problems.bounded(equal, seed))


@pytest.mark.parametrize("resolver", RESOLVERS, ids=str)
def test_c_and_python_give_the_same_bits(library, resolver):
    answered = [c.check_same(library, resolver, h) for h in (
        *hierarchies(40), *(problem.h for name in FAMILIES for problem in family(name)))]
    assert sum(res is not None for res in answered) > 40


def test_c_verifies_what_python_verifies_and_writes_to_its_work_space_only(library):
    resolver = make("hcod")
    for h in map(problems.structured, range(700, 740)):
        res, (_, memory) = resolver.solve(h), library.solve("hcod", h)
        values = memory.values.copy()
        for by in (0.0, 1e-3):
            memory.x[:-1] = x = res.x + by
            found = type(res)(x, res.status, res.memory).verified(h)
            status = library.call("verify", c.problem_of(h), memory)
            assert status == (c.SOLVED if found else c.INACCURATE)
            np.testing.assert_array_equal(memory.x[:-1], x)
        np.testing.assert_array_equal(memory.values, values)
        assert memory.untouched


@pytest.mark.parametrize("name", ["hcod", "tpm", "merged"])
def test_warm_sequences_give_the_same_bits(library, name):
    warm = 0
    for seed in range(12):
        h = problems.bounded(problems.structured(seed, equalities_only=True), seed)
        starts = h if name == "tpm" or seed % 2 else problems.generate(seed)
        memory, before = library.memory(starts), None
        for tick in sequence(starts, 10, seed):
            warm += before is not None
            res = c.check_same(library, (name, {}, {}), tick, memory, before)
            before = None if res is None else res.memory
    assert warm > 40


def test_without_code_made_ahead_it_is_compiled_to_the_same_bits(tmp_path, monkeypatch):
    """As where a newer LLVM wrote it."""
    monkeypatch.setattr(caching, "FOLDER", tmp_path)
    caching.write_part("solvers", ("", source_digest(can_open), {}, ()), llvm=b"of another LLVM")
    write(tmp_path, ("recursive",))
    for h in hierarchies(5):
        c.check_same(c.Library(tmp_path), ("recursive", {}, {}), h)


def test_code_for_fixed_sizes_gives_the_same_bits(tmp_path):
    write(tmp_path, ("hcod",), fix=(7, 5, 3))
    library, resolver = c.Library(tmp_path), RESOLVERS[0]
    equal, others = family("EQ7"), [*family("EQ7sing"), *family("INEQ7")[:5]]
    assert equal[0].h.sizes.tolist() == [3, 1, 1]
    memory, before = library.memory(equal[0].h), None
    for h in [problem.h for problem in (*equal, *others)]:
        c.check_same(library, resolver, h)
    for h in (problem.h for problem in equal[:5]):
        before = c.check_same(library, resolver, h, memory, before).memory
    singular = Hierarchy.from_levels([(np.ones((3, 7)), np.ones(3)), (np.ones((1, 7)), [2.0]),
                                      (np.eye(7)[:1], [3.0])])
    c.check_same(library, resolver, singular)
    for wrong in ((7, 0, 1), (7, 5), (7, 2, 3)):
        with pytest.raises(HierarchyError):
            write(tmp_path, ("hcod",), fix=wrong)


def box():
    """Bounds, a task and a posture of three unknowns, in fresh arrays."""
    return Hierarchy.from_levels([(np.eye(3), -np.ones(3), np.ones(3)), (np.ones((1, 3)), [5.0]),
                                  (np.eye(3), np.zeros(3))])


@pytest.mark.parametrize(("said", "told"), [("'in a.o:' 'no symbol x'", "no symbol x"), ("", "")])
def test_the_last_line_of_a_linker_that_fails_is_told(tmp_path, monkeypatch, said, told):
    compiler = tmp_path / "cc"
    compiler.write_text(f"#!/bin/sh\nfor line in {said}; do echo \"$line\" >&2; done\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert _link(tmp_path, "native") == f"{compiler} failed: {told}"


def test_spoilt_data_give_the_bits_and_statuses_of_python(library):
    rng = np.random.default_rng(1)
    worst = np.array([np.nan, np.inf, -np.inf, 1e308, -1e200, 5e-324, 0.0, 1e-300])
    for seed in range(150):
        h = problems.structured(seed) if seed % 2 else problems.generate(seed)
        for array in (h.A.ravel(), h.lower, h.upper, h.reference):
            if array.size and rng.random() < 0.5:
                array[rng.integers(array.size)] = rng.choice(worst)
        for name in c.NAMES:
            for damped in ({}, *[{"damping": 0.1}] * (name != "merged")):
                c.check_same(library, (name, damped, damped), h)
        status, _ = library.solve("merged", h, c.settings_of(damping=0.1))
        assert status == c.INVALID  # which C has without damping only


@pytest.mark.parametrize("wrong", [
    {"n": 0}, {"n": -3}, {"n": 2**40}, {"m": -1}, {"m": 6}, {"m": 2**62}, {"levels": -1},
    {"levels": 2}, {"levels": 2**33}, {"A": None}, {"lower": None}, {"upper": None},
    {"sizes": None}, {"sizes": (3, 2, 3)}, {"sizes": (9, -1, -1)},
    {"sizes": (2**62, 2**62, 7 - 2**63)}], ids=str)
def test_sizes_that_do_not_add_up_are_invalid(library, wrong):
    h = box()
    if isinstance(wrong.get("sizes"), tuple):
        wrong = {"sizes": (c.ctypes.c_int64 * 3)(*wrong["sizes"])}
    for name in c.NAMES:
        memory = library.memory(h)
        assert library.call(f"solve_{name}", c.problem_of(h, **wrong), memory) == c.INVALID
        assert memory.untouched
        assert (np.r_[memory.work, memory.values] == c.CANARY).all()
        assert (memory.answer == (c.CANARY if "n" in wrong else 0.0)).all()
    if {"n", "m", "A", "sizes"} & set(wrong):
        status, norms = library.violations(c.problem_of(h, **wrong), np.ones(3), 3)
        assert (status, set(norms)) == (c.INVALID, {c.CANARY})


@pytest.mark.parametrize("pointer", ["problem", "record", "x", "work"])
def test_a_missing_pointer_is_invalid(library, pointer):
    h, memory = box(), library.memory(box())
    assert library.call("solve_hcod", c.problem_of(h), memory, **{pointer: None}) == c.INVALID
    memory.record.values = None
    assert library.call("solve_hcod", c.problem_of(h), memory) == c.INVALID
    assert memory.untouched
    assert library.violations(c.problem_of(h), None, 3)[0] == c.INVALID


@pytest.mark.parametrize("name", c.NAMES)
def test_a_record_of_garbage_does_no_harm(library, name):
    for garbage in (np.nan, np.inf, 1e300, -1.0, 2.0):
        h, memory = box(), library.memory(box())
        for used in (3 * h.m + 3, h.n + len(h.sizes) + 3 * h.m + 3):
            memory.values[:-1], memory.record.used, memory.record.warm = garbage, used, 1
            status, left = library.solve(name, h, memory=memory)
            assert np.isfinite(left.answer).all()
            if status == c.SOLVED and name in ("hcod", "tpm"):
                np.testing.assert_allclose(left.answer, make(name).solve(h).x, atol=1e-9)


@pytest.mark.parametrize("name", c.NAMES)
@pytest.mark.parametrize("missing", [{"missing": 1}, {"missing": 10_000}, {"missing_values": 1}],
                         ids=str)
def test_too_little_memory_is_a_status(library, name, missing):
    h = family("HUM38")[0].h
    status, left = library.solve(name, h, memory=library.memory(h, **missing))
    assert status == c.TOO_SMALL
    assert not left.answer.any()
    assert (left.work == c.CANARY).all()


def test_settings_without_a_value_are_those_of_python_and_out_of_range_are_invalid(library):
    h = family("INEQ7")[0].h
    plain, given = (library.solve("hcod", h, settings)[1] for settings in (None, c.settings_of()))
    assert plain.answer.tobytes() == given.answer.tobytes() == make("hcod").solve(h).x.tobytes()
    for wrong in ({"damping": -0.1}, {"damping": np.nan}, {"threshold": 0.0},
                  {"rank_tolerance": 1.0}, {"rank_tolerance": np.nan}, {"tolerance": 0.0},
                  {"tolerance": 0.1}, {"isotropic": -1.0}, {"largest": 0.0}, {"max_iterations": 0},
                  {"optimal": 2}, {"miss": -1}, {"method": 4}):
        assert library.solve("hcod", box(), c.settings_of(**wrong))[0] == c.INVALID, wrong
    one, other = library.memory(h), library.memory(h)
    library.call("solve_hcod", c.problem_of(h), one)
    library.call("solve_hcod", c.problem_of(h, reference=None), other)  # it is zero
    assert h.reference.any() or one.answer.tobytes() == other.answer.tobytes()


@pytest.mark.parametrize(("name", "levels", "status"), [
    ("tpm", [(np.eye(2), [0.0, 0.0]), (np.ones((1, 2)), [0.0], [1.0])], c.REFUSED),
    ("sns", [(np.eye(2)[[0, 1, 0]], [0.0, 0.0, 2.0], [1.0, 1.0, 3.0])], c.CONTRADICTION)])
def test_the_row_that_is_refused_or_contradicts_another_is_named(library, name, levels, status):
    found, left = library.solve(name, Hierarchy.from_levels(levels))
    assert (found, left.record.row) == (status, 2)
