"""The resolvers of a comparison: which by default, and which can resolve a scenario."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from hierarchy.errors import HierarchyError, brief
from solvers.qp import backends
from solvers.resolver import Handles

if TYPE_CHECKING:
    from scenarios.config.scenario import Scenario

# The methods that the letter compares, and ours, by the rows that a scenario has.
DEFAULT_RESOLVERS: dict[Handles, tuple[str, ...]] = {
    "equalities": ("tpm-published", "tpm", "recursive", "augmented", "hqp",
                   "hqp:backend=osqp", "hqp:backend=daqp", "hcod"),
    "bounds": ("tpm", "sns", "sns:form=optimal", "weighted", "hqp", "hcod"),
    "inequalities": ("weighted", "hqp", "hqp:backend=daqp", "hcod"),
    "activations": ("smooth",)}


def default_resolvers(asked: Handles = "equalities") -> tuple[tuple[str, ...], dict[str, str]]:
    """Return the installed ones of DEFAULT_RESOLVERS, and how to install the others."""
    wanted = {spec: spec.partition(":backend=")[2] for spec in DEFAULT_RESOLVERS[asked]}
    missing = {spec: "pip install 'task-hierarchy[qp]'" for spec, backend in wanted.items()
               if backend in backends.BACKENDS and not backends.installed(backend)}
    return tuple(spec for spec in wanted if spec not in missing), missing


def usable(scenario: Scenario, specs: Sequence[str] | None
           ) -> tuple[dict[str, Scenario], list[str]]:
    """Return the scenario under each spec that can resolve it, and why others cannot.

    `specs` None stands for the installed ones of DEFAULT_RESOLVERS.
    """
    wanted = default_resolvers(scenario.asks)[0] if specs is None else specs
    if isinstance(wanted, str) or not isinstance(wanted, Iterable):
        raise HierarchyError(f"resolvers: expected a list of names, got {brief(wanted)}")
    can, refused = {}, []
    for spec in dict.fromkeys(wanted):
        changed = scenario.with_resolver(spec)
        resolver, asked = changed.make_resolver(), changed.asks
        if resolver.can_resolve(asked):
            can[spec] = changed
        else:
            refused.append(f"{spec} is not run on {scenario.name}, which asks for {asked}: it "
                           f"resolves {resolver.handles}")
    return can, refused
