"""Times of a whole tick of inverse dynamics, with the quality of each package's answers."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from scenarios.bench.machine import machine
from scenarios.bench.peers.entrants import OWN, PLACO, TSID, Entrant
from scenarios.bench.peers.environments import MissingError
from scenarios.bench.peers.process import Process, stage
from scenarios.bench.peers.stand.judge import Judge, judge, read_log
from scenarios.bench.peers.stand.ours import TASKS
from scenarios.bench.peers.stand.states import TICKS, make_stand
from scenarios.bench.rows import table_of_numbers, write_rows
from scenarios.files import write_json

WORKER = "scenarios.bench.peers.stand.worker"
TURN = 250       # ticks per turn
REHEARSED = 20   # ticks at the start of a turn that do not count: cold caches
_HERE = "scenarios.bench.peers.stand"

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


def run(out: Path | None = None, entrants: Sequence[Entrant] = ENTRANTS,
        ticks: int = TICKS) -> list[dict[str, Any]]:
    """Ask all entrants at the same states, judge their answers; print, and return the rows.

    Each has its own process, all on one core; they take turns of TURN ticks until each has been
    asked `ticks` times. Missing entrants are listed with the reason. Writes stand.csv,
    stand-missing.json and machine.json into `out`.
    """
    console = Console(highlight=False, markup=False)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        scene, states = make_stand(folder, ticks)
        logs, missing = _asked(entrants, folder, ticks)
        of = Judge(scene, states)
        rows = [{"entrant": label, **judge(read_log(file), of), **about}
                for label, (file, about) in logs.items()]
    _print(console, rows)
    for label, reason in missing.items():
        console.print(f"skipped: {label} ({reason})")
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        write_json(out / "stand-missing.json", missing)
        write_json(out / "machine.json", machine())
        if rows:
            write_rows(rows, out / "stand.csv")
    return rows


def _asked(entrants: Sequence[Entrant], folder: Path, ticks: int
           ) -> tuple[dict[str, tuple[Path, dict[str, str]]], dict[str, str]]:
    """Return the log of each entrant with what it says of itself, and who is missing and why."""
    core = max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0
    staged, missing = stage(folder / "staged"), {}
    processes: dict[str, Process] = {}
    logs = {}
    try:
        for entrant in entrants:
            try:
                processes[entrant.label] = Process(entrant, folder / "scene.json", staged, core,
                                                   WORKER)
            except MissingError as error:
                missing[entrant.label] = str(error)
        # One turn over all states first, which compiles, fills caches and is not counted.
        turns = [(ticks, ticks)] + [(TURN, REHEARSED)] * -(-ticks // TURN)
        for label, problem in _in_turns(processes, turns).items():
            missing[label] = problem
            processes.pop(label).stop()
        logs = {label: (process.finish(), process.about) for label, process in processes.items()}
    finally:
        for process in processes.values():
            process.stop()
    return logs, missing


def _in_turns(processes: dict[str, Process], turns: Sequence[tuple[int, int]]) -> dict[str, str]:
    """Give every process its turns; return who ended, and why."""
    ended: dict[str, str] = {}
    for number, rehearsed in turns:
        for label, process in processes.items():
            if label not in ended:
                try:
                    process.turn(number, rehearsed)
                except MissingError as error:
                    ended[label] = str(error)
    return ended


def _print(console: Console, rows: list[dict[str, Any]]) -> None:
    table = table_of_numbers((
        "tick\nmedian", "\np95", "\np99.9", "solve\nmedian", "dynamics", "contact", "torque",
        "friction", "fail"), "One tick of inverse dynamics of a humanoid on two feet")
    for row in rows:
        table.add_row(row["entrant"], *(_digits(row[key]) for key in (
            "median_us", "p95_us", "p99.9_us", "solve_us")), *(_power(row.get(f"{key} max"))
            for key in ("dynamics", "contact", "torque", "friction")), str(row["failed"]))
    console.print(table)
    console.print(NOTES, "", sep="\n")
    missed = table_of_numbers((*TASKS, "priorities", "version"),
                              "Missed by each task, median / largest")
    for row in rows:
        missed.add_row(row["entrant"], *(
            f"{_short(row.get(f'{task} median'))} / {_short(row.get(f'{task} max'))}"
            for task in TASKS), row["priorities"], row["version"])
    console.print(missed)


def _digits(value: float | None) -> str:
    return "–" if value is None else f"{value:.0f}" if value >= 100.0 else f"{value:.1f}"


def _power(value: float | None) -> str:
    return "–" if value is None else f"{value:.0e}"


def _short(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"
