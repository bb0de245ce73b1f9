"""The simulated depth camera: true depths, its errors, its clock."""

import numpy as np
import pytest
from refusals import refused
from scene import TURN, deproject, distance

from hierarchy import Robot, State
from hierarchy.avoidance import Obstacle, Obstacles
from scenarios.cell.sensors.camera import DepthCamera, Pinhole, looking_at
from scenarios.config.sections.sensor import CameraSection

STATE = State.at(Robot.named("kuka_lwr"), [0.9, -0.9, 0.9, 1.2, 1.0, 1.8, 0.0])
SMALL = {"width": 80, "height": 60, "fx": 70.0, "fy": 65.0}
EXACT = {"noise_floor": 0.0, "noise_growth": 0.0, "rounding": "step", "step": 0.0, "missing": 0.0,
         "missing_at_edges": 0.0, "outliers": 0.0}
IDEAL = {"ideal": True, "near": 0.0, "far": 1e9}
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


def camera(*obstacles, errors=IDEAL, capsules=(), pinhole=None, **settings):
    section = CameraSection(**{"kind": "camera", "backdrop": 0.0, **errors, **settings})
    return DepthCamera(section, pinhole or Pinhole(**SMALL), Obstacles(obstacles), capsules)


def wall(depth=2.0, **settings):
    """A wall that fills the image, with the default errors."""
    return camera(backdrop=depth, **{"errors": {}, **settings})


def depths(taken):
    return taken.image(0, STATE)[0].astype(float)


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
    pinhole, seen = Pinhole(**SMALL), depths(camera(SHAPES[name]))
    assert (seen > 0.0).sum() > 20
    beside = np.zeros_like(seen)
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        beside += np.roll(seen, step, axis) > 0.0
    rng = np.random.default_rng(1)
    v, u = rng.integers(60, size=100), rng.integers(80, size=100)
    whole = (seen > 0.0) * 4 == beside  # inside or outside with all neighbours
    for i, j in zip(v[whole[v, u]], u[whole[v, u]], strict=True):
        assert seen[i, j] == pytest.approx(traced(SHAPES[name], pinhole, j, i), rel=2e-6), (i, j)


@pytest.mark.parametrize(("rounding", "step"), [("step", 0.01), ("disparity", 2.85e-3)])
def test_rounding_is_to_steps_of_the_depth_or_of_its_inverse_and_bounded(rounding, step):
    errors = EXACT | {"rounding": rounding, "step": step}
    seen, true = (depths(camera(SHAPES["sphere"], errors=one)) for one in (errors, IDEAL))
    power = 1.0 if rounding == "step" else -1.0
    steps, exact = (one[true > 0] ** power / step for one in (seen, true))
    np.testing.assert_allclose(steps, np.rint(steps), atol=2e-3)
    assert len(np.unique(steps)) > 3
    np.testing.assert_allclose(steps, exact, rtol=0.0, atol=0.5 + 1e-3)


@pytest.mark.parametrize("depth", [1.0, 3.0])
def test_noise_has_the_stated_size_and_a_bound(depth):
    errors = {"step": 0.0, "missing": 0.0, "missing_at_edges": 0.0, "outliers": 0.0}
    off = depths(wall(depth, errors=errors)) - depth
    sigma = 1.2e-3 + 1.9e-3 * (depth - 0.4) ** 2
    assert abs(off.mean()) < 0.05 * sigma
    assert off.std() == pytest.approx(sigma, rel=0.05)
    assert np.abs(off).max() <= 3.5 * sigma + 1e-6


def test_pixels_are_missing_at_random_and_more_so_at_edges():
    errors = {"missing": 0.1, "missing_at_edges": 0.5, "outliers": 0.0}
    assert (depths(wall(errors=errors)) == 0).mean() == pytest.approx(0.1, abs=0.02)
    scene = camera(Obstacle("sphere", (0.0, 0.0, 2.0), (0.5,)), backdrop=4.0, errors=errors)
    missing = np.mean([scene.image(i, STATE)[0] == 0 for i in range(40)], axis=0)
    steps = np.abs(np.diff(scene.scene.astype(float), axis=1)) > 0.05
    edge = np.pad(steps, ((0, 0), (1, 0))) | np.pad(steps, ((0, 0), (0, 1)))
    assert missing[edge].mean() == pytest.approx(0.5, abs=0.05)


def test_outliers_are_nearer_and_come_in_their_share_of_frames():
    scene = wall(errors=EXACT | {"outliers": 0.3})
    seen = [scene.image(i, STATE)[0].copy() for i in range(200)]
    sizes = [np.count_nonzero(reading != 2.0) for reading in seen]
    assert np.mean(np.array(sizes) > 0) == pytest.approx(0.3, abs=0.1)
    assert set(sizes) >= {0, 1, 9, 25}
    assert max(sizes) == 25
    assert 0.5 <= np.min(seen) <= np.max(seen) == 2.0


def test_jitter_delays_each_frame_by_less_than_its_most_and_by_the_seed():
    late, same, other = (camera(rate=30.0, jitter=0.02, seed=seed) for seed in (3, 3, 4))
    times = np.array([late.time(i) for i in range(100)])
    waits = times - np.arange(100) / 30.0
    assert waits.min() >= 0.0
    assert 0.015 < waits.max() < 0.02
    assert [late.newest(t) for t in times] == list(range(100))
    assert [late.newest(t - 1e-6) for t in times] == list(range(-1, 99))
    assert same.time(5) == times[5] != other.time(5)


@pytest.mark.parametrize(("make", "said"), [
    (lambda: Pinhole(width=0), "width [px] = 0"), (lambda: Pinhole(fx=np.nan), "fx [px] = nan"),
    (lambda: Pinhole(rotation=np.eye(3) * 1.1), "rotation"),
    (lambda: Pinhole(rotation=np.diag([1, 1, -1])), "rotation"),
    (lambda: Pinhole(position=(0, np.inf, 0)), "position"),
    (lambda: looking_at((1, 2, 3), (1, 2, 3)), "position and look_at are both"),
    (lambda: looking_at([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), "position and look_at are both"),
    (lambda: camera(rate=30.0, jitter=0.05), "jitter = 0.05 s")])
def test_what_cannot_be_is_refused_by_name(make, said):
    refused(said, make)


def test_a_camera_faces_what_it_looks_at_with_the_middle_of_its_pixels():
    assert (Pinhole(**SMALL).cx, Pinhole(**SMALL).cy) == (39.5, 29.5)  # of 0 to 79, of 0 to 59
    R = looking_at([0.0, 0.0, 1.0], [0.0, 1.0, 1.0])
    np.testing.assert_allclose(R, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]], atol=1e-15)
