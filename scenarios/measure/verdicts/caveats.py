"""What has to be said about resolvers before one of them is called the best."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from hierarchy.words import listed
from scenarios.recording.facts import ResolverFacts

_SAME = {"each pivot": "each level"}  # the same x while no level loses rank


def caveats(resolvers: Mapping[str, ResolverFacts]) -> Iterator[str]:
    """Yield which columns have no strict priorities, and which damp something else than the first.

    resolvers : label of a column to its resolver.
    """
    damped = {label: _SAME.get(one.damped, one.damped) for label, one in resolvers.items()}
    first = next(iter(damped), "")
    said: dict[tuple[str, ...], list[str]] = {}
    for labels, one, many in (
            (tuple(label for label, one in resolvers.items() if not one.strict),
             "is not strict at every rank", "are not strict at every rank"),
            (tuple(label for label, what in damped.items() if what != damped[first]),
             f"damps differently from {first}", f"damp differently from {first}")):
        if labels:
            said.setdefault(labels, []).append(one if len(labels) == 1 else many)
    yield from (f"{listed(labels)} {listed(what)}" for labels, what in said.items())
