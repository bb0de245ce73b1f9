"""Mutation testing: which single changes of the packages does no test notice?

    python tests/mutate.py --count 100 --seed 1                      samples all modules below
    python tests/mutate.py solvers/explain.py --count 10 --seed 0    samples one module

Each mutant is one change: a comparison, an arithmetic or boolean operator, a constant or a returned
value. Its module is replaced as it is imported, in the tests and in every program that they start;
the checkout is not touched, so kernels come from the cache. The tests are those of `TESTS`, or of
--tests: first those not marked slow, then, where these pass, the slow ones. Prints every survivor
with its line, and the share of survivors. A mutant that takes over three times the CPU time
of the unchanged tests, and 20 s, counts as killed.

Not mutated: compiled kernels and the numbers they read (each mutant would compile for minutes),
`strict=` of zip (a check that does not fire where shapes have been checked), what only a type
checker reads, and solvers/batch/on_jax.py where jax is not installed.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import marshal
import math
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import CodeType

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported
os.environ.setdefault("MPLBACKEND", "Agg")

ROOT = Path(__file__).parents[1]
SAMPLED = ("hierarchy", "solvers", "scenarios/measure")
COMPILED = ("compiled", "unlocked", "inlined")
# The folder of kernels, and the integer codes that kernels read.
OF_KERNELS = ("solvers/kernels/", "solvers/status.py")

# Test files of a module or a folder, quickest first; the longest path that fits counts.
TESTS = {
    "hierarchy/": "hierarchy/test_robot hierarchy/test_stack",
    "hierarchy/activation": "solvers/test_smooth",
    "hierarchy/allocation": "hierarchy/test_allocation scenarios/test_hierarchical",
    "hierarchy/avoidance/": "hierarchy/test_avoidance hierarchy/test_danger_bounds",
    "hierarchy/avoidance/barrier": "hierarchy/test_separation hierarchy/test_self_collision",
    "hierarchy/avoidance/pairs": "hierarchy/test_separation",
    "hierarchy/avoidance/self_collision": "hierarchy/test_self_collision hierarchy/test_models",
    "hierarchy/contacts": "hierarchy/test_contacts",
    "hierarchy/jit/": "hierarchy/test_jit hierarchy/test_stack hierarchy/test_limits",
    "hierarchy/jit/exporting": "solvers/test_library",
    "hierarchy/kinematics": "hierarchy/test_tasks",
    "hierarchy/limits": "hierarchy/test_limits hierarchy/test_danger_bounds",
    "hierarchy/loop/": "hierarchy/test_loop",
    "hierarchy/notebook": "scenarios/test_notebooks",
    "hierarchy/paths": "hierarchy/test_paths hierarchy/test_tasks scenarios/test_continuing",
    "hierarchy/plugins": "scenarios/test_plugins",
    "hierarchy/problem": "hierarchy/test_problem solvers/test_wrong_types solvers/test_resolver "
                         "solvers/test_give scenarios/test_notebooks",
    "hierarchy/robot": "hierarchy/test_robot hierarchy/test_models",
    "hierarchy/robots/": "hierarchy/test_robot hierarchy/test_models "
                         "hierarchy/test_self_collision scenarios/test_humanoid",
    "hierarchy/stack": "hierarchy/test_stack hierarchy/test_tasks solvers/test_wrong_types "
                       "solvers/test_give hierarchy/test_contacts",
    "hierarchy/state": "hierarchy/test_robot hierarchy/test_stack hierarchy/test_tasks "
                       "solvers/test_wrong_types hierarchy/test_contacts",
    "hierarchy/task": "hierarchy/test_stack hierarchy/test_tasks solvers/test_wrong_types",
    "hierarchy/tasks/": "hierarchy/test_tasks solvers/test_wrong_types scenarios/test_humanoid",
    "hierarchy/tasks/avoidance": "hierarchy/test_tasks hierarchy/test_avoidance",
    **{f"hierarchy/tasks/{name}": "hierarchy/test_contacts solvers/test_whole_body"
       for name in ("base_dynamics", "centre_of_pressure", "contact_force", "contact_motion",
                    "forces", "friction", "least_force", "momentum", "together")},
    **{f"hierarchy/tasks/{name}": "hierarchy/test_tasks scenarios/test_listed_kinds"
       for name in ("coupling", "geometric", "look_at", "manipulability", "relative")},
    "hierarchy/tasks/cumulated_repulsion": "hierarchy/test_cumulated_repulsion",
    "hierarchy/tasks/danger_bounds": "hierarchy/test_danger_bounds hierarchy/test_models",
    "hierarchy/tasks/joint_limits": "hierarchy/test_limits hierarchy/test_models",
    "hierarchy/tasks/posture": "hierarchy/test_tasks hierarchy/test_models",
    "hierarchy/tasks/self_separation": "hierarchy/test_self_collision",
    "hierarchy/tasks/separation": "hierarchy/test_separation",
    "hierarchy/tasks/tangent_cone": "scenarios/test_rivals",
    "hierarchy/tasks/torque_limits": "hierarchy/test_limits hierarchy/test_contacts",
    "scenarios/measure/": "scenarios/test_parting scenarios/test_report",
    "scenarios/measure/goals": "scenarios/test_goals",
    "scenarios/measure/verdict": "scenarios/test_goals",
    "scenarios/measure/tracking": "scenarios/test_metrics scenarios/test_singular",
    "scenarios/measure/safety": "scenarios/test_metrics scenarios/test_plants",
    "scenarios/measure/computing": "scenarios/test_metrics scenarios/test_faults",
    "scenarios/measure/metric": "scenarios/test_metrics",
    "scenarios/measure/run_folder": "scenarios/test_recording scenarios/test_plants",
    "scenarios/measure/statistics": "scenarios/test_statistics",
    "scenarios/measure/metrics": "scenarios/test_metrics scenarios/test_hierarchical "
                                 "scenarios/test_plants scenarios/test_faults",
    "solvers/": "solvers/test_resolver solvers/test_wrong_types solvers/test_contract",
    "solvers/adapters/": "solvers/test_adapters",
    "solvers/batch/": "solvers/test_batch",
    "solvers/certificate": "solvers/test_certificate solvers/test_contract",
    "solvers/explain": "solvers/test_hcod",
    "solvers/factorization/": "solvers/test_factorization",
    "solvers/give": "solvers/test_give",
    "solvers/ik": "solvers/test_ik solvers/test_wrong_types",
    "solvers/library/": "solvers/test_library solvers/test_library_inputs "
                        "solvers/test_library_programs",
    "solvers/metric": "solvers/test_metric",
    "solvers/problems/": "solvers/test_problems scenarios/test_problem_families",
    "solvers/problems/kinds": "solvers/test_problem_kinds solvers/test_problems",
    "solvers/qp/": "solvers/test_hqp solvers/test_failures solvers/test_contract",
    "solvers/qp/programs": "solvers/test_adapters solvers/test_hqp solvers/test_contract",
    **{f"solvers/resolvers/{name}": f"solvers/test_resolver {own} solvers/test_contract"
       for name, own in {
           "augmented": "", "hcod": "solvers/test_hcod",
           "hqp": "solvers/test_hqp solvers/test_failures",
           "recursive": "solvers/test_recursive solvers/test_dampings_of_recursive",
           "reverse": "solvers/test_reverse", "saturation": "solvers/test_sns",
           "set_based": "solvers/test_set_based", "smooth": "solvers/test_smooth",
           "sns": "solvers/test_sns", "tpm": "solvers/test_tpm solvers/test_tpm_limits",
           "weighted": "solvers/test_weighted"}.items()},
    "solvers/workspace": "solvers/test_workspace solvers/test_tpm_limits",
}

IMPORTED_ONCE = ("numpy", "numba", "numba.np.arraymath", "scipy.optimize", "scipy.stats",
                 "scipy.spatial.transform", "pinocchio", "qpsolvers", "osqp", "matplotlib.pyplot",
                 "pydantic", "typer", "rich.console", "jinja2", "mujoco")

# Loaded by every Python that is started: takes the code of one module from a file.
HOOK = '''
import marshal, os, sys
from importlib.machinery import SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path

class Loader(SourceFileLoader):
    def get_code(self, fullname):
        return marshal.loads(Path(os.environ["MUTANT_CODE"]).read_bytes())

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == os.environ["MUTANT_NAME"]:
            file = os.environ["MUTANT_FILE"]
            return spec_from_file_location(name, file, loader=Loader(name, file))

if "MUTANT_NAME" in os.environ:
    sys.meta_path.insert(0, Finder)
'''

SWAPS = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
         ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn,
         ast.NotIn: ast.In, ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div,
         ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}


@dataclass(frozen=True)
class Mutant:
    """One change: of the node with this index in `ast.walk` over the module."""

    module: str
    line: int
    index: int
    kind: str

    def code(self) -> tuple[str, CodeType]:
        """Return what was and what is, and the changed module; lines stay where they are."""
        tree = parsed(self.module)
        described = change(list(ast.walk(tree))[self.index], self.kind)
        tree = ast.fix_missing_locations(tree)
        return described, compile(tree, str(ROOT / self.module), "exec")


def parsed(module: str) -> ast.Module:
    return ast.parse((ROOT / module).read_text())


def modules() -> list[str]:
    """Return every module that is sampled, relative to the root."""
    files = sorted(file for folder in SAMPLED for file in (ROOT / folder).rglob("*.py"))
    names = [file.relative_to(ROOT).as_posix() for file in files]
    left_out = OF_KERNELS if find_spec("jax") else (*OF_KERNELS, "solvers/batch/on_jax.py")
    return [name for name in names if not name.startswith(left_out)]


def mutants(module: str) -> Iterator[Mutant]:
    """Yield every mutant of a module."""
    tree = parsed(module)
    left_out = {id(node) for top in ast.walk(tree) if untested(top) for node in ast.walk(top)}
    for index, node in enumerate(ast.walk(tree)):
        if id(node) not in left_out:
            for kind in changes(node):
                yield Mutant(module, node.lineno, index, kind)


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
    return isinstance(node, ast.FunctionDef) and any(
        isinstance(mark, ast.Name) and mark.id in COMPILED for mark in node.decorator_list)


@cache
def read_by_kernels() -> frozenset[str]:
    """Return every name that a kernel of the packages reads."""
    files = [file for folder in ("hierarchy", "solvers", "scenarios")
             for file in (ROOT / folder).rglob("*.py")]
    kernels = [node for file in files for node in ast.parse(file.read_text()).body
               if is_kernel(node)]
    return frozenset(node.id for kernel in kernels for node in ast.walk(kernel)
                     if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load))


def changes(node: ast.AST) -> tuple[str, ...]:
    """Return the kinds of change that a node allows."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
        return ("compare",)
    if isinstance(node, (ast.BinOp, ast.BoolOp)) and type(node.op) in SWAPS:
        return ("operator",)
    if isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float)):
        return ("constant",)
    if isinstance(node, ast.Return) and not isinstance(node.value, (ast.Constant, type(None))):
        return ("return",)
    return ()


def change(node: ast.AST, kind: str) -> str:
    """Change a node in place and return what it was and what it is."""
    before = ast.unparse(node)
    if kind == "compare":
        node.ops[0] = SWAPS[type(node.ops[0])]()
    elif kind == "operator":
        node.op = SWAPS[type(node.op)]()
    elif kind == "constant":
        node.value = _other(node.value)
    else:
        node.value = ast.Constant(None)
    return f"{before}  ->  {ast.unparse(node)}"


def _other(value: bool | int | float) -> bool | int | float:
    """Return another constant: the other truth value, the next integer, or zero (one for zero)."""
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) else float(value == 0.0)


def tests_of(mutant: Mutant) -> tuple[str, ...]:
    """Return the test files of a mutant, relative to the root."""
    line = (ROOT / mutant.module).read_text().splitlines()[mutant.line - 1]
    records = ("tests/project/test_records.py",)
    if "frozen=" in line:
        return records
    path = max((path for path in TESTS if mutant.module.startswith(path)), key=len)
    return ("field(" in line) * records + tuple(f"tests/{name}.py" for name in TESTS[path].split())


class Runner:
    """Runs tests with one module replaced, each time in a fork of this process.

    What the packages import from elsewhere is imported before, once, and so are the kernels with
    what they import; a mutant of one of these modules makes a fork import all packages anew.
    """

    def __init__(self, folder: Path, limit: float) -> None:
        self.folder, self.limit = folder, limit
        self.seconds: dict[tuple[str, str], float] = {}
        (folder / "sitecustomize.py").write_text(HOOK)
        for name in IMPORTED_ONCE:
            with contextlib.suppress(ImportError):
                import_module(name)
        sys.path.insert(0, str(ROOT))
        for file in sorted((ROOT / "solvers" / "kernels").glob("*.py")):
            import_module(f"solvers.kernels.{file.stem}")

    def unchanged(self, test: str, mark: str) -> float:
        """Return the CPU time of a test file on the packages as they are [s]; exit if it fails."""
        if (test, mark) not in self.seconds:
            passed, self.seconds[test, mark] = self._run([test], mark, {}, self.limit)
            if not passed:
                sys.exit(f"{(self.folder / 'output').read_text()}\n{test} ({mark}) fails without "
                         f"any change, or takes over {self.limit:g} s")
        return self.seconds[test, mark]

    def survives(self, module: str, code: CodeType, tests: tuple[str, ...]) -> bool:
        """Whether the tests pass with this code of a module."""
        (self.folder / "mutant").write_bytes(marshal.dumps(code))
        name = module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        environment = {"MUTANT_NAME": name, "MUTANT_FILE": str(ROOT / module),
                       "MUTANT_CODE": str(self.folder / "mutant")}
        for mark in ("not slow", "slow"):
            limit = 20.0 + 3.0 * sum(self.unchanged(test, mark) for test in tests)
            if not self._run([*tests], mark, environment, limit)[0]:
                return False
        return True

    def _run(self, tests: list[str], mark: str, environment: dict[str, str],
             limit: float) -> tuple[bool, float]:
        """Return whether the tests pass, and their CPU time [s], which `limit` bounds."""
        child = os.fork()
        if child == 0:
            try:
                self._become(environment, math.ceil(limit))
                code = int(pytest.main(["-q", "-x", "-p", "no:cacheprovider", "-m", mark, *tests]))
            except BaseException:
                traceback.print_exc()
                code = 1
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)
        code, used = _ended(child, 20.0 * limit)
        return code in (0, 5), used.ru_utime + used.ru_stime  # 5: no test has this mark

    def _become(self, environment: dict[str, str], limit: int) -> None:
        """Make this fork what a fresh Python in a session of its own would be."""
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        output = os.open(self.folder / "output", os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(output, stream)
        os.chdir(ROOT)
        path = [str(self.folder), str(ROOT)]
        os.environ.update(environment, PYTHONPATH=os.pathsep.join(path), PYTHONSAFEPATH="1")
        sys.path[:] = [*path, *(place for place in sys.path if place != str(ROOT / "tests"))]
        if environment.get("MUTANT_NAME") in sys.modules:
            for name in [*sys.modules]:
                if name.partition(".")[0] in ("hierarchy", "solvers", "scenarios"):
                    del sys.modules[name]
        exec(HOOK, {})


def _ended(child: int, limit: float) -> tuple[int, resource.struct_rusage]:
    """Wait for a fork, end it and all that it started; return its exit status and its usage."""
    end = time.monotonic() + limit
    pid = 0
    while pid == 0:
        pid, status, used = os.wait4(child, os.WNOHANG)
        if pid == 0 and time.monotonic() > end:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    return os.waitstatus_to_exitcode(status), used


def main() -> None:
    """Try a random sample of mutants; exit with 1 if the tests fail unchanged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="*", help="files to change, relative to the root")
    parser.add_argument("--tests", nargs="+", help="test files, in place of those in TESTS")
    parser.add_argument("--count", type=int, default=10, help="mutants to try")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--start", type=int, default=1, metavar="N",
                        help="leave out what comes before mutant N of the sample")
    parser.add_argument("--limit", type=float, default=900.0,
                        help="CPU time limit of an unchanged test file [s]")
    options = parser.parse_args()
    every = [mutant for module in options.modules or modules() for mutant in mutants(module)]
    sample = random.Random(options.seed).sample(every, min(options.count, len(every)))
    with tempfile.TemporaryDirectory() as folder:
        alive = _try(sample, options.start, options.tests, Runner(Path(folder), options.limit))
    tried = len(sample) - options.start + 1
    print(f"{alive} of {tried} mutants survived: {alive / tried:.0%} "
          f"(of {len(every)} possible, seed {options.seed})")


def _try(sample: list[Mutant], start: int, tests: list[str] | None, runner: Runner) -> int:
    """Return how many mutants from `start` on survive, and print them."""
    broken = compile("raise ImportError", "broken", "exec")
    if runner.survives(sample[0].module, broken, tuple(tests or tests_of(sample[0]))):
        sys.exit("the tests pass without the module")
    alive = 0
    for done, mutant in enumerate(sample[start - 1:], start):
        described, code = mutant.code()
        survived = runner.survives(mutant.module, code, tuple(tests or tests_of(mutant)))
        alive += survived
        if survived:
            print(f"survived: {done}: {mutant.module}:{mutant.line}: {described}", flush=True)
        print(f"{done} of {len(sample)} tried, {alive} survived", file=sys.stderr, flush=True)
    return alive


if __name__ == "__main__":
    main()
