"""The resolvers as a C library give the bits of Python, also in warm sequences."""

import sys
from concurrent.futures import ThreadPoolExecutor

import c_library as c
import numpy as np
import pytest
from sequences import sequence

from benchmark.studies.recorded import recorded
from hierarchy import Hierarchy
from scenarios import load
from scenarios.problems.reference import FAMILIES, family
from solvers import make, problems

if not sys.platform.startswith("linux"):
    pytest.skip("the C library is made on Linux", allow_module_level=True)

# name in both, settings in Python, the same in C
RESOLVERS = [
    ("hcod", {}, {}),
    ("hcod", {"damping": 0.1}, {"damping": 0.1}),
    ("hcod", {"tolerance": 1e-8, "max_iterations": 3}, {"tolerance": 1e-8, "max_iterations": 3}),
    ("tpm", {}, {}),
    ("tpm", {"damping": 0.1, "threshold": 0.3}, {"damping": 0.1, "threshold": 0.3}),
    ("recursive", {}, {}),
    ("recursive", {"method": "nakamura", "damping": 0.1}, {"method": 1, "damping": 0.1}),
    ("recursive", {"method": "chiaverini", "damping": 0.1, "isotropic": 0.01},
     {"method": 2, "damping": 0.1, "isotropic": 0.01}),
    ("recursive", {"method": "selective", "largest": 0.3}, {"method": 3, "largest": 0.3}),
    ("sns", {}, {}),
    ("sns", {"form": "optimal", "scales": "miss"}, {"optimal": 1, "miss": 1}),
    ("merged", {}, {}),
    ("merged", {"ratio": 2.0, "step": 1.0, "strict_levels": 1},
     {"ratio": 2.0, "step": 1.0, "strict_levels": 1}),
]


def hierarchies(count, first=0):
    """Generated and structured problems, equalities alone and with bounds above them."""
    for seed in range(first, first + count):
        equal = problems.structured(seed, equalities_only=True)
        yield from (problems.generate(seed), problems.structured(seed), equal,
                    problems.bounded(equal, seed))


@pytest.mark.slow
@pytest.mark.parametrize("resolver", RESOLVERS, ids=str)
def test_c_and_python_give_the_same_bits(library, resolver):
    answered = [c.check_same(library, resolver, h) for h in hierarchies(40)]
    assert sum(res is not None for res in answered) > 40


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_c_and_python_give_the_same_bits_on_the_reference_families(library, name):
    for problem in family(name):
        for resolver in RESOLVERS:
            c.check_same(library, resolver, problem.h)


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_object_loaded_without_a_linker_gives_the_same_bits(folder):
    library = c.Library.unlinked(folder / "lib" / "libtask_hierarchy.a")
    for h in hierarchies(5):
        c.check_same(library, RESOLVERS[0], h)


@pytest.mark.slow
def test_threads_do_not_disturb_each_other(library):
    h = family("HUM38")[0].h
    status, alone = library.solve("hcod", h)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda _: library.solve("hcod", h), range(400)))
    assert status == c.SOLVED
    assert all(left.answer.tobytes() == alone.answer.tobytes() for _, left in together)


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [[], [0], [1], [60], [0] * 100, [2, 0, 3], [1] * 40])
@pytest.mark.parametrize("n", [1, 2, 40])
def test_the_sizes_that_the_library_states_are_enough(library, n, sizes):
    rng = np.random.default_rng(n)
    rows = [(rng.normal(size=(m, n)), rng.normal(size=m)) for m in sizes]
    h = Hierarchy.from_levels(rows, np.zeros(n))
    for name, _, settings in RESOLVERS:
        status, left = library.solve(name, h, c.settings_of(**settings))
        merged = name == "merged"  # which has nothing to merge in some of these
        assert status in (c.SOLVED, c.INACCURATE, c.ITERATION_LIMIT, *[c.REFUSED] * merged)
        assert np.isfinite(left.answer).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ellipse-limits", "humanoid-reach", "dual-arm"])
def test_the_commands_of_a_scenario_come_out_of_c_to_the_last_bit(library, name):
    scenario = load(name)
    resolver, memory = scenario.make_resolver(), None
    damped, before = {"damping": resolver.damping}, None
    assert resolver == make(resolver.name, **damped)
    for h in recorded(name, 200):
        memory = memory or library.memory(h)
        before = c.check_same(library, (resolver.name, damped, damped), h, memory, before).memory
