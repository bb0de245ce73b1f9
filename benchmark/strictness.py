"""Does a lower task disturb an upper one while velocity limits are active?

A KUKA LWR tracks a step of its end effector that is too fast for its joints, and with lower
priority another posture; every tick is resolved twice at the same state, with and without the
posture: the scene `step` of the packages' comparison, asked of every resolver that handles bounds.
A resolver whose answer is clipped at the limits shows what a lack of strictness looks like.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmark.packages import OWN, Entrant
from benchmark.peers.compare import Log, measure
from benchmark.peers.hierarchy import arm
from benchmark.peers.moving import QUESTIONS, STEP_TICKS, judge_step, make_scenes
from benchmark.peers.scenes import Arm
from benchmark.report import Column, Report, Row, Section, Table, power, whole, yes
from hierarchy import Hierarchy
from solvers import Resolution, make, names
from solvers.qp.backends import BACKENDS, installed

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


def cut_off(scene: Arm, posture: bool) -> tuple[Any, Any]:
    """Ask `tpm` for all levels but the first, whose bounds clip its answer: not strict."""
    def solve(h: Hierarchy, memory: Any) -> Resolution:
        n = h.n
        rest = h.changed(A=h.A[n:], lower=h.lower[n:], upper=h.upper[n:], sizes=h.sizes[1:],
                         names=h.names[1:])
        res = make("tpm").solve(rest)
        return Resolution(np.clip(res.x, h.lower[:n], h.upper[:n]), res.status)

    return arm(scene, posture, solve)


def entrants() -> list[Entrant]:
    """Return every resolver that handles bounds, in each of its settings, and one that does not."""
    every = [(make(name, **more), more) for name in names() for more in _SETTINGS.get(name, [{}])]
    return [*(OWN.peer("arm", one.label, resolver=one.name, **more)
              for one, more in every if one.handles != "equalities"),
            Entrant("tpm, cut off", OWN, "benchmark.strictness:cut_off")]


def run() -> Report:
    """Let all run the step; the rows have what `judge_step` finds, and who is strict."""
    with tempfile.TemporaryDirectory() as folder:
        scene = make_scenes(Path(folder))["step"]

        def judged(log: Log, _: Any) -> Row:
            found, failed = judge_step(log, scene), int(log["failed"].sum())
            return {"ticks": len(log["t"]), "failed": failed, **found,
                    "strict": found["moved_m"] <= AIM and not failed}

        rows, missing = measure(entrants(), QUESTIONS, [
            ("open", asdict(scene), True), ("turn", STEP_TICKS, 0)], judged)
    title = "Motion of the end effector due to the posture, which has lower priority [m]"
    text = f"strict: at most {AIM:g} m per tick, and no tick without an answer."
    return Report("Strictness at the limits", [
        Section(title, [Table(title, rows, _COLUMNS)], text)], {"strictness": rows}, missing)
