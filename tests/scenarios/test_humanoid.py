"""Robots with branches and floating bases, and scenarios whose tasks are listed in order."""

import numpy as np
import pytest

from hierarchy import Robot, Stack, State, Task
from hierarchy.errors import HierarchyError
from hierarchy.paths import Ellipse, Still
from hierarchy.tasks import CentreOfMass, Pointing, Pose, Position
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.config import Scenario, ScenarioError
from scenarios.draw.figures.picture import picture
from scenarios.measure.metrics import measure
from scenarios.results.comparing import compare

pytestmark = pytest.mark.slow

ROBOTS = {name: Robot.named(name) for name in ("humanoid", "dual_arm")}
PATH = Ellipse((0.1, 0.2, 0.8), (0.1, 0.0, 0.1), (0.0, 0.1, 0.0), rate=1.3)
STEP = 1e-6


def tasks(robot):
    hand = robot.frame("left_hand")
    return {"position": Position(hand, PATH), "pose": Pose(hand, PATH, np.eye(3)),
            "pointing": Pointing(hand, (1.0, 0.2, 0.0), 0.3),
            "centre of mass": CentreOfMass(robot, PATH),
            "centre of mass, x and y": CentreOfMass(robot, PATH, (0, 1))}


def some_states(robot, count=5, seed=1):
    rng = np.random.default_rng(seed)
    return [(robot.integrate(robot.rest, 0.3 * rng.normal(size=robot.n)),
             rng.normal(size=robot.n)) for _ in range(count)]


CASES = [(name, task) for name, robot in ROBOTS.items() for task in tasks(robot)]


@pytest.mark.parametrize(("name", "task"), CASES)
def test_jacobian_and_its_derivative_agree_with_central_differences(name, task):
    robot = ROBOTS[name]
    task = tasks(robot)[task]
    for q, v in some_states(robot):
        def moved(step, q=q, v=v):
            return State.at(robot, robot.integrate(q, step), v, 0.7)

        state = State.at(robot, q, v, 0.7)
        J = task.jacobian(state)
        if task.name != "pose":  # whose rows are the angular velocity, not the error's derivative
            columns = [(task.error(moved(-STEP * e)) - task.error(moved(STEP * e))) / (2 * STEP)
                       for e in np.eye(robot.n)]
            np.testing.assert_allclose(J, np.transpose(columns), atol=2e-8)
        later, before = moved(STEP * v), moved(-STEP * v)
        difference = (task.jacobian(later) - task.jacobian(before)) / (2 * STEP)
        np.testing.assert_allclose(task.jacobian_derivative(state), difference, atol=2e-8)


@pytest.mark.parametrize("differences", [None, 1e-3])
@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize(("name", "task"), CASES)
def test_compiled_rows_equal_those_of_the_plain_methods(name, task, level, differences):
    robot = ROBOTS[name]
    task = tasks(robot)[task]
    q, v = some_states(robot, 1)[0]
    state = State.at(robot, q, v, 0.7, differences)
    state.move(0.8, robot.integrate(q, 1e-3 * v), v)
    written, plain = [(np.zeros((task.dimension, robot.n)), np.zeros(task.dimension),
                       np.zeros(task.dimension)) for _ in range(2)]
    task.writer(state, level, *written, row=0)()
    Task.writer(task, state, level, *plain, row=0)()
    for a, b in zip(written, plain, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)


def test_the_centre_of_mass_is_that_of_pinocchio():
    import pinocchio as pin
    robot = ROBOTS["humanoid"]
    task = CentreOfMass(robot, Still((0.0, 0.0, 0.0)))
    for q, v in some_states(robot):
        state, data = State.at(robot, q, v), robot.model.createData()
        np.testing.assert_allclose(task.position(state), pin.centerOfMass(robot.model, data, q),
                                   atol=1e-12)
        np.testing.assert_allclose(task.jacobian(state),
                                   pin.jacobianCenterOfMass(robot.model, data, q), atol=1e-12)


@pytest.mark.parametrize(("axes", "said"), [((), "axes"), ((1, 0), "in this order"),
                                            ((0, 3), "must be some of 0, 1, 2")])
def test_axes_that_make_no_sense_are_refused(axes, said):
    with pytest.raises(HierarchyError, match=said):
        CentreOfMass(ROBOTS["humanoid"], PATH, axes)


def test_a_robot_without_masses_has_no_centre_of_mass(tmp_path):
    path = tmp_path / "bare.urdf"
    path.write_text('<robot name="bare"><link name="a"/><link name="b"/><joint name="j" '
                    'type="continuous"><parent link="a"/><child link="b"/></joint></robot>')
    with pytest.raises(HierarchyError, match="'bare' has no masses"):
        CentreOfMass(Robot.from_file(path), PATH)


def test_the_humanoid_stands_on_its_soles_with_its_weight_over_them():
    robot = ROBOTS["humanoid"]
    state = State.at(robot, robot.rest)
    assert (robot.base, robot.n, robot.nq, robot.actuated) == ("floating", 36, 37, 6)
    feet = [state.position(robot.frame(f"{side}_foot")) for side in ("left", "right")]
    for foot, side in zip(feet, (1, -1), strict=True):
        assert abs(foot[2]) < 1e-3
        assert foot[1] * side > 0
    centre = CentreOfMass(robot, PATH).position(state)
    assert abs(centre[1]) < 1e-12
    assert -0.05 < centre[0] < 0.16, "between heel and toe"
    assert robot.masses.sum() == pytest.approx(40.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_left_and_right_of_a_table_are_mirror_images(name):
    robot = ROBOTS[name]
    state = State.at(robot, robot.rest)
    left, right = (state.position(robot.frame(f"{side}_hand")) for side in ("left", "right"))
    np.testing.assert_allclose(left, right * [1, -1, 1], atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_table_starts_within_its_limits(name):
    robot = ROBOTS[name]
    assert (robot.rest >= robot.lower).all()
    assert (robot.rest <= robot.upper).all()


def test_a_table_can_have_another_base():
    hung = Robot.named("humanoid", "fixed")
    assert (hung.base, hung.n, hung.nq) == ("fixed", 30, 30)
    assert {capsule.joint for capsule in hung.capsules if capsule.name == "base"} == {0}
    loose = Robot.named("kuka_lwr", "floating")
    assert (loose.n, loose.nq) == (13, 14)
    assert [capsule.joint for capsule in loose.capsules] == [4, 6, 8]


@pytest.fixture(scope="module")
def standing():
    return simulate(load("humanoid"))


def test_all_levels_above_the_posture_are_met(standing):
    assert standing.fault is None
    found = measure(standing)
    for name in ("left_foot", "right_foot", "centre_of_mass"):
        assert found[f"task_{name}_rms"].value < 1e-5
    for name in ("right_hand", "left_hand"):
        assert found[f"task_{name}_max_settled"].value < 1e-4, "what a period of 5 ms leaves"
        assert found[f"task_{name}_end"].value < 1e-5
    assert found["task_gaze_max_settled"].value < 0.05
    assert found["task_left_foot_turned_rms"].unit == "deg"
    assert found["joint_limit_excess"].value == 0.0


def test_the_humanoid_bends_to_the_floor_and_reaches_over_its_head(standing):
    hand = standing["task_position_right_hand"][:, 2]
    assert hand.min() == pytest.approx(0.5, abs=1e-3)
    assert hand[-1] == pytest.approx(1.4, abs=1e-3)
    assert standing["q"][:, 2].min() < standing["q"][0, 2] - 0.05, "the whole body takes part"


def test_the_base_stays_a_rotation(standing):
    np.testing.assert_allclose(np.linalg.norm(standing["q"][:, 3:7], axis=1), 1.0, atol=1e-12)


def test_what_is_recorded_of_a_task_is_its_error(standing):
    cell, k = build(standing.scenario), 700
    cell.state.move(standing["t"][k], standing["q"][k], standing["v"][k])
    for task in cell.listed:
        np.testing.assert_allclose(standing[f"task_error_{task.name.replace(' ', '_')}"][k],
                                   task.error(cell.state), atol=1e-15)


@pytest.mark.parametrize("name", ["humanoid", "dual-arm"])
@pytest.mark.parametrize("resolver", ["recursive", "hcod", "sns", "hqp:backend=proxqp"])
def test_strict_resolvers_agree_over_a_short_run(name, resolver):
    scenario = load(name, ["control.duration=0.4"])
    changed = scenario.with_resolver(resolver)
    one, other = simulate(scenario), simulate(changed)
    bound = max(1e-6, changed.make_resolver().accuracy)
    assert abs(one["q"] - other["q"]).max() < bound
    assert (other["status"] == 0).all()


def test_both_hands_of_the_dual_arm_follow_their_ellipses():
    run = simulate(load("dual-arm"))
    found = measure(run)
    for name in ("right_hand", "left_hand"):
        assert found[f"task_{name}_max_settled"].value < 5e-4, "of the start, which dies out"
        assert found[f"task_{name}_end"].value < 5e-5
        assert found[f"task_{name}_ahead_end"].value < 0.1
    assert found["joint_limit_excess"].value == 0.0
    assert np.ptp(run["task_position_left_hand"][:, 1]) > 0.4


@pytest.fixture(scope="module")
def reaching():
    scenario = load("humanoid-reach", ["control.duration=4.0"])
    return {name: simulate(scenario.with_resolver(name)) for name in ("tpm", "hcod", "augmented")}


@pytest.mark.parametrize("name", ["tpm", "hcod"])
def test_out_of_reach_strict_resolvers_keep_the_feet(reaching, name):
    run = reaching[name]
    for foot in ("left_foot", "right_foot"):
        assert np.linalg.norm(run[f"task_error_{foot}"][:, :3], axis=1).max() < 0.003
    assert np.linalg.norm(run["task_error_centre_of_mass"], axis=1).max() < 0.003
    assert np.linalg.norm(run["task_error_left_hand"][-1]) > 0.3, "nobody can reach that far"
    excess = np.maximum(run["q"] - run["joint_upper"], run["joint_lower"] - run["q"])
    assert excess.max() < 1e-6


def test_out_of_reach_the_resolver_without_priorities_lets_the_feet_slip(reaching):
    run = reaching["augmented"]
    slips = [np.linalg.norm(run[f"task_error_{foot}"][:, :3], axis=1).max()
             for foot in ("left_foot", "right_foot")]
    assert min(slips) > 0.05


def test_resolvers_that_take_bounds_keep_the_humanoids_limits():
    for resolver in ("tpm", "sns"):
        scenario = load("humanoid", ["control.duration=0.3", "limits.acceleration=50"])
        run = simulate(scenario.with_resolver(resolver))
        assert abs(run["a"][:, 6:]).max() <= 50 + 1e-9
        assert np.linalg.norm(run["task_error_right_hand"], axis=1).max() < 1e-3


def test_a_comparison_has_a_row_for_each_task(tmp_path):
    found = compare([load("humanoid", ["control.duration=0.1"])], ["tpm", "recursive"],
                    out=tmp_path / "out")
    labels = [metric.label for metric in found.runs[0].metrics.values()]
    for name in ("Left foot", "Right hand", "Centre of mass", "Gaze", "Posture"):
        assert f"{name}: error, rms" in labels
    assert (tmp_path / "out" / "index.html").exists()


def test_the_picture_of_a_robot_that_branches_shows_its_body(standing):
    from matplotlib.collections import PatchCollection
    axes = picture({"tpm": standing}).axes[0]
    bodies = [c for c in axes.collections if isinstance(c, PatchCollection)]
    assert len(bodies) == 4
    assert all(len(body.get_paths()) == 16 for body in bodies)


def test_a_joint_can_be_started_by_its_name():
    scenario = load("humanoid", {"start.joints": {"left_elbow": -1.5}})
    cell = build(scenario)
    assert cell.plant.q[cell.robot.coordinate("left_elbow")] == -1.5
    with pytest.raises(ScenarioError, match="did you mean 'left_elbow'"):
        build(load("humanoid", {"start.joints": {"left_elbo": -1.5}}))


def listed(*entries, **control):
    return {"name": "own", "robot": {"model": "dual_arm"},
            "control": {"duration": 0.02, "resolver": "tpm", "stack": "hierarchical", **control},
            "tasks": list(entries)}


HAND = {"kind": "position", "frame": "left_hand"}


def test_a_task_without_a_path_stays_where_it_is():
    run = simulate(Scenario.model_validate(listed(HAND)))
    assert abs(run["task_error_position"]).max() < 1e-12


def test_tasks_stand_behind_limits_position_and_pointing_in_their_order():
    data = listed({**HAND, "name": "b"}, {**HAND, "name": "a"}, {"kind": "com", "axes": "z"})
    data["limits"] = {"acceleration": 10.0}
    data["position"] = {"path": {"kind": "still", "position": [0.5, -0.4, 0.8]}}
    cell = build(Scenario.model_validate(data))
    assert cell.stack.names == ("joint limits", "position", "b", "a", "com")


@pytest.mark.parametrize(("entries", "control", "said"), [
    ([HAND, HAND], {}, "2 tasks are named 'position'"),
    ([HAND], {"stack": "switched"}, "hierarchical"),
    ([{**HAND, "from_start": True}], {}, "from_start needs a path"),
    ([{**HAND, "frame": 3}], {}, "frame"),
    ([{"kind": "fly"}], {}, "kind"),
    ([{**HAND, "stifness": 1.0}], {}, "stifness"),
])
def test_a_wrong_list_of_tasks_is_refused(entries, control, said):
    with pytest.raises(ValueError, match=said):
        Scenario.model_validate(listed(*entries, **control))


@pytest.mark.parametrize(("entry", "said"), [
    ({**HAND, "frame": "left_hnad"}, "task 'position': unknown frame 'left_hnad'; did you mean "
                                     "'left_hand'"),
    ({"kind": "posture", "target": [0.0]}, "1 values for 15 joint positions of robot 'dual_arm'"),
    ({"kind": "posture", "joints": {"elbow": 0.0}}, "task 'posture': unknown joint 'elbow'"),
])
def test_a_task_that_does_not_fit_its_robot_is_named(entry, said):
    with pytest.raises(ScenarioError) as error:
        build(Scenario.model_validate(listed(entry)))
    assert said in str(error.value)


def test_an_inequality_in_the_list_asks_for_a_resolver_that_takes_them():
    cone = {"kind": "pointing", "frame": "left_hand", "axis": [1, 0, 0], "alpha_d": 10}
    assert Scenario.model_validate(listed(cone)).asks == "inequalities"
    assert Scenario.model_validate(listed({**cone, "rows": "equality"})).asks == "equalities"


def test_a_posture_in_the_null_space_leaves_a_floating_base_alone():
    robot = ROBOTS["humanoid"]
    from hierarchy.tasks import Posture
    stack = Stack([Position(robot.frame("left_hand"), PATH)], "acceleration",
                  Posture((0.1,) * 30))
    h = stack.hierarchy(State.at(robot, robot.rest))
    np.testing.assert_array_equal(h.reference[:6], 0.0)
    np.testing.assert_allclose(h.reference[6:], 10.0 * (0.1 - robot.rest[7:]))


def test_a_file_as_run_is_read_back(standing, tmp_path):
    (tmp_path / "again.toml").write_text(standing.scenario.to_toml())
    assert load(tmp_path / "again.toml") == standing.scenario


def test_links_of_the_dual_arm_can_be_kept_apart():
    data = listed(HAND, resolver="hcod")
    data["avoidance"] = {"kind": "separation", "self_collision": 0.02}
    cell = build(Scenario.model_validate(data))
    assert cell.stack.names == ("self-separation", "position")
    assert simulate(Scenario.model_validate(data)).fault is None


def test_romeo_out_of_its_package_moves_alike_under_strict_resolvers():
    from importlib.metadata import PackageNotFoundError, distribution
    try:
        distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    scenario = load("romeo", ["control.duration=0.5"])
    runs = {name: simulate(scenario.with_resolver(name)) for name in ("tpm", "recursive", "hcod")}
    for run in runs.values():
        assert abs(run["q"] - runs["tpm"]["q"]).max() < 1e-6
        assert np.linalg.norm(run["task_error_left_foot"], axis=1).max() < 1e-5
        assert np.linalg.norm(run["task_error_right_hand"], axis=1).max() < 1e-4
