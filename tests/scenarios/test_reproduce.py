from pathlib import Path

import numpy as np
import pytest

from hierarchy.errors import HierarchyError
from scenarios.config import shipped
from scenarios.reproduce import pages
from scenarios.reproduce.blocks import BLOCKS, CLAIMS
from scenarios.reproduce.claims import Compares, Ends, Keeps
from scenarios.reproduce.rows import Rows, read, write
from scenarios.reproduce.studies import STUDIES, Study

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
