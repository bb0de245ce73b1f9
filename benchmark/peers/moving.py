"""The scenes `ellipse` and `step`: a whole tick of inverse kinematics of an arm, judged."""

import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from benchmark import figures, packages
from benchmark.packages import Entrant
from benchmark.peers.compare import TICK, TURN_LIMIT, Ask, Log, joined, measure, times, turns
from benchmark.peers.scenes import Arm
from benchmark.process import START_LIMIT, EndedError
from benchmark.report import Column, Report, Row, Section, Table, power, text
from benchmark.urdf import urdf
from hierarchy import Robot, State
from hierarchy.paths import Still
from hierarchy.tasks import Position

QUESTIONS = "benchmark.peers.scenes:Moving"
STEP_TICKS = 2000
START = (0.923, -0.854, 0.903, 1.195, 0.971, 1.796, 0.0)   # [rad] start of the letter's run
STEP = (-0.3, 0.15, -0.25)                                 # [m]
POSTURE = (1.2, 0.6, -1.0, -1.2, 1.0, -0.9, 1.0)           # [rad] from the start
_SETTLED = 3.0     # [s] after which the start off the path has no influence
_AT_LIMIT = 1e-6   # [rad/s]
_FIRST, _ANY, _OWN = "bounds of joints, first", "any, in any level", "of its own kinds, hard"

ENTRANTS = (
    packages.OWN.peer("arm", "tpm", f"strict; {_FIRST}", resolver="tpm"),
    packages.OWN.peer("arm", "sns", f"strict; {_FIRST}", resolver="sns"),
    packages.OWN.peer("arm", "hcod", f"strict; {_ANY}", resolver="hcod"),
    packages.OWN.peer("arm", "weighted", f"weights; {_ANY}", resolver="weighted", ratio=1000.0),
    packages.DAQP.peer("arm", "DAQP by hand", f"strict, softened; {_ANY}"),
    *(packages.PLACO.peer("arm", label, f"{words}; {_OWN} or soft", priority=priority)
      for label, priority, words in (("placo", "soft", "weights"),
                                     ("placo hard", "hard", "hard, then weights"),
                                     ("placo scaled", "scaled", "scaled, then weights"))),
    *(package.peer("arm", package.module + " hard" * hard, f"{'hard, then ' * hard}weights; {rows}",
                   hard=hard)
      for package, rows in ((packages.TSID, _OWN), (packages.MINK, "any, hard"),
                            (packages.PINK, "any, hard"))
      for hard in (False, True)),
    packages.EMBODIK.peer("arm", "embodiK", f"strict, scaled; {_OWN}"),
    packages.ROBOPLAN.peer("arm", "OInK", f"weights; {_OWN}", levels=False),
    packages.ROBOPLAN.peer("arm", "OInK levels", f"strict below a whole pose; {_OWN}", levels=True),
    packages.FRAX.peer("arm", "frax", "strict, then clipped; limits of joints"),
)
NOTES = """\
Times in microseconds, one core, from Python. tick: kinematics, rows, solve. solve: the solve \
alone, if it can be called alone. at limit: median tick with a joint at its velocity limit. path: \
largest distance [m] from the path after 3 s. moved: largest motion [m per tick] of the end \
effector due to the posture, in a step too fast for the joints. over: largest velocity [rad/s] \
beyond a limit. fail: ticks without a solution, ellipse / step."""
_COLUMNS = (*TICK, Column("at\nlimit", "at_limit_us"), Column("path", "path_error_m", power),
            Column("moved", "moved_m", power), Column("over", "excess_rad_s", power),
            Column("fail", "fails", str))
_ABOUT = (Column("version", "version", text), Column("priorities; inequality rows", "kind", text),
          Column("after a NaN in q", "nan", text))


def run(entrants: Sequence[Entrant] = ENTRANTS, ticks: int = 20_000, seconds: float = 20.0
        ) -> Report:
    """Run all entrants on the same two scenes, and judge them with our model of the arm.

    They take turns until each has `ticks` or took `seconds` [s].
    """
    with tempfile.TemporaryDirectory() as temporary:
        scenes = make_scenes(Path(temporary))
        asked = [("open", asdict(scenes["ellipse"])), *turns(ticks, 1000, 1000, 50)]
        rows, missing = measure(entrants, QUESTIONS, asked,
                                lambda log, ask: _judged(log, ask, scenes), seconds)
    title = "One tick of inverse kinematics of a KUKA LWR, and its quality"
    return Report("Inverse kinematics beside other packages", [
        Section(title, [Table(title, rows, _COLUMNS)], NOTES, {"peers": figures.bars(rows)}),
        Section("The packages", [Table("", rows, _ABOUT)])], {"peers": rows}, missing)


def make_scenes(folder: Path) -> dict[str, Arm]:
    """Return the scenes `ellipse` and `step`, and write their arm into the folder."""
    robot = Robot.named("kuka_lwr")
    file = folder / f"{robot.name}.urdf"
    file.write_text(urdf(robot))
    goal = State.at(robot, START).position(robot.frame(robot.end_effector)) + STEP
    ellipse = Arm(str(file), robot.end_effector, robot.joint_names, START,
                  robot.velocity_limit.tolist(), np.add(START, POSTURE).tolist(),
                  (0.0, 0.6, 0.0), (0.2, 0.0, 0.2), (0.0, 0.1, 0.0), 1.0)
    still = (0.0, 0.0, 0.0)
    return {"ellipse": ellipse, "step": replace(ellipse, centre=goal.tolist(), cosine=still,
                                                sine=still, turning=0.0)}


def _judged(path: Log, ask: Ask, scenes: dict[str, Arm]) -> Row:
    """Return the row of an entrant from its path, its step, and what a NaN does to it."""
    ask(("open", asdict(scenes["step"]), True), START_LIMIT)
    reply = ask(("turn", STEP_TICKS, 0), TURN_LIMIT)
    try:
        ask(("open", asdict(scenes["ellipse"])), START_LIMIT)
        nan = ask(("after_nan",), START_LIMIT)
    except EndedError as end:
        nan = f"{end.kind}: {end}"
    step, limit = joined([reply]), np.array(scenes["ellipse"].limit)
    found = {**times(path), **judge_step(step, scenes["step"]), "nan": nan,
             "path_error_m": _path_error(path, scenes["ellipse"]),
             "step_failed": int(step["failed"].sum())}
    found["excess_rad_s"] = max(float((abs(path["v"]) - limit).max()), found["excess_rad_s"])
    return {**found, "fails": f"{found['failed']}/{found['step_failed']}"}


def judge_step(log: Log, scene: Arm) -> Row:
    """Return what the posture does to the end effector in the step, from a log beside one without.

    moved_m, last_m : largest and last motion [m per tick] due to the posture. prevented_m : largest
    motion in a tick that the limits prevent. error_m : final distance from the goal. excess_rad_s :
    beyond a limit. at_limit_ticks, at_limit_us : with a joint at its limit, and their median time.
    """
    robot = Robot.from_file(scene.file, scene.frame)
    frame, limit, period = robot.frame(scene.frame), np.array(scene.limit), scene.period
    task, moved, prevented = Position(frame, Still((0.0, 0.0, 0.0))), [], []
    goal, _ = scene.target(0.0)
    answered = np.logical_not(log["failed"])
    for q, v, other in zip(*(log[key][answered] for key in ("q", "v", "other")), strict=True):
        state = State.at(robot, q)
        J = task.jacobian(state)
        moved.append(period * float(np.linalg.norm(J @ (v - other))))
        wanted = scene.gain * (goal - state.position(frame))
        prevented.append(period * float(np.linalg.norm(wanted - J @ other)))
    at_limit = answered & (abs(log["v"]) > limit - _AT_LIMIT).any(axis=1)
    end = State.at(robot, log["q"][-1] + period * log["v"][-1]).position(frame)
    over = max(float((abs(log[key]) - limit).max()) for key in ("v", "other"))
    return {"moved_m": max(moved, default=np.nan), "last_m": moved[-1] if moved else np.nan,
            "prevented_m": max(prevented, default=np.nan), "excess_rad_s": max(over, 0.0),
            "error_m": float(np.linalg.norm(goal - end)), "at_limit_ticks": int(at_limit.sum()),
            "at_limit_us": (float(np.median(log["time"][at_limit])) / 1e3 if at_limit.any()
                            else np.nan)}


def _path_error(log: Log, scene: Arm) -> float:
    """Return the largest distance [m] of the end effector from the path after settling."""
    robot = Robot.from_file(scene.file, scene.frame)
    state, frame, still = State.at(robot, scene.start), robot.frame(scene.frame), np.zeros(robot.n)
    errors = []
    for t, q in zip(log["t"], log["q"], strict=True):
        if t >= _SETTLED:
            state.move(t, q, still)
            errors.append(float(np.linalg.norm(state.position(frame) - scene.target(t)[0])))
    return max(errors, default=np.nan)
