"""The Python in the documents runs as printed."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
BLOCKS = [(name, i, code) for name in ("README.md", "CONTRIBUTING.md", "docs/hcod.md")
          for i, code in enumerate(BLOCK.findall((ROOT / name).read_text(encoding="utf-8")))]


@pytest.mark.parametrize(("name", "i", "code"), BLOCKS, ids=[f"{b[0]}-{b[1]}" for b in BLOCKS])
def test_a_code_block_of_a_document_runs(name, i, code):
    exec(compile(code, f"{name} block {i}", "exec"), {"__name__": "document"})


def test_the_documents_have_code_to_run():
    assert len(BLOCKS) >= 3


def test_the_task_of_the_guide_serves_in_a_stack():
    from hierarchy import Robot, Stack
    from solvers import make

    names = {"__name__": "document"}
    exec(next(code for name, _, code in BLOCKS if name == "CONTRIBUTING.md"), names)
    state = Robot.named("kuka_lwr").state([0.1] * 7)
    h = Stack([names["Elbow"](joint=3, angle=1.0)], "velocity").hierarchy(state)
    assert make("tpm").solve(h).x[3] == pytest.approx(2.0 * 0.9)
