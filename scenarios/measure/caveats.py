"""What has to be said about resolvers before one of them is called the best."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from hierarchy.words import listed
from scenarios.loop.facts import ResolverFacts

_SAME = {"each pivot": "each level"}  # the same x while no level loses rank


def caveats(resolvers: Mapping[str, ResolverFacts]) -> Iterator[str]:
    """Yield which columns have no strict priorities, and which damp something else than the first.

    resolvers : label of a column to its resolver.
    """
    loose = [label for label, one in resolvers.items() if not one.strict]
    if loose:
        yield f"{listed(loose)} {_verb(loose, 'is', 'are')} not strict at every rank"
    damped = {label: _SAME.get(one.damped, one.damped) for label, one in resolvers.items()}
    first = next(iter(damped), "")
    other = [label for label, what in damped.items() if what != damped[first]]
    if other:
        yield f"{listed(other)} {_verb(other, 'damps', 'damp')} otherwise than {first}"


def _verb(labels: list[str], one: str, many: str) -> str:
    return one if len(labels) == 1 else many
