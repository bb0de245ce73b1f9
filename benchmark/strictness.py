"""Does a lower task disturb an upper one while velocity limits are active?

A KUKA LWR tracks a step of its end effector that is too fast for its joints, and with lower
priority another posture; every tick is resolved twice at the same state, with and without the
posture: the scene `step` of the packages' comparison, asked of every resolver that handles bounds.
A resolver whose answer is clipped at the limits shows what a lack of strictness looks like.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from benchmark.packages import OWN, Entrant
from benchmark.peers.compare import Log, measure
from benchmark.peers.moving import QUESTIONS, judge_step, make_scenes
from benchmark.peers.ours import arm
from benchmark.peers.scenes import Arm
from benchmark.report import Report, Section
from benchmark.store import Row
from benchmark.tables import Column, Table, power, whole, yes
from hierarchy import Hierarchy
from solvers import Resolution, Resolver, make, names
from solvers.qp.backends import BACKENDS, installed
from solvers.resolver import Handles

AIM = 1e-9                       # [m per tick] of the end effector
_SETTINGS: Mapping[str, Sequence[Mapping[str, Any]]] = {  # of those that have several
    "hqp": [{"backend": backend} for backend in BACKENDS if installed(backend)],
    "weighted": [{"ratio": ratio} for ratio in (10.0, 100.0, 1000.0)],
    "sns": [{}, {"form": "optimal"}]}
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
    strict: ClassVar[bool] = False  # clipping affects every level

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h, whose first level bounds every unknown."""
        n = h.n
        rest = h.changed(A=h.A[n:], lower=h.lower[n:], upper=h.upper[n:], sizes=h.sizes[1:],
                         names=h.names[1:])
        res = make("tpm").solve(rest)
        return Resolution(np.clip(res.x, h.lower[:n], h.upper[:n]), res.status)


def cut_off(scene: Arm, posture: bool) -> tuple[Any, Any]:
    """The adapter of `CutOff`."""
    return arm(scene, posture, CutOff())


def entrants() -> list[Entrant]:
    """Return every resolver that handles bounds, in each of its settings, and one that does not."""
    every = [(make(name, **more), more) for name in names() for more in _SETTINGS.get(name, [{}])]
    return [*(Entrant(one.label, OWN, "benchmark.peers.ours:arm", {"resolver": one.name, **more})
              for one, more in every if one.handles != "equalities"),
            Entrant(CutOff.name, OWN, "benchmark.strictness:cut_off")]


def run(resolvers: Sequence[Entrant] | None = None, duration: float = 2.0) -> Report:
    """Let resolvers, by default all that handle bounds, run the step for `duration` [s].

    The rows have what `judge_step` finds, and whether the resolver is strict.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene = make_scenes(Path(folder))["step"]

        def judged(log: Log, _: Any) -> Row:
            found, failed = judge_step(log, scene), int(log["failed"].sum())
            return {"ticks": len(log["t"]), "failed": failed, **found,
                    "strict": found["moved_m"] <= AIM and not failed}

        ticks = round(duration / scene.period)
        rows, missing = measure(entrants() if resolvers is None else resolvers, QUESTIONS,
                                [("open", asdict(scene), True), ("turn", ticks, 0)], judged)
    title = "Motion of the end effector due to the posture, which has lower priority [m]"
    text = f"strict: at most {AIM:g} m per tick, and no tick without an answer."
    return Report("Strictness at the limits", [
        Section(title, [Table(title, rows, _COLUMNS)], text)], {"strictness": rows}, missing)
