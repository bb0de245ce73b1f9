"""One package has all public names, and says whose files stand in for ours."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import hierarchy
import scenarios
import solvers
import task_hierarchy

ROOT = Path(__file__).parents[2]


def test_the_fourth_package_has_the_names_of_the_three():
    assert set(task_hierarchy.__all__) == {*hierarchy.__all__, *solvers.__all__,
                                           *scenarios.__all__}
    assert task_hierarchy.make is solvers.make


@pytest.mark.parametrize("name", ["hierarchy", "solvers", "scenarios"])
def test_a_package_of_the_same_name_is_named_in_one_line(name, tmp_path):
    (tmp_path / name).mkdir()
    file = tmp_path / name / "__init__.py"
    file.touch()
    done = subprocess.run([sys.executable, "-c", "from task_hierarchy import main"], text=True,
                          env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"},
                          capture_output=True, check=False, cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(
        f"ImportError: the package {name!r} is {file}, not task-hierarchy's")
