"""Whole inverse kinematics beside other packages: success and time on poses of three robots."""

import xml.etree.ElementTree as ET
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from benchmark.packages import MINK, OWN, PINK, PLACO
from benchmark.process import Field
from benchmark.report import Column, Report, Row, Section, Table, power, tell
from benchmark.timing import times_of
from hierarchy import Robot, State
from hierarchy.errors import RobotError
from hierarchy.kinematics import rotation_vector
from hierarchy.problem import Array
from hierarchy.robots.names import file_of

QUESTIONS = "benchmark.peers.scenes:Reaching"
TOLERANCE = 1e-6     # of the errors [m and rad] together
STARTS = 20          # configurations that each problem may be started from
LIMIT = 60.0         # [s] for one pose
_OUT = 1.5           # how much further than the furthest of the reachable ones,
_FEWEST = 1000       # which are at least so many

ENTRANTS = (OWN.peer("reach", "ours"), *(
    package.peer("reach", package.module) for package in (PINK, MINK, PLACO)))
_COLUMNS = (Column("reached\n%", "reached %"), Column("beyond\nlimits %", "beyond limits %"),
            Column("error,\nmedian", "error, median", power), Column("ms,\nmedian", "ms, median"),
            Column("\np95", "ms, p95"))


class Model(NamedTuple):
    """Joints of a robot whose names have one of `parts`, and the frames that they move."""

    name: str
    parts: tuple[str, ...]
    frames: tuple[str, ...]


ROBOTS = {
    "UR5": Model("example_robot_data:ur5_joint_limited_robot", ("",), ("tool0",)),
    "Panda": Model("example_robot_data:panda", ("panda_joint",), ("panda_hand_tcp",)),
    "G1 arms": Model("example_robot_data:g1_29dof_rev_1_0", ("shoulder", "elbow", "wrist"),
                     ("left_rubber_hand", "right_rubber_hand"))}


def run(count: int = 1000, seed: int = 0) -> Report:
    """Solve `count` reachable and as many unreachable problems of each robot with each package.

    Reachable poses are those of random configurations within the limits; for unreachable ones the
    first hand is moved out. Every answer is judged with our kinematics: all errors within
    twice `TOLERANCE`, all joints within their limits.
    """
    rows: list[Row] = []
    absent: dict[str, str] = {}
    with TemporaryDirectory() as folder, Field(ENTRANTS, QUESTIONS) as field:
        for name, model in ROBOTS.items():
            try:
                file = _plain_urdf(model, Path(folder) / f"{name.replace(' ', '-')}.urdf")
            except RobotError as error:
                absent[name] = str(error)
                continue
            robot = Robot.from_file(file, shapes=False)
            for kind in ("reachable", "unreachable"):
                tell(f"{name}, {kind} ...")
                poses, starts = problems(robot, model.frames, count, seed, kind == "reachable")
                asked = [("problem", [str(file), model.frames, TOLERANCE], pose, start)
                         for pose, start in zip(poses.tolist(), starts.tolist(), strict=True)]
                for label, answers in field.answers(asked, LIMIT, count).items():
                    about = {"robot": name, "poses": kind, "package": label}
                    rows.append({"entrant": ", ".join(about.values()), **about,
                                 **judge(answers, robot, model.frames, poses)})
    return Report("Whole inverse kinematics", [Section("", [Table(
        "Poses of hands: robot, poses, package", rows, _COLUMNS)])], {"ik": rows},
        {**absent, **field.missing}, failed=not rows)


def judge(answers: list[Row], robot: Robot, frames: tuple[str, ...], poses: Array) -> Row:
    """Return the shares reached and beyond a limit, the median error, and times [ms]."""
    pairs = [(one, pose) for one, pose in zip(answers, poses, strict=True) if "q" in one]
    if not pairs:  # each answer ended the process
        return {"reached %": 0.0}
    q = np.array([one["q"] for one, _ in pairs])
    errors = np.array([error(robot, frames, at, pose)
                       for at, (_, pose) in zip(q, pairs, strict=True)])
    inside = ((q >= robot.lower - 1e-9) & (q <= robot.upper + 1e-9)).all(axis=1)
    times = times_of([1e9 * one["seconds"] for one, _ in pairs])
    return {"reached %": 100.0 * float(((errors <= 2.0 * TOLERANCE) & inside).sum()) / len(poses),
            "beyond limits %": 100.0 * float((~inside).mean()),
            "error, median": float(np.median(errors)), "ms, median": times["median_us"] / 1e3,
            "ms, p95": times["p95_us"] / 1e3}


def _plain_urdf(model: Model, file: Path) -> Path:
    """Write the robot's URDF without shapes, and with all other joints fixed."""
    root = ET.parse(file_of(model.name)).getroot()
    for link in root.iter("link"):
        for part in (*link.findall("visual"), *link.findall("collision")):
            link.remove(part)
    for joint in root.findall("joint"):
        if not any(part in str(joint.get("name")) for part in model.parts):
            joint.set("type", "fixed")
    for known in root.findall("mujoco"):
        root.remove(known)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", fusestatic="false",
                  balanceinertia="true", boundmass="1e-6", boundinertia="1e-9")
    ET.ElementTree(root).write(file)
    return file


def problems(robot: Robot, frames: tuple[str, ...], count: int, seed: int, reachable: bool
             ) -> tuple[Array, Array]:
    """Return targets (count, frames, 4, 4) and starts (count, STARTS, nq)."""
    rng = np.random.default_rng([seed, reachable])
    q = rng.uniform(robot.lower, robot.upper, (max(count, _FEWEST), robot.nq))
    poses = np.array([_poses(robot, frames, one) for one in q])
    if not reachable:
        base = State.at(robot, robot.rest).placements[1, 9:]
        away = poses[:, 0, :3, 3] - base
        far = _OUT * np.linalg.norm(away, axis=1).max()
        poses[:, 0, :3, 3] = base + far * away / np.linalg.norm(away, axis=1, keepdims=True)
    return poses[:count], rng.uniform(robot.lower, robot.upper, (count, STARTS, robot.nq))


def _poses(robot: Robot, frames: tuple[str, ...], q: Array) -> Array:
    state, poses = State.at(robot, q), np.tile(np.eye(4), (len(frames), 1, 1))
    for pose, frame in zip(poses, frames, strict=True):
        pose[:3, :3], pose[:3, 3] = state.rotation(frame), state.position(frame)
    return poses


def error(robot: Robot, frames: tuple[str, ...], q: Array, poses: Array) -> float:
    """Return the length of all position [m] and rotation errors [rad] together."""
    here = _poses(robot, frames, q)
    turns = [rotation_vector(np.ascontiguousarray(there[:3, :3] @ pose[:3, :3].T))
             for there, pose in zip(poses, here, strict=True)]
    return float(np.linalg.norm([*(poses[:, :3, 3] - here[:, :3, 3]), *turns]))
