"""The scenes `ellipse` and `step`: a whole tick of inverse kinematics of an arm, judged.

In `step` a KUKA LWR tracks a step of its end effector that is too fast for its joints, and with
lower priority another posture; every tick is resolved twice at the same state, with and without the
posture. Does the lower task disturb the upper one while velocity limits are active? `strictness`
asks every resolver that handles bounds; one whose answer is clipped at the limits shows what a lack
of strictness looks like.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmark import figures, packages
from benchmark.packages import Entrant
from benchmark.peers.adapters.hierarchy import arm
from benchmark.peers.compare import ABOUT, TICK, TURN_LIMIT, Ask, Log, joined, measure, times, turns
from benchmark.peers.scenes import Arm
from benchmark.peers.urdf import urdf
from benchmark.process import START_LIMIT, EndedError
from benchmark.report import Column, Report, Row, Section, Table, power, text, whole, yes
from hierarchy import Hierarchy, Robot, State
from hierarchy.paths import Still
from hierarchy.tasks import Position
from solvers import Resolution, make, names
from solvers.qp.backends import BACKENDS, installed

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
_SETTINGS: Mapping[str, Sequence[Mapping[str, Any]]] = {  # of those that have several
    "hqp": [{"backend": backend} for backend in BACKENDS if installed(backend)],
    "weighted": [{"ratio": ratio} for ratio in (10.0, 100.0, 1000.0)],
    "sns": [{}, {"form": "optimal"}]}
_BESIDE = (Column("max per\ntick", "moved_m", power), Column("last\ntick", "last_m", power),
            Column("limits\nprevent", "prevented_m", power),
            Column("final\nerror", "error_m", power), Column("at\nlimit", "at_limit_ticks", whole),
            Column("over\n[rad/s]", "excess_rad_s", power), Column("fail", "failed", whole),
            Column("strict", "strict", yes))
_SAID = f"""\
An arm tracks a step that is too fast for its joints: velocity limits, then the position, then a \
distant posture. Every tick is resolved with and without the posture. limits prevent: largest \
motion in a tick that the limits prevent. at limit: ticks with a joint at its limit. over: largest \
velocity beyond a limit. strict: the posture moves the end effector by at most \
{figures.STRICT:g} m per tick, and no tick is without an answer."""


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
    tables = [Table(title, rows, _COLUMNS), Table("The packages", rows, (
        *ABOUT, Column("after a NaN in q", "nan", text)))]
    return Report("Inverse kinematics beside other packages", [
        Section("", tables, NOTES, {"peers": figures.bars(rows)})], {"peers": rows}, missing)


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


def cut_off(scene: Arm, posture: bool) -> tuple[Any, Any]:
    """Ask `tpm` for all levels but the first, whose bounds clip its answer: not strict."""
    def solve(h: Hierarchy, memory: Any) -> Resolution:
        n = h.n
        rest = h.changed(A=h.A[n:], lower=h.lower[n:], upper=h.upper[n:], sizes=h.sizes[1:],
                         names=h.names[1:])
        res = make("tpm").solve(rest)
        return Resolution(np.clip(res.x, h.lower[:n], h.upper[:n]), res.status)

    return arm(scene, posture, solve)


def bounded() -> list[Entrant]:
    """Return every resolver that handles bounds, in each of its settings, and one that does not."""
    every = [(make(name, **more), more) for name in names() for more in _SETTINGS.get(name, [{}])]
    return [*(packages.OWN.peer("arm", one.label, resolver=one.name, **more)
              for one, more in every if one.handles != "equalities"),
            Entrant("tpm, cut off", packages.OWN, "benchmark.peers.moving:cut_off")]


def strictness() -> Report:
    """Let all run the step; the rows have what `judge_step` finds, and who is strict."""
    with tempfile.TemporaryDirectory() as folder:
        scene = make_scenes(Path(folder))["step"]

        def judged(log: Log, _: Any) -> Row:
            found, failed = judge_step(log, scene), int(log["failed"].sum())
            return {"ticks": len(log["t"]), "failed": failed, **found,
                    "strict": found["moved_m"] <= figures.STRICT and not failed}

        rows, missing = measure(bounded(), QUESTIONS, [
            ("open", asdict(scene), True), ("turn", STEP_TICKS, 0)], judged)
    title = "Motion of the end effector due to the posture, which has lower priority [m]"
    return Report("Strictness at the limits", [Section("", [Table(title, rows, _BESIDE)],
                                                       _SAID)], {"strictness": rows}, missing)
