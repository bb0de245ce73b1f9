"""The resolvers that a scenario is compared under unless others are named."""

from __future__ import annotations

from solvers.qp.backends import BACKENDS, installed
from solvers.resolver import Handles

# By default every way that the letter compares, and ours; where rows are inequalities, the whole
# field of those that take them.
DEFAULT_RESOLVERS: dict[Handles, tuple[str, ...]] = {
    "equalities": ("tpm", "tpm:form=staircase", "recursive", "augmented", "hqp",
                   "hqp:backend=osqp", "hqp:backend=daqp", "hcod"),
    "bounds": ("tpm:form=staircase", "sns", "sns:form=optimal", "weighted", "hqp", "hcod"),
    "inequalities": ("weighted", "hqp", "hqp:backend=daqp", "hcod")}


def default_resolvers(asked: Handles = "equalities") -> tuple[tuple[str, ...], dict[str, str]]:
    """Return those of DEFAULT_RESOLVERS that can run here, and of the others what brings them."""
    wanted = {spec: spec.partition(":backend=")[2] for spec in DEFAULT_RESOLVERS[asked]}
    missing = {spec: "pip install 'task-hierarchy[qp]'" for spec, backend in wanted.items()
               if backend in BACKENDS and not installed(backend)}
    return tuple(spec for spec in wanted if spec not in missing), missing
