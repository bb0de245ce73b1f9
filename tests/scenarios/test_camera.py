"""The simulated depth camera, and distances out of its images.

Depths are those of known geometry, distances those of all pixels one by one.
"""

from math import inf
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest
from refusals import refused
from scene import ROBOT, TURN, deproject, distance

from hierarchy import State
from hierarchy.avoidance import ControlPoint, Obstacle, Obstacles
from hierarchy.avoidance.body import pack_capsules
from scenarios import load, simulate
from scenarios.cell.robot import on_column
from scenarios.cell.sensors.camera import DepthCamera, Pinhole, RecordedFrames, looking_at
from scenarios.cell.sensors.depth_sensor import DepthSpace, ObstacleImage
from scenarios.cell.sensors.rendering import draw_robot
from scenarios.cell.sensors.sensor import ExactDistances
from scenarios.config.sections.sensor import CameraSection, ImageSection

STATE = State.at(ROBOT, [0.9, -0.9, 0.9, 1.2, 1.0, 1.8, 0.0])
IDEAL = CameraSection(kind="camera", backdrop=0.0, ideal=True, near=0.0, far=1e9)
SHAPES = {
    "sphere": Obstacle("sphere", (0.1, 0.0, 2.0), (0.3,)),
    "capsule": Obstacle("capsule", (-0.1, 0.1, 2.0), (0.1, 0.4), TURN),
    "capsule across": Obstacle("capsule", (0.05, 0.1, 2.0), (0.1, 0.4),
                               ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))),
    "capsule along the axis": Obstacle("capsule", (0.02, 0.01, 2.0), (0.1, 0.4)),
    "box": Obstacle("box", (0.0, 0.1, 2.0), (0.3, 0.2, 0.5), TURN),
    "sphere half outside": Obstacle("sphere", (1.1, 0.5, 2.0), (0.3,)),
    "box around the camera's plane": Obstacle("box", (0.4, 0.0, 0.0), (0.1, 0.1, 1.0)),
    "capsule past the camera": Obstacle("capsule", (0.3, 0.1, 0.2), (0.1, 1.0))}


def traced(obstacle, pinhole, u, v):
    """Depth by sphere tracing, from the distance function alone; 0 for a miss."""
    ray, share = deproject(pinhole, (u, v, 1.0)) - pinhole.position, 0.0
    for _ in range(2000):
        off, _ = distance(obstacle, pinhole.position + share * ray)
        if off < 1e-9:
            return share
        share += off / np.linalg.norm(ray)
        if share > 20.0:
            break
    return 0.0


@pytest.mark.parametrize("name", SHAPES)
def test_every_pixel_has_the_depth_at_which_its_ray_meets_the_shape(name):
    """Sphere tracing needs nothing but the distance function; grazing rays are left out."""
    pinhole = Pinhole(width=80, height=60, fx=70.0, fy=65.0)
    seen = DepthCamera(IDEAL, pinhole, Obstacles([SHAPES[name]]), ()).image(0, STATE)[0]
    seen = seen.astype(float)
    assert (seen > 0.0).sum() > 20
    beside = np.zeros_like(seen)
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        beside += np.roll(seen, step, axis) > 0.0
    rng = np.random.default_rng(1)
    v, u = rng.integers(60, size=100), rng.integers(80, size=100)
    whole = (seen > 0.0) * 4 == beside  # inside or outside with all neighbours
    for i, j in zip(v[whole[v, u]], u[whole[v, u]], strict=True):
        assert seen[i, j] == pytest.approx(traced(SHAPES[name], pinhole, j, i), rel=2e-6), (i, j)


# -- distances out of images -----------------------------------------------------------------------
CAPSULES = on_column(ROBOT, ROBOT.capsules, 0.31)
FACING = Pinhole(101, 81, 100.0, 100.0)  # at the origin, z forward, its middle in pixel (50, 40)
SIDE = Pinhole(320, 240, 262.0, 262.0, position=(0.3, 2.2, 0.8),
               rotation=looking_at((0.3, 2.2, 0.8), (0.0, 0.3, 0.1)))


def space_of(pinhole, points, capsules, region, mean_within=(inf, inf), **settings):
    section = ImageSection(kind="camera", region=region, **settings)
    exact = ExactDistances(ROBOT, Obstacles(), mean_within=mean_within)
    exact.points = points
    return DepthSpace(section, pinhole, exact, capsules, region)


def seen_in(image, *places, thin=inf, **settings):
    """Measure points in an image (h, w) without a robot in it, the end effector last."""
    points = [ControlPoint("point", 0, np.array(place, dtype=float)) for place in places]
    space = space_of(FACING, points, (), 0.4, support=1, thin=None if thin == inf else thin,
                     **settings)
    obstacles = ObstacleImage.empty(FACING.height, FACING.width)
    space.find_obstacles(np.asarray(image, np.float32), STATE.placements, obstacles)
    return space.measure(obstacles, STATE.placements)


def one_by_one(image, pinhole, point, region, thin=inf, within=inf):
    """Distance, direction from the nearest and mean direction over all pixels; plain numpy.

    The mean is over what is nearer than `within`, and the nearest where nothing is.
    """
    v, u = np.nonzero(image)
    depth, own = image[v, u].astype(float), pinhole.project(point)[2]
    counted = np.where(depth < own, np.minimum(depth + thin, own), depth)
    off = point - deproject(pinhole, np.column_stack([u, v, counted]))
    distance = np.linalg.norm(off, axis=1)
    if not (distance < region).any():
        return inf, np.zeros(3), np.zeros(3)
    off, distance = off[distance < region], distance[distance < region]
    nearest = np.argmin(distance)
    counted = distance < within if distance.min() < within else distance == distance.min()
    mean = (off / distance[:, None])[counted].mean(axis=0)
    return distance[nearest], off[nearest] / distance[nearest], mean / np.linalg.norm(mean)


@pytest.mark.parametrize(("share", "thin"), [(0.002, inf), (0.3, 0.1), (0.3, 0.0)])
def test_distances_and_directions_are_those_of_all_pixels_one_by_one(share, thin):
    """Neither the square that is visited, nor the tiles that are left out, lose a pixel."""
    rng, seen_some = np.random.default_rng(5), 0
    for _ in range(6):
        image = rng.uniform(0.6, 2.5, (81, 101)) * (rng.random((81, 101)) < share)
        image = image.astype(np.float32)
        points = rng.uniform((-1, -1, 0.3), (1, 1, 2.8), (6, 3))
        for body, tip in ((0.0, 0.0), (0.2, 0.3), (0.3, 0.1), (inf, inf)):
            seen = seen_in(image, *points, thin=thin, mean_within=(body, tip))
            for k, point in enumerate(points):
                mean = tip if k == len(points) - 1 else body
                D, nearest, average = one_by_one(image, FACING, point, 0.4, thin, mean)
                assert seen.distance[k] == pytest.approx(D, abs=1e-6)
                seen_some += D < inf
                if 0.05 < D < inf:
                    np.testing.assert_allclose(seen.direction[k], average if mean else nearest,
                                               atol=1e-4)
    assert seen_some > 12


def test_the_arm_does_not_avoid_itself():
    """Wherever it is, and whatever the camera gets wrong but for outliers in blobs."""
    section = CameraSection(kind="camera", backdrop=4.0, outliers=0.0)
    camera = DepthCamera(section, SIDE, Obstacles(), CAPSULES)
    space = space_of(SIDE, ExactDistances(ROBOT, Obstacles()).points, CAPSULES, region=0.4)
    rng, obstacles = np.random.default_rng(8), ObstacleImage.empty(SIDE.height, SIDE.width)
    for i in range(60):
        state = State.at(ROBOT, rng.uniform(0.9 * ROBOT.lower, 0.9 * ROBOT.upper))
        space.find_obstacles(*camera.image(i, state), obstacles)
        assert (camera.scene < 3.9).mean() > 0.005
        assert np.isinf(space.measure(obstacles, state.placements).distance).all()


QUICK = ["sensor={kind='camera', position=[0.3, 2.2, 0.8], look_at=[0.0, 0.3, 0.1], width=160, "
         "height=120, fx=131.0, fy=131.0}", "control.duration=0.6", "plant={}",
         "control.resolver=hqp", "control.options={}"]


def test_a_camera_sees_the_true_robot_and_not_where_late_joints_say_it_is():
    """It drew the arm where the controller thought it was, from which it was then removed."""
    missed: list[int] = []

    def look(tick, controller):
        cell, camera = controller.cell, controller.cell.sensor.source
        if cell.sensor.measurement.stamp == cell.state.t:
            true = State.at(cell.robot, cell.plant.extra["true_q"])
            drawn = np.empty_like(camera.scene)
            draw_robot(drawn, camera.pinhole.packed(), true.placements,
                       *pack_capsules(cell.robot.capsules), 0.0)
            missed.append(int((np.isfinite(drawn) & (camera.scene > drawn)).sum()))
        return {}

    run = simulate(load("human", [*QUICK, "start.v=[0.8,0,0,0,0,0,0]", "control.duration=0.3",
                                  "plant.measurement={delay=0.05}"]), audits=[look])
    assert np.abs(run["true_q"] - run["q"]).max() > 0.02
    assert len(missed) > 5
    assert max(missed) == 0


def test_the_robot_of_a_recorded_image_is_where_its_joints_say_or_where_it_is():
    frames, joints = RecordedFrames("hand", ROBOT), State.at(ROBOT, ROBOT.rest)
    frames._placements[:2] = None, joints.placements
    assert frames.image(0, STATE)[1] is STATE.placements
    assert frames.image(1, STATE)[1] is joints.placements


def test_frames_that_cannot_be_used_are_refused_by_name(tmp_path):
    run = simulate(load("human", [*QUICK, "control.duration=0.3"]))
    example = Path(__file__).parents[2] / "examples" / "record_frames.py"
    folder = run_path(str(example))["write"](tmp_path / "some", run, frames=6)
    refused("has no frames", RecordedFrames, tmp_path, ROBOT)
    text = (folder / "frames.toml").read_text()
    for wrong, said in ((text.replace("width = 160", "width = 161"), "0000.png"),
                        (text.replace("fx = ", "gx = "), "fx: Field required"),
                        (text.replace("0001.png", "9999.png"), "9999.png"),
                        (text.replace("time = ", "at = "), "time"), ("x = [", "frames.toml"),
                        (text.replace("scale = 0.001", "scale = -1.0"), "scale"),
                        (text.replace("q = [", "q = [0.0, "), "frame.0.q"),
                        (text.replace("time = 0.0\n", "time = 9.0\n"), "increase")):
        (tmp_path / "frames.toml").write_text(wrong)
        for png in folder.glob("*.png"):
            (tmp_path / png.name).write_bytes(png.read_bytes())
        refused(said, RecordedFrames, tmp_path, ROBOT)
