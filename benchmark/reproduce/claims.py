"""The blocks of pages about the protocol: its claims, and what was found about them."""

from __future__ import annotations

from benchmark.reproduce.protocol import Claim, Protocol, Rows
from benchmark.reproduce.verdicts import judged, shown
from scenarios.measure.statistics import probability


def asked(protocol: Protocol) -> list[str]:
    """Return a table of the quotations: what decides them."""
    lines = ["| section, quotation | decided by | smallest effect |", "|---|---|---|"]
    before = ""
    for one in protocol.claims:
        if one.family == "letter":
            said = f"{one.section}: “{one.quotation}”"
            lines.append(f"| {'the same' if said == before else said} | {_decider(one)} | "
                         f"{_least(protocol, one)} |")
            before = said
    return lines


def untested(protocol: Protocol) -> list[str]:
    """Return the letter's claims that runs do not decide, with the reason."""
    parts = [(*said.removesuffix(")").rsplit(" (", 1), why)
             for said, why in protocol.untested.items()]
    return [f"- {section}: “{quotation}”: {why}." for quotation, section, why in parts]


def found(protocol: Protocol, rows: Rows, family: str) -> list[str]:
    """Return a table of what was found about the claims of a family; of our own, what decides."""
    own = family == "own"
    head = ["claim", *(["decided by, smallest effect"] if own else []), "effect [95 % interval]",
            ", ".join(rows.layouts), "Holm's p", "verdict"]
    lines = [f"| {' | '.join(head)} |",
             "|---" * len(head) + "|"]
    for one in judged(protocol, rows, family):
        each = ", ".join(shown(one.claim, rows, effect).partition(" [")[0]
                         for effect in one.layouts)
        by = f" | {_decider(one.claim)}, {_least(protocol, one.claim)}" if own else ""
        lines.append(f"| {one.claim.text}{by} | {shown(one.claim, rows, one.effect)} | {each} | "
                     f"{probability(one.p).removeprefix('p = ')} | {one.decided} |")
    return lines


def progress(protocol: Protocol, rows: Rows) -> str:
    """Return how much of the protocol has been run."""
    arms = f"starts on each of {len(rows.layouts)} arms, without and with noise."
    if len(rows.seeds) == len(protocol.seeds) and rows.starts == protocol.starts:
        return f"{len(rows.seeds)} seeds, {rows.starts} {arms}"
    return (f"Run so far: {len(rows.seeds)} of {len(protocol.seeds)} seeds, {rows.starts} of "
            f"{protocol.starts} {arms} *Undecided* can change with more.")


def faults(protocol: Protocol, rows: Rows) -> list[str]:
    """Return how much of the protocol has been run, and which columns have runs with a fault."""
    total = rows.blocks.size
    said = [f"`{column}` {total - int(rows.ended(column).sum())} of {total} "
            f"({'; '.join(reason.partition(':')[0] for reason in reasons)})"
            for column, reasons in rows.reasons[0].items()]
    return [f"{progress(protocol, rows)} Runs that ended in a fault: {', '.join(said) or 'none'}."]


def _decider(claim: Claim) -> str:
    if not claim.metric:
        return f"share of runs of `{claim.of}` that reach their end"
    if claim.rival:
        word = "below" if claim.below else "above"
        return f"`{claim.metric}` of `{claim.of}` {word} that of `{claim.rival}`"
    bound = f"at least {claim.least:g}" if claim.most == float("inf") else f"at most {claim.most:g}"
    return f"`{claim.metric}` of `{claim.of}` {bound}"


def _least(protocol: Protocol, claim: Claim) -> str:
    if not claim.rival:
        return f"{100 * protocol.share:g} % of starts"
    return f"{claim.matters:g}{' %' if claim.percent else ' (SI)' if claim.matters < 1 else ''}"
