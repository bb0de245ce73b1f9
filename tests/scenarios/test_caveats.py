from scenarios.config import load
from scenarios.measure.verdicts.caveats import caveats
from scenarios.recording.facts import resolver_facts


def said(name, *specs):
    return list(caveats({spec: resolver_facts(load(name).with_resolver(spec)) for spec in specs}))


def test_nothing_is_said_of_strict_resolvers_that_damp_the_same():
    assert said("ellipse", "tpm", "recursive", "hcod", "sns") == []
    assert said("ellipse-limits", "tpm", "hcod") == []


def test_who_is_not_strict_or_damps_otherwise_is_named():
    assert said("ellipse", "tpm", "hcod", "weighted", "augmented") == [
        "weighted and augmented are not strict at every rank and damp differently from tpm"]
    assert said("ellipse-limits", "tpm", "sns", "weighted") == [
        "weighted is not strict at every rank", "sns and weighted damp differently from tpm"]


def test_pivots_are_damped_as_levels_are():
    assert said("ellipse", "tpm-published", "tpm") == [
        "tpm-published is not strict at every rank"]


def test_damping_differs_where_limits_act():
    assert said("ellipse-limits", "tpm", "sns") == ["sns damps differently from tpm"]


def test_one_that_is_not_damped_is_named():
    assert said("ellipse", "tpm", "tpm:damping=0.0") == [
        "tpm:damping=0.0 damps differently from tpm"]
