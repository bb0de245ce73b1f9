"""Studies, statements about them, and the pages that have what came of them."""

import json
import re
import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmark.reproduce import pages, whole
from benchmark.reproduce.blocks import judged, statements
from benchmark.reproduce.studies import BLOCKS, STUDIES, Rows, Study, plain, read, rows_of
from benchmark.reproduce.ticks import DAMPED, LARGEST, LEFT
from hierarchy.errors import HierarchyError
from scenarios.config import shipped
from scenarios.results.sampled import Workers

ROOT = Path(__file__).parents[2]
PAGES = pages.marked(ROOT)


def rows(**columns):
    """Rows of a study with one metric, the largest speed."""
    starts = len(next(iter(columns.values())))
    values = {name: {"speed_max": list(some)} for name, some in columns.items()}
    return Rows("study", "a command", starts, 1,
                {"speed_max": {"label": "Joint speed, max", "unit": "rad/s"}}, values,
                dict.fromkeys(columns, starts))


def verdict(found, **decides):
    return judged(found, {"metric": "speed_max", **decides})[1]


def test_a_comparison_is_true_reversed_or_not_told():
    low = np.linspace(1.0, 2.0, 16)
    mixed = low + np.where(np.arange(16) % 2, 0.1, -0.1)
    found = rows(a=low, b=low + 0.5, c=mixed, d=low)
    assert verdict(found, of="b", above="a") == "true"
    assert verdict(found, of="b", below="a") == "reversed"
    assert verdict(found, of="c", below="a") == "not distinguishable"
    assert verdict(found, of="d", below="a") == "the same"
    assert verdict(rows(a=[1.0], b=[None]), of="b", above="a") == "not decided"
    assert judged(found, {"metric": "speed_max", "of": "b", "above": "a"})[0] == (
        "2.000 [1.750, 2.250] rad/s against 1.500 [1.250, 1.750] rad/s; "
        "higher in 16 of 16, p < 0.001")


def test_a_bound_is_kept_from_every_start_from_some_or_from_none():
    found = rows(a=[1.0, 2.0, 3.0, 4.0])
    for most, expected in ((4.0, "true"), (3.5, "not from every start"), (0.5, "false")):
        assert verdict(found, of="a", most=most) == expected
    assert verdict(found, of="a", least=1.5) == "not from every start"
    assert "kept from 3 of 4 (30 to 95 %)" in judged(found, {
        "metric": "speed_max", "of": "a", "most": 3.5})[0]


def test_every_statement_names_a_column_of_its_study():
    for study in STUDIES.values():
        for _, decides in statements(study.name):
            named = {decides[key] for key in ("of", "below", "above") if key in decides}
            assert named <= set(study.names)
    assert {one.get("study") for one in BLOCKS.values()} - {None} == set(STUDIES)


@pytest.mark.parametrize("study", [study for study in STUDIES.values() if study.columns],
                         ids=lambda study: study.name)
def test_every_column_is_a_scenario_of_its_own_name(study):
    for column in study.columns:
        assert column.scenario in shipped()
        assert column.load().name == column.name
        assert column.load().variation


@pytest.mark.parametrize("name", PAGES)
def test_a_page_has_what_its_rows_and_commands_say(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert pages.filled(text, ROOT, name, read(ROOT / pages.RESULTS)) == text


def test_an_unknown_block_or_metric_is_named(tmp_path):
    for name in ("other", "blend"):
        with pytest.raises(HierarchyError, match=rf"page\.md: block '{name}'"):
            pages.filled(f"<!-- reproduce: {name} -->\n<!-- end of {name} -->", tmp_path,
                         "page.md", {})
    with pytest.raises(HierarchyError, match="'speed_min'"):
        rows(a=[1.0]).column("a", "speed_min")


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
    return f"before\n<!-- measured: {mark} -->\n{inside}<!-- end of measurement -->\nafter\n"


def test_a_page_gets_the_whole_output_or_the_lines_between_two(tmp_path):
    pages.file_of("python a.py", tmp_path).write_text(BENCH)
    fill = partial(pages.filled, root=tmp_path, page="page.md", rows={})
    assert fill(page("python a.py")) == page("python a.py", f"```\n{BENCH}```\n")
    mark = "python a.py | INEQ7 .. Times of"
    assert fill(page(mark, "old\n")) == page(
        mark, "```\nINEQ7\n            median  p95\nhqp proxqp    1443 1945\n```\n")
    for text, says in ((page("python b.py"), r"page\.md: no output of 'python b\.py' is stored"),
                       (page("python a.py | EQ8 .. EQ9"), r"no line of the output .* with 'EQ8'")):
        with pytest.raises(HierarchyError, match=says):
            fill(text)


def test_a_command_that_fails_leaves_the_others(tmp_path, capsys):
    (tmp_path / "good.py").write_text("print('good')\n")
    (tmp_path / "bad.py").write_text("print('half')\nraise SystemExit(3)\n")
    (tmp_path / "page.md").write_text(page("python bad.py") + page("python good.py"))
    assert dict(whole.outputs(["page.md"], tmp_path, tmp_path / "out")) == {
        "python good.py": "good\n"}
    said = capsys.readouterr().err
    assert "left as it is: python bad.py: exit code 3\nhalf" in said
    assert re.search(r"^  0:0\d min$", said, re.MULTILINE)
    assert whole.minutes(2467.4) == "41:07 min"


@pytest.fixture
def documents(tmp_path):
    """A checkout that has documents only."""
    for name in PAGES:
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / pages.RESULTS, tmp_path / pages.RESULTS, dirs_exist_ok=True)
    return tmp_path


def ending_with(error, *ended):
    def run(*_):
        yield from ended
        raise error
    return run


@pytest.mark.parametrize(("error", "code", "said"), [
    (KeyboardInterrupt(), 130, "the same command continues from here"),
    (OSError(28, "No space left on device", "out/a"), 1, "out/a cannot be written: No space left")])
def test_a_study_that_has_ended_is_stored_whatever_ends_the_command(
        error, code, said, documents, monkeypatch, capsys):
    old = read(documents / pages.RESULTS)["blend"]
    new = replace(old, values={name: {metric: [9.0] * old.starts for metric in values}
                               for name, values in old.values.items()})
    monkeypatch.setattr(whole, "ran", ending_with(error, new))
    assert whole.run(["blend", "letter"], documents / "out", root=documents) == code
    assert said in capsys.readouterr().err
    assert read(documents / "out") == {"blend": new}
    assert read(documents / pages.RESULTS)["blend"] == new
    assert "9.000" in (documents / "docs/results/loops.md").read_text()


def test_an_output_is_written_as_its_command_ends(documents, monkeypatch):
    command = "hierarchy bench batch --seconds 4"
    monkeypatch.setattr(whole, "outputs", ending_with(KeyboardInterrupt(), (command, "ten\n")))
    assert whole.run(["docs/batch.md"], documents / "out", root=documents) == 130
    assert pages.file_of(command, documents).read_text() == "ten\n"
    assert "```\nten\n```" in (documents / "docs/batch.md").read_text()


def test_quick_lists_the_commands_that_it_does_not_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(whole, "ran", lambda *_: iter([rows(a=[1.0])]))
    assert whole.run([], tmp_path, True, 1, as_json=True) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["not_made"]["hierarchy bench tick"] == ["docs/results/problems.md"]
    with pytest.raises(HierarchyError, match=r"--quick runs studies, and docs/batch\.md has"):
        whole.run(["docs/batch.md"], tmp_path, True, 1)


@pytest.mark.slow
def test_what_is_measured_in_ticks_is_stored_for_each_start(tmp_path, monkeypatch):
    scenario = tmp_path / "short.toml"
    scenario.write_text('extends = "ellipse"\nname = "short"\n[control]\nduration = 0.1\n')
    common = {"title": "a title", "scenario": str(scenario), "resolver": "tpm", "starts": 2}
    for study in (Study("pairs", pairs={"recursive": ("tpm", "recursive")}, **common),
                  Study("pivots", pivots=("avoidance",), **common)):
        found = rows_of(study, tmp_path / "none", Workers())
        assert found.ended == dict.fromkeys(study.names, 2)
        if study.pairs:
            assert (found.column("recursive", LARGEST) < 1e-9).all()
        else:
            assert (found.column("avoidance", DAMPED) == 1.0).all()
            one, other = found.column("avoidance", LEFT)
            assert 0.0 < one < 1.0
            assert 0.0 < other < 1.0
            assert one != other
    assert plain(np.array([np.inf, 1.0])) == [None, 1.0]
