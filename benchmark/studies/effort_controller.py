"""Compile the ros2_control example for efforts and compare what it sends with Python's torques.

    python -m benchmark.studies.effort_controller

Needs a compiler of C++, Eigen and the headers of urdfdom (Debian: libeigen3-dev,
liburdfdom-headers-dev), and minutes: pinocchio's headers, from its wheel, are large. Both sides
have the same arm, tasks and period; the C++ side simulates the arm.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pinocchio

from benchmark.urdf import urdf
from hierarchy import Robot, Stack, State
from hierarchy.paths import Still
from hierarchy.problem import Array
from hierarchy.tasks import JointLimits, Position, Posture, TorqueLimits
from solvers import make
from solvers.library import write

EXAMPLE = Path(__file__).parents[2] / "examples" / "ros2_control"
EIGEN, URDF = Path("/usr/include/eigen3"), Path("/usr/include/urdf_model")
PERIOD = 0.001  # [s]
# What pinocchio's own CMake files define.
DEFINED = ("PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION", "PINOCCHIO_WITH_URDFDOM",
           "BOOST_MPL_LIMIT_LIST_SIZE=30", "BOOST_MPL_LIMIT_VECTOR_SIZE=30",
           "BOOST_FUSION_INVOKE_MAX_ARITY=12", "BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS")


def compiled(folder: Path, library: Path) -> Path:
    """Compile the simulated controller; SystemExit names what is missing."""
    compiler = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
    prefix = next((path for path in Path(pinocchio.__file__).parents
                   if (path / "include" / "pinocchio").is_dir()), None)
    missing = [name for name, found in (("a compiler of C++", compiler), ("Eigen", EIGEN.is_dir()),
                                        ("headers of urdfdom", URDF.is_dir()),
                                        ("headers of pinocchio", prefix)) if not found]
    if compiler is None or prefix is None or missing:
        raise SystemExit(f"needs {', '.join(missing)}")
    include, lib = prefix / "include", prefix / "lib"
    subprocess.run(
        [compiler, "-std=c++17", "-Wall", "-Wextra", "-Werror",
         *(f"-D{name}" for name in DEFINED), EXAMPLE / "simulated_effort.cpp", "-I",
         EXAMPLE / "stub", "-I", library / "include", "-isystem", include, "-isystem",
         include / "urdfdom", "-isystem", EIGEN, library / "lib" / "libtask_hierarchy.a",
         f"-L{lib}", "-lpinocchio_default", "-lpinocchio_parsers", f"-Wl,-rpath,{lib}", "-lm",
         "-o", folder / "simulated"], check=True)
    return folder / "simulated"


def torques(ticks: int) -> tuple[Array, int]:
    """Return what Python sends (ticks, 7) [N m], and in how many ticks a limit is active."""
    robot = Robot.named("kuka_lwr")
    q, v = np.array([0.0, 0.6, 0.0, -1.4, 0.0, 0.8, 0.0]), np.zeros(7)
    state, hand = State.at(robot, q), robot.frame("end_effector")
    goal = Still(state.position(hand) + np.array([0.0, 0.3, 0.2]))
    stack = Stack([TorqueLimits(robot), JointLimits(robot, 10.0, PERIOD),
                   Position(hand, goal, 100.0, 20.0), Posture(tuple(q))], "acceleration")
    resolver, memory, sent, limited = make("hcod"), None, np.empty((ticks, 7)), 0
    for tick in range(ticks):
        state.move(PERIOD * tick, q, v)
        res = resolver.solve(stack.hierarchy(state), memory)
        sent[tick] = state.mass_matrix() @ res.x + state.bias_effort()
        limited += res.active is not None and bool(res.active[:14].any())
        q, v = q + PERIOD * (v + PERIOD / 2 * res.x), v + PERIOD * res.x
        memory = res.memory
    return sent, limited


def main() -> int:
    """Compile, run and compare; exit code 1 if the torques differ by more than rounding."""
    with tempfile.TemporaryDirectory() as name:
        folder, arm = Path(name), Path(name) / "arm.urdf"
        arm.write_text(urdf(Robot.named("kuka_lwr")))
        write(folder)
        said = subprocess.run([compiled(folder, folder), arm], check=True, capture_output=True,
                              text=True).stdout
    in_c = np.array([line.split() for line in said.splitlines()], dtype=float)
    in_python, limited = torques(len(in_c))
    apart = float(np.abs(in_c - in_python).max())
    print(f"{len(in_c)} ticks, {limited} with a limit active: the torques of C++ and Python agree "
          f"to {apart:.0e} N m, the largest is {np.abs(in_python).max():.0f} N m")
    return int(apart > 1e-9)


if __name__ == "__main__":
    sys.exit(main())
