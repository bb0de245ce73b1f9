"""The benchmark after the first paper: its arms, its references, who reaches what, its files."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import oracle
import pytest
import rank_cases
import typer

from hierarchy import Hierarchy, Robot, State
from hierarchy.robots import KUKA_LWR, TABLES
from scenarios.bench import accuracy, arms, exact, first_paper, growth, growth_figure
from scenarios.cli.main import app
from solvers import Resolution, Status, make, names

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """Errors and times of a small run, and the folder that it wrote."""
    folder = tmp_path_factory.mktemp("first-paper")
    few = pytest.MonkeyPatch()
    few.setattr(growth.run, "__defaults__", (growth.TASKS[:3], growth.JOINTS[:3], 0))
    errors, times = first_paper.run(folder, arms=50, checked=10, seconds=0.0)
    few.undo()
    return errors, times, folder


def claims():
    """Accuracy by label of those that claim to be strict."""
    return {resolver.label: resolver.accuracy for resolver in accuracy.resolvers()
            if resolver.strict}


def test_the_commands_take_as_many_arms_as_the_page_says():
    own = {"arms": first_paper.ARMS, "checked": first_paper.CHECKED,
           "seconds": first_paper.SECONDS}
    group = typer.main.get_command(app).commands["bench"]
    for name in ("first-paper", "accuracy", "growth"):
        given = {param.name: param.default for param in group.commands[name].params}
        assert {key: given[key] for key in own if key in given} == {
            key: own[key] for key in own if key in given}
    page = (Path(__file__).parents[2] / "docs/first-paper.md").read_text(encoding="utf-8")
    assert f"on the first {first_paper.CHECKED} arms of each kind" in page


def test_the_jacobians_are_those_of_pinocchio(monkeypatch):
    rng = np.random.default_rng(5)
    some, q = arms.draw(4, rng), rng.uniform(-3.0, 3.0, (4, 6))
    for i, J in enumerate(some.jacobians(q)):
        table = replace(KUKA_LWR, name="some", a=tuple(some.a[i]), d=tuple(some.d[i]),
                        alpha=tuple(np.degrees(some.alpha[i])), range=(180.0,) * 6,
                        velocity=(1.0,) * 6, mass=(1.0,) * 6, control_points=())
        monkeypatch.setitem(TABLES, "some", table)
        state = State.at(Robot.named("some"), q[i])
        p = state.position(state.robot.frame("end_effector"))
        linear = state.J[:3] + np.cross(state.J[3:].T, p).T
        np.testing.assert_allclose(J, np.vstack([linear, state.J[3:]]), atol=1e-12)


def test_regular_arms_are_regular_and_near_singular_ones_lack_one_direction():
    regular = np.linalg.svd(arms.regular(200), compute_uv=False)
    near = np.linalg.svd(arms.near_singular(200), compute_uv=False)
    assert regular[:, -1].min() >= arms.REGULAR
    assert near[:, -2].min() >= arms.REGULAR
    assert near[:, -1].min() >= arms.NEAREST
    assert near[:, -1].max() < 0.02
    assert np.percentile(near[:, -1], 10) < 1e-5


@pytest.mark.parametrize("case", [
    rank_cases.generic, rank_cases.more_rows_than_joints, rank_cases.row_repeated_inside_a_level,
    rank_cases.rows_repeated_in_a_lower_level, rank_cases.zero_rows,
    rank_cases.conflicting_targets, rank_cases.one_joint, rank_cases.no_freedom_left])
def test_rational_arithmetic_gives_the_answer_of_the_oracle(case):
    h = rank_cases.build(case, with_reference=True)
    np.testing.assert_allclose(exact.exact(h), oracle.solve(h), rtol=1e-10, atol=1e-10)


def test_rational_arithmetic_has_no_tolerance():
    h = Hierarchy.from_levels([([[1.0, 0.0]], [0.0]), ([[1.0, 2.0**-40]], [1.0])])
    assert exact.exact(h).tolist() == [0.0, 2.0**40]


def test_the_damped_reference_is_that_of_the_oracle():
    for h in accuracy.hierarchies(accuracy.CASES[2], 20, 0)[0]:
        np.testing.assert_allclose(exact.damped(h, 0.05, 0.1), oracle.solve(h, 0.05, 0.1),
                                   atol=1e-9)


@pytest.mark.parametrize("case", [c for c in accuracy.CASES if not c.damping], ids=lambda c: c.name)
def test_the_least_that_a_task_can_miss_is_what_the_exact_answer_misses(case):
    for h, least in zip(*accuracy.hierarchies(case, 5, 3), strict=True):
        x = exact.exact(h)
        rounding = 1e-14 * (1.0 + np.linalg.norm(x))
        np.testing.assert_allclose(h.violations(x), least, atol=rounding)


def test_a_row_for_every_resolver_and_case(tables):
    errors, _, _ = tables
    labels = {resolver.label for resolver in map(make, names())} | {"tpm-published"}
    labels |= {"reverse in-order"} if "reverse" in names() else set()
    for case in accuracy.CASES:
        rows = [row for row in errors if row["case"] == case.name]
        expected = labels if case.damping else labels | {accuracy.NUMPY}
        assert {row["resolver"] for row in rows} == expected
        assert all(row["failed"] == 0 and row["arms"] == 50 for row in rows)


def test_strict_resolvers_reach_all_that_the_tasks_can_have(tables):
    errors, _, _ = tables
    for row in errors:
        if row["resolver"] in claims() and row["case"] in ("regular", "conflict", "crowded"):
            worst = [row[key] for key in row if key.endswith("_max")]
            assert max(worst) < claims()[row["resolver"]], row
            assert row["certified"] == 1.0, row


def test_damped_resolvers_but_reverse_agree_with_the_damped_reference(tables):
    errors, _, _ = tables
    for row in errors:
        if row["case"] == "damped" and row["resolver"] in claims().keys() - {"reverse in-order"}:
            assert row["x_max"] < claims()[row["resolver"]], row


def test_the_table_tells_who_is_not_strict(tables):
    errors, _, _ = tables
    found = {(row["case"], row["resolver"]): row for row in errors}
    assert found["conflict", "augmented"]["task_1_max"] > 0.1
    assert found["regular", "tpm-published"]["task_3_max"] < 1e-9
    assert found["crowded", "tpm-published"]["task_4_max"] > 0.1
    assert found["crowded", "tpm-published"]["certified"] < 1.0


def test_the_sentence_under_a_table_names_the_tasks_that_are_missed():
    rows = [{"resolver": name, "x_max": 0.0, "task_1_max": 1e-15, "task_2_max": worst,
             "task_3_max": 1e-15}
            for name, worst in (("one", 1e-14), ("another", 0.5), ("third", 2e-15))]
    assert accuracy.said(accuracy.CASES[0], rows) == (
        "Result: the smallest possible errors are reached by one and third, to between 2e-15 "
        "(third) and 1e-14 (one); another misses task 2 by up to 0.5, the rest by 1e-15.")


def test_a_resolver_that_never_answers_is_counted_and_reaches_nothing(capsys, monkeypatch):
    def nothing(h):
        return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)

    monkeypatch.setattr(accuracy, "entrants", lambda damping: {"silent": nothing})
    (row,) = accuracy.run(3, 2, cases=accuracy.CASES[:1])
    assert row["failed"] == 3
    assert row["certified"] == 0.0
    said = " ".join(capsys.readouterr().out.split())
    assert "no answer: silent 3" in said
    assert "no answers" in said


def test_under_damping_it_names_who_finds_another_answer():
    rows = [{"resolver": "one", "x_max": 1e-12}, {"resolver": "another", "x_max": 0.25}]
    assert accuracy.said(accuracy.CASES[2], rows) == (
        "Result: the damped reference x is found by one, to 1e-12; another x by another, "
        "up to 0.2 away.")


def test_every_strict_resolver_is_timed_at_every_size(tables):
    _, times, _ = tables
    sizes = {("tasks", *size) for size in growth.TASKS[:3]} | {
        ("joints", *size) for size in growth.JOINTS[:3]}
    assert {(row["figure"], row["joints"], row["tasks"], row["resolver"]) for row in times} == {
        (*size, label) for size in sizes
        for label in accuracy.entrants().keys() - set(growth.LEVEL_LESS)}
    assert {"tpm", "tpm-published", "recursive", "hcod", accuracy.NUMPY} <= {
        row["resolver"] for row in times}
    assert all(row["solves"] >= 1 and row["median_us"] > 0.0 for row in times)


def test_a_time_is_the_median_and_the_95th_percentile_of_its_calls():
    timed = growth.Timed("some", 7, 2, lambda: None, times=[1000 * i for i in range(1, 102)])
    row = timed.row("tasks")
    assert (row["solves"], row["median_us"], row["p95_us"]) == (101, 51.0, 96.0)


def test_an_exponent_is_the_slope_of_the_upper_half_of_the_sizes():
    rows = [{"figure": "joints", "resolver": "some", "joints": n, "median_us": max(100.0, n**2)}
            for n in (1, 3, 9, 20, 40, 80)]
    assert growth.exponents(rows, "joints") == {"some": pytest.approx(2.0)}


def test_no_name_in_the_figure_is_written_over_another():
    spread = growth_figure._spread([0.1, 0.11, 0.5, 0.9, 0.9])
    assert np.diff(spread).min() >= growth_figure._APART - 1e-12
    assert spread[2] == pytest.approx(0.5)


def test_all_is_written_into_the_folder(tables):
    errors, times, folder = tables
    for name, rows in (("errors.csv", errors), ("growth.csv", times)):
        with (folder / name).open() as file:
            assert len(list(csv.DictReader(file))) == len(rows)
    assert {path.name for path in folder.iterdir()} == {
        "errors.csv", "growth.csv", "machine.json", "growth.svg", "growth.png"}
