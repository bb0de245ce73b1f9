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


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_data_frame_has_a_column_for_each_number(library, monkeypatch):
    run = simulate(load("ellipse", ["control.duration=0.02"]))
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
def test_a_notebook_of_the_documents_runs_and_prints_what_is_stored_up_to_numbers(
        path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text, names = path.read_text(encoding="utf-8"), {"__name__": "__main__"}
    assert not re.search(r"/(home|root|tmp|work|Users)/", text), "paths of a machine"
    cells = json.loads(text)["cells"]
    assert len({cell["id"] for cell in cells}) == len(cells)
    for number, cell in enumerate((one for one in cells if one["cell_type"] == "code"), 1):
        exec(compile("".join(cell["source"]), f"{path.name}, code cell {number}", "exec"), names)
        stored = "".join("".join(out.get("text", "")) for out in cell["outputs"])
        said, stored = (re.sub(r"-?\d[\d.e+-]*", "#", text)
                        for text in (capsys.readouterr().out, stored))
        assert (said, cell["execution_count"]) == (stored, number)
        assert "error" not in [out["output_type"] for out in cell["outputs"]] != []
