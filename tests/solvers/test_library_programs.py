"""The folder of the C library, programs in C and C++ that use it, and its command.

What needs a compiler is skipped by name where there is none.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import c_library as c
import numpy as np
import pytest
from rank_cases import sequence
from refusals import refused

from benchmark.studies import recorded
from hierarchy import Hierarchy, Robot, Stack, State
from hierarchy.limits import Limits
from hierarchy.paths import Still
from hierarchy.tasks import JointLimits, Position
from scenarios.problems.recorded import family
from solvers import make, problems
from solvers.library import differs, write

if not sys.platform.startswith("linux"):
    pytest.skip("the C library is made on Linux", allow_module_level=True)

ROOT = Path(__file__).parents[2]
ROS2 = ROOT / "examples" / "ros2_control"
EXAMPLES = ROOT / "examples" / "c"
STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"]
CXX = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
needs_c = pytest.mark.skipif(c.COMPILER is None, reason="no compiler of C")


@pytest.mark.skipif(shutil.which("nm") is None, reason="no nm")
def test_it_asks_for_nothing_but_libm_and_owns_no_variable(folder):
    done = subprocess.run(["nm", folder / "lib" / "libtask_hierarchy.a"], capture_output=True,
                          text=True, check=True)
    kinds = re.findall(r"^\w* +(\w) (\S+)$", done.stdout, re.MULTILINE)
    assert {name for kind, name in kinds if kind == "U"} <= {"hypot", "memset", "memcpy", "sqrt"}
    assert {kind for kind, _ in kinds} <= set("UTtr")  # code and constants
    assert {name for kind, name in kinds if kind == "T"} == {
        *(f"th_solve_{name}" for name in c.NAMES), "th_work_size", "th_record_size",
        "th_verify", "th_violations", "th_version", "th_digest"}


def built(out, source, folder, *flags, compiler=c.COMPILER):
    """Compile one file with the static library; returns the program."""
    subprocess.run([compiler, *flags, source, "-I", folder / "include",
                    folder / "lib" / "libtask_hierarchy.a", "-lm", "-o", out], check=True)
    return out


def said(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_the_code_that_documents_show_is_that_of_the_examples():
    shown = [block for page in (ROOT / "docs").rglob("*.md") for block in re.findall(
        r"^```c\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)]
    examples = "".join(path.read_text(encoding="utf-8") for path in EXAMPLES.iterdir())
    assert shown
    assert all(block in examples for block in shown)


CHECKED = ["-Wconversion", "-Wsign-conversion", *STRICT, "-g", "-fsanitize=address,undefined",
           "-fno-sanitize-recover=all"]
PROGRAMS = {
    "once.c": ["-std=c99", *CHECKED], "once.cpp": ["-std=c++17", "-fno-exceptions", *CHECKED],
    "eigen.cpp": ["-std=c++17", "-DTASK_HIERARCHY_EIGEN", "-isystem", "/usr/include/eigen3"],
    "loop.c": ["-std=gnu99", *CHECKED]}


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_examples_compile_without_a_warning_and_run_under_the_address_sanitizer(
        folder, tmp_path, name):
    compiler = CXX if name.endswith("cpp") else c.COMPILER
    if compiler is None or (name == "eigen.cpp" and not Path("/usr/include/eigen3").exists()):
        pytest.skip(f"no compiler or no library for {name}")
    program = built(tmp_path / "program", EXAMPLES / name, folder, *PROGRAMS[name],
                    compiler=compiler)
    expected = "6000 ticks, 0 braked, .*" if name == "loop.c" else r"status 0, x = 0\.9 0\.1\n"
    assert re.fullmatch(expected, said(program), re.DOTALL)


@needs_c
def test_recorded_problems_of_a_standing_humanoid_give_the_same_bits_in_c(folder, tmp_path):
    pytest.importorskip("mujoco")
    replay = built(tmp_path / "replay", EXAMPLES / "replay.c", folder, "-std=c99", *STRICT)
    recorded.main("stand-push", tmp_path / "ticks", 15)
    assert said(replay, tmp_path / "ticks").startswith(
        "15 ticks of 60 unknowns and 181 rows: 15 with the bits of Python, others within 0e+00, "
        "0 unsolved")


@pytest.mark.skipif(CXX is None, reason="no compiler of C++")
def test_the_limits_of_ros2_control_are_those_of_python_also_for_a_joint_without_limits(tmp_path):
    subprocess.run([CXX, "-std=c++17", "-I", ROS2, ROOT / "tests/data/ros2_limits.cpp", "-o",
                    tmp_path / "box"], check=True)
    boxes = [Limits(*np.array([[-far], [far], [2.0], [10.0]]), 0.01).box(
        np.array([0.3]), np.array([0.1]), level)
        for far in (0.5, np.inf) for level in ("velocity", "acceleration")]
    np.testing.assert_allclose(
        np.array(said(tmp_path / "box").split(), dtype=float), np.ravel(boxes), rtol=1e-12)


@pytest.mark.skipif(CXX is None, reason="no compiler of C++")
def test_the_controller_of_ros2_control_sends_what_python_sends(folder, tmp_path):
    """Against stub headers: the same arm, tasks and period, with two writers of the rows."""
    program = built(tmp_path / "simulated", ROS2 / "simulated.cpp", folder, "-std=c++17", *STRICT,
                    "-I", ROS2 / "stub", compiler=CXX)
    sent = np.array([line.split() for line in said(program).splitlines()], dtype=float)
    robot, period = Robot.named("kuka_lwr"), 0.001
    q, v = np.array([0.0, 0.6, 0.0, -1.4, 0.0, 0.8, 0.0]), np.zeros(7)
    state, hand = State.at(robot, q), robot.frame("end_effector")
    goal = Still(state.position(hand) + np.array([0.0, 0.3, 0.2]))
    stack = Stack([JointLimits(robot, 10.0, period), Position(hand, goal, gain=5.0)], "velocity")
    resolver, memory = make("hcod"), None
    for tick, command in enumerate(sent):
        state.move(period * tick, q, v)
        res = resolver.solve(stack.hierarchy(state), memory)
        np.testing.assert_allclose(command, res.x, atol=1e-9)
        v, memory = res.x, res.memory
        q = q + period * v
    assert len(sent) == 2000
    assert np.abs(np.diff(sent, axis=0)).max() <= 10.0 * period * (1.0 + 1e-9)


@needs_c
@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake")
@pytest.mark.parametrize("linked", ["task_hierarchy", "shared"])
def test_cmake_finds_it(folder, tmp_path, linked):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(once C)\n"
        "find_package(task_hierarchy 0.1.0 REQUIRED)\n"
        f"add_executable(once {EXAMPLES / 'once.c'})\n"
        f"target_link_libraries(once task_hierarchy::{linked})\n")
    out = tmp_path / "out"
    said("cmake", "-S", tmp_path, "-B", out, f"-DCMAKE_PREFIX_PATH={folder}")
    said("cmake", "--build", out)
    assert said(out / "once") == "status 0, x = 0.9 0.1\n"


@needs_c
@pytest.mark.parametrize(("name", "resolver"), [("INEQ7", "hcod"), ("EQ7", "tpm")])
def test_many_solves_allocate_nothing_and_touch_no_new_page(folder, tmp_path, name, resolver):
    recorded.record_sequence(tmp_path / "ticks", sequence(family(name)[0].h, 100))
    program = built(tmp_path / "study", ROOT / "tests/helpers/c_speed.c", folder, "-O2")
    solves, failed, allocated, faults, *_ = map(int, said(
        program, tmp_path / "ticks", resolver, "200000").split())
    assert (solves, failed, allocated, faults) == (200_000, 0, 0, 0)


def test_ticks_of_a_stack_that_switches_are_no_sequence_of_one_shape(tmp_path):
    shapes = [Hierarchy.from_levels([(np.eye(2)[:m], np.zeros(m))]) for m in (1, 1, 2)]
    refused("tick 2 has levels of [2] rows, tick 0 of [1]", recorded.record_sequence,
            tmp_path / "ticks", shapes)


def test_check_compares_the_kernels(folder, tmp_path, command):
    assert "same kernels" in command("library --check --out", folder).out
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    header = other / "include" / "task_hierarchy.h"
    digest = re.search(r'TH_DIGEST "(\w{16})"', header.read_text()).group(1)
    header.write_text(header.read_text().replace(digest, "0" * 16))
    assert "and libtask_hierarchy.a another" in differs(other)
    code = other / "lib" / "libtask_hierarchy.a"
    code.write_bytes(code.read_bytes().replace(digest.encode(), b"0" * 16))
    assert f"those installed have {digest}" in command("library --check --out", other, code=1).err
    header.write_bytes(b"\xff")
    assert "digest nothing" in differs(other)
    refused("task_hierarchy.h is missing", differs, tmp_path)


def test_the_command_writes_a_library_for_any_x86_64_that_agrees_to_rounding_and_for_arm(
        tmp_path, command):
    out, target = tmp_path / "lib", "x86_64" if os.uname().machine == "x86_64" else "native"
    line = "library --resolvers recursive --out", out
    assert "libtask_hierarchy.a" in command(*line, "--target", target).out
    assert "not empty" in command(*line, code=2).err
    library = c.Library(out)
    kinds = problems.KINDS[:-2]  # without rows far lighter than others, where rounding is larger
    for seed in range(30):
        h = problems.structured(seed, kinds, equalities_only=True)
        x, left = make("recursive").solve(h).x, library.solve("recursive", h)[1]
        assert np.abs(left.answer - x).max() <= 1e-9 * (1.0 + np.abs(x).max())
    (tmp_path / "arm").mkdir()
    arm = write(tmp_path / "arm", ("recursive",), "aarch64")
    content = (tmp_path / "arm" / "lib" / "libtask_hierarchy.a").read_bytes()
    elf = content[content.index(b"\x7fELF"):]
    assert int.from_bytes(elf[18:20], "little") == 183  # EM_AARCH64
    assert arm.shared in ("", "no linker: none of aarch64-linux-gnu-gcc is found")
    assert "th_solve_sns" not in (tmp_path / "arm/include/task_hierarchy.h").read_text()
