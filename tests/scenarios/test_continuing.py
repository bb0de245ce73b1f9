"""A run goes on with other settings: the same robot, plant and obstacles, other tasks."""

import pytest

from hierarchy.avoidance import Obstacle, Obstacles
from hierarchy.paths import Waypoints
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.controller import Controller
from scenarios.loop.recorder import Recorder

WAY = Waypoints((0.0, 1.0), ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))


def drive(controller, recorder, first, ticks):
    plant = controller.cell.plant
    for k in range(first, first + ticks):
        plant.act(controller.command(k * 0.001, plant.q, plant.v))
        recorder.write()
        recorder.look()


def test_an_obstacle_that_was_shifted_keeps_its_offset_while_it_moves():
    obstacles = Obstacles([Obstacle("point", (0.1, 0.2, 0.3)),
                           Obstacle("sphere", (0.0, 0.0, 0.0), (0.1,), path=WAY)])
    for offset in ((0.0, 0.0, 0.5), (0.0, 0.1, 0.0)):  # not one on top of the other
        obstacles.shift(0, offset)
        obstacles.shift(1, offset)
    assert obstacles.centres[0] == pytest.approx([0.1, 0.3, 0.3])
    for t in (0.0, 0.5, 1.0):
        assert obstacles.at(t)[1, 4:7] == pytest.approx(WAY(t)[0] + [0.0, 0.1, 0.0])


@pytest.mark.slow
def test_a_cell_that_is_kept_goes_on_where_it_was():
    scenario = load("ellipse", ["control.options.damping=0.0"])
    whole, parted = Controller(scenario), Controller(scenario)
    once, twice = Recorder(whole, 60), Recorder(parted, 60)
    drive(whole, once, 0, 60)
    drive(parted, twice, 0, 30)
    again = Controller(scenario, build(scenario, parted.cell))
    twice.follow(again)
    drive(again, twice, 30, 30)
    assert again.cell.plant is parted.cell.plant
    one, other = once.finish(scenario, None), twice.finish(scenario, None)
    for name in ("t", "q", "v", "command", "order", "minimal_distance", "desired_position"):
        assert (one[name] == other[name]).all(), name
