import pytest

from hierarchy import HierarchyError
from scenarios.cell.build import build
from scenarios.config import ScenarioError, load, shipped


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_loads_under_its_own_name_and_reads_back_the_same(name, tmp_path):
    scenario = load(name)
    assert scenario.name == name
    assert scenario.title
    scenario.make_resolver()
    (tmp_path / "scenario.toml").write_text(scenario.to_toml())
    assert load(tmp_path / "scenario.toml") == scenario


def test_a_variant_has_two_names_and_those_of_a_file_extend_it(tmp_path):
    assert load("ellipse:35deg") == load("ellipse-35deg")
    (tmp_path / "mine.toml").write_text('extends = "ellipse:limits"\nname = "mine"\n'
                                        "[variants.wide.pointing]\nalpha_d = 50.0\n")
    assert load(f"{tmp_path}/mine.toml").pointing.alpha_d == 5.0
    wide = load(f"{tmp_path}/mine.toml:wide")
    assert (wide.name, wide.pointing.alpha_d) == ("mine-wide", 50.0)
    assert wide.limits == load("ellipse-limits").limits
    with pytest.raises(HierarchyError, match="wide"):
        load(f"{tmp_path}/mine.toml:wid")


def test_changes_are_toml_values_at_dotted_keys():
    s = load("ellipse", ["pointing.alpha_d=35", "pointing.kind=equality",
                         "avoidance.obstacles=[[1, 2, 3]]", "control.options.damping = 0.02"])
    assert (s.pointing.alpha_d, s.pointing.rows) == (35.0, "equality")
    assert s.avoidance.obstacles[0].centre == (1, 2, 3)
    assert s.control.settings() == {"damping": 0.02, "threshold": 0.1}
    assert load("ellipse", {"pointing.alpha_d": 35}).pointing.alpha_d == 35


def test_a_resolver_is_swapped_by_name_keeping_the_shared_settings():
    s = load("ellipse").with_resolver("recursive")
    assert s.control.resolver == "recursive"
    assert s.control.settings() == {"damping": 0.05, "threshold": 0.1}
    assert load("ellipse", ["control.resolver=recursive"]) == s, "changing its name is enough"
    assert s.with_resolver("tpm-published") == load("ellipse")
    t = load("ellipse").with_resolver("tpm:damping=0.01")
    assert t.control.settings() == {"damping": 0.01, "threshold": 0.1}


def test_a_file_extends_another(tmp_path):
    (tmp_path / "mine.toml").write_text(
        'extends = "ellipse"\nname = "mine"\n[pointing]\nalpha_d = 12\n')
    (tmp_path / "yours.toml").write_text(
        'extends = "mine.toml"\nname = "yours"\n[control]\nperiod = 0.002\n')
    s = load(tmp_path / "yours.toml")
    assert (s.name, s.pointing.alpha_d, s.control.period) == ("yours", 12, 0.002)
    assert s.avoidance == load("ellipse").avoidance


def test_a_stack_that_asks_for_nothing_is_refused(tmp_path):
    path = tmp_path / "idle.toml"
    path.write_text('name = "idle"\n[robot]\nmodel = "kuka_lwr"\n'
                    '[control]\nresolver = "tpm"\nduration = 1.0\n')
    with pytest.raises(ScenarioError, match="scenario 'idle': the stack is empty"):
        build(load(path))
