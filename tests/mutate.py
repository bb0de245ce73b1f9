"""Mutation testing: which single changes of the packages does no test notice?

    python tests/mutate.py --map                                     which test runs which line
    python tests/mutate.py --count 100 --seed 1                      samples all three packages
    python tests/mutate.py solvers/explain.py --count 10 --seed 0    samples one module

Each mutant is one change: a comparison, an arithmetic or boolean operator, a constant or a returned
value. Its module is replaced as it is imported, in the tests and in every program that they start;
the checkout is not touched, so kernels come from the cache. The tests are those that run the
changed line, by the map that --map makes with coverage (of all tests, or of those named by --tests;
once, and again when tests have changed), or --tests. Processes that tests start count as theirs. A
line that runs as its module is imported has DEFAULTS and the tests of its module. FEW tests are
asked before all others, a case of each function first, those first that run few lines: four of five
mutants end there. Then come those of SEEN, which tell much in little time, MOST others, and the
WHOLE files with the most of such tests: what a shared fixture runs counts only for the test that
asked for it first. Prints every survivor with its line, and the share of survivors. A mutant whose
tests take more CPU time than --limit at once counts as killed.

Not mutated: compiled kernels and the numbers they read (each mutant would compile for minutes),
`strict=` of zip (a check that does not fire where shapes have been checked), what only a type
checker reads, and solvers/batch/on_jax.py where jax is not installed.
"""

import argparse
import ast
import contextlib
import marshal
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from importlib.util import MAGIC_NUMBER, find_spec
from pathlib import Path
from types import CodeType
from typing import Any

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported
os.environ.setdefault("MPLBACKEND", "Agg")

ROOT = Path(__file__).parents[1]
sys.path[0] = str(ROOT)  # beside this file are folders of tests with the names of the packages
SAMPLED = ("hierarchy", "solvers", "scenarios")
FILES = sorted(file for folder in SAMPLED for file in (ROOT / folder).rglob("*.py"))
MAP = ROOT / "build" / "tests-of-lines"
FEW, MOST, WHOLE = 8, 40, 6  # tests of a mutant, beside those of SEEN, and then files of tests
SEEN = "tests/scenarios/test_seen.py"
DEFAULTS = (f"{SEEN}::test_what_is_seen_is_as_it_was[computed defaults]",
            "tests/scenarios/test_config.py", "tests/project/test_project.py::"
            "test_records_are_frozen_and_what_they_compute_is_neither_shown_nor_compared")
COMPILED = ("compiled", "unlocked", "internal", "inlined", "measured")
# The folder of kernels, the integer codes that kernels read, and the LLVM code that they contain.
OF_KERNELS = ("solvers/kernels/", "solvers/status.py", "hierarchy/jit/intrinsics.py")

# Loaded by every Python that is started while the map is made: notes what a test runs there.
NOTED = '''
import atexit, os
from coverage import Coverage

noted = Coverage(os.environ["MAP"], data_suffix=True, source=os.environ["MAPPED"].split(":"),
                 context=os.environ["MAP_OF"])
noted.start()
atexit.register(lambda: (noted.stop(), noted.save()))
'''

SWAPS = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
         ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn,
         ast.NotIn: ast.In, ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div,
         ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}
CHANGED = (ast.Compare, ast.BinOp, ast.BoolOp, ast.Constant, ast.Return)


@dataclass(frozen=True)
class Mutant:
    """One change: of the node with this index in `ast.walk` over the module."""

    module: str
    line: int
    index: int

    def code(self) -> tuple[str, CodeType]:
        """Return what was and what is, and the changed module; lines stay where they are."""
        tree = parsed(self.module)
        described = change(list(ast.walk(tree))[self.index])
        tree = ast.fix_missing_locations(tree)
        return described, compile(tree, str(ROOT / self.module), "exec")


def parsed(module: str) -> ast.Module:
    return ast.parse((ROOT / module).read_text())


def modules() -> list[str]:
    """Return every module that is sampled, relative to the root."""
    names = [file.relative_to(ROOT).as_posix() for file in FILES]
    left_out = OF_KERNELS if find_spec("jax") else (*OF_KERNELS, "solvers/batch/on_jax.py")
    return [name for name in names if not name.startswith(left_out)]


def mutants(module: str) -> Iterator[Mutant]:
    """Yield every mutant of a module."""
    tree = parsed(module)
    left_out = {id(node) for top in ast.walk(tree) if untested(top) for node in ast.walk(top)}
    for index, node in enumerate(ast.walk(tree)):
        if id(node) not in left_out and isinstance(node, CHANGED) and change(node):
            yield Mutant(module, node.lineno, index)


def untested(node: ast.AST) -> bool:
    """Whether a node and all inside it stays as it is, for the reasons in the module's text."""
    if isinstance(node, ast.keyword):
        return node.arg == "strict"
    if isinstance(node, ast.If):
        return ast.unparse(node.test) == "TYPE_CHECKING"
    if isinstance(node, ast.Assign):
        named = {name.id for name in ast.walk(node.targets[0]) if isinstance(name, ast.Name)}
        return not named.isdisjoint(read_by_kernels()) and node.col_offset == 0
    return is_kernel(node)


def is_kernel(node: ast.AST) -> bool:
    """Whether a function is compiled: it says so, or has no types, as those that others compile."""
    if not isinstance(node, ast.FunctionDef):
        return False
    typed = node.returns or any(one.annotation for one in node.args.args)
    return not typed or any(isinstance(mark, ast.Name) and mark.id in COMPILED
                            for mark in node.decorator_list)


@cache
def read_by_kernels() -> frozenset[str]:
    """Return every name that a kernel of the packages reads."""
    kernels = [node for file in FILES for node in ast.parse(file.read_text()).body
               if is_kernel(node)]
    return frozenset(node.id for kernel in kernels for node in ast.walk(kernel)
                     if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load))


def change(node: ast.AST) -> str:
    """Change a node in place and return what it was and what it is; nothing if it stays."""
    before = ast.unparse(node)
    match node:
        case ast.Compare(ops=[op, *_]) if type(op) in SWAPS:
            node.ops[0] = SWAPS[type(op)]()
        case ast.BinOp(op=op) | ast.BoolOp(op=op) if type(op) in SWAPS:
            node.op = SWAPS[type(op)]()
        case ast.Constant(value=bool(value)):
            node.value = not value
        case ast.Constant(value=int(value)):
            node.value = value + 1
        case ast.Constant(value=float(value)):
            node.value = float(value == 0.0)
        case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
            node.value = ast.Constant(None)
        case _:
            return ""
    return f"{before}  ->  {ast.unparse(node)}"


class Contexts:
    """Tells coverage which test runs; files of tests have been imported by then."""

    def __init__(self, coverage: Any) -> None:
        self.coverage = coverage

    def pytest_collection_finish(self) -> None:
        self.coverage.start()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.coverage.switch_context(nodeid)
        os.environ["MAP_OF"] = nodeid


def write_map(tests: list[str]) -> None:
    """Run tests, and keep which of them run which line."""
    from coverage import Coverage

    MAP.parent.mkdir(exist_ok=True)
    source = [str(ROOT / name) for name in SAMPLED]
    coverage = Coverage(str(MAP), source=source)
    coverage.start()
    for module in modules():  # what these run as they are imported, is of no test
        with contextlib.suppress(ImportError):
            if not module.endswith("__main__.py"):
                import_module(module[:-3].removesuffix("/__init__").replace("/", "."))
    coverage.stop()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "sitecustomize.py").write_text(NOTED)
        os.environ |= {"PYTHONPATH": os.pathsep.join((folder, str(ROOT))), "MAP": str(MAP),
                       "MAPPED": ":".join(source)}
        code = pytest.main(["-q", "-p", "no:cacheprovider", "-n", "0", *tests],
                           [Contexts(coverage)])
    coverage.stop()
    coverage.save()
    coverage.combine([str(MAP.parent)])
    coverage.save()
    if code:
        sys.exit("the tests fail without any change")


@cache
def known() -> dict[str, dict[int, set[str]]]:
    """Return the tests of each line of each module that does not run as the module is imported."""
    from coverage import CoverageData

    data = CoverageData(str(MAP))
    data.read()
    return {module: {line: {*tests} for line, tests in data.contexts_by_lineno(
        str(ROOT / module)).items() if "" not in tests} for module in modules()}


@cache
def footprints() -> Counter[str]:
    """Return how many lines each test runs."""
    return Counter(test for lines in known().values() for tests in lines.values() for test in tests)


def tests_of(mutant: Mutant) -> list[tuple[str, ...]]:
    """Return the tests that run the line of a mutant, and then files of them."""
    lines = known()[mutant.module]
    default = mutant.line not in lines
    every = set().union(*lines.values()) if default else lines[mutant.line]
    seen, order = Counter[str](), dict[str, tuple[int, int]]()
    for test in sorted(every):
        function = test.partition("[")[0]
        order[test] = seen[function], footprints()[test]
        seen[function] += 1
    first = [test for test in order if test.startswith(SEEN)]
    others = sorted(order.keys() - {*first}, key=order.__getitem__)[:MOST]
    files = Counter(test.partition("::")[0] for test in order.keys() - {*first})
    groups = (tuple(others[:FEW]), (*(DEFAULTS if default else ()), *first, *others[FEW:]),
              *((file,) for file, _ in files.most_common(WHOLE)))
    return [group for group in groups if group]


def passes(folder: Path, limit: int, tests: tuple[str, ...]) -> bool:
    """Whether tests pass in a process with the byte code of a folder, in this CPU time [s]."""
    with (folder / "output").open("w") as output, subprocess.Popen(
            [sys.executable, "-m", "pytest", "-qx", "-n0", "-pno:cacheprovider", *tests],
            cwd=ROOT, stdout=output, stderr=output, start_new_session=True,
            preexec_fn=partial(resource.setrlimit, resource.RLIMIT_CPU, (limit,) * 2),
            env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONPYCACHEPREFIX": str(folder)},
    ) as process:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(2.0 * limit)  # one that waits for ever
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    if "\nERROR: not found: " in (folder / "output").read_text():
        sys.exit("tests of the map are gone or have other names: python tests/mutate.py --map")
    return process.returncode in (0, 5)  # 5: nothing was to be run


def survives(folder: Path, limit: int, mutant: Mutant, code: CodeType,
             groups: list[tuple[str, ...]]) -> bool:
    """Whether all tests pass with this byte code of the module of a mutant."""
    file = Path(f"{folder}{ROOT / mutant.module}").with_suffix(
        f".{sys.implementation.cache_tag}.pyc")
    file.parent.mkdir(parents=True, exist_ok=True)
    unchecked = (1).to_bytes(4, "little") + bytes(8)  # the source may be another one
    file.write_bytes(MAGIC_NUMBER + unchecked + marshal.dumps(code))
    survived = all(passes(folder, limit, tests) for tests in groups)
    file.unlink()
    return survived


def main() -> None:
    """Try a random sample of mutants; exit with 1 if the tests fail unchanged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="*", help="files to change, relative to the root")
    parser.add_argument("--tests", nargs="+", help="tests, in place of those of the map")
    parser.add_argument("--map", action="store_true", help="make the map of tests and end")
    parser.add_argument("--count", type=int, default=10, help="mutants to try")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--limit", type=int, default=300,
                        help="CPU time that the tests of a mutant have at once [s]")
    options = parser.parse_args()
    if options.map:
        write_map(options.tests or ["tests"])
        return
    if not (MAP.exists() or options.tests):
        sys.exit(f"{MAP} is missing: python tests/mutate.py --map")
    every = [mutant for module in options.modules or modules() for mutant in mutants(module)]
    sample = random.Random(options.seed).sample(every, min(options.count, len(every)))
    with tempfile.TemporaryDirectory() as folder:
        alive = _try(sample, options.tests, Path(folder), options.limit)
    print(f"{alive} of {len(sample)} mutants survived: {alive / len(sample):.0%} "
          f"(of {len(every)} possible, seed {options.seed})")


def _try(sample: list[Mutant], tests: list[str] | None, folder: Path, limit: int) -> int:
    """Return how many mutants survive, and print them."""
    groups = [[tuple(tests)] if tests else tests_of(mutant) for mutant in sample]
    first = groups[0][0]
    if not passes(folder, limit, first):
        sys.exit(f"{(folder / 'output').read_text()}\n{first} fails without any change")
    if survives(folder, limit, sample[0], compile("raise ImportError", "", "exec"), [first]):
        sys.exit("the tests pass without the module")
    alive = 0
    for done, (mutant, asked) in enumerate(zip(sample, groups, strict=True), 1):
        described, code = mutant.code()
        survived = survives(folder, limit, mutant, code, asked)
        alive += survived
        if survived:
            print(f"survived: {done}: {mutant.module}:{mutant.line}: {described}", flush=True)
        print(f"{done} of {len(sample)} tried, {alive} survived", file=sys.stderr, flush=True)
    return alive


if __name__ == "__main__":
    main()
