"""The registry, the status, the resolution; what importing costs."""

import subprocess
import sys

import numpy as np
import pytest

from hierarchy import HierarchyError
from solvers import Resolution, Status, make, names


def test_names_are_sorted_and_each_makes_its_resolver():
    assert list(names()) == sorted(names())
    assert {"recursive", "tpm", "hqp", "augmented"} <= set(names())
    assert all(make(name).name == name for name in names())


@pytest.mark.parametrize("status", list(Status))
def test_the_text_of_a_status_says_what_to_do(status):
    assert str(status).startswith(status.name.lower().replace("_", " ") + ": ")
    assert len(status.remedy) > 5


def test_a_resolution_is_solved_unless_it_says_otherwise():
    res = Resolution(np.zeros(2))
    assert (res.status, res.iterations, res.memory) == (Status.SOLVED, 1, None)
    assert not hasattr(res, "__dict__")
    assert "SOLVED" in repr(res)


def test_a_form_that_does_not_exist_names_those_that_do():
    with pytest.raises(HierarchyError, match="form of tpm 'publishd'; did you mean 'published'"):
        make("tpm", form="publishd")


def test_labels_name_what_makes_another_method():
    assert make("tpm").label == "tpm"
    assert make("tpm", form="published").label == "tpm published"
    assert make("hqp").label == "hqp proxqp"


def test_importing_solvers_does_not_import_the_quadratic_programming_backends():
    code = ("import sys, solvers; "
            "print([m for m in ('qpsolvers', 'proxsuite', 'osqp') "
            "if m in sys.modules])")
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
