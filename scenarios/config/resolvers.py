"""The resolvers of a comparison by default."""

from __future__ import annotations

from solvers.qp import backends
from solvers.resolver import Handles

# The methods that the letter compares, and ours; for inequalities all resolvers that accept them.
DEFAULT_RESOLVERS: dict[Handles, tuple[str, ...]] = {
    "equalities": ("tpm", "tpm:form=staircase", "recursive", "augmented", "hqp",
                   "hqp:backend=osqp", "hqp:backend=daqp", "hcod"),
    "bounds": ("tpm:form=staircase", "sns", "sns:form=optimal", "weighted", "hqp", "hcod"),
    "inequalities": ("weighted", "hqp", "hqp:backend=daqp", "hcod"),
    "activations": ("smooth",)}


def default_resolvers(asked: Handles = "equalities") -> tuple[tuple[str, ...], dict[str, str]]:
    """Return the installed ones of DEFAULT_RESOLVERS, and how to install the others."""
    wanted = {spec: spec.partition(":backend=")[2] for spec in DEFAULT_RESOLVERS[asked]}
    missing = {spec: "pip install 'task-hierarchy[qp]'" for spec, backend in wanted.items()
               if backend in backends.BACKENDS and not backends.installed(backend)}
    return tuple(spec for spec in wanted if spec not in missing), missing
