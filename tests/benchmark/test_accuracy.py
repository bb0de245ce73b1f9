"""Accuracy and growth: their arms, their references, who reaches what, their rows."""


import pytest

from benchmark.solve import accuracy, growth
from benchmark.solve.ours import Ours


@pytest.fixture(scope="module")
def tables():
    """Errors and times of a small run."""
    few = pytest.MonkeyPatch()
    few.setattr(growth, "FIRST_PAPER", {key: sizes[:3] for key, sizes in
                                        growth.FIRST_PAPER.items()})
    found = {**accuracy.run(arms=50, checked=10).rows, **growth.run(seconds=0.0).rows}
    few.undo()
    return found["errors"], found["growth"]


def claims():
    """Accuracy by label of those that claim to be strict."""
    made = [(one.label, Ours(**one.options).resolver) for one in accuracy.entrants()
            if "resolver" in one.options]
    return {label: resolver.accuracy for label, resolver in made if resolver.strict}


def test_strict_resolvers_reach_all_that_the_tasks_can_have(tables):
    errors, _ = tables
    for row in errors:
        if row["entrant"] in claims() and row["case"] in ("regular", "conflict", "crowded"):
            worst = [row[key] for key in row if key.endswith("_max")]
            assert max(worst) < claims()[row["entrant"]], row
            assert row["certified"] == 1.0, row
