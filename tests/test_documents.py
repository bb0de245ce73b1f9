"""The Python in the documents runs as printed."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
DOCUMENTS = ["README.md", "CONTRIBUTING.md", *(f"docs/{path.name}" for path in sorted(
    (ROOT / "docs").glob("*.md")) if BLOCK.search(path.read_text(encoding="utf-8")))]


def code_of(name):
    """All Python blocks of a document as one program: later blocks go on from earlier ones."""
    return "\n".join(BLOCK.findall((ROOT / name).read_text(encoding="utf-8")))


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_code_of_a_document_runs(name):
    code = code_of(name)
    assert code.strip()
    exec(compile(code, name, "exec"), {"__name__": "document"})


def test_the_task_of_the_guide_serves_in_a_stack():
    from hierarchy import Robot, Stack
    from solvers import make

    names = {"__name__": "document"}
    exec(code_of("CONTRIBUTING.md"), names)
    state = Robot.named("kuka_lwr").state([0.1] * 7)
    h = Stack([names["Elbow"](joint=3, angle=1.0)], "velocity").hierarchy(state)
    assert make("tpm").solve(h).x[3] == pytest.approx(2.0 * 0.9)
