"""Robots of MJCF files are what MuJoCo says they are; MuJoCo itself is asked."""

import sys
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from refusals import refused

from hierarchy import Robot, State
from hierarchy.errors import RobotError, UnknownNameError
from hierarchy.tasks import Posture
from scenarios.cell.robot import start_of
from scenarios.config.sections.robot import StartSection

mujoco = pytest.importorskip("mujoco")
public_robots = pytest.importorskip("benchmark.studies.public_robots")

GEOM = '<geom type="capsule" fromto="0 0 0 .3 0.1 0" size=".03"/>'


def link(name, joint='axis="0 1 0"', more="", place='pos=".3 0 0"'):
    return (f'<body name="{name}" {place}><joint name="{name}_joint" {joint}/>{GEOM}'
            f'<site name="{name}_tip" pos=".3 0 .1" euler="10 20 30"/>{more}</body>')


def world(inside, sections=""):
    return f"<worldbody>{inside}</worldbody>{sections}"


CUBE = '<body name="cube" pos="0 1 1"><freejoint/><geom type="box" size=".1 .1 .1"/></body>'
TABLE = '<body name="table"><geom type="box" size=".5 .5 .1"/></body>'
TARGET = '<body name="target" mocap="true"><geom size=".02"/></body>'
WALKER = (f'<body name="trunk" pos="0 0 .5" quat=".8 .6 0 0"><freejoint name="root"/>{GEOM}'
          f'{link("leg")}</body>')
TURNED = 'pos="0 0 1" euler="10 20 30"'
# What MuJoCo compiles away, as classes and units, is in no row.
KINDS = {
    "a fixed root has a pose": world(
        f'<body name="mount" pos="0 0 .5" quat="1 0 0 1">{GEOM}{link("a", place=TURNED)}</body>'),
    "limited or not": world(link("a", 'range="-9 9" limited="false" armature=".3"', link(
        "b", 'type="slide" range="0 .04" limited="true"'))),
    "references": world(link("a", 'axis="1 2 3" ref="40" pos=".1 .2 .3"', link(
        "b", 'type="slide" axis="1 1 0" ref=".2"'))),
    "several joints of one body": world(
        '<body name="base"><joint name="x" type="slide" axis="1 0 0"/><joint name="yaw" '
        f'axis="0 0 1" pos=".1 .2 0"/><joint name="tilt" axis="1 0 0" pos="0 .1 .1"/>{GEOM}'
        f'{link("a")}</body>'),
    "nameless bodies and joints": world(
        f"<body><joint/>{GEOM}<body><joint/>{GEOM}<joint type='slide'/></body>"
        f"<body><joint/>{GEOM}</body></body>"),
    "names in common": world(
        f'<body name="a"><joint name="a" pos=".1 0 0"/>{GEOM}<site name="a" pos="0 0 .2"/></body>'),
    "on the moon, tilted": world(link("a"), '<option gravity="1 0 -1.62"/>'),
    "without gravity": world(WALKER, '<option><flag gravity="disable"/></option>'),
    "two arms on a table": world(f'<body name="table" pos="0 0 1">{GEOM}{link("a")}{link("b")}'
                                 "</body>"),
    "not quite XML": world(link("a") + "<!-- a -- b -->"),
    "a table first": world(TABLE + link("a")), "a target first": world(TARGET + link("a")),
    "a loose cube first": world(CUBE + link("a")), "a drone": world(CUBE),
    "a walker": world(WALKER + TABLE),
    "a ball joint": world(link("a", 'type="ball" pos=".1 0 0" armature=".2"', link("b"))),
    "a geared drive": world(link("a", more=link("b")), '<actuator><motor joint="b_joint" '
                            'gear="-7" armature=".1"/></actuator>'),
    "masses of classes and meshes": world(
        link("a", more='<geom type="mesh" mesh="m" density="500"/>'),
        '<asset><mesh name="m" vertex="0 0 0 .2 0 0 0 .3 0 0 0 .4"/></asset>'),
    "a cloth": world(link("a") + '<flexcomp name="cloth" type="grid" count="2 2 1" '
                     'spacing=".1 .1 .1" radius=".01" mass="1" dim="2"/>')}


@pytest.fixture
def written(tmp_path):
    def write(inside):
        path = tmp_path / "robot.xml"
        path.write_text(f"<mujoco>{inside}</mujoco>")
        return path
    return write


def of_mujoco(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    return model, mujoco.MjData(model)

@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_is_what_mujoco_has(kind, written):
    assert public_robots.of_mjcf(written(KINDS[kind])) == "equal"


@pytest.mark.parametrize("package", public_robots.MJCF + public_robots.URDF)
def test_robots_of_public_packages_are_what_mujoco_and_pinocchio_have(package):
    judged = [(str(file), verdict, why) for file, verdict, why in public_robots.tried(package)]
    if not judged:
        pytest.skip(f"{package} is not installed")
    assert [one for one in judged if one[1] == "differs"] == []
    assert "equal" in {verdict for _, verdict, _ in judged}


def test_the_root_element_says_what_a_file_is_and_not_its_suffix(written):
    path = written(world(WALKER))
    assert Robot.load(path.rename(path.with_suffix(".mjcf"))).n == 7


def test_without_mujoco_the_extra_is_named(written, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    path = written(world(link("a")))
    refused("pip install 'task-hierarchy[sim]'", Robot.load, path, error=RobotError)


def test_threads_that_read_files_leave_the_filters_of_warnings_as_they_were(written):
    path, before = written(world(link("a"))), (list(warnings.filters), warnings.showwarning)
    with ThreadPoolExecutor(8) as threads:
        assert {robot.n for robot in threads.map(Robot.load, 100 * [path])} == {1}
    assert (warnings.filters, warnings.showwarning) == before


def test_a_scene_is_one_robot_unless_a_root_is_named(written):
    path = written(world(link("a", more=link("fore")) + link("b")))
    assert Robot.load(path).n == 3
    assert Robot.load(path, root=["a", "b"]).joint_names == ("a_joint", "fore_joint", "b_joint")
    only = Robot.load(path, root="fore")
    assert only.joint_names == ("fore_joint",)
    assert set(only.missing) >= {"left out, since it is not under root: b",
                                 "held at the reference, since it is above root: a_joint"}
    refused("unknown body 'c'", Robot.load, path, root="c", error=UnknownNameError)


@pytest.mark.parametrize("scene", [link("a") + WALKER, WALKER + WALKER.replace('="', '="other_', 1)
                                   .replace('"root"', '"other"').replace('"leg', '"other_leg')])
def test_a_second_body_that_floats_is_refused_by_name(scene, written):
    path = written(world(scene))
    with pytest.raises(RobotError, match=r"body '\w*trunk' floats, .* root = one of"):
        Robot.load(path)
    assert Robot.load(path, root="trunk").base == "floating"
    assert Robot.load(path, base="fixed").base == "fixed"


TIE = ('<tendon><fixed name="tie" armature=".1"><joint joint="a_joint" coef="1"/>'
       '<joint joint="b_joint" coef="1"/></fixed></tendon>')


@pytest.mark.parametrize(("inside", "sections", "said"), [
    ('<replicate count="401" offset="1 0 0"><body><joint/><geom size=".1"/></body></replicate>', "",
     "has 401 velocities, of at most 400"),  # it would fill the memory
    (link("a", 'range="nan 1" limited="true"'), "", "jnt_range of joint 'a_joint' is not a number"),
    (link("a"), '<option gravity="0 0 nan"/>', "gravity is not a number"),
    (link("a"), '<keyframe><key name="k" qpos="nan"/></keyframe>', "key_qpos of key 'k'"),
    (link("a"), '<equality><joint joint1="a_joint" polycoef="nan"/></equality>',
     "eq_data of equality 'equality 0'"), (TABLE, "", "it has no joint that moves"),
    (link("a", 'armature="-1"'), "", "the armature of a_joint is negative"),
    (link("a", more=link("b")), TIE, "which a robot here cannot have: tendon 'tie'")])
def test_what_no_robot_has_is_refused_by_name(inside, sections, said, written):
    refused(said, Robot.load, written(world(inside, sections)), error=RobotError)


def test_a_base_floats_where_it_is_asked_to(written):
    path = written(world(link("a")))
    robot, held = Robot.load(path, base="floating"), Robot.load(path)
    assert (robot.base, robot.n, robot.masses.sum()) == ("floating", 7, held.masses.sum())
    np.testing.assert_allclose(State.at(robot, robot.rest).position("a_tip"),
                               State.at(held, held.rest).position("a_tip"), atol=1e-12)
    table = Robot.load(written(world(TABLE)), base="floating")
    assert (table.n, Posture({}).error(State.at(table, table.rest)).size) == (6, 0)


@pytest.mark.parametrize(("joint", "value", "qpos"), [
    ("shoulder", (0.0, 0.6, 0.0), [0.9553364891, 0.0, 0.2955202067, 0.0]),
    ("shoulder", (0.0, 0.6, 0.0, 0.8), [0.8, 0.0, 0.6, 0.0]),
    ("root", (0.1, 0.2, 0.3, 0.0, 0.6, 0.0), [.1, .2, .3, 0.9553364891, 0.0, 0.2955202067, 0.0])])
def test_a_ball_and_a_free_joint_are_locked_where_mujoco_has_them(joint, value, qpos, written):
    ball = link("arm", 'type="ball" pos=".1 0 .05"', link("hand")).replace("arm_joint", "shoulder")
    path = written(world(WALKER.replace(GEOM, GEOM + ball, 1)))
    robot = Robot.load(path, locked={joint: value})
    assert joint not in robot.joint_names
    model, data = of_mujoco(path)
    at = model.joint(joint).qposadr[0]
    data.qpos[at:at + len(qpos)] = qpos
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(State.at(robot, robot.rest).position("hand_tip"),
                               data.site("hand_tip").xpos, atol=1e-9)
    refused(f"locked: joint '{joint}'", Robot.load, path, locked={joint: (1, 2)}, error=RobotError)


@pytest.mark.parametrize(("actuator", "joint", "effort"), [
    ('<motor joint="a_joint" gear="3" ctrlrange="-2 2"/>', "", 6.0),
    ('<motor joint="a_joint" gear="-3" ctrlrange="-2 2" forcerange="-1 1"/>', "", 3.0),
    ('<position joint="a_joint" gear="2" kp="9" ctrlrange="-1 1" forcerange="-5 5"/>', "", 10.0),
    ('<general joint="a_joint" gainprm="4" ctrlrange="-1 1"/>', "", 4.0),
    ('<motor joint="a_joint" ctrlrange="-2 2"/><motor joint="a_joint" ctrlrange="-1 1"/>', "", 3.0),
    ('<motor joint="a_joint" ctrlrange="-2 2"/>', 'actuatorfrcrange="-1.5 1.5"', 1.5),
    ('<motor joint="a_joint" ctrlrange="-2 3"/>', "", 2.0),
    ('<motor joint="a_joint" ctrlrange="0 3"/>', "", np.inf),
    ('<motor joint="a_joint"/>', "", np.inf), ("", "", np.inf),
    ('<position joint="a_joint" kp="9" ctrlrange="-1 1"/>', "", np.inf),
    ('<orientation joint="b_joint"/><motor joint="a_joint" gear="3" ctrlrange="-2 2"/>', "", 6.0),
    ('<general joint="a_joint" dyntype="filter" ctrlrange="-2 2" actrange="-1 1"/>', "", 1.0),
    ('<general joint="a_joint" dyntype="integrator" ctrlrange="-2 2" actrange="-4 4"/>', "", 4.0),
    ('<motor joint="a_joint" ctrlrange="-2 2"/><motor joint="a_joint" group="3"/>', "", 2.0)])
def test_effort_limits_are_what_actuators_can_do(actuator, joint, effort, written):
    arm = link("a", f'{joint} axis="0 1 0"', link("b", 'type="ball"'))
    robot = Robot.load(written(world(arm, f"<actuator>{actuator}</actuator>"
                                     '<option actuatorgroupdisable="3"/>')))
    np.testing.assert_allclose(robot.effort_limit, [effort, *[np.inf] * 3])
    assert (robot.velocity_limit == np.inf).all()
    assert "velocity limits: an MJCF has none" in robot.missing


@pytest.mark.parametrize(("flag", "effort"), [
    ("limit", 8.0), ("constraint", 8.0), ("equality", 8.0), ("clampctrl", 9.0),
    ("actuation", np.inf), ("contact", 8.0)])
def test_a_robot_is_without_what_the_options_of_its_file_disable(flag, effort, written):
    path = written(world(
        link("a", 'range="-9 9"', link("b", 'range="-9 9" actuatorfrcrange="-3 3"')),
        '<equality><joint joint1="b_joint" joint2="a_joint"/></equality><actuator><motor joint='
        '"a_joint" gear="4" ctrlrange="-2 2" forcerange="-2.25 2.25"/></actuator>'
        f'<option><flag {flag}="disable"/></option>'))
    model, data = of_mujoco(path)
    data.qpos[:], data.ctrl[:] = 1.0, 1e3
    mujoco.mj_forward(model, data)
    rows, kind = {*data.efc_type.tolist()}, mujoco.mjtConstraint
    robot = Robot.load(path)
    assert np.isfinite(robot.upper).tolist() == [int(kind.mjCNSTR_LIMIT_JOINT) in rows] * 2
    assert len(robot.coupled) == (int(kind.mjCNSTR_EQUALITY) in rows)
    assert robot.effort_limit.tolist() == [data.qfrc_actuator[0] or np.inf, 3.0] == [effort, 3.0]


@pytest.mark.parametrize(("inside", "said"), [
    (link("a", 'stiffness="0 5"'), "stiffness of joints: not in the equations of motion"),
    (link("a", 'damping="0 5"'), "damping of joints: not in the equations of motion"),
    (WALKER.replace("<freejoint", '<joint type="free" armature=".1"'),
     "armature of a free joint: without Coriolis forces: root"),
    (link("a", 'pos="0 0 .1"').replace("a_joint", "a"),
     "frames with their kind in the name, which another frame has: a (body)")])
def test_what_a_robot_is_without_or_calls_otherwise_is_said(inside, said, written):
    if '"0 5"' in inside and not hasattr(mujoco.MjModel, "dof_dampingpoly"):
        pytest.skip("older MuJoCo has no polynomials of passive forces")
    assert said in Robot.load(written(world(inside))).missing


def residual(path, q):
    """What MuJoCo has left of the equalities at q, of joints with one coordinate."""
    model, data = of_mujoco(path)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    return data.efc_pos[data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)]


TIED = ('<fixed name="{0}"><joint joint="{1}" coef=".5"/><joint joint="{2}" coef="-2"/></fixed>'
        '<fixed name="{2}"><joint joint="{2}" coef="3"/></fixed>')
TENDONS = (f'<tendon>{TIED.format("ab", "a_joint", "b_joint")}'
           f'{TIED.format("cd", "c_joint", "d_joint")}</tendon>')


@pytest.mark.parametrize(("tendons", "equalities"), [
    ("", '<joint joint1="b_joint" joint2="a_joint" polycoef=".1 .2 .3 .4 .5"/>'
     '<joint joint1="d_joint" polycoef=".2 0 0 0 0"/>'),
    (TENDONS, '<tendon tendon1="ab" polycoef=".1 0 0 0 0"/>'
     '<tendon tendon1="d_joint" polycoef=".3 0 0 0 0"/>')])
def test_joints_follow_others_by_polynomials_of_positions_or_by_tendons(
        tendons, equalities, written):
    sections = f"{tendons}<equality>{equalities}</equality>"
    arm = link("a", 'ref="20"', link("b", 'ref="-30"', link("c", more=link("d"))))
    path = written(world(arm, sections))
    one, other = Robot.load(path).coupled
    assert (one.joint, one.other, other.joint, other.other) == ("b_joint", "a_joint", "d_joint", "")
    for a in (-1.0, 0.3, 0.9):
        q = [a, np.polyval(one.coefficients[::-1], a), 0.2, other.coefficients[0]]
        np.testing.assert_allclose(residual(path, q), 0.0, atol=1e-12)
    if tendons:
        (held, _) = Robot.load(path, locked={"b_joint": q[1]}).coupled
        assert (held.joint, held.coefficients) == ("a_joint", (pytest.approx(0.9),))
    else:
        held = Robot.load(path, locked={"a_joint": 0.3}).coupled[0]
        np.testing.assert_allclose(held.coefficients, [np.polyval(one.coefficients[::-1], 0.3)])
    robot = Robot.load(written(world(
        arm, f'<option><flag equality="disable"/></option>{sections}')))
    assert not robot.coupled
    assert any(said.startswith("equalities that are not active") for said in robot.missing)


@pytest.mark.parametrize(("equality", "rigid"), [
    ('<connect name="close" body1="a" body2="c" anchor=".1 .2 .3"/>', False),
    ('<connect name="close" body1="c" anchor=".1 .2 .3"/>', False),
    ('<connect name="close" site1="a_tip" site2="c_tip"/>', False),
    ('<connect name="close" site1="c_tip" site2="mark"/>', False),
    ('<weld name="close" body1="a" body2="c"/>', True),
    ('<weld name="close" body1="a" body2="c" torquescale="0"/>', False),
    ('<weld name="close" body1="a" body2="c" anchor=".1 .2 .3" relpose=".1 .3 .2 .5 .5 .5 .5"/>',
     True),
    ('<weld name="close" site1="a_tip" site2="c_tip"/>', True)])
def test_closed_chains_join_the_frames_that_mujoco_joins(equality, rigid, written):
    chain = link("a", 'axis="0 0 1"', link("b", more=link("c", 'axis="1 1 0"')))
    path = written(world('<site name="mark" pos=".2 .4 .1" euler="0 0 30"/>' + chain,
                         f"<equality>{equality}</equality>"))
    robot = Robot.load(path)
    loop, = robot.loops
    assert (loop.name, loop.rigid) == ("close", rigid)
    assert Robot.load(path, root="a").loops == robot.loops
    assert robot.end_effector not in loop.frames or "site" in equality
    for q in np.random.default_rng(2).uniform(-1.0, 1.0, (3, 3)):
        state, expected = State.at(robot, q), residual(path, q)
        one, other = (robot.frame(name) for name in loop.frames)
        np.testing.assert_allclose(state.position(one) - state.position(other), expected[:3],
                                   atol=1e-12)
        if rigid:
            cosine = (np.trace(state.rotation(one).T @ state.rotation(other)) - 1.0) / 2.0
            half = np.sqrt((1.0 - cosine) / 2.0)  # sine of half the angle between them
            np.testing.assert_allclose(half, np.linalg.norm(expected[3:]), atol=1e-9)


def test_keyframes_are_starts(written):
    path = written(world(WALKER, '<keyframe><key name="home" qpos="0 0 1 .6 0 .8 0 .3"/><key '
                         'qpos="0 0 2 1 0 0 0 .4"/></keyframe>'))
    robot = Robot.load(path)
    assert list(robot.starts) == ["home", "key 1"]
    np.testing.assert_allclose(robot.starts["home"], [0, 0, 1, 0, 0.8, 0, 0.6, 0.3], atol=1e-12)
    held = Robot.load(path, base="fixed")
    np.testing.assert_allclose(start_of(held, StartSection(keyframe="home"))[0], [0.3])
    moved = StartSection(keyframe="key 1", joints={"leg_joint": 0.1})
    np.testing.assert_allclose(start_of(held, moved)[0], [0.1])
    refused("unknown keyframe 'hom'", robot.start, "hom", error=UnknownNameError)


def test_a_difference_from_mujoco_names_the_body(written, monkeypatch):
    from hierarchy.robots.mjcf import model

    path, exact = written(world(link("a", more=link("b")))), model.pose
    monkeypatch.setattr(model, "pose", lambda place, turn: exact(place * (1.0 + 1e-8), turn))
    refused("body 'a' is 3e-09 from where MuJoCo has it", Robot.load, path, error=RobotError)
    monkeypatch.setattr(model, "pose", exact)
    inertia = model.pin.Inertia
    monkeypatch.setattr(model.pin, "Inertia", lambda mass, centre, about: inertia(
        mass, centre, about * (1.0 + 1e-6)))
    with pytest.raises(RobotError, match=r"the inertia at body '[ab]' is "):
        Robot.load(path)
