"""Notebooks: what objects show there, what a run gives, and the notebooks of the documents."""

import json
import re
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from scenarios import load, simulate

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))


@pytest.fixture(scope="module")
def run():
    return simulate(load("ellipse", ["control.duration=0.02"]))


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_data_frame_has_a_column_for_each_number(run, library, monkeypatch):
    fake = types.ModuleType(library)
    fake.DataFrame = dict
    for name in ("pandas", "polars"):  # None: the import fails
        monkeypatch.setitem(sys.modules, name, fake if name == library else None)
    for found in (run.to_dataframe(), run.to_dataframe(library)):
        assert list(found) == list(run.columns())
        np.testing.assert_array_equal(found["q[3]"], run["q"][:, 3])
    monkeypatch.setitem(sys.modules, library, None)
    refused("needs pandas or polars: pip install pandas", run.to_dataframe)
    refused(f"needs {library}: pip install {library}", run.to_dataframe, library)
    refused("unknown library 'panda'; did you mean 'pandas'", run.to_dataframe, "panda")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebooks_of_the_documents_run_and_print_what_is_stored_up_to_numbers(
        path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for number, cell in enumerate(cells_of(path, "code")):
        exec(compile("".join(cell["source"]), f"{path.name}, code cell {number}", "exec"), names)
        stored = "".join("".join(out.get("text", "")) for out in cell["outputs"])
        said, stored = (re.sub(r"-?\d[\d.e+-]*", "#", text)
                        for text in (capsys.readouterr().out, stored))
        assert said == stored


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_stored_with_their_outputs_and_no_paths_of_a_machine(path):
    assert all(cell["outputs"] for cell in cells_of(path, "code"))
    assert [cell["execution_count"] for cell in cells_of(path, "code")] == list(
        range(1, 1 + len(cells_of(path, "code"))))
    assert not any(out["output_type"] == "error" for cell in cells_of(path, "code")
                   for out in cell["outputs"])
    assert not re.search(r"/(home|root|tmp|work|Users)/", path.read_text(encoding="utf-8"))
    assert len({cell["id"] for cell in cells_of(path)}) == len(cells_of(path))


def cells_of(path, kind=None):
    """The cells of a notebook, of one kind."""
    return [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
            if kind in (None, cell["cell_type"])]
