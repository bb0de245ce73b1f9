"""The resolvers as a C library: the bits of Python, no memory of their own, and a status for all.

The library is made once, by the first worker that needs it. Without a compiler of C it is loaded by
LLVM, and what needs a compiler is skipped by name.
"""

import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import c_library as c
import c_speed
import numpy as np
import pytest
from c_speed import record_sequence, recorded, sequence

from hierarchy import Hierarchy, HierarchyError
from scenarios import load
from scenarios.bench.families import FAMILIES, family
from scenarios.cli.main import run_command
from solvers import make, problems
from solvers.library import differs, write
from solvers.library.archive import archive

if not sys.platform.startswith("linux"):
    pytest.skip("the C library is made on Linux", allow_module_level=True)

ROOT = Path(__file__).parents[2]
EXAMPLES, PROGRAM = ROOT / "examples" / "c", ROOT / "docs" / "studies" / "c_speed.c"
STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"]
COMPILER = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
CXX = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
needs_c = pytest.mark.skipif(COMPILER is None, reason="no compiler of C")
LIBM = {"hypot", "memset", "memcpy"}  # all that the library asks for

# name in both, settings in Python, the same in C
RESOLVERS = [
    ("hcod", {}, {}),
    ("hcod", {"damping": 0.1}, {"damping": 0.1}),
    ("hcod", {"tolerance": 1e-8, "guesses": 1, "max_iterations": 3},
     {"tolerance": 1e-8, "guesses": 1, "max_iterations": 3}),
    ("tpm", {}, {}),
    ("tpm", {"damping": 0.1, "threshold": 0.3}, {"damping": 0.1, "threshold": 0.3}),
    ("recursive", {}, {}),
    ("recursive", {"method": "nakamura", "damping": 0.1}, {"method": 1, "damping": 0.1}),
    ("recursive", {"method": "chiaverini", "damping": 0.1, "isotropic": 0.01},
     {"method": 2, "damping": 0.1, "isotropic": 0.01}),
    ("recursive", {"method": "selective", "largest": 0.3}, {"method": 3, "largest": 0.3}),
    ("sns", {}, {}),
    ("sns", {"form": "optimal", "scales": "miss"}, {"optimal": 1, "miss": 1}),
]
NAMES = ("hcod", "tpm", "recursive", "sns")


def made(tmp_path_factory, target, resolvers=NAMES):
    """The folder of a library, made once for all workers."""
    import fcntl

    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root
    folder = root / f"c-library-{target}"
    with (root / f"{folder.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            folder.mkdir()
            write(folder, resolvers, target)
    return folder


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return made(tmp_path_factory, "native")


@pytest.fixture(scope="session")
def generic(tmp_path_factory):
    """The library for any x86-64, with one resolver."""
    if os.uname().machine != "x86_64":
        pytest.skip("not an x86-64")
    return made(tmp_path_factory, "x86_64", ("hcod",))


@pytest.fixture(scope="session")
def library(folder):
    shared = folder / "lib" / "libtask_hierarchy.so"
    return c.Library.linked(shared) if shared.exists() else c.Library.unlinked(
        folder / "lib" / "libtask_hierarchy.a")


@pytest.fixture
def unverified(monkeypatch):
    """Let answers in doubt keep the status of the kernels in Python too."""
    for module in ("hcod", "tpm"):
        monkeypatch.setattr(f"solvers.resolvers.{module}.certify",
                            lambda h, x: SimpleNamespace(certified=False))


def hierarchies(count, first=0):
    """Generated and structured problems, equalities alone and with bounds above them."""
    for seed in range(first, first + count):
        equal = problems.structured(seed, equalities_only=True)
        yield from (problems.generate(seed), problems.structured(seed), equal,
                    problems.bounded(equal, seed))


def check_same(library, resolver, h, memory=None, before=None):
    """One solve in both, from memories of both; returns what Python leaves."""
    name, python, settings = resolver
    try:
        res = make(name, **python).solve(h, before)
    except HierarchyError:
        status, left = library.solve(name, h, c.settings_of(**settings), memory)
        assert status in (c.REFUSED, c.CONTRADICTION)
        assert 0 <= left.record.row < h.m
        assert not left.answer.any()
        return None
    status, left = library.solve(name, h, c.settings_of(**settings), memory)
    assert left.answer.tobytes() == res.x.tobytes()
    assert status == res.status or (name, status) == ("tpm", c.ITERATION_LIMIT)
    assert left.record.iterations == res.iterations
    assert (left.record.warm == 1) == (res.memory is not None)
    if res.memory is not None:
        assert left.values[:left.record.used].tobytes() == res.memory.tobytes()
    return res


@pytest.mark.slow
@pytest.mark.parametrize("resolver", RESOLVERS, ids=str)
@pytest.mark.usefixtures("unverified")
def test_c_and_python_give_the_same_bits(library, resolver):
    answered = [check_same(library, resolver, h) for h in hierarchies(60)]
    assert sum(res is not None for res in answered) > 60


@pytest.mark.slow
@pytest.mark.usefixtures("unverified")
def test_c_and_python_give_the_same_bits_on_ten_thousand_hierarchies(library):
    count = 0
    for h in hierarchies(2500, first=1_000_000):
        count += 1
        for name in NAMES:
            check_same(library, (name, {}, {}), h)
    assert count == 10_000


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.usefixtures("unverified")
def test_c_and_python_give_the_same_bits_on_the_reference_families(library, name):
    for problem in family(name):
        for resolver in RESOLVERS:
            check_same(library, resolver, problem.h)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hcod", "tpm"])
@pytest.mark.usefixtures("unverified")
def test_warm_sequences_give_the_same_bits(library, name):
    warm = 0
    for seed in range(30):
        h = problems.bounded(problems.structured(seed, equalities_only=True), seed)
        starts = h if name == "tpm" or seed % 2 else problems.generate(seed)
        memory, before = library.memory(starts), None
        for tick in sequence(starts, 10, seed):
            warm += before is not None
            res = check_same(library, (name, {}, {}), tick, memory, before)
            before = None if res is None else res.memory
    assert warm > 100


@pytest.mark.slow
@pytest.mark.usefixtures("unverified")
def test_a_record_goes_on_with_another_kind_of_rows(library):
    """From inequalities to equalities alone, and back."""
    rng = np.random.default_rng(5)
    A, b = rng.normal(size=(6, 7)), rng.normal(size=6)
    wide = Hierarchy.from_levels([(A[:3], b[:3] - 0.1, b[:3] + 0.1), (A[3:], b[3:])])
    equal = Hierarchy.from_levels([(A[:3], b[:3]), (A[3:], b[3:])])
    memory, before = library.memory(wide), None
    for h in (wide, equal, wide, wide, equal, equal):
        before = check_same(library, ("hcod", {}, {}), h, memory, before).memory


@pytest.mark.slow
def test_the_object_loaded_without_a_linker_gives_the_same_bits(folder, unverified):
    library = c.Library.unlinked(folder / "lib" / "libtask_hierarchy.a")
    for h in hierarchies(5):
        check_same(library, RESOLVERS[0], h)


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
        assert status in (c.SOLVED, c.INACCURATE, c.ITERATION_LIMIT)
        assert np.isfinite(left.answer).all()


def box():
    """Bounds, a task and a posture of three unknowns, in fresh arrays."""
    return Hierarchy.from_levels([(np.eye(3), -np.ones(3), np.ones(3)), (np.ones((1, 3)), [5.0]),
                                  (np.eye(3), np.zeros(3))])


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("array", ["A", "lower", "upper", "reference"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
def test_numbers_that_are_none_are_a_status(library, name, array, value):
    for at in range(3):
        h = box()
        getattr(h, array).ravel()[at] = value
        status, left = library.solve(name, h)
        assert np.isfinite(left.answer).all()
        if np.isnan(value) and name != "recursive":
            assert status == c.NUMERICAL_FAILURE
        if status not in (c.SOLVED, c.INACCURATE):
            assert not left.answer.any()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_lower_side_above_the_upper_is_a_status(library, name):
    h = box()
    h.lower[1], h.upper[1] = 1.0, -1.0
    if name == "recursive":
        h = Hierarchy(h.A[3:], h.lower[3:], h.upper[3:], h.sizes[1:], h.reference, h.names[1:])
        h.lower[0], h.upper[0] = 1.0, -1.0
    status, left = library.solve(name, h)
    assert status == c.NUMERICAL_FAILURE
    assert not left.answer.any()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("wrong", [
    {"n": 0}, {"n": -3}, {"n": 2**40}, {"m": -1}, {"m": 6}, {"m": 2**62}, {"levels": -1},
    {"levels": 2}, {"levels": 2**33}, {"A": None}, {"lower": None}, {"upper": None},
    {"sizes": None}], ids=str)
def test_sizes_that_do_not_add_up_are_invalid(library, name, wrong):
    h = box()
    memory = library.memory(h)
    assert library.call(name, c.problem_of(h, **wrong), memory) == c.INVALID
    assert memory.untouched
    assert (memory.work == c.CANARY).all()
    assert (memory.values == c.CANARY).all()
    assert (memory.answer == (c.CANARY if "n" in wrong else 0.0)).all()


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [[3, 2, 3], [9, -1, -1], [2**62, 2**62, 7 - 2**63]])
def test_sizes_of_levels_that_do_not_add_up_are_invalid(library, sizes):
    h, memory = box(), library.memory(box())
    h.sizes[:] = sizes
    assert library.call("hcod", c.problem_of(h), memory) == c.INVALID
    assert (memory.work == c.CANARY).all()


@pytest.mark.slow
@pytest.mark.parametrize("pointer", ["problem", "record", "x", "work"])
def test_a_missing_pointer_is_invalid(library, pointer):
    h, memory = box(), library.memory(box())
    assert library.call("hcod", c.problem_of(h), memory, **{pointer: None}) == c.INVALID
    assert memory.untouched


@pytest.mark.slow
def test_a_record_without_room_is_invalid(library):
    h, memory = box(), library.memory(box())
    memory.record.values = None
    assert library.call("hcod", c.problem_of(h), memory) == c.INVALID
    assert not memory.answer.any()


@pytest.mark.slow
@pytest.mark.parametrize("garbage", [np.nan, np.inf, 1e300, -1.0, 2.0])
@pytest.mark.parametrize("name", NAMES)
def test_a_record_of_garbage_does_no_harm(library, name, garbage):
    h, memory = box(), library.memory(box())
    for used in (3 * h.m + 3, h.n + len(h.sizes) + 3 * h.m + 3):
        memory.values[:-1], memory.record.used, memory.record.warm = garbage, used, 1
        status, left = library.solve(name, h, memory=memory)
        assert np.isfinite(left.answer).all()
        if status == c.SOLVED and name in ("hcod", "tpm"):
            np.testing.assert_allclose(left.answer, make(name).solve(h).x, atol=1e-9)


@pytest.mark.slow
def test_without_a_reference_it_is_zero(library):
    h, one, other = box(), library.memory(box()), library.memory(box())
    assert library.call("hcod", c.problem_of(h), one) == c.SOLVED
    assert library.call("hcod", c.problem_of(h, reference=None), other) == c.SOLVED
    assert one.answer.tobytes() == other.answer.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("missing", [{"missing": 1}, {"missing": 10_000}, {"missing_values": 1}],
                         ids=str)
def test_too_little_memory_is_a_status(library, name, missing):
    h = family("HUM38")[0].h
    status, left = library.solve(name, h, memory=library.memory(h, **missing))
    assert status == c.TOO_SMALL
    assert not left.answer.any()
    assert (left.work == c.CANARY).all()


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [
    {"damping": -0.1}, {"damping": np.nan}, {"threshold": 0.0}, {"rank_tolerance": 1.0},
    {"rank_tolerance": np.nan}, {"tolerance": 0.0}, {"tolerance": 0.1}, {"isotropic": -1.0},
    {"largest": 0.0}, {"guesses": 0}, {"max_iterations": 0}, {"optimal": 2}, {"miss": -1},
    {"method": 4}], ids=str)
def test_a_setting_out_of_range_is_invalid(library, wrong):
    assert library.solve("hcod", box(), c.settings_of(**wrong))[0] == c.INVALID


@pytest.mark.slow
def test_the_default_settings_are_those_of_python(library):
    h = family("INEQ7")[0].h
    assert (library.solve("hcod", h)[1].answer.tobytes()
            == library.solve("hcod", h, c.settings_of())[1].answer.tobytes()
            == make("hcod").solve(h).x.tobytes())


@pytest.mark.slow
def test_a_spent_budget_keeps_the_finished_levels(library):
    limited = 0
    for problem in family("HUM38")[:10]:
        h = problem.h
        for budget in (1, 5, 20):
            status, left = library.solve("hcod", h, c.settings_of(max_iterations=budget))
            if status == c.ITERATION_LIMIT:
                limited, unfinished = limited + 1, int(left.values[3 * h.m + 2])
                np.testing.assert_allclose(h.violations(left.answer)[:unfinished],
                                           problem.norms[:unfinished], atol=1e-8)
    assert limited > 5


@pytest.mark.slow
def test_the_row_that_is_refused_is_named(library):
    h = Hierarchy.from_levels([(np.eye(2), [0.0, 0.0]), (np.ones((1, 2)), [0.0], [1.0])])
    status, left = library.solve("tpm", h)
    assert (status, left.record.row) == (c.REFUSED, 2)


@pytest.mark.slow
def test_bounds_that_contradict_each_other_are_named(library):
    h = Hierarchy.from_levels([(np.eye(2)[[0, 1, 0]], [0.0, 0.0, 2.0], [1.0, 1.0, 3.0])])
    status, left = library.solve("sns", h)
    assert (status, left.record.row) == (c.CONTRADICTION, 2)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("nm") is None, reason="no nm")
def test_it_asks_for_nothing_but_libm_and_owns_no_variable(folder):
    done = subprocess.run(["nm", folder / "lib" / "libtask_hierarchy.a"], capture_output=True,
                          text=True, check=True)
    kinds = re.findall(r"^\w* +(\w) (\S+)$", done.stdout, re.MULTILINE)
    assert {name for kind, name in kinds if kind == "U"} <= LIBM
    assert {kind for kind, _ in kinds} <= set("UTtr")  # code and constants
    assert {name for kind, name in kinds if kind == "T"} == {
        *(f"th_solve_{name}" for name in NAMES), "th_work_size", "th_record_size", "th_version",
        "th_digest"}


def built(out, source, folder, *flags, compiler=COMPILER):
    """Compile one file with the static library; returns the program."""
    subprocess.run([compiler, *flags, source, "-I", folder / "include",
                    folder / "lib" / "libtask_hierarchy.a", "-lm", "-o", out], check=True)
    return out


def said(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_the_code_that_documents_show_is_that_of_the_examples():
    shown = [block for page in (ROOT / "docs").rglob("*.md") for block in re.findall(
        r"^```c\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)]
    examples = "".join(path.read_text(encoding="utf-8") for path in EXAMPLES.iterdir())
    assert shown
    assert all(block in examples for block in shown)


@needs_c
@pytest.mark.slow
def test_the_examples_compile_without_a_warning_and_run(folder, tmp_path):
    once = built(tmp_path / "once", EXAMPLES / "once.c", folder, "-std=c99", *STRICT)
    assert said(once) == "status 0, x = 0.9 0.1\n"
    loop = built(tmp_path / "loop", EXAMPLES / "loop.c", folder, "-std=c99", *STRICT)
    assert re.match(r"6000 ticks, 0 braked, speeds at a bound [1-9]\d* times, error at most 0\.",
                    said(loop))


@pytest.mark.slow
@pytest.mark.skipif(CXX is None, reason="no compiler of C++")
def test_the_header_of_cxx_compiles_without_exceptions(folder, tmp_path):
    once = built(tmp_path / "once", EXAMPLES / "once.cpp", folder, "-std=c++17",
                 "-fno-exceptions", *STRICT, compiler=CXX)
    assert said(once) == "status 0, x = 0.9 0.1\n"


@pytest.mark.slow
@pytest.mark.skipif(CXX is None or not Path("/usr/include/eigen3").exists(), reason="no Eigen")
def test_the_example_with_eigen_compiles(folder, tmp_path):
    program = built(tmp_path / "eigen", EXAMPLES / "eigen.cpp", folder, "-std=c++17",
                    "-DTASK_HIERARCHY_EIGEN", "-isystem", "/usr/include/eigen3", compiler=CXX)
    assert said(program) == "status 0, x = 0.9 0.1\n"


@needs_c
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake")
@pytest.mark.parametrize("linked", ["task_hierarchy", "shared"])
def test_cmake_finds_it(folder, tmp_path, linked):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(once C)\n"
        "find_package(task_hierarchy 0.1.0 REQUIRED)\n"
        f"add_executable(once {EXAMPLES / 'once.c'})\n"
        f"target_link_libraries(once task_hierarchy::{linked})\n")
    out = tmp_path / "out"
    said("cmake", "-S", tmp_path, "-B", out, f"-DCMAKE_PREFIX_PATH={folder}")
    said("cmake", "--build", out)
    assert said(out / "once") == "status 0, x = 0.9 0.1\n"


@needs_c
@pytest.mark.slow
@pytest.mark.parametrize(("name", "resolver"), [("INEQ7", "hcod"), ("EQ7", "tpm")])
def test_a_million_solves_allocate_nothing_and_touch_no_new_page(folder, tmp_path, name, resolver):
    record_sequence(tmp_path / "ticks", sequence(family(name)[0].h, 100))
    program = built(tmp_path / "study", PROGRAM, folder, "-O2")
    solves, failed, allocated, faults, *_ = map(int, said(
        program, tmp_path / "ticks", resolver, "1000000").split())
    assert (solves, failed, allocated, faults) == (1_000_000, 0, 0, 0)


@needs_c
@pytest.mark.slow
def test_the_study_of_speed_prints_a_row_for_every_sequence(folder, tmp_path, capsys):
    rows = c_speed.run(tmp_path, turns=1, library=folder)
    assert all(row["c_median_us"] > 0.0 and row["ratio"] > 0.0 for row in rows)
    said = capsys.readouterr().out
    assert all(f"{row['problems']}, {row['resolver']}" in said for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ellipse-limits", "humanoid-reach", "dual-arm"])
def test_the_commands_of_a_scenario_come_out_of_c_to_the_last_bit(library, name, unverified):
    scenario = load(name)
    resolver, memory = scenario.make_resolver(), None
    damped, before = {"damping": resolver.damping}, None
    assert resolver == make(resolver.name, **damped)
    for h in recorded(name, 200):
        memory = memory or library.memory(h)
        before = check_same(library, (resolver.name, damped, damped), h, memory, before).memory


@needs_c
@pytest.mark.slow
def test_the_program_that_counts_allocations_sees_them(folder, tmp_path):
    source = tmp_path / "allocating.c"
    source.write_text(PROGRAM.read_text().replace(
        "double begin = now();", "double begin = now(); free(malloc(16));"))
    record_sequence(tmp_path / "ticks", sequence(family("EQ7")[0].h, 2))
    program = built(tmp_path / "study", source, folder, "-O0")
    assert int(said(program, tmp_path / "ticks", "hcod", "10").split()[2]) == 10


@needs_c
@pytest.mark.slow
def test_the_examples_pass_the_address_sanitizer(folder, tmp_path):
    program = built(tmp_path / "loop", EXAMPLES / "loop.c", folder, "-g",
                    "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    assert said(program).startswith("6000 ticks, 0 braked")


@needs_c
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
def test_the_examples_pass_valgrind(generic, tmp_path):
    """With the library for any x86-64, since valgrind knows no AVX-512."""
    program = built(tmp_path / "loop", EXAMPLES / "loop.c", generic, "-g")
    done = subprocess.run(["valgrind", "--error-exitcode=9", "--leak-check=full", program],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@needs_c
@pytest.mark.slow
def test_the_library_for_any_x86_64_agrees_to_rounding(generic):
    library = c.Library.linked(generic / "lib" / "libtask_hierarchy.so")
    for h in hierarchies(50):
        status, left = library.solve("hcod", h)
        x = make("hcod").solve(h).x
        assert status in (c.SOLVED, c.INACCURATE)
        assert np.abs(left.answer - x).max() <= 1e-12 * (1.0 + np.abs(x).max())


@pytest.mark.slow
def test_code_for_aarch64_is_made_here(tmp_path):
    written = write(tmp_path, ["recursive"], "aarch64")
    content = (tmp_path / "lib" / "libtask_hierarchy.a").read_bytes()
    elf = content[content.index(b"\x7fELF"):]
    assert int.from_bytes(elf[18:20], "little") == 183  # EM_AARCH64
    assert "aarch64" in written.shared
    assert "th_solve_sns" not in (tmp_path / "include" / "task_hierarchy.h").read_text()


@pytest.mark.slow
def test_header_and_library_state_the_same_version_and_digest(folder, library):
    header = (folder / "include" / "task_hierarchy.h").read_text()
    assert f'#define TH_VERSION "{library.text("th_version")}"' in header
    assert f'#define TH_DIGEST "{library.text("th_digest")}"' in header
    assert "@" not in header
    assert "Apache License" in (folder / "share/doc/task_hierarchy/LICENSE").read_text()


@pytest.mark.slow
def test_check_compares_the_kernels(folder, tmp_path, capsys):
    assert run_command(["library", "--check", "--out", str(folder)]) == 0
    assert "same kernels" in capsys.readouterr().out
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    header = other / "include" / "task_hierarchy.h"
    digest = re.search(r'TH_DIGEST "(\w+)"', header.read_text()).group(1)
    header.write_text(header.read_text().replace(digest, "0" * 16))
    assert "and libtask_hierarchy.a another" in differs(other)
    code = other / "lib" / "libtask_hierarchy.a"
    code.write_bytes(code.read_bytes().replace(digest.encode(), b"0" * 16))
    assert run_command(["library", "--check", "--out", str(other)]) == 1
    assert f"those installed have {digest}" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_writes_a_library(tmp_path, capsys):
    out = str(tmp_path / "lib")
    assert run_command(["library", "--out", out, "--resolvers", "recursive"]) == 0
    assert "libtask_hierarchy.a" in capsys.readouterr().out
    assert run_command(["library", "--out", out]) == 2
    assert "not empty" in capsys.readouterr().err


@pytest.mark.parametrize(("options", "words"), [
    (["--resolvers", "hcdo"], "did you mean 'hcod'"), (["--resolvers", "hqp"], "'hqp'"),
    (["--resolvers", "hcod,"], "empty name"), (["--target", "x86"], "did you mean 'x86_64'")])
def test_a_wrong_name_is_an_error_that_names_it(tmp_path, capsys, options, words):
    assert run_command(["library", "--out", str(tmp_path / "lib"), *options]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "lib").exists()


@pytest.mark.slow
@pytest.mark.parametrize("target", ["native", "x86_64"])
def test_kernels_that_are_not_compiled_are_an_error(tmp_path, target):
    done = subprocess.run(
        [sys.executable, "-m", "scenarios.cli.main", "library", "--target", target, "--out",
         tmp_path / "lib"], capture_output=True, text=True, check=False,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"})
    assert done.returncode == 2
    assert "NUMBA_DISABLE_JIT is set" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_folder_without_a_library_is_an_error(tmp_path):
    with pytest.raises(HierarchyError, match=r"task_hierarchy\.h is missing"):
        differs(tmp_path)


@pytest.mark.skipif(shutil.which("ar") is None, reason="no ar")
@pytest.mark.parametrize("content", [b"odd", b"even"])
def test_ar_reads_the_archive(tmp_path, content):
    file = tmp_path / "one.a"
    file.write_bytes(archive("one.o", content, ["first", "second"]))
    assert said("ar", "t", file) == "one.o\n"
    assert said("ar", "p", file, "one.o").encode() == content
    assert "first in one.o\nsecond in one.o" in said("nm", "--print-armap", file)
