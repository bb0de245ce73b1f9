"""Several scenarios under several resolvers."""

import pytest

from hierarchy import HierarchyError
from scenarios import compare, load


@pytest.mark.slow
def test_a_resolver_that_cannot_resolve_a_scenario_is_not_run_and_is_named(tmp_path):
    limited = load("ellipse", {"name": "limited", "control.duration": 0.01,
                               "control.options": {}, "limits.acceleration": 20.0})
    free = load("ellipse", ["control.duration=0.01"])
    done = compare([free, limited], ["recursive", "hcod"], out=tmp_path / "a")
    assert [(run.scenario.name, run.spec) for run in done.runs] == [
        ("ellipse", "recursive"), ("ellipse", "hcod"), ("limited", "hcod")]
    assert done.refused == ("recursive is not run on limited, which asks for bounds: it resolves "
                            "equalities",)
    assert done.refused[0] in (tmp_path / "a" / "index.html").read_text()
    with pytest.raises(HierarchyError, match="recursive is not run on limited"):
        compare([limited], ["recursive"])
