"""Mutation testing: which single changes of the packages does no test notice?

    python tests/mutate.py --map                                     which test runs which line
    python tests/mutate.py --count 100 --seed 1                      samples all three packages
    python tests/mutate.py solvers/explain.py --count 10 --seed 0    samples one module

Each mutant is one change: a comparison, an arithmetic or boolean operator, a constant or a returned
value. Its module is replaced as it is imported, in the tests and in every program that they start;
the checkout is not touched, so kernels come from the cache. The tests are those that run the
changed line, by the map that --map makes with coverage (of all tests, or of those named by --tests;
once, and again when tests have changed), or --tests. Processes that tests start count as theirs. A
line that runs as its module is imported has the tests of its module, or SEEN if no other line of
it runs. Of many tests those of SEEN and MOST others are taken: a case of each function first, those
first that run few lines, FEW of which are asked before all others: four of five mutants end there.
A mutant that survives meets REFUSALS, each of whose cases is another check, and the WHOLE files
with the most of such tests: what a shared fixture runs counts only for the test that asked for it
first. Prints every survivor with its line, and the share of survivors. A mutant whose tests take
more CPU time than --limit at once counts as killed.

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
from importlib.util import find_spec
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
REFUSALS = "tests/hierarchy/test_wrong_values.py", "tests/scenarios/test_wrong_inputs.py"
COMPILED = ("compiled", "unlocked", "internal", "inlined", "measured")
# The folder of kernels, the integer codes that kernels read, and the LLVM code that they contain.
OF_KERNELS = ("solvers/kernels/", "solvers/status.py", "hierarchy/jit/intrinsics.py")

# Loaded by every Python that is started: takes the code of one module from a file.
HOOK = '''
import marshal, os
from importlib.machinery import SourceFileLoader
usual = SourceFileLoader.get_code

def get_code(loader, name):
    if name != os.environ.get("MUTANT_NAME"):
        return usual(loader, name)
    with open(os.environ["MUTANT_CODE"], "rb") as file:
        return marshal.load(file)

SourceFileLoader.get_code = get_code
'''

# The same while the map is made: notes what a test runs in another process.
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


def name_of(module: str) -> str:
    return module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


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
    """Tells coverage which test runs."""

    def __init__(self, coverage: Any) -> None:
        self.coverage = coverage

    def within(self, context: str) -> Iterator[None]:
        self.coverage.switch_context(context)
        os.environ["MAP_OF"] = context
        result = yield
        self.coverage.switch_context("")
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        return (yield from self.within(item.nodeid))

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Iterator[None]:
        """What a file of tests runs as it is imported, all of its tests depend on."""
        of = collector.nodeid if isinstance(collector, pytest.File) else ""
        return (yield from self.within(of))


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
                import_module(name_of(module))
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "sitecustomize.py").write_text(NOTED)
        os.environ |= {"PYTHONPATH": os.pathsep.join((folder, str(ROOT))), "MAP": str(MAP),
                       "MAPPED": ":".join(source), "MAP_OF": ""}
        code = pytest.main(["-q", "-p", "no:cacheprovider", "-n", "0", *tests],
                           [Contexts(coverage)])
    coverage.stop()
    coverage.save()
    coverage.combine([str(MAP.parent)])
    coverage.save()
    if code:
        sys.exit("the tests fail without any change")


@cache
def known() -> dict[str, dict[int, list[str]]]:
    """Return the tests of each line of each file, as the map has them."""
    from coverage import CoverageData

    data = CoverageData(str(MAP))
    data.read()
    return {file: data.contexts_by_lineno(file) for file in data.measured_files()}


@cache
def footprints() -> Counter[str]:
    """Return how many lines each test runs."""
    return Counter(test for lines in known().values() for tests in lines.values() for test in tests)


@cache
def lines_of(module: str) -> dict[int, tuple[str, ...]]:
    """Return the tests of each line of a module; of line 0 those that run any line of it."""
    lines = {line: tuple(tests) for line, tests in known().get(str(ROOT / module), {}).items()
             if "" not in tests}  # those run as the module is imported
    return lines | {0: tuple(sorted({test for tests in lines.values() for test in tests}))}


def tests_of(mutant: Mutant) -> list[tuple[str, ...]]:
    """Return the tests that run the line of a mutant, and then files of them."""
    line = (ROOT / mutant.module).read_text().splitlines()[mutant.line - 1]
    records = ("tests/project/test_project.py::"
               "test_records_are_frozen_and_what_they_compute_is_neither_shown_nor_compared",)
    keys = (f"{SEEN}::test_what_is_seen_is_as_it_was[computed defaults]",
            "tests/scenarios/test_config.py")[:1 + mutant.module.startswith("scenarios/config/")]
    if "frozen=" in line:
        return [(*records, keys[0])]
    lines = lines_of(mutant.module)
    if not lines[0]:
        return [(SEEN,)]
    default = not lines.get(mutant.line)
    seen, order = Counter[str](), dict[str, tuple[int, int]]()
    for test in sorted(lines.get(mutant.line) or lines[0]):
        function = test.partition("[")[0]
        order[test] = seen[function], footprints()[test]
        seen[function] += 1
    first = [test for test in order if test.startswith(SEEN)]  # much in little time
    others = sorted(order.keys() - {*first}, key=order.__getitem__)[:MOST]
    files = Counter(test.partition("::")[0] for test in order.keys() - {*first})
    whole = [file for file in REFUSALS if file in files] + [
        file for file, _ in files.most_common(WHOLE) if file not in REFUSALS]
    groups = (tuple(others[:FEW]),
              ("field(" in line) * records + default * keys + (*first, *others[FEW:]),
              *((file,) for file in whole))
    return [group for group in groups if group]


@dataclass(frozen=True)
class Runner:
    """Runs tests in a process of their own, with one module replaced in all that they start."""

    folder: Path
    limit: int  # CPU time [s]

    def passes(self, tests: tuple[str, ...], **environment: str) -> bool:
        """Whether tests pass with this environment, in time."""
        path = os.pathsep.join((str(self.folder), str(ROOT)))
        with (self.folder / "output").open("w") as output, subprocess.Popen(
                [sys.executable, "-m", "pytest", "-qx", "-n0", "-pno:cacheprovider", *tests],
                cwd=ROOT, stdout=output, stderr=output, start_new_session=True,
                preexec_fn=partial(resource.setrlimit, resource.RLIMIT_CPU, (self.limit,) * 2),
                env={**os.environ, "PYTHONPATH": path, **environment},
        ) as process:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(2.0 * self.limit)  # one that waits for ever
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        if "\nERROR: not found: " in (self.folder / "output").read_text():
            sys.exit("tests of the map are gone or have other names: python tests/mutate.py --map")
        return process.returncode in (0, 5)  # 5: nothing was to be run

    def survives(self, module: str, code: CodeType, tests: tuple[str, ...]) -> bool:
        """Whether the tests pass with this code of a module."""
        (self.folder / "sitecustomize.py").write_text(HOOK)
        (self.folder / "mutant").write_bytes(marshal.dumps(code))
        return self.passes(tests, MUTANT_NAME=name_of(module),
                           MUTANT_CODE=str(self.folder / "mutant"))


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
        alive = _try(sample, options.tests, Runner(Path(folder), options.limit))
    print(f"{alive} of {len(sample)} mutants survived: {alive / len(sample):.0%} "
          f"(of {len(every)} possible, seed {options.seed})")


def _try(sample: list[Mutant], tests: list[str] | None, runner: Runner) -> int:
    """Return how many mutants survive, and print them."""
    first = tuple(tests or tests_of(sample[0])[0])
    if not runner.passes(first):
        sys.exit(f"{(runner.folder / 'output').read_text()}\n{first} fails without any change")
    if runner.survives(sample[0].module, compile("raise ImportError", "", "exec"), first):
        sys.exit("the tests pass without the module")
    alive = 0
    for done, mutant in enumerate(sample, 1):
        described, code = mutant.code()
        survived = all(runner.survives(mutant.module, code, some)
                       for some in ([tuple(tests)] if tests else tests_of(mutant)))
        alive += survived
        if survived:
            print(f"survived: {done}: {mutant.module}:{mutant.line}: {described}", flush=True)
        print(f"{done} of {len(sample)} tried, {alive} survived", file=sys.stderr, flush=True)
    return alive


if __name__ == "__main__":
    main()
