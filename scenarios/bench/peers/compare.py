"""Times of a whole tick of inverse kinematics, with the quality of each package's solution."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from hierarchy import Robot, State
from hierarchy.problem import Array
from scenarios.bench import strictness
from scenarios.bench.machine import machine
from scenarios.bench.peers.entrants import ENTRANTS, Entrant
from scenarios.bench.peers.environments import MissingError
from scenarios.bench.peers.process import Process, after_nan, stage
from scenarios.bench.peers.scene import Scene, write_scenes
from scenarios.bench.peers.urdf import urdf
from scenarios.bench.rows import table_of_numbers, write_rows
from scenarios.files import write_json

TURN = 1000        # ticks per turn
REHEARSED = 50     # ticks at the start of a turn that do not count: cold caches
WARM_UP = 1000     # ticks before the first turn
_SETTLED = 3.0     # [s] after which the start off the path has no influence
_AT_LIMIT = 1e-6   # [rad/s]

NOTES = """\
Times in microseconds, one core, from Python. tick: kinematics, rows, solve. solve: the solve \
alone, if it can be called alone. at limit: median tick with a joint at its velocity limit. path: \
largest distance [m] from the path after 3 s. moved: largest motion [m per tick] of the end \
effector due to the posture, in a step too fast for the joints. over: largest velocity [rad/s] \
beyond a limit. fail: ticks without a solution, ellipse / step."""


def run(out: Path | None = None, entrants: Sequence[Entrant] | None = None,
        ticks: int = 20_000, seconds: float = 20.0) -> list[dict[str, Any]]:
    """Run all entrants on the same two scenes, judge them with our model; print, return the rows.

    Each has its own process, all on one core; they take turns of TURN ticks, so that noise of the
    machine affects all equally, until each has `ticks` or took `seconds` [s]. Missing entrants are
    listed with the reason. Writes peers.csv, missing.json, machine.json and a figure into `out`.
    """
    console = Console(highlight=False, markup=False)
    chosen = ENTRANTS if entrants is None else entrants
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        scenes = make_scenes(folder)
        write_scenes(scenes, folder / "scenes.json")
        rows, missing = _run_all(chosen, scenes, stage(folder / "staged"), folder, ticks, seconds)
    _print(console, rows)
    for label, reason in missing.items():
        console.print(f"skipped: {label} ({reason})")
    if out is not None:
        _write(rows, missing, out)
    return rows


def make_scenes(folder: Path) -> dict[str, Scene]:
    """Return the scenes `ellipse` and `step`, and write their arm into the folder."""
    robot = Robot.named("kuka_lwr")
    file = folder / f"{robot.name}.urdf"
    file.write_text(urdf(robot))
    start = strictness.START
    goal = State.at(robot, start).position(robot.frame(robot.end_effector)) + strictness.STEP
    ellipse = Scene(str(file), robot.end_effector, robot.joint_names, tuple(start),
                    tuple(robot.velocity_limit.tolist()),
                    tuple(np.add(start, strictness.POSTURE).tolist()), (0.0, 0.6, 0.0),
                    (0.2, 0.0, 0.2), (0.0, 0.1, 0.0), 1.0)
    still = (0.0, 0.0, 0.0)
    return {"ellipse": ellipse, "step": replace(ellipse, centre=tuple(goal.tolist()),
                                                cosine=still, sine=still, turning=0.0)}


def _run_all(entrants: Sequence[Entrant], scenes: dict[str, Scene], staged: Path, folder: Path,
             ticks: int, seconds: float) -> tuple[list[dict[str, Any]], dict[str, str]]:
    processes: list[Process] = []
    missing: dict[str, str] = {}
    rows: list[dict[str, Any]] = []
    core = max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0
    file = folder / "scenes.json"
    try:
        for entrant in entrants:
            with _named(missing, entrant):
                processes.append(Process(entrant, file, staged, core))
        _take_turns(processes, missing, ticks, seconds)
        for process in processes:
            entrant = process.entrant
            if entrant.label not in missing:
                with _named(missing, entrant):
                    rows.append({**judge(process.finish(), scenes), **process.about,
                                 "entrant": entrant.label,
                                 "nan": after_nan(entrant, file, staged)})
    finally:
        for process in processes:
            process.stop()
    return [{"entrant": row.pop("entrant"), **row} for row in rows], missing


class _named:  # noqa: N801
    """Record the reason of a missing entrant, and continue."""

    def __init__(self, missing: dict[str, str], entrant: Entrant) -> None:
        self.missing, self.label = missing, entrant.label

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type | None, error: BaseException | None, _: object) -> bool:
        if isinstance(error, MissingError):
            self.missing[self.label] = str(error)
            return True
        return False


def _take_turns(processes: list[Process], missing: dict[str, str], ticks: int,
                seconds: float) -> None:
    turns = [(WARM_UP, WARM_UP)] + [
        (REHEARSED + part, REHEARSED) for part in _parts(ticks, TURN)]
    for counted, (number, rehearsed) in enumerate(turns):
        for process in processes:
            late = counted > 1 and process.seconds > seconds
            if process.entrant.label not in missing and not late:
                with _named(missing, process.entrant):
                    process.turn(number, rehearsed)


def _parts(whole: int, part: int) -> list[int]:
    return [min(part, whole - first) for first in range(0, whole, part)]


def judge(file: Path, scenes: dict[str, Scene]) -> dict[str, Any]:
    """Return the results of one entrant, from its log and our own model of the arm."""
    with np.load(file) as kept:
        log = {key: kept[key] for key in kept.files}
    limit = np.array(scenes["ellipse"].limit)
    answered, clocked = ~log["failed"], log["clocked"]
    times = log["time"][clocked & answered] / 1e3
    median, p95, p999 = (np.percentile(times, [50.0, 95.0, 99.9]).tolist() if len(times)
                         else [None] * 3)
    again = log["resolve"][clocked & answered] / 1e3
    at_limit = (~log["step_failed"]
                & (abs(log["step_v"]) > limit - _AT_LIMIT).any(axis=1))
    excess = max(float((abs(log[key]) - limit).max()) for key in ("v", "step_v", "step_other"))
    return {
        "ticks": int(clocked.sum()), "median_us": median, "p95_us": p95, "p99.9_us": p999,
        "solve_us": float(np.median(again)) if again.any() else None,
        "at_limit_us": (float(np.median(log["step_time"][at_limit]) / 1e3) if at_limit.any()
                        else None),
        "at_limit_ticks": int(at_limit.sum()),
        "path_error_m": _path_error(log, scenes["ellipse"]),
        "moved_m": _moved(log, scenes["step"]), "excess_rad_s": max(excess, 0.0),
        "failed": int(log["failed"].sum()), "step_failed": int(log["step_failed"].sum()),
        "why": str(log["why"]) or str(log["step_why"])}


def _path_error(log: dict[str, Array], scene: Scene) -> float | None:
    """Return the largest distance [m] of the end effector from the path after settling."""
    robot = Robot.from_file(scene.file, scene.frame)
    state, frame, still = State.at(robot, scene.start), robot.frame(scene.frame), np.zeros(robot.n)
    errors = [0.0]
    for t, q in zip(log["t"], log["q"], strict=True):
        if t >= _SETTLED:
            state.move(t, q, still)
            errors.append(float(np.linalg.norm(state.position(frame) - scene.target(t)[0])))
    return max(errors) if len(errors) > 1 else None


def _moved(log: dict[str, Array], scene: Scene) -> float | None:
    """Return the largest motion [m per tick] of the end effector due to the posture."""
    robot = Robot.from_file(scene.file, scene.frame)
    from hierarchy.paths import Still
    from hierarchy.tasks import Position

    task, moved = Position(robot.frame(scene.frame), Still((0.0, 0.0, 0.0))), []
    for q, v, other, failed in zip(log["step_q"], log["step_v"], log["step_other"],
                                   log["step_failed"], strict=True):
        if not failed:
            moved.append(np.linalg.norm(task.jacobian(State.at(robot, q)) @ (v - other)))
    return float(max(moved)) * scene.period if moved else None


def _print(console: Console, rows: list[dict[str, Any]]) -> None:
    times = table_of_numbers(
        ("tick\nmedian", "\np95", "\np99.9", "solve\nmedian", "at\nlimit", "path", "moved", "over",
         "fail"), "One tick of inverse kinematics of a KUKA LWR, and its quality")
    for row in rows:
        times.add_row(row["entrant"], *(_digits(row[key]) for key in (
            "median_us", "p95_us", "p99.9_us", "solve_us", "at_limit_us")),
            *(_power(row[key]) for key in ("path_error_m", "moved_m", "excess_rad_s")),
            f"{row['failed']}/{row['step_failed']}")
    console.print(times)
    console.print(NOTES, "", sep="\n")
    kinds = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    for head in ("", "version", "priorities", "inequality rows", "after a NaN in q"):
        kinds.add_column(head, overflow="fold")
    for row in rows:
        kinds.add_row(*(row[key] for key in ("entrant", "version", "priorities", "rows", "nan")))
    console.print(kinds)


def _digits(value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.0f}" if value >= 100.0 else f"{value:.1f}"


def _power(value: float | None) -> str:
    return "–" if value is None else f"{value:.0e}"


def _write(rows: list[dict[str, Any]], missing: dict[str, str], out: Path) -> None:
    from scenarios.bench.peers.figure import bars
    from scenarios.draw.figures.drawing import write

    out.mkdir(parents=True, exist_ok=True)
    write_json(out / "missing.json", missing)
    write_json(out / "machine.json", machine())
    if rows:
        write_rows(rows, out / "peers.csv")
        write(bars(rows), str(out / "peers"))
