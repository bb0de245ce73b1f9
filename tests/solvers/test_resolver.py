"""The registry, the status, the resolution; what importing costs."""

from dataclasses import fields
from unittest import mock

import numpy as np
import pytest
from refusals import refused

from hierarchy import Hierarchy
from hierarchy.errors import UnknownNameError
from solvers import Status, make, names
from solvers.resolvers.set_based import SetBased
from solvers.resolvers.settled import Settled
from solvers.workspace import WORKSPACE


@pytest.mark.parametrize("name", [*names(), "smooth"])
def test_settings_of_every_resolver_are_checked_by_name(name):
    assert isinstance(make(name, damping=1).damping, float)
    assert all(field.kw_only for field in fields(make(name)))
    refused("did you mean 'damping'", make, name, dampnig=0.1)
    refused("unknown setting", make, name, _settings=1)
    for setting, value in [("damping", float("nan")), ("threshold", float("inf")),
                           ("rank_tolerance", True)]:  # others are in tests/helpers/computed.py
        refused(f"{name}: {setting} = ", make, name, **{setting: value})


@pytest.mark.parametrize(("name", "kinds"), [
    ("recursive", {"equalities"}), ("tpm", {"equalities", "bounds"}),
    ("hcod", {"equalities", "bounds", "inequalities"}), ("smooth", {"equalities", "activations"})])
def test_a_resolver_says_which_rows_it_can_resolve(name, kinds):
    assert {kind for kind in ("equalities", "bounds", "inequalities", "activations")
            if make(name).can_resolve(kind)} == kinds
    refused("equality", make(name).can_resolve, "equality")


def test_what_overflows_on_the_way_is_a_failure_and_says_nothing_else(monkeypatch):
    tiny = Hierarchy.from_levels([([[1e-160, 0.0]], [1.0])])
    monkeypatch.setattr("solvers.resolvers.hqp._Cascade.run",
                        mock.Mock(side_effect=np.linalg.LinAlgError))
    for resolver in (make("smooth", damping=0.0), make("hqp")):
        res = resolver.solve(tiny)
        assert (res.status, res.x.tolist()) == (Status.NUMERICAL_FAILURE, [0.0, 0.0])


@pytest.mark.parametrize(("name", "settings"), [
    ("smooth", {"eta": 0.0}), *(("hcod", {"max_iterations": wrong}) for wrong in (2**31, True)),
    ("recursive", {"method": "selective", "largest": 0.0}), ("merged", {"scales": ("hand",)}),
    ("recursive", {"method": "nakamura", "isotropic": 0.1}), ("weighted", {"strict_levels": True}),
    *(("weighted", {"weights": wrong}) for wrong in ([1.0, 0.0], [1.0, "2"], "12"))], ids=str)
def test_a_setting_that_makes_no_sense_is_named_with_its_value(name, settings):
    setting, value = list(settings.items())[-1]
    refused(f"{name}: {setting} = {value!r}", make, name, **settings)


@pytest.mark.parametrize("form", ["null-space", "slack"])
def test_the_programs_of_hqp_begin_at_a_memory_of_their_levels(form, monkeypatch):
    qpsolvers, begun = pytest.importorskip("qpsolvers"), []
    solve = qpsolvers.solve_problem
    monkeypatch.setattr(qpsolvers, "solve_problem", lambda *given, initvals, **more: begun.append(
        initvals) or solve(*given, initvals=initvals, **more))
    h = Hierarchy.from_levels([(np.eye(2)[:1], [-1.0], [1.0]), ([[1.0, 1.0]], [3.0])])
    memory = make("hqp", form=form).solve(h).memory
    for given, begins in ((None, False), (memory, True), (memory[:1], False)):
        begun.clear()
        make("hqp", form=form).solve(h, given)
        assert {one is not None for one in begun} == {begins}
    begun.clear()  # that of other levels may be far off, which proxqp took seconds to leave
    make("hqp", form=form).solve(h, 1e12 * memory)
    assert max(np.abs(one).max() for one in begun if one is not None) <= 1e6


def test_settings_of_parts_are_named():
    refused("merged: scales: 'hand'", make, "merged", scales={"hand": 0.0})
    refused("unknown form of hqp 'slak'; did you mean 'slack'", make, "hqp", form="slak",
            error=UnknownNameError)
    for name, key in (("hqp", "backend"), ("reverse", "form")):
        refused(f"{key} of {name}", make, name, **{key: np.zeros(2)}, error=UnknownNameError)
    assert make("hcod", max_iterations=2**31 - 1).max_iterations == 2147483647
    for made, wrong in ((SetBased, {"tolerance": -1.0}), (SetBased, {"most": 0}),
                        (Settled, {"period": 0.0}), (Settled, {"softness": -1.0, "period": 0.1})):
        refused(next(iter(wrong)), made, inner=make("tpm"), **wrong)
    assert Settled(inner=make("tpm"), period=0.1, softness=0.0).softness == 0.0


# The work space: its content never matters.
@pytest.mark.parametrize("left", range(-1, 6))
def test_nor_do_integers_left_in_it_by_a_solve_that_refuted_a_sign(left, monkeypatch):
    rows = [[-2.0], [-2.0]]
    memory = make("hcod").solve(Hierarchy.from_levels([(rows, [-np.inf, 1], [1, np.inf])])).memory
    monkeypatch.setattr(WORKSPACE, "array", np.full(1000, left).view(np.float64))
    h = Hierarchy.from_levels([(rows, [-np.inf, 2], [-1, np.inf])])
    assert make("hcod").solve(h, memory).iterations == 2
