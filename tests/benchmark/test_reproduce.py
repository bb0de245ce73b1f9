"""Pages that have what came of runs and commands."""

import re
from functools import partial
from pathlib import Path

import pytest

from benchmark.reproduce import pages
from benchmark.reproduce.blocks import Stored
from hierarchy.errors import HierarchyError

ROOT = Path(__file__).parents[2]
PAGES = pages.marked(ROOT)
STORED = Stored.read(ROOT)


@pytest.mark.parametrize("name", PAGES)
def test_a_page_has_what_its_rows_and_commands_say(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert pages.filled(text, ROOT, name, STORED) == text


def test_every_output_that_is_stored_stands_in_a_page_or_is_linked():
    texts = [path.read_text("utf-8") for path in (ROOT / "README.md", *ROOT.glob("docs/**/*.md"))]
    shown = {pages.file_of(found["name"], ROOT).name for text in texts
             for found in pages._MARK.finditer(text) if found["kind"] != "reproduce"}
    linked = {name for text in texts for name in re.findall(r"output/([\w.-]+\.txt)\)", text)}
    assert {"README.md", "docs/results/problems.md", "docs/results/loops.md"} <= set(PAGES)
    assert {path.name for path in (ROOT / pages.OUTPUT).iterdir()} == shown | linked


def test_an_unknown_block_is_named(tmp_path):
    with pytest.raises(HierarchyError, match=r"page\.md: block 'other'"):
        pages.filled("<!-- reproduce: other -->\n<!-- end -->", tmp_path, "page.md",
                     STORED)


BENCH = """\
EQ7
            median  p95
plain numpy   55.3 83.4
hcod warm     1.85 2.43

INEQ7
            median  p95
hqp proxqp    1443 1945
Times of one call
"""


def page(mark, inside=""):
    return f"before\n<!-- measured: {mark} -->\n{inside}<!-- end -->\nafter\n"


def test_a_page_gets_the_whole_output_or_the_lines_between_two(tmp_path):
    pages.file_of("python a.py", tmp_path).write_text(BENCH)
    fill = partial(pages.filled, root=tmp_path, page="page.md", stored=STORED)
    assert fill(page("python a.py")) == page("python a.py", f"```\n{BENCH}```\n")
    mark = "python a.py | INEQ7 .. Times of"
    assert fill(page(mark, "old\n")) == page(
        mark, "```\nINEQ7\n            median  p95\nhqp proxqp    1443 1945\n```\n")
    mark += " | EQ7 .. hcod | without ^hqp|[A-Z]7"
    head = "            median  p95"
    assert fill(page(mark)) == page(mark, f"```\n{head}\n\n{head}\nplain numpy   55.3 83.4\n```\n")
    for text, says in ((page("python b.py"), r"page\.md: no output of 'python b\.py' is stored"),
                       (page("python a.py | EQ8 .. EQ9"), "has no line that starts with 'EQ8'")):
        with pytest.raises(HierarchyError, match=says):
            fill(text)
