"""The repository itself: what it promises about set-up, documents and imports."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest

import hierarchy
import scenarios
import solvers

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"\[[^\]]*\]\((?!https?://|#|mailto:)([^)#\s]+)")


def test_documents_point_only_at_files_that_exist():
    assert [(document.name, link) for document in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"))
            for link in LINK.findall(document.read_text(encoding="utf-8"))
            if not (document.parent / link).exists()] == []


def test_what_is_compiled_ahead_are_kernels_with_types_of_arguments():
    from hierarchy.jit.linking import found
    from hierarchy.jit.sources import kinds_in
    from scenarios.ahead.building import CALLS

    for call in CALLS.read_text().splitlines():
        name, _, kinds = call.removesuffix(")").partition("(")
        assert callable(found(name)), call
        assert kinds_in(kinds), call


def test_every_dependency_has_a_pinned_version_and_the_version_is_one():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines()
             if line and not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9_.+!-]+", line) for line in lines)
    pinned = {line.partition("==")[0].lower().replace("_", "-") for line in lines}
    extras = project["optional-dependencies"].values()
    asked = [*project["dependencies"], *(one for extra in extras for one in extra)]
    assert {re.split(r"[<>=\[ ]", one)[0].lower() for one in asked} - {project["name"]} <= pinned
    assert f"\nversion: {project['version']}\n" in (ROOT / "CITATION.cff").read_text()


@pytest.mark.parametrize(("interpreter", "said"), [
    ("", ".venv is a link"), ("#!/bin/sh\nexit 1\n", "needs Python 3.11 or newer"),
    ('#!/bin/sh\ncase "$2" in\n  *ensurepip*) exit 1;;\n  *print*) echo 3.11;;\nesac\n',
     "apt install python3.11-venv")])
def test_make_says_what_is_missing_where_python_does_not_serve(interpreter, said, tmp_path):
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    python = tmp_path / "python"
    python.write_text(interpreter)
    python.chmod(0o755)
    if not interpreter:
        (tmp_path / ".venv").symlink_to(tmp_path)
    done = subprocess.run(["make", "set-up", f"PYTHON={python}"], cwd=tmp_path, text=True,
                          capture_output=True, check=False)
    assert done.returncode != 0
    assert said in done.stderr
    assert python.exists()


# One after the other in one process, and what is not loaded after each.
LIGHT = {
    "import scenarios": {"numpy", "pydantic"},
    "import scenarios.cli.main": {"numpy", "numba", "pinocchio", "scipy", "matplotlib"},
    "scenarios.cli.main.run_command(['--help'])": {
        "numpy", "numba", "pinocchio", "pydantic", "matplotlib"},
    "import scenarios.ahead.building": {"pydantic", "pinocchio"},  # which `make` installs later
    "import hierarchy as h; h.Hierarchy": {"pinocchio"},
    "import solvers, solvers.qp.backends": {"pinocchio", "qpsolvers", "proxsuite", "osqp"},
    "solvers.make('hcod').solve(h.Hierarchy.from_levels([([[1.0]], [1.0])]))": {
        "pinocchio", "matplotlib", "qpsolvers"},
    "import scenarios.cell.build": {"scipy.spatial", "matplotlib"},
    "scenarios.cli.main.run_command('run ellipse --duration 0.01'.split())": {"matplotlib"}}


def test_a_program_loads_no_heavy_package_that_it_does_not_need(tmp_path):
    code = "\n".join(("import sys", *(f"{line}\nassert not {heavy} & set(sys.modules), {line!r}"
                                     for line, heavy in LIGHT.items())))
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)


@pytest.mark.parametrize("package", ["hierarchy", "solvers", "scenarios", "task_hierarchy"])
def test_what_a_package_says_it_exports_is_there(package):
    module = import_module(package)
    assert set(module.__all__) <= set(dir(module))
    for name in module.__all__:
        assert callable(getattr(module, name))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = module.nothing
    assert package == "task_hierarchy" or all(getattr(import_module("task_hierarchy"), name)
                                              is getattr(module, name) for name in module.__all__)


def failed(code, folder):
    """What a program complains of, by lines, that finds the modules of a folder before ours."""
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, cwd=folder,
                          check=False, env={**os.environ, "PYTHONPATH": f"{folder}:{ROOT}"})
    assert done.returncode == 1
    return done.stderr.splitlines()


@pytest.mark.parametrize("name", ["hierarchy", "solvers", "scenarios"])
def test_a_package_of_the_same_name_is_named_in_one_line(name, tmp_path):
    (tmp_path / name).mkdir()
    file = tmp_path / name / "__init__.py"
    file.touch()
    message = f"the package {name!r} is {file}, not task-hierarchy's"
    command = "import sys; sys.argv = ['bin/hierarchy', 'doctor']; "
    for before, said in ("", f"ImportError: {message}"), (command, f"hierarchy: error: {message}"):
        complaint = failed(f"{before}from task_hierarchy import main", tmp_path)
        assert complaint[-1].startswith(said)
    assert len(complaint) == 1


def test_an_older_pinocchio_that_comes_first_is_named_in_one_line(tmp_path):
    (tmp_path / "pinocchio.py").write_text("__version__ = '3.9.0'\n")
    assert f"pinocchio 3.9.0 in {tmp_path / 'pinocchio.py'} is older" in failed(
        "from hierarchy import Robot", tmp_path)[-1]


@pytest.mark.parametrize(("name", "size", "without"), [
    ("Robot", "robots", ["pinocchio", "coal"]), ("simulate", "scenarios", ["pydantic"]),
    ("simulate", "scenarios", ["pinocchio", "coal"])])
def test_a_name_of_a_larger_size_says_the_line_that_installs_it(name, size, without, tmp_path):
    assert f"pip install 'task-hierarchy[{size}]'" in failed(
        f"import sys; sys.modules |= dict.fromkeys({without})\n"
        f"import task_hierarchy; task_hierarchy.{name}", tmp_path)[-1]


@pytest.mark.parametrize("package", ["hierarchy", "solvers", "scenarios"])
def test_the_map_names_every_part_of_a_package_in_the_order_of_the_layers(package):
    told = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = told.partition(f"### `{package}/`")[2].partition("\n#")[0]
    on_map = [name.removesuffix("/").removesuffix(".py")
              for name in re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE)]
    assert sorted(on_map) == sorted(
        path.stem for path in (ROOT / package).iterdir()
        if path.suffix == ".py" or (path.is_dir() and path.name != "__pycache__")
        if path.name != "__init__.py")
    linted = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = next(contract["layers"] for contract in linted["contracts"]
                  if contract.get("containers") == [package])
    layer_of = {name: i for i, layer in enumerate(layers) for name in layer.split(" | ")}
    code = [name for name in on_map if name != "library" or package != "scenarios"]  # TOML only
    assert [layer_of[name] for name in code] == sorted(layer_of.values())


def test_functions_and_texts_of_classes_are_short_and_arguments_few():
    """Functions outside `solvers/kernels`; `solve_ik` has the arguments of pink."""
    nodes = [(f"{file.relative_to(ROOT)}: {node.name}", node)
             for package in ("hierarchy", "solvers", "scenarios")
             for file in sorted((ROOT / package).rglob("*.py"))
             for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
             if isinstance(node, (ast.ClassDef, ast.FunctionDef))]
    long = [where for where, node in nodes if isinstance(node, ast.ClassDef)
            and len((ast.get_docstring(node) or "").splitlines()) > 15]
    functions = [(where, node) for where, node in nodes
                 if isinstance(node, ast.FunctionDef) and "kernels/" not in where]
    lengths = sorted(node.end_lineno - node.lineno + 1 for _, node in functions)
    many = [where for where, node in functions
            if len([one for one in (*node.args.posonlyargs, *node.args.args)
                    if one.arg not in ("self", "cls")]) > 8
            and not any(".command" in ast.unparse(mark) for mark in node.decorator_list)]
    assert (long, many) == ([], ["solvers/adapters/for_pink.py: solve_ik"])
    assert lengths[len(lengths) // 2] <= 8
    assert lengths[len(lengths) * 9 // 10] <= 20


def records(package):
    """Every dataclass that is defined in a package whose modules can be imported here."""
    for module in walk_packages(package.__path__, f"{package.__name__}."):
        try:
            ends = module.name.endswith("__main__")  # is run as it is imported
            found = () if ends else vars(import_module(module.name)).values()
        except ImportError:  # an optional package is missing
            continue
        yield from (one for one in found if isinstance(one, type) and is_dataclass(one)
                    and one.__module__ == module.name)


@pytest.mark.parametrize("package", [hierarchy, solvers, scenarios],
                         ids=lambda package: package.__name__)
def test_records_are_frozen_and_what_they_compute_is_neither_shown_nor_compared(package):
    assert [one for one in records(package) if not one.__dataclass_params__.frozen] == []
    computed = [(f"{one.__qualname__}.{field.name}", field) for one in records(package)
                for field in fields(one) if not field.init]
    assert [name for name, field in computed if field.repr or field.compare] == []
