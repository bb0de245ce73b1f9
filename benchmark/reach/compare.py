"""Whole inverse kinematics beside other packages: success and time on poses of three robots."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from benchmark.packages import MINK, OWN, PINK, PLACO, Entrant, MissingError
from benchmark.process import START_LIMIT, EndedError, Process, staged
from benchmark.report import Report, Section
from benchmark.store import Row
from benchmark.tables import Column, Table, power
from benchmark.timing import times_of
from hierarchy import Robot, State
from hierarchy.errors import RobotError
from hierarchy.problem import Array
from hierarchy.robots.names import file_of
from hierarchy.tasks.pose import rotation_vector

QUESTIONS = "benchmark.reach.questions:Questions"
TOLERANCE = 1e-6     # of the errors [m and rad] together
STARTS = 20          # configurations that each problem may be started from
LIMIT = 60.0         # [s] for one pose
_HERE = "benchmark.reach.packages"
_OUT = 1.5           # how much further than the furthest of the reachable ones

ENTRANTS = (Entrant("ours", OWN, f"{_HERE}:Ours"), Entrant("pink", PINK, f"{_HERE}:Pink"),
            Entrant("mink", MINK, f"{_HERE}:Mink"), Entrant("placo", PLACO, f"{_HERE}:Placo"))
_COLUMNS = (Column("reached\n%", "reached %"), Column("beyond\nlimits %", "beyond limits %"),
            Column("error,\nmedian", "error, median", power), Column("ms,\nmedian", "ms, median"),
            Column("\np95", "ms, p95"))


class Arm(NamedTuple):
    """Joints of a robot whose names have one of `parts`, and the frames that they move."""

    model: str
    parts: tuple[str, ...]
    frames: tuple[str, ...]


ROBOTS = {
    "UR5": Arm("example_robot_data:ur5_joint_limited_robot", ("",), ("tool0",)),
    "Panda": Arm("example_robot_data:panda", ("panda_joint",), ("panda_hand_tcp",)),
    "G1 arms": Arm("example_robot_data:g1_29dof_rev_1_0", ("shoulder", "elbow", "wrist"),
                   ("left_rubber_hand", "right_rubber_hand"))}


def run(count: int = 1000, seed: int = 0) -> Report:
    """Solve `count` reachable and as many unreachable problems of each robot with each package.

    Reachable poses are those of random configurations within the limits; for unreachable ones the
    first hand is moved out. Every answer is judged with our kinematics: all errors within
    `TOLERANCE`, all joints within their limits.
    """
    rows: list[Row] = []
    missing: dict[str, str] = {}
    with TemporaryDirectory() as folder:
        for name, arm in ROBOTS.items():
            try:
                file = _plain_urdf(arm, Path(folder) / f"{name.replace(' ', '-')}.urdf")
            except RobotError as error:
                missing[name] = str(error)
                continue
            robot = Robot.from_file(file, shapes=False)
            for kind in ("reachable", "unreachable"):
                poses, starts = problems(robot, arm, count, seed, kind == "reachable")
                made = Path(folder) / "problems.npz"
                np.savez(made, urdf=str(file), frames=np.array(arm.frames), poses=poses,
                         starts=starts, tolerance=TOLERANCE)
                for one in ENTRANTS:
                    about = {"robot": name, "poses": kind, "package": one.label}
                    print(*about.values(), "...", file=sys.stderr, flush=True)
                    try:
                        answers = _asked(one, made, count)
                    except MissingError as error:
                        missing[f"{name}, {kind}, {one.label}"] = str(error)
                        continue
                    rows.append(about | judge(answers, robot, arm, poses) | {
                        "entrant": ", ".join(about.values())})
    return Report("Whole inverse kinematics", [Section("", [Table(
        "Poses of hands: robot, poses, package", rows, _COLUMNS)])], {"ik": rows}, missing)


def _asked(entrant: Entrant, file: Path, count: int) -> list[Row]:
    """Return the answers to the problems of a file, empty where a process ended."""
    answers, opened = list[Row](), False
    with staged() as folder:
        process = Process(entrant, QUESTIONS, folder)
        try:
            for p in range(count):
                try:
                    if not opened:
                        process.ask(("open", str(file)), START_LIMIT)
                        opened = True
                    answers.append(process.ask(("problem", p), LIMIT))
                except EndedError:
                    if not opened:
                        raise
                    answers.append({})
                    opened = False
        finally:
            process.stop()
    return answers


def judge(answers: list[Row], robot: Robot, arm: Arm, poses: Array) -> Row:
    """Return the shares reached and beyond a limit, the median error, and times [ms]."""
    pairs = [(np.array(one["q"]), pose) for one, pose in zip(answers, poses, strict=True) if one]
    q = np.array([one for one, _ in pairs])
    errors = np.array([error(robot, arm, one, pose) for one, pose in pairs])
    inside = ((q >= robot.lower - 1e-9) & (q <= robot.upper + 1e-9)).all(axis=1)
    times = times_of([1e9 * one["seconds"] for one in answers if one])
    return {"reached %": 100.0 * float(((errors <= 2.0 * TOLERANCE) & inside).sum()) / len(poses),
            "beyond limits %": 100.0 * float((~inside).mean()),
            "error, median": float(np.median(errors)), "ms, median": times["median_us"] / 1e3,
            "ms, p95": times["p95_us"] / 1e3}


def _plain_urdf(arm: Arm, file: Path) -> Path:
    """Write the robot's URDF without shapes, and with all other joints fixed."""
    root = ET.parse(file_of(arm.model)).getroot()
    for link in root.iter("link"):
        for kind in ("visual", "collision"):
            for part in link.findall(kind):
                link.remove(part)
    for joint in root.findall("joint"):
        if not any(part in str(joint.get("name")) for part in arm.parts):
            joint.set("type", "fixed")
    for known in root.findall("mujoco"):
        root.remove(known)
    compiler = ET.SubElement(ET.SubElement(root, "mujoco"), "compiler")
    compiler.attrib |= {"fusestatic": "false", "balanceinertia": "true", "boundmass": "1e-6",
                        "boundinertia": "1e-9"}
    ET.ElementTree(root).write(file)
    return file


def problems(robot: Robot, arm: Arm, count: int, seed: int, reachable: bool
             ) -> tuple[Array, Array]:
    """Return targets (count, frames, 4, 4) and starts (count, STARTS, nq)."""
    rng = np.random.default_rng([seed, reachable])
    q = rng.uniform(robot.lower, robot.upper, (count, robot.nq))
    poses = np.array([_poses(robot, arm, one) for one in q])
    if not reachable:
        base = State.at(robot, robot.rest).placements[1, 9:]
        away = poses[:, 0, :3, 3] - base
        far = _OUT * np.linalg.norm(away, axis=1).max()
        poses[:, 0, :3, 3] = base + far * away / np.linalg.norm(away, axis=1, keepdims=True)
    return poses, rng.uniform(robot.lower, robot.upper, (count, STARTS, robot.nq))


def _poses(robot: Robot, arm: Arm, q: Array) -> Array:
    state, poses = State.at(robot, q), np.tile(np.eye(4), (len(arm.frames), 1, 1))
    for pose, frame in zip(poses, arm.frames, strict=True):
        pose[:3, :3], pose[:3, 3] = state.rotation(frame), state.position(frame)
    return poses


def error(robot: Robot, arm: Arm, q: Array, poses: Array) -> float:
    """Return the length of all position [m] and rotation errors [rad] together."""
    here = _poses(robot, arm, q)
    turns = [rotation_vector(np.ascontiguousarray(there[:3, :3] @ pose[:3, :3].T))
             for there, pose in zip(poses, here, strict=True)]
    return float(np.linalg.norm([*(poses[:, :3, 3] - here[:, :3, 3]), *turns]))
