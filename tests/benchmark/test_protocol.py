"""The protocol of studies in closed loop, and the pages that have what came of runs."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from benchmark.reproduce import blocks, fronts, pages, protocol, verdicts, whole
from hierarchy.errors import HierarchyError
from scenarios.results.sampled import Workers


def test_the_blocked_test_is_wilcoxons_in_one_block_and_ignores_shifts_between_blocks():
    scipy = pytest.importorskip("scipy.stats")
    apart = np.random.default_rng(5).standard_normal(40) + 0.3
    found = verdicts.blocked(apart, np.zeros(40, dtype=int))
    assert found.p == pytest.approx(scipy.wilcoxon(apart, method="asymptotic").pvalue, rel=0.05)
    assert found.low < found.estimate < found.high
    shifted = verdicts.blocked(apart - found.low - 1e-9, np.zeros(40, dtype=int))
    assert shifted.p == pytest.approx(0.05, abs=0.01)


def test_every_claim_names_columns_that_load_on_the_letters_own_robot():
    layout = protocol.PROTOCOL.layouts["lwr"]
    for name, column in protocol.PROTOCOL.columns.items():
        assert column.load(layout, name).variation
    for claim in protocol.PROTOCOL.claims:
        assert {claim.of, claim.rival} - {""} <= set(protocol.PROTOCOL.columns)
        assert bool(claim.quotation) == (claim.family == "letter")
    assert len(blocks.block("asked-letter", blocks.Stored(None, []), str).splitlines()) > 5


def test_runs_are_resumed_and_noise_is_small(tmp_path, monkeypatch):
    short = {"lwr": {**protocol.PROTOCOL.layouts["lwr"], "control.duration": 0.02}}
    some = replace(protocol.PROTOCOL, layouts=short, seeds=(1,), starts=2,
                   columns={name: protocol.PROTOCOL.columns[name] for name in ("letter", "hqp")})
    (first,) = protocol.run(some, tmp_path, Workers(1))
    file = tmp_path / "runs" / "all.jsonl"
    before = file.stat().st_size
    (second,) = protocol.run(some, tmp_path, Workers(1))
    assert (first, before) == (second, file.stat().st_size)
    monkeypatch.setattr(protocol, "_MEASURED", "other metrics")
    assert next(protocol.run(some, tmp_path, Workers(1))) == first
    assert file.stat().st_size > 1.9 * before
    exact, noisy = (first.column("letter", "speed_max", k) for k in (0, 1))
    assert exact == pytest.approx(noisy, rel=1e-4)
    protocol.write(first, tmp_path / "rows.json")
    assert protocol.read(tmp_path / "rows.json") == first


def test_trials_that_are_left_out_of_the_second_scene_are_not_on_the_front(monkeypatch):
    rng, ran = np.random.default_rng(5), []
    scores = rng.exponential(size=(40, 2, 3))
    scores[rng.random((40, 2)) < 0.3] = np.inf

    def made(name, method, trials, scenes, where):
        ran.append(len(trials))
        return scores[[one["k"] for one in trials], :scenes[1]], []

    monkeypatch.setattr(fronts, "_scores", made)
    found = fronts._trained("", fronts.Method("hcod"), [{"k": k} for k in range(40)], ())
    whole = scores.max(axis=1)
    assert ([k for k in range(40) if not fronts.dominated(found, k)]
            == [k for k in range(40) if not fronts.dominated(whole, k)])
    assert sum(ran[1:]) < 30


ROOT = Path(__file__).parents[2]
PAGES = pages.marked(ROOT)
STORED = blocks.Stored.read(ROOT)


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


def test_a_command_runs_again_after_a_change_of_what_it_reads(tmp_path):
    data = tmp_path / "scenarios" / "library" / "ellipse.toml"
    data.parent.mkdir(parents=True)
    for text in ("first", "second"):
        data.write_text(text)
        assert pages.run(f"python -c 'print(open(\"{data}\").read())'", tmp_path, tmp_path / "out"
                         ) == f"{text}\n"


def test_reproduce_ends_with_1_where_a_command_ends_with_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "ROOT", tmp_path)
    (tmp_path / "README.md").write_text(page("python -c 'exit(3)'"))
    assert whole.run(["README.md"], tmp_path / "out") == 1
    refused("--quick makes the first seed of protocol, which is not asked for", whole.run,
            ["fronts"], tmp_path / "out", quick=True)


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


def test_what_is_not_there_yet_is_named_and_ends_no_filling():
    asked = {"table": "EQ7", "row": "hcod", "place": "3"}
    with pytest.raises(HierarchyError, match="row 'hcod' below 'EQ7' of the output has no number"):
        blocks.cell("EQ7\nhcod 1.0 2.0\n", asked)


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
                       (page("python a.py | EQ8 .. EQ9"), "has no line that starts with 'EQ8'"),
                       (page("table of python a.py"), r"page\.md: not enough values"),
                       (page("python a.py | without ("), r"page\.md: missing \)"),
                       ("<!-- reproduce: other -->\n<!-- end -->", r"page\.md: block 'other'")):
        with pytest.raises(HierarchyError, match=says):
            fill(text)
