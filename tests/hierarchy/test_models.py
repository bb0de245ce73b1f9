"""Robots out of files that the tests write: what is read, what is proposed, what is missing."""

import sys
from itertools import combinations
from pathlib import Path
from types import ModuleType
from unittest import mock

import numpy as np
import pytest
from refusals import refused
from urdf_text import joint, link, shape, urdf

from hierarchy import Robot
from hierarchy.avoidance.body import pairs_of_tree
from hierarchy.errors import RobotError, UnknownNameError
from hierarchy.robots import files, names
from hierarchy.tasks.separation import separable_pairs
from scenarios.cell.robot import make_robot
from scenarios.config.sections.robot import RobotSection

ROBOTS = Path(__file__).parents[1] / "data" / "robots"
LIMIT = '<limit lower="0.5" upper="2" velocity="3" effort="10"/>'


@pytest.fixture
def arm(tmp_path):
    def write(shape='<sphere radius="0.04"/>', limit=LIMIT, kind="revolute"):
        path, text = tmp_path / "arm.urdf", (ROBOTS / "arm.urdf.txt").read_text()
        path.write_text(text.format(shape=shape, limit=limit, kind=kind))
        return path
    return write


TETRAHEDRON = [(0.0, 0.0, 0.0), (0.05, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.0, 0.3)]


def test_a_tool_is_the_end_effector_and_primitives_are_capsules(arm):
    robot = Robot.from_file(arm())
    assert (robot.end_effector, Robot.from_file(arm(), "fore").end_effector) == ("tool0", "fore")
    _, upper, ball = robot.capsules
    assert (upper.joint, upper.radius) == (1, 0.05)
    np.testing.assert_allclose([upper.start, upper.end], [(0, 0, 0), (0, 0, 0.4)], atol=1e-12)
    assert (ball.joint, ball.radius, ball.start) == (2, 0.04, (0.0, 0.0, 0.15))
    assert pairs_of_tree(robot.capsules, robot.parents) == [(0, 2)]


@pytest.mark.parametrize("name", ["part.stl", "package://parts/meshes/part.stl",
                                  "package://{}/part.stl"])
def test_the_capsule_of_a_mesh_here_or_in_a_folder_above_holds_its_corners(arm, tmp_path, name):
    name = name.format(tmp_path.name)  # of the folder itself
    path = tmp_path / name.removeprefix("package://").removeprefix(f"{tmp_path.name}/")
    path.parent.mkdir(parents=True, exist_ok=True)
    facets = ["facet normal 0 0 0\nouter loop\n{}\nendloop\nendfacet".format("\n".join(
        "vertex {} {} {}".format(*corner) for corner in face))
        for face in combinations(TETRAHEDRON, 3)]
    path.write_text("\n".join(["solid tetrahedron", *facets, "endsolid"]))  # of the STL format
    robot = Robot.from_file(arm(f'<mesh filename="{name}"/>'))
    massless = "masses beyond elbow, turn: none, so torques do not hold these joints"
    assert robot.missing == (massless,)
    capsule = robot.capsules[2]
    start, way = np.array(capsule.start), np.subtract(capsule.end, capsule.start)
    for off in np.add(TETRAHEDRON, (0, 0, 0.15)) - start:
        along = np.clip(off @ way / (way @ way), 0.0, 1.0) * way
        assert np.linalg.norm(off - along) <= capsule.radius + 1e-9
    assert capsule.radius < 0.06, "along the mesh, not across it"
    path.unlink()
    robot = Robot.from_file(arm(f'<mesh filename="{name}"/>'))
    assert robot.missing[0].startswith(f"meshes of fore are not there, such as {name!r}")
    assert robot.missing[1:] == (massless,)
    assert [capsule.joint for capsule in robot.capsules] == [0, 1]


def test_a_collada_mesh_is_in_its_unit_and_scaled(arm, tmp_path):
    """Coal leaves the unit out: in millimetres, each link had the capsule of a building."""
    corners = " ".join(str(1000.0 * x) for corner in TETRAHEDRON for x in corner)
    (tmp_path / "part.dae").write_text(
        (ROBOTS / "part.dae.txt").read_text().format(corners=corners))
    plain, double = (Robot.from_file(arm(f'<mesh filename="part.dae" {scale}/>')).capsules[2]
                     for scale in ("", 'scale="2 2 2"'))
    assert 0.02 < plain.radius < 0.06
    assert double.radius == pytest.approx(2 * plain.radius)


def test_a_section_lists_its_own_points_and_capsules(arm):
    robot = make_robot(RobotSection.model_validate({
        "model": str(arm()),
        "control_points": [{"frame": "tool0", "offset": [0, 0, 0.1]}, {"joint": "elbow"}],
        "capsules": [{"start": [0, 0, 0], "end": [0, 0, 0.1], "radius": 0.1},
                     {"joint": "elbow", "start": [0, 0, 0], "end": [0, 0, 0.3], "radius": 0.05}]}))
    assert [point.joint for point in robot.control_points] == [3, 2]
    np.testing.assert_allclose(robot.control_points[0].offset, [0, 0, 0.2])
    assert [capsule.joint for capsule in robot.capsules] == [0, 2]


@pytest.mark.parametrize("package", ["example_robot_data", "robot_descriptions"])
def test_a_package_that_is_missing_is_named_with_its_extra(package, monkeypatch):
    absent = mock.Mock(side_effect=names.PackageNotFoundError)
    monkeypatch.setattr(names, "distribution", absent)
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    monkeypatch.setitem(sys.modules, "robot_descriptions._descriptions", None)
    refused("pip install 'task-hierarchy[descriptions]'", Robot.load, f"{package}:panda",
            error=RobotError)


def test_a_robot_of_robot_descriptions_is_read_from_where_it_was_downloaded(arm, monkeypatch):
    """Modules in place of the package, which knows one robot."""
    package, index, some = map(ModuleType, ("robot_descriptions", "_descriptions", "some"))
    index.DESCRIPTIONS, some.URDF_PATH = {"some_description": None}, str(arm())
    for name, module in {"": package, "._descriptions": index, ".some_description": some}.items():
        monkeypatch.setitem(sys.modules, f"robot_descriptions{name}", module)
    robot = Robot.load("robot_descriptions:some")
    assert (robot.name, robot.n) == ("some", 3)
    refused("did you mean 'some_description'", Robot.load, "robot_descriptions:sum_description",
            error=UnknownNameError)
    monkeypatch.setitem(sys.modules, "robot_descriptions.some_description", None)
    refused("could not be downloaded", Robot.load, "robot_descriptions:some_description",
            error=RobotError)


# What is wrong in a file is named before pinocchio reads it, which would end the process or say
# "not a valid URDF model". First changes of a file that is right.
PLAIN = {"link": "", "kind": "revolute", "parent": "base", "axis": "0 0 1", "mimic": "", "more": "",
         "limit": '<limit lower="-2" upper="2" velocity="1" effort="10"/>'}
LOOP = '<joint name="back" type="fixed"><parent link="fore"/><child link="upper"/></joint>'
WRONG = [
    ({"axis": "0 0 0"}, "joint 'shoulder': its axis is zero"),
    ({"axis": "1e-200 0 0"}, "joint 'shoulder': its axis is zero"),
    ({"axis": "0 1e200 0"}, "joint 'shoulder': its axis is too long"),
    ({"axis": "0 1"}, "joint 'shoulder': its axis xyz = '0 1' is not three finite numbers"),
    ({"parent": "nobody"}, "joint 'shoulder': its parent link 'nobody' does not exist"),
    ({"limit": '<limit lower="nan" upper="0.5"/>'}, "its limit lower = 'nan'(?!.* is above)"),
    ({"link": '<inertial><mass value="-1"/></inertial>'}, "link 'upper': its mass '-1'"),
    ({"link": '<inertial><origin xyz="0 1e160 0"/></inertial>'},
     "link 'upper': its origin xyz = '0 1e160 0' is larger than 1e.50"),
    ({"link": '<collision><origin quat_xyzw="1 0 0 1"/></collision>'},
     "link 'upper': its quat_xyzw is ignored before <robot version=\"1.1\">; give rpy"),
    ({"link": '<inertial><inertia ixx="-1e308"/></inertial>'}, "its inertia ixx = '-1e308' is"),
    ({"mimic": '<mimic joint="shoulder" offset="1e308"/>'}, "'elbow': its mimic offset = '1e308'"),
    ({"kind": "revolut"}, "joint 'shoulder': its type is 'revolut'"),
    ({"limit": ""}, "joint 'shoulder': it is revolute and has no <limit>"),
    ({"limit": '<limit lower="2" upper="-2"/>'}, "its lower limit 2 is above its upper limit -2"),
    ({"more": LOOP}, "joints 'back', 'elbow' are a loop"),
    ({"more": '<link name="alone"/>'}, "links 'base', 'alone' have no parent"),
    ({"more": '<link name="upper"/>'}, "link 'upper' occurs 2 times"),
    ({"more": "<xacro:include>"}, "not valid XML"),
    ({"mimic": '<mimic joint="elbow"/>'}, "joint 'elbow': it is to follow itself"),
    ({"mimic": '<mimic joint="shoulder"/>', "kind": "planar"},
     "joint 'elbow': it is to follow joint 'shoulder', and a planar joint has several positions")]
ONE_BODY = """<body name="{0}"><joint name="{0}" axis="0 0 1" range="-90 90"/><geom size="0.03"/>
{1}</body>"""


@pytest.mark.parametrize(("name", "text", "said"), [
    *(("arm.urdf", changed, said) for changed, said in WRONG),
    ("a.sdf", "<sdf/>", r"is an SDF \(Gazebo\), which is not read; give the URDF"),
    ("a.xacro", "<robot name='r'><xacro:include filename='b'/></robot>",
     r"has macros, such as <xacro:include>; .*xacro in\.xacro > out\.urdf"),
    ("a.urdf", "<robot name='r'><xacro:include filename='b'/></robot>", r"no link.*out\.urdf"),
    ("a.urdf", "<launch/>", r"starts with <launch>; expected a URDF \(<robot>\) or an MJCF"),
    ("a.xml", "<mujocoinclude/>", "give the file that includes it"),
    ("a.toml", "name = 'a'", r"A scenario is read by scenarios\.load"),
    ("a.urdf", "<robot/>", "its <robot> has no name"),
    ("a.urdf", urdf(link("a", shape('<box size="1 -1 1"/>'))),
     "link 'a': its box has size = '1 -1 1'"),
    ("a.urdf", urdf(link("a"), link("b"), joint("j", "prismatic", "a", "b", "")),
     "prismatic and has no <limit>$"),
    ("a.urdf", "<robot name='r'><link name='table'/></robot>", "with base = 'floating'"),
    *(("it.xml", f"<mujoco>{inside}</mujoco>", said) for inside, said in (
        ('<include file="no.xml"/>', "Error opening file '.*no.xml'"),
        ('<include file="it.xml"/>', "'.*it.xml' already included"),
        ("", "it has no joint that moves"),
        (f"<worldbody>{ONE_BODY.format('universe', '')}</worldbody>", "no model can"),
        (f"<worldbody>{ONE_BODY.format('a', ONE_BODY.format('a', ''))}</worldbody>",
         "repeated name 'a' in "),
        (f"<worldbody>{ONE_BODY.format('a', '')}</worldbody>".replace("1", "0"),
         "axis too small in joint Element name 'a'")))])
def test_a_file_that_is_no_robot_is_refused_with_the_reason(name, text, said, tmp_path, capfd):
    if name == "it.xml":
        pytest.importorskip("mujoco")
    if isinstance(text, dict):
        text = (ROBOTS / "two_joints.urdf.txt").read_text().format(**{**PLAIN, **text})
    (tmp_path / name).write_text(text)
    with pytest.raises(RobotError, match=said) as raised:
        Robot.load(tmp_path / name)
    assert Path(name).stem in str(raised.value)
    assert capfd.readouterr() == ("", "")


def test_a_file_with_the_name_of_a_table_is_not_that_table(arm):
    robot = Robot.load(str(arm().rename(arm().with_name("humanoid.urdf"))))
    assert (robot.name, robot.table) == ("humanoid", None)
    assert separable_pairs(Robot.load("humanoid"), 9.0), "a table says what is watched"
    assert separable_pairs(robot, 0.01) == [(0, 2)]


def test_a_joint_with_more_coordinates_than_velocities_has_no_limits():
    ball = Robot.load(ROBOTS / "odd.xml")
    assert np.isinf(ball.position_limits()[0][3:6]).all()
    ball.lower[3] = -1.0
    refused("joint 'wrist' has 4 coordinates for 3 velocities", ball.position_limits)


def test_a_name_is_looked_for_in_the_installed_packages(monkeypatch):
    monkeypatch.setattr(names, "_NAMES", {
        "one": lambda: {"stretch": None, "straight": None, "stretched_arm": None},
        "other": mock.Mock(side_effect=ImportError), "third": lambda: {"stretcher": None}})
    assert names.elsewhere("stretchy") == (
        "The installed packages have one:stretch, third:stretcher.")
    assert "descriptions" in names.elsewhere("ur5")


def test_a_robot_whose_shapes_cannot_be_read_has_none_and_says_so(arm, monkeypatch):
    read = mock.Mock(side_effect=[RuntimeError("no mesh"), RuntimeError("no shape")])
    monkeypatch.setattr(files, "_urdf_shapes", read)
    robot = Robot.from_file(arm())
    assert robot.capsules == ()
    assert [what in " ".join(robot.missing) for what in ("no mesh", "no shape")] == [True, True]
