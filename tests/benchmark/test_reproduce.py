import json
import re
import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import typer
from scenarios.reproduce import commands, pages
from scenarios.reproduce.blocks import BLOCKS, CLAIMS, by_metric
from scenarios.reproduce.claims import Compares, Ends, Keeps
from scenarios.reproduce.rows import Rows, read, write
from scenarios.reproduce.studies import STUDIES, Pair, Pivot, Study, Watched
from scenarios.reproduce.watched import DAMPED, LARGEST, LEFT, jobs, measured, rows_of_watched
from scenarios.reproduce.whole import chosen, minutes, outputs

from hierarchy.errors import HierarchyError
from scenarios.cli import reproduce as command
from scenarios.cli.main import app
from scenarios.config import shipped
from scenarios.sweep.run import digest, run_batch
from scenarios.sweep.store import Store
from scenarios.sweep.whole import Workers

ROOT = Path(__file__).parents[2]


def rows(**columns):
    """Rows of a study with one metric, the largest speed."""
    starts = len(next(iter(columns.values())))
    values = {name: {"speed_max": list(some)} for name, some in columns.items()}
    return Rows("study", "a command", starts, 1,
                {"speed_max": {"label": "Joint speed, max", "unit": "rad/s"}}, values,
                dict.fromkeys(columns, starts))


def speed(first, second, expected):
    return Compares("text", "study", "speed_max", first, second, expected)


def test_a_comparison_is_true_reversed_or_not_told():
    low = np.linspace(1.0, 2.0, 16)
    mixed = low + np.where(np.arange(16) % 2, 0.1, -0.1)
    found = rows(a=low, b=low + 0.5, c=mixed, d=low)
    assert speed("a", "b", "higher").judge(found).verdict == "true"
    assert speed("a", "b", "lower").judge(found).verdict == "reversed"
    assert speed("a", "c", "lower").judge(found).verdict == "not distinguishable"
    assert speed("a", "d", "lower").judge(found).verdict == "the same"
    assert speed("a", "b", "higher").judge(rows(a=[1.0], b=[None])).verdict == "not decided"
    said = speed("a", "b", "higher").judge(found).found
    assert said == ("2.000 [1.750, 2.250] rad/s against 1.500 [1.250, 1.750] rad/s; "
                    "higher in 16 of 16, p < 0.001")


def test_a_bound_is_kept_from_every_start_from_some_or_from_none():
    found = rows(a=[1.0, 2.0, 3.0, 4.0])
    for most, verdict in ((4.0, "true"), (3.5, "not from every start"), (0.5, "false")):
        judged = Keeps("text", "study", "speed_max", "a", most=most).judge(found)
        assert judged.verdict == verdict
    assert "kept from 3 of 4 (30 to 95 %)" in Keeps("text", "study", "speed_max", "a",
                                                     most=3.5).judge(found).found


def test_a_run_that_ends_early_has_no_value_and_is_counted():
    found = rows(a=[1.0, None, 3.0])
    found.ended["a"] = 2
    assert Ends("text", "study", "a").judge(found).verdict == "not from every start"
    assert found.spread("a", "speed_max").count == 2
    assert Keeps("text", "study", "speed_max", "a", most=9.0).judge(found).verdict == (
        "not from every start")


def test_rows_are_read_as_they_were_written(tmp_path):
    kept = rows(a=[1.0, None, 3.0], b=[1e-9, 2.0, 3.0])
    path = write(kept, tmp_path)
    assert read(tmp_path) == {"study": kept}
    assert '    "speed_max": [1.0, null, 3.0]' in path.read_text().splitlines()


def test_a_table_of_metrics_compares_each_column_with_the_first():
    kept = {"study": rows(a=[1.0] * 16, b=[2.0] * 16)}
    line = by_metric(kept, "study", ["speed_max"], ["a", "b"]).splitlines()[2]
    assert line.count("|") == 4
    assert "higher in 16 of 16, p < 0.001 |" in line


def test_an_unknown_block_or_metric_is_named():
    with pytest.raises(HierarchyError, match=r"page\.md: there is no block 'other'"):
        pages.filled("<!-- reproduce: other -->\n<!-- end of other -->", BLOCKS, {}, "page.md")
    with pytest.raises(HierarchyError, match=r"page\.md: block 'blend': no rows of study 'blend'"):
        pages.filled("<!-- reproduce: blend -->\n<!-- end of blend -->", BLOCKS, {}, "page.md")
    with pytest.raises(HierarchyError, match="'speed_min'"):
        rows(a=[1.0]).column("a", "speed_min")


def test_a_block_is_replaced_and_the_rest_is_left():
    text = "before\n<!-- reproduce: one -->\nold\n<!-- end of one -->\nafter\n"
    made = pages.filled(text, {"one": lambda rows: "new"}, {}, "page.md")
    assert made == text.replace("old", "new")


def test_every_claim_names_a_column_of_its_study():
    columns = {study.name: {column.name for column in study.columns} for study in STUDIES}
    for claim in CLAIMS:
        named = {getattr(claim, name) for name in ("column", "first", "second")
                 if hasattr(claim, name)}
        assert named <= columns[claim.study]


@pytest.mark.parametrize("study", [study for study in STUDIES if isinstance(study, Study)],
                         ids=lambda study: study.name)
def test_every_column_is_a_scenario_of_its_own_name(study):
    for column in study.columns:
        assert column.scenario in shipped()
        assert column.load().name == column.name
        assert column.load().variation


@pytest.mark.parametrize("name", pages.PAGES)
def test_a_page_has_what_its_rows_say(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert pages.filled(text, BLOCKS, read(ROOT / pages.RESULTS), name) == text


# Commands whose output stands in a page.

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


@pytest.mark.parametrize("name", commands.PAGES)
def test_a_page_has_what_its_commands_printed(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert commands.commands(text)
    assert commands.filled(text, ROOT, name) == text


def test_every_output_that_is_kept_stands_in_a_page():
    texts = [(ROOT / name).read_text(encoding="utf-8") for name in commands.PAGES]
    printed = {one: "" for text in texts for one in commands.commands(text)}
    kept = {path.name for path in (ROOT / commands.OUTPUT).iterdir()}
    assert kept == {commands.file_of(command, ROOT).name for command in printed}


def test_every_page_with_a_mark_is_written():
    for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
        name, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
        assert ("<!-- measured: " in text) == (name in commands.PAGES), name
        assert ("<!-- reproduce: " in text) == (name in pages.PAGES), name


def page(mark, inside=""):
    return f"before\n<!-- measured: {mark} -->\n{inside}<!-- end of measurement -->\nafter\n"


def test_a_page_gets_the_whole_output_or_the_lines_between_two(tmp_path):
    commands.keep({"python a.py": BENCH}, tmp_path)
    whole = commands.filled(page("python a.py"), tmp_path, "page.md")
    assert whole == page("python a.py", f"```\n{BENCH}```\n")
    mark = "python a.py | INEQ7 .. Times of"
    part = commands.filled(page(mark, "old\n"), tmp_path, "page.md")
    assert part == page(mark, "```\nINEQ7\n            median  p95\n"
                              "hqp proxqp    1443 1945\n```\n")


def test_a_table_gets_the_medians_of_its_rows_and_columns(tmp_path):
    commands.keep({"hierarchy bench resolvers": BENCH}, tmp_path)
    table = "| | EQ7 [us] | INEQ7 | notes |\n|---|---|---|---|\n{}"
    old = "| `hcod`, warm | 9 | 9 | kept |\n| `hqp` | 9 | 9 | too |\n"
    new = "| `hcod`, warm | 1.9 | – | kept |\n| `hqp` | – | 1443 | too |\n"
    mark = "table of hierarchy bench resolvers"
    found = commands.filled(page(mark, table.format(old)), tmp_path, "page.md")
    assert found == page(mark, table.format(new))


def test_an_output_that_is_missing_or_lacks_the_lines_is_named(tmp_path):
    with pytest.raises(HierarchyError, match=r"page\.md: no output of 'python a\.py' is kept"):
        commands.filled(page("python a.py"), tmp_path, "page.md")
    commands.keep({"python a.py": BENCH}, tmp_path)
    with pytest.raises(HierarchyError, match=r"page\.md: no line of the output .* with 'EQ8'"):
        commands.filled(page("python a.py | EQ8 .. EQ9"), tmp_path, "page.md")


def test_a_command_is_run_once_for_the_same_code(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("print('one  ')\nprint('Numbers: runs/a')\n")
    assert commands.run("python script.py", tmp_path, tmp_path / "out") == "one\n"
    script.write_text("print('two')\n")
    assert commands.run("python script.py", tmp_path, tmp_path / "out") == "one\n"
    (tmp_path / "docs" / "studies").mkdir(parents=True)
    (tmp_path / "docs" / "studies" / "new.py").write_text("")
    assert commands.run("python script.py", tmp_path, tmp_path / "out") == "two\n"


def test_a_command_that_fails_is_named_and_keeps_nothing(tmp_path):
    (tmp_path / "script.py").write_text("print('half')\nraise SystemExit(3)\n")
    with pytest.raises(commands.CommandError, match=r"python script\.py: exit code 3\nhalf"):
        commands.run("python script.py", tmp_path, tmp_path / "out")
    assert not list((tmp_path / "out").rglob("output.txt"))


def test_a_command_that_fails_leaves_the_others(tmp_path):
    (tmp_path / "good.py").write_text("print('good')\n")
    (tmp_path / "bad.py").write_text("raise SystemExit(3)\n")
    (tmp_path / "page.md").write_text(page("python bad.py") + page("python good.py"))
    told = []
    found = dict(outputs(["page.md"], tmp_path, tmp_path / "out", told.append))
    assert found == {"python good.py": "good\n"}
    assert told[1].startswith("left as it is: python bad.py: exit code 3")


def test_it_says_how_long_each_command_and_all_of_it_took(documents, monkeypatch, capsys):
    (documents / "good.py").write_text("print('good')\n")
    (documents / "page.md").write_text(page("python good.py"))
    told = []
    assert dict(outputs(["page.md"], documents, documents / "out", told.append))
    assert re.fullmatch(r"  0:0\d min", told[1])
    assert minutes(2467.4) == "41:07 min"
    monkeypatch.setattr(command, "checkout", lambda: documents)
    monkeypatch.setattr(command, "outputs", lambda *_: iter([]))
    assert command.reproduce_command(["docs/batch.md"], documents / "out", False, 1) == 0
    assert re.search(r"^0:0\d min in all$", capsys.readouterr().err, re.MULTILINE)


def test_studies_and_pages_are_chosen_by_name():
    assert chosen([]).studies == STUDIES
    assert chosen([]).pages == commands.PAGES
    some = chosen(["docs/batch.md", "letter"])
    assert [study.name for study in some.studies] == ["letter"]
    assert some.pages == ("docs/batch.md",)
    with pytest.raises(HierarchyError, match=r"'docs/view\.md'"):
        chosen(["docs/view.md"])


def test_the_help_names_every_study():
    found = typer.main.get_command(app).commands["reproduce"].params[0].help
    assert {study.name for study in STUDIES} <= set(re.findall(r"\w+", found))


@pytest.fixture
def documents(tmp_path):
    """A checkout that has documents only."""
    for name in {*pages.PAGES, *commands.PAGES}:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / pages.RESULTS, tmp_path / pages.RESULTS)
    return tmp_path


def ending_with(error, *ended):
    def run(*_):
        yield from ended
        raise error
    return run


@pytest.mark.parametrize(("error", "code", "said"), [
    (KeyboardInterrupt(), 130, "the same command continues from here"),
    (OSError(28, "No space left on device", "out/a"), 1, "out/a cannot be written: No space left")])
def test_a_study_that_has_ended_is_kept_whatever_ends_the_command(
        error, code, said, documents, monkeypatch, capsys):
    old = read(documents / pages.RESULTS)["blend"]
    new = replace(old, values={name: {metric: [9.0] * old.starts for metric in values}
                               for name, values in old.values.items()})
    monkeypatch.setattr(command, "checkout", lambda: documents)
    monkeypatch.setattr(command, "reproduce", ending_with(error, new))
    assert command.reproduce_command(["blend", "letter"], documents / "out", False, 1) == code
    assert said in capsys.readouterr().err
    assert read(documents / "out") == {"blend": new}
    assert read(documents / pages.RESULTS)["blend"] == new
    assert "9.000" in (documents / "docs/reproduction.md").read_text()


def test_an_output_is_written_as_its_command_ends(documents, monkeypatch, capsys):
    monkeypatch.setattr(command, "checkout", lambda: documents)
    monkeypatch.setattr(command, "outputs", ending_with(
        KeyboardInterrupt(), ("hierarchy bench tick", "ten ticks\n")))
    assert command.reproduce_command(["docs/benchmarks.md"], documents / "out", False, 1) == 130
    assert commands.file_of("hierarchy bench tick", documents).read_text() == "ten ticks\n"
    assert "ten ticks" in (documents / "docs/benchmarks.md").read_text()


def test_a_page_that_cannot_be_filled_does_not_keep_others_from_it(documents):
    page = documents / "docs/reproduction.md"
    page.write_text(page.read_text() + "<!-- reproduce: other -->\n<!-- end of other -->\n")
    found = read(documents / pages.RESULTS)
    found["human"] = replace(found["human"], seed=99)
    changed, lacking = pages.write(documents, BLOCKS, found)
    assert changed == [documents / "docs/experiment.md"]
    assert lacking == ["docs/reproduction.md: there is no block 'other'"]


def test_quick_lists_the_commands_that_it_does_not_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "reproduce", lambda *_: iter([rows(a=[1.0])]))
    assert command.reproduce_command([], tmp_path, True, 1, as_json=True) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["not_made"]["hierarchy bench tick"] == ["docs/benchmarks.md"]
    with pytest.raises(HierarchyError, match=r"--quick runs studies, and docs/batch\.md has"):
        command.reproduce_command(["docs/batch.md"], tmp_path, True, 1)


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    for out in (file, file / "below"):
        with pytest.raises(HierarchyError, match=f"cannot be written: {file} is a file"):
            command.reproduce_command(["letter"], out, True, 1)


@pytest.mark.slow
def test_what_is_measured_in_ticks_is_kept_for_each_start(tmp_path):
    scenario = tmp_path / "short.toml"
    scenario.write_text('extends = "ellipse"\nname = "short"\n[control]\nduration = 0.5\n')
    study = Watched("short", "a title", str(scenario), "tpm", (
        Pair("recursive", "tpm", "recursive"), Pivot("avoidance")), starts=2)
    store = Store(tmp_path / "out")
    with store.opened():
        store.add(run_batch(jobs(study, 1), digest(), partial(measured, study)))
    found = rows_of_watched(study, "a command", 1, store.folder, Workers(), progress=pytest.fail)
    assert found.ended == {"recursive": 2, "avoidance": 2}
    assert (found.column("recursive", LARGEST) < 1e-9).all()
    assert (found.column("avoidance", DAMPED) == 1.0).all()
    one, other = found.column("avoidance", LEFT)
    assert 0.0 < one < 1.0
    assert 0.0 < other < 1.0
    assert one != other
