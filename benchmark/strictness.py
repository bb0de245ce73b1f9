"""Does a lower task disturb an upper one while velocity limits are active?

A KUKA LWR tracks a step of its end effector that is too fast for its joints, and with lower
priority another posture; every tick is resolved twice at the same state, with and without the
posture: the scene `step` of the packages' comparison, asked of every resolver that handles bounds.
A resolver whose answer is clipped at the limits shows what a lack of strictness looks like.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from benchmark.peers.compare import joined
from benchmark.peers.moving import judge_step, make_scenes
from benchmark.peers.ours import arm
from benchmark.peers.questions import Moving
from benchmark.report import Report, Section
from benchmark.store import Row
from benchmark.tables import Column, Table, power, whole, yes
from hierarchy import Hierarchy, HierarchyError
from scenarios.results.pool import ended
from solvers import Resolution, Resolver, make, names
from solvers.qp.backends import BACKENDS, installed
from solvers.resolver import Handles

AIM = 1e-9                       # [m per tick] of the end effector
RATIOS = (10.0, 100.0, 1000.0)   # of weights of successive levels
_FORMS = {"sns": ("optimal",)}   # besides the default
_COLUMNS = (Column("max per\ntick", "moved_m", power), Column("last\ntick", "last_m", power),
            Column("limits\nprevent", "prevented_m", power),
            Column("final\nerror", "error_m", power), Column("at\nlimit", "at_limit_ticks", whole),
            Column("over\n[rad/s]", "excess_rad_s", power), Column("fail", "failed", whole),
            Column("strict", "strict", yes))


@final
@dataclass(frozen=True, kw_only=True)
class CutOff(Resolver):
    """`tpm` on all levels but the first, whose bounds clip its answer. Not strict."""

    name: ClassVar[str] = "tpm, cut off"
    handles: ClassVar[Handles] = "bounds"

    @property
    def strict(self) -> bool:
        """Never: clipping affects every level."""
        return False

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h, whose first level bounds every unknown."""
        n = h.n
        rest = h.changed(A=h.A[n:], lower=h.lower[n:], upper=h.upper[n:], sizes=h.sizes[1:],
                         names=h.names[1:])
        res = make("tpm").solve(rest)
        return Resolution(np.clip(res.x, h.lower[:n], h.upper[:n]), res.status)


def able() -> list[Resolver]:
    """Return every resolver that handles bounds, with each backend and ratio."""
    found: list[Resolver] = []
    for name in names():
        if name == "hqp":
            found += [make(name, backend=backend) for backend in BACKENDS if installed(backend)]
        elif name == "weighted":
            found += [make(name, ratio=ratio) for ratio in RATIOS]
        else:
            found += [make(name), *(make(name, form=form) for form in _FORMS.get(name, ()))]
    return [resolver for resolver in found if resolver.handles != "equalities"]


def strictness(resolver: Resolver, duration: float = 2.0) -> Row:
    """Run the step for `duration` [s]; see `judge_step`, and `strict`: whether it is so.

    Raises
    ------
    HierarchyError : it has no answer in any tick, as when it does not handle bounds.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene = make_scenes(Path(folder))["step"]
        asked = Moving(arm, {"resolver": resolver})
        asked.open(asdict(scene), beside=True)
        reply = asked.turn(round(duration / scene.period), 0)
        log = joined([reply])
        if log["failed"].all():
            raise HierarchyError(f"{resolver.label}: {reply['why']}")
        found, failed = judge_step(log, scene), int(log["failed"].sum())
    return {"entrant": resolver.label, "ticks": len(log["t"]), "failed": failed, **found,
            "strict": found["moved_m"] <= AIM and not failed}


def run(resolvers: Iterable[Resolver] | None = None, duration: float = 2.0) -> Report:
    """Measure resolvers, by default all that handle bounds."""
    chosen = [*able(), CutOff()] if resolvers is None else list(resolvers)
    found = {resolver.label: row for resolver, row in ended(
        partial(strictness, duration=duration), chosen)}
    rows = [row for one in chosen if (row := found[one.label])]
    title = "Motion of the end effector due to the posture, which has lower priority [m]"
    text = f"strict: at most {AIM:g} m per tick, and no tick without an answer."
    return Report("Strictness at the limits", [
        Section(title, [Table(title, rows, _COLUMNS)], text)], {"strictness": rows},
        {label: "its process ended, as said above" for label, row in found.items() if not row})

