"""What `hierarchy check ROBOT` prints to paste makes a scenario that runs, of the same robot."""

import pytest
import urdf_text
from urdf_text import INERTIAL, joint, link, placed, shape

from hierarchy import Robot
from scenarios import load
from scenarios.cell.robot import make_robot
from scenarios.cli.main import run_command

CONTROL = """
[damping]
value = 5.0
[control]
stack = "hierarchical"
resolver = "hcod"
duration = 0.02
[[tasks]]
kind = "pose"
"""
LIMIT = '<limit lower="0.5" upper="1" velocity="0" effort="1"/>'


def urdf(*joints):
    """A tree of joints (name, kind, parent, child, inside)."""
    links = dict.fromkeys(end for _, _, *ends, _ in joints for end in ends)
    return urdf_text.urdf(
        *(link(name, INERTIAL + shape('<sphere radius="0.01"/>')) for name in links),
        *(joint(*one, origin=placed("0.1 0.2 0.3")) for one in joints))


FOLLOWING = [("f1", "revolute", "palm", "finger1", LIMIT),
             *((f"f{i}", "revolute", "palm", f"finger{i}", f'{LIMIT}<mimic joint="f1"/>')
               for i in (2, 3, 4))]
ROBOTS = {
    "gripper.urdf": urdf(("wrist", "revolute", "arm", "palm", LIMIT), *FOLLOWING),
    "free.urdf": urdf(("free", "floating", "world", "trunk", ""),
                      ("hip", "revolute", "trunk", "leg", LIMIT)),
    "turning.urdf": urdf(("pan", "continuous", "base", "head", ""),
                         ("tilt", "continuous", "head", "eye", "")),
    "odd.urdf": urdf(("a &quot;joint&quot; \\ é&#9;", "revolute", "base", "tool 'x' = [1]", LIMIT),
                     ("left/wrist.pitch", "prismatic", "tool 'x' = [1]", "ns::tool0", LIMIT)),
    "UPPER.URDF": urdf(("hip", "revolute", "trunk", "leg", LIMIT)),
    "scene.xml": """<mujoco><worldbody><geom type="plane" size="1 1 1"/><light pos="0 0 1"/>
        <body name="arm" pos="0 0 0.2"><joint name="hinge" axis="0 1 0" range="-90 90"/>
        <geom type="capsule" size="0.05" fromto="0 0 0 0 0 0.3"/><body name="hand" pos="0 0 0.3">
        <joint name="wrist" axis="1 0 0" range="-90 90"/><geom size="0.05"/></body></body>
        </worldbody></mujoco>""",
}


def pasted(model, folder, capsys):
    """Return the robot that `check` described, and that of a scenario with what it printed."""
    assert run_command(["check", model]) == 0
    said = capsys.readouterr().out
    assert said.count("  follows         f") == 3 * ("gripper" in model)
    section, path = said[said.index("[robot]\n"):], folder / "pasted.toml"
    end = next(line for line in section.splitlines() if line.startswith("end_effector = "))
    path.write_text('name = "pasted"\n' + section + CONTROL
                    + end.replace("end_effector", "frame", 1))
    assert run_command(["check", str(path)]) == 0, capsys.readouterr().err
    assert run_command(["run", str(path), "--out", str(folder / "run")]) == 0
    return Robot.load(model), make_robot(load(path).robot)


def expect_the_same(one, other):
    assert (other.base, other.joint_names, other.end_effector) == (
        one.base, one.joint_names, one.end_effector)
    assert [c.joint for c in other.capsules] == [c.joint for c in one.capsules]
    assert [p.joint for p in other.control_points] == [p.joint for p in one.control_points]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_section_to_paste_runs_as_it_is(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(ROBOTS[name])
    expect_the_same(*pasted(name, tmp_path, capsys))


@pytest.mark.usefixtures("example_robot_data")
@pytest.mark.parametrize("name", ["pr2", "romeo"])
def test_the_section_of_a_public_robot_runs_as_it_is(name, tmp_path, capsys):
    expect_the_same(*pasted(f"example_robot_data:{name}", tmp_path, capsys))
