"""Contacts before they are trusted: what a start, a first tick and a fault say of them."""


import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from standing import ROBOT, feet

from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.config import ScenarioError
from scenarios.config.plant import TorqueSection
from scenarios.loop.first_tick import first_tick

changed = load("stand-push").with_changes
ANKLE = ROBOT.rest[ROBOT.coordinate("left_ankle_pitch")]

pytestmark = pytest.mark.usefixtures("with_mujoco")


def tilted(degrees):
    """Both soles turned by their ankles from where they are flat."""
    angle = float(ANKLE + np.radians(degrees))
    return {"start.on_floor": True,
            "start.joints": {"left_ankle_pitch": angle, "right_ankle_pitch": angle}}


@pytest.mark.parametrize(("keys", "said"), [
    (tilted(13.5), "'left_foot' is not flat on the floor but tilted by 13.5 deg; its corner "
                   r"\(-0.05, -0.04, 0\) is 49 mm above the floor"),
    ({"contacts.1.up": [1.0, 0.0, 0.0]},
     r"'right_foot' is turned on edge, 90 deg .* \[0, 0, 1\] here: set `up`"),
    ({"contacts.0.up": [0.0, 0.0, -1.0]}, "'left_foot' is upside down, 180 deg"),
    ({"plant.height": -0.05}, "'left_foot' is 50 mm above the floor. start.on_floor"),
    ({"plant.height": 0.02}, "'left_foot' is 20 mm below the floor"),
    ({"contacts.0.x": None, "contacts.0.y": None, "contacts.0.offset": [0.0, 0.0, 0.01]},
     "'left_foot' is 9 mm above the floor")])
def test_a_contact_that_does_not_stand_on_the_floor_is_refused(keys, said):
    with pytest.raises(ScenarioError, match=f"contacts.*: at the start .*{said}"):
        build(changed(keys))


@pytest.mark.parametrize("keys", [
    tilted(0.4), {"plant.height": -0.0015},
    {**tilted(8.0), "contacts.0.open": [[0.0, 1.0]], "contacts.1.open": [[0.0, 1.0]]},
], ids=["a little", "a little above", "open at the start"])
def test_what_comes_down_within_a_few_ticks_or_later_is_not_refused(keys):
    build(changed(keys))


def test_a_floor_with_less_friction_than_the_controller_counts_on_is_named():
    found = first_tick(changed({"plant.friction": 0.4, "contacts.1.friction": 0.3})).warnings
    assert [line for line in found if "friction" in line] == [
        "contact 'left_foot': the controller counts on a friction of 0.7, and the plant has 0.4 "
        "(plant.friction): it may slip"]


def test_a_joint_that_passes_its_stop_ends_the_run_with_a_fault():
    """No torque within the limits stops an elbow at 40 rad/s within the way that it has."""
    v, name = np.zeros(ROBOT.n), "left_elbow"
    v[ROBOT.velocity_names.index(name)] = 40.0
    run = simulate(changed({"start.v": v.tolist(), "plant.beyond_stop": 0.1,
                            "control.duration": 0.5}))
    assert run.fault.startswith(f"joint {name} is 0.1")
    assert "beyond its stop at" in run.fault
    assert run.ticks < 300
    column = ROBOT.coordinate(name)
    upper = ROBOT.upper[column]
    assert (run["q"][:, column] < upper + 0.1).all()


def test_a_base_that_tilts_has_fallen():
    q, v = ROBOT.rest.copy(), np.zeros(ROBOT.n)
    q[2] += 100.0
    v[3:6] = [1.0, -2.0, 0.5]
    plant = TorqueRobot(ROBOT, feet(), q, v, section=TorqueSection(
        kind="torque", tilt=0.5, fall=1e3, beyond_stop=1e3))
    for _ in range(1000):
        angle = Rotation.from_quat(plant.q[3:7]).apply([0.0, 0.0, 1.0])[2]
        assert (plant.fault is not None) == (np.arccos(angle) > 0.5)
        if plant.fault:
            break
        plant.act(np.zeros(ROBOT.n - 6))
    assert plant.fault.startswith("the robot has fallen: its base has tilted by 0.5 rad (")
