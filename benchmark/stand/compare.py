"""Times of a whole tick of inverse dynamics, with the quality of each package's answers."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmark.packages import OWN, PLACO, TSID, Entrant
from benchmark.report import Report, Section
from benchmark.stand.judge import Judge, judge
from benchmark.stand.ours import TASKS
from benchmark.stand.states import TICKS, make_stand
from benchmark.tables import Column, Table, power, text, whole
from benchmark.turns import Turns, measure

QUESTIONS = "benchmark.stand.questions:Questions"
_HERE = "benchmark.stand"

ENTRANTS = (
    Entrant("hcod", OWN, f"{_HERE}.ours:Ours", {"resolver": "hcod"}),
    Entrant("weighted", OWN, f"{_HERE}.ours:Weighted"),
    Entrant("tsid fast", TSID, f"{_HERE}.with_tsid:Tsid", {"solver": "SolverHQuadProgFast"}),
    Entrant("tsid", TSID, f"{_HERE}.with_tsid:Tsid", {"solver": "SolverHQuadProg"}),
    Entrant("placo", PLACO, f"{_HERE}.with_placo:Placo"),
)
NOTES = """\
tick: kinematics, dynamics, rows, solve, torques, from Python [us]. solve: the solve alone, where \
it can be called alone. dynamics: largest residual of the equations of motion [N, N m]. contact: \
of the soles' rest [m/s^2]. torque: beyond a limit [N m]. friction: wrench of a sole that its \
corners cannot push [N]. Below: median and largest miss of each task [m/s^2, rad/s^2]."""
_COLUMNS = (Column("tick\nmedian", "median_us"), Column("\np95", "p95_us"),
            Column("\np99.9", "p99.9_us"), Column("solve\nmedian", "solve_us"),
            *(Column(key, f"{key} max", power) for key in ("dynamics", "contact", "torque",
                                                           "friction")),
            Column("fail", "failed", whole))
_MISSES = (*(Column(f"{task if of == 'median' else ''}\n{of}", f"{task} {of}", power)
             for task in TASKS for of in ("median", "max")),
           Column("priorities", "priorities", text), Column("version", "version", str))


def run(entrants: Sequence[Entrant] = ENTRANTS, ticks: int = TICKS) -> Report:
    """Ask all entrants at the same states, and judge their answers by our model.

    They take turns until each has been asked `ticks` times.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        of = Judge(*make_stand(folder, ticks))
        # One turn over all states first, which compiles, fills caches and is not counted.
        rows, missing = measure(entrants, QUESTIONS, (str(folder / "scene.json"),),
                                Turns(ticks, ticks, 250, 20),
                                lambda log, why, _: {**judge(log, of), "why": why})
    title = "One tick of inverse dynamics of a humanoid on two feet"
    tables = [Table(title, rows, _COLUMNS), Table("Missed by each task", rows, _MISSES)]
    return Report("Inverse dynamics beside other packages", [Section(title, tables, NOTES)],
                  {"stand": rows}, missing, failed=bool(missing))
