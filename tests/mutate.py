"""Mutation testing: which single changes of a module does no test notice?

    python tests/mutate.py solvers/explain.py --tests tests/solvers/test_hcod.py --count 10 --seed 0

Each mutant is one change (a comparison, an arithmetic or boolean operator, a constant, a returned
value) in a temporary copy of the packages, which comes first on PYTHONPATH. Prints every survivor
with its line, and the share of survivors. A mutant that runs past the time limit counts as killed.
Compiled kernels are not mutated: each mutant would compile for minutes.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("hierarchy", "solvers", "scenarios")
SWAPS = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
         ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn,
         ast.NotIn: ast.In, ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div,
         ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}


def mutants(source: str) -> Iterator[tuple[int, str, str]]:
    """Yield line, description and source of every mutant."""
    for index, node in enumerate(ast.walk(ast.parse(source))):
        for kind in changes(node):
            tree = ast.parse(source)
            described = change(list(ast.walk(tree))[index], kind)
            yield node.lineno, described, ast.unparse(tree)


def changes(node: ast.AST) -> tuple[str, ...]:
    """Return the kinds of change that a node allows."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
        return ("compare",)
    if isinstance(node, (ast.BinOp, ast.BoolOp)) and type(node.op) in SWAPS:
        return ("operator",)
    if isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float)):
        return ("constant",)
    if isinstance(node, ast.Return) and node.value is not None:
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


def survives(copy: Path, tests: list[str], limit: float) -> bool:
    """Whether the tests pass on the packages in `copy`."""
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONSAFEPATH": "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider",
               *(str(ROOT / test) for test in tests)]
    try:
        run = subprocess.run(command, cwd=copy, env=environment, capture_output=True,
                             timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return False
    return run.returncode == 0


def fresh_copy() -> Path:
    """Copy the packages, always to the same place: compiled kernels are cached by their path."""
    copy = Path(tempfile.gettempdir()) / "task-hierarchy-mutants"
    shutil.rmtree(copy, ignore_errors=True)
    for package in PACKAGES:
        shutil.copytree(ROOT / package, copy / package,
                        ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def main() -> None:
    """Try a random sample of the mutants of one module; exit with 1 if the tests fail unchanged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("module", help="file to change, relative to the root of the checkout")
    parser.add_argument("--tests", nargs="+", required=True, help="test files of that module")
    parser.add_argument("--count", type=int, default=10, help="mutants to try")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--limit", type=float, default=300.0, help="time limit per mutant [s]")
    options = parser.parse_args()
    source = (ROOT / options.module).read_text()
    every = list(mutants(source))
    sample = random.Random(options.seed).sample(every, min(options.count, len(every)))
    copy = fresh_copy()
    if not survives(copy, options.tests, 10.0 * options.limit):  # compiles the kernels of the copy
        sys.exit("the tests fail, or take too long, without any change")
    alive = 0
    for line, described, mutant in sample:
        (copy / options.module).write_text(mutant)
        if survives(copy, options.tests, options.limit):
            alive += 1
            print(f"survived: {options.module}:{line}: {described}", flush=True)
    print(f"{alive} of {len(sample)} mutants survived (of {len(every)} possible, "
          f"seed {options.seed})")


if __name__ == "__main__":
    main()
