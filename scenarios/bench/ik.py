"""Whole inverse kinematics beside other packages: success and time on poses of three robots."""

from __future__ import annotations

import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from hierarchy import Robot, State
from hierarchy.errors import RobotError
from hierarchy.problem import Array
from hierarchy.robots.names import file_of
from hierarchy.tasks.pose import rotation_vector
from scenarios.bench.peers.entrants import MINK, OWN, PINK, PLACO, Package
from scenarios.bench.peers.environments import MissingError, python_of
from scenarios.bench.peers.process import stage
from scenarios.bench.rows import table_of_numbers, write_rows

TOLERANCE = 1e-6     # of the errors [m and rad] together
STARTS = 20          # configurations that each problem may be started from
_WORKER = "scenarios.bench.peers.reaching"
_OUT = 1.5           # how much further than the furthest of the reachable ones
_LIMIT = 7200.0      # [s] for one entrant on the problems of a robot
_PACKAGES: dict[str, Package] = {"ours": OWN, "pink": PINK, "mink": MINK, "placo": PLACO}


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


def run(out: Path | None = None, count: int = 1000, seed: int = 0) -> list[dict[str, Any]]:
    """Solve `count` reachable and as many unreachable problems of each robot with each package.

    Reachable poses are those of random configurations within the limits; for unreachable ones the
    first hand is moved out. Every answer is judged with our kinematics: all errors within
    `TOLERANCE`, all joints within their limits. Prints a table; ik.csv in `out`, if given, has the
    rows measured so far.
    """
    rows: list[dict[str, Any]] = []
    with TemporaryDirectory() as folder:
        staged = stage(Path(folder) / "staged")
        for name, arm in ROBOTS.items():
            try:
                file = _plain_urdf(arm, Path(folder) / f"{name.replace(' ', '-')}.urdf")
            except RobotError as error:
                print(f"{name}: left out: {error}")
                continue
            robot = Robot.from_file(file, shapes=False)
            for reachable in (True, False):
                poses, starts = _problems(robot, arm, count, seed, reachable)
                problems = Path(folder) / "problems.npz"
                np.savez(problems, urdf=str(file), frames=np.array(arm.frames), poses=poses,
                         starts=starts, tolerance=TOLERANCE)
                for label in _PACKAGES:
                    row = {"robot": name, "poses": "reachable" if reachable else "unreachable"}
                    print(*row.values(), label, "...", file=sys.stderr, flush=True)
                    rows.append(row | _measured(label, robot, arm, poses, problems, staged))
                    if out is not None:
                        write_rows(rows, out / "ik.csv")
    _print(rows)
    return rows


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


def _problems(robot: Robot, arm: Arm, count: int, seed: int,
              reachable: bool) -> tuple[Array, Array]:
    """Return targets (count, frames, 4, 4) and starts (count, STARTS, nq)."""
    rng = np.random.default_rng([seed, reachable])
    q = rng.uniform(robot.lower, robot.upper, (count, robot.nq))
    poses = np.array([_poses(robot, arm, one) for one in q])
    if not reachable:
        base = State.at(robot, robot.rest).placements[1, 9:]
        far = _OUT * np.linalg.norm(poses[:, 0, :3, 3] - base, axis=1).max()
        away = poses[:, 0, :3, 3] - base
        poses[:, 0, :3, 3] = base + far * away / np.linalg.norm(away, axis=1, keepdims=True)
    return poses, rng.uniform(robot.lower, robot.upper, (count, STARTS, robot.nq))


def _poses(robot: Robot, arm: Arm, q: Array) -> Array:
    state, poses = State.at(robot, q), np.tile(np.eye(4), (len(arm.frames), 1, 1))
    for pose, frame in zip(poses, arm.frames, strict=True):
        pose[:3, :3], pose[:3, 3] = state.rotation(frame), state.position(frame)
    return poses


def _measured(label: str, robot: Robot, arm: Arm, poses: Array, problems: Path,
              staged: Path) -> dict[str, Any]:
    """Return how an entrant did, or why it could not be run."""
    result = problems.with_name("result.npz")
    result.unlink(missing_ok=True)
    try:
        python = python_of(_PACKAGES[label])
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        if label != "ours":
            environment["PYTHONPATH"] = os.pathsep.join(
                [str(staged), os.environ.get("PYTHONPATH", "")])
        done = subprocess.run([python, "-m", _WORKER, label, str(problems), str(result)],
                              capture_output=True, text=True, timeout=_LIMIT, check=False,
                              env=environment, cwd=None if label == "ours" else staged)
        if done.returncode or not result.is_file():
            raise MissingError((done.stderr.strip().splitlines() or ["ended"])[-1])
    except (MissingError, subprocess.TimeoutExpired) as error:
        return {"package": label, "why": str(error)}
    with np.load(result) as found:
        q, seconds = found["q"], found["seconds"]
    errors = np.array([_error(robot, arm, one, pose) for one, pose in zip(q, poses, strict=True)])
    inside = ((q >= robot.lower - 1e-9) & (q <= robot.upper + 1e-9)).all(axis=1)
    return {"package": label, "reached %": 100.0 * float(((errors <= 2.0 * TOLERANCE)
                                                          & inside).mean()),
            "beyond limits %": 100.0 * float((~inside).mean()),
            "error, median": float(np.median(errors)),
            "ms, median": 1e3 * float(np.median(seconds)),
            "ms, p95": 1e3 * float(np.percentile(seconds, 95.0))}


def _error(robot: Robot, arm: Arm, q: Array, poses: Array) -> float:
    """Return the length of all position [m] and rotation errors [rad] together."""
    here = _poses(robot, arm, q)
    turns = [rotation_vector(np.ascontiguousarray(there[:3, :3] @ pose[:3, :3].T))
             for there, pose in zip(poses, here, strict=True)]
    return float(np.linalg.norm([*(poses[:, :3, 3] - here[:, :3, 3]), *turns]))


def _print(rows: list[dict[str, Any]]) -> None:
    heads = ("reached %", "beyond limits %", "error, median", "ms, median", "ms, p95")
    table = table_of_numbers(heads, first="robot, poses, package")
    for row in rows:
        name = f"{row['robot']}, {row['poses']}, {row['package']}"
        cells = [f"{row[head]:.3g}" for head in heads] if "why" not in row else [row["why"][:60]]
        table.add_row(name, *cells)
    Console(width=120).print(table)
