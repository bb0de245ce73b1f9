"""The success rates of a sweep as a sentence."""

from __future__ import annotations

from scenarios.sweep.results import Criterion, Results
from scenarios.words import listed

_IN_WORDS = {"Reached the end": "reached the end", "Touched nothing": "touched nothing",
             "Kept the joint limits": "kept the joint limits",
             "Every tick solved": "had every tick solved"}


def success(results: Results) -> str:
    """Return in how many runs each criterion was met, for all resolvers together if equal."""
    said: dict[str, list[str]] = {}
    for criterion in results.criteria()[:-1]:
        said.setdefault(_who(results, criterion), []).append(_IN_WORDS[criterion.label])
    text = "; ".join(f"{who} {listed(did)}" for who, did in said.items())
    return f"{text[0].upper()}{text[1:]}."


def _who(results: Results, criterion: Criterion) -> str:
    shares = {label: results.share(criterion, label) for label in results.labels}
    met, of = sum(s.met for s in shares.values()), sum(s.of for s in shares.values())
    if met == of:
        return f"all {of} runs" if of > 1 else "the run"
    if met == 0:
        return "no run"
    if len({(share.met, share.of) for share in shares.values()}) == 1:
        each = " under each resolver" if len(shares) > 1 else ""
        return f"{next(iter(shares.values()))} runs{each}"
    return listed([f"{share} runs under {label}" for label, share in shares.items()])
