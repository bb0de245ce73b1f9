"""Paths: position, velocity and acceleration agree, and pass where they should."""

from functools import partial
from pathlib import Path as FilePath

import numpy as np
import pytest
from computed import PATHS, POINTS, TIMES
from refusals import refused

from hierarchy import paths

BLENDED = paths.Blended(TIMES, POINTS, blend=0.3)


@pytest.mark.parametrize("path", [*PATHS, BLENDED], ids=lambda path: type(path).__name__)
def test_velocity_and_acceleration_are_the_derivatives(path):
    h = 1e-6
    for t in np.linspace(-0.2, 5.0, 401) + 1e-4:  # not where a piece begins
        before, now, later = path(t - h), path(t), path(t + h)
        rates = (later[:2] - before[:2]) / (2 * h)
        np.testing.assert_allclose(rates, now[1:], atol=2e-8, rtol=1e-6)


def test_blended_waypoints_do_not_stop_and_miss_corners_by_what_is_said():
    path = BLENDED
    for i in (1, 2):
        at = path(TIMES[i] + 0.15)
        before = np.subtract(POINTS[i], POINTS[i - 1]) / (TIMES[i] - TIMES[i - 1])
        after = np.subtract(POINTS[i + 1], POINTS[i]) / (TIMES[i + 1] - TIMES[i])
        assert np.linalg.norm(at[1]) > 0.1
        assert np.linalg.norm(at[0] - POINTS[i]) == pytest.approx(
            5 / 64 * 0.3 * np.linalg.norm(after - before))
    np.testing.assert_allclose(path(0.5)[0], POINTS[0])
    np.testing.assert_allclose(path(3.8), [POINTS[3], [0] * 3, [0] * 3], atol=1e-12)


@pytest.mark.parametrize("make", [paths.Waypoints, paths.Recorded,
                                  partial(paths.Blended, blend=0.5)])
def test_times_of_few_digits_take_none_of_those_of_the_present(make):
    times, points = np.array([1000, 1001, 1002], dtype=np.float32), np.array(POINTS[:3])
    for t in (1000.2503, 1001.7501):
        np.testing.assert_array_equal(make(times, points)(t), make(times.astype(float), points)(t))


@pytest.mark.parametrize("names", ["", "t, x, y, z\n", "\ufeff"])
def test_a_path_of_a_csv_file_passes_its_points_with_continuous_acceleration(names, tmp_path):
    rows = "\n".join(",".join(map(str, (t, *p))) for t, p in zip(TIMES, POINTS, strict=True))
    (tmp_path / "a.csv").write_text(f"{names}{rows}\n\n", encoding="utf-8")
    path = paths.Recorded.from_csv(tmp_path / "a.csv")
    whole = [paths.Recorded(TIMES, np.round(9 * np.abs(POINTS)).astype(kind))
             for kind in (np.uint8, float)]  # unsigned numbers wrap where they are subtracted
    np.testing.assert_array_equal(*(one((TIMES[0] + TIMES[1]) / 2) for one in whole))
    for t, point in zip(TIMES, POINTS, strict=True):
        np.testing.assert_allclose(path(t)[0], point, atol=1e-12)
    for t in TIMES[1:-1]:
        np.testing.assert_allclose(path(t - 1e-9), path(t + 1e-9), atol=1e-6)
    np.testing.assert_allclose(path(TIMES[0] + 1e-9)[1], 0.0, atol=1e-6)
    np.testing.assert_allclose(path(TIMES[-1] - 1e-9)[1], 0.0, atol=1e-6)


BVH = FilePath(__file__).parents[1] / "data" / "motion.bvh"


def test_turns_follow_the_order_of_the_channels():
    motion = paths.read_bvh(BVH)
    np.testing.assert_array_equal(motion.times, [0.0, 0.5])
    expected = {"hips": ([1, 0, 0], [1, 10, 0]), "knee": ([1, -2, 0], [3, 10, 0]),
                # Rz(90) Ry(90) takes x to -z and y to -x; the knee's turn takes -y to -z.
                "knee end": ([1, -5, 0], [3, 7, 0]), "hand": ([5, 0, 0], [1, 10, -4])}
    assert set(motion.positions) == set(expected)
    for name, places in expected.items():
        np.testing.assert_allclose(motion.positions[name], places, atol=1e-12, err_msg=name)


@pytest.mark.parametrize(("read", "text", "said"), [
    *((paths.Recorded.from_csv, text, said) for text, said in (
        ("t,x,y,z\n0,0,0,0\n1,0,0\n", ", line 3: expected t, x, y, z, got '1,0,0'"),
        ("0,0,0,0\n1,a,0,0\n", ", line 2: expected t, x, y, z, got '1,a,0,0'"),
        ("0,0,0,0;\n1,0,0,0\n2,0,0,0\n", ", line 1: expected t, x, y, z, got '0,0,0,0;'"),
        ("t,x,y,z\n\n0,0,0,0\n1,0,0\n", ", line 4: expected t, x, y, z, got '1,0,0'"),
        ("0,0,0,0\n1,nan,0,0\n", ": points[1] [m]: expected 3 finite numbers"),
        ("0,0,0,0\n0,1,0,0\n", "times must increase"), ("0,0,0,0\n", "one point is no motion"),
        ("", "0 times for 0 points"))),
    *((paths.read_bvh, BVH.read_text().replace(old, new, 1), said) for old, new, said in (
        ("MOTION", "", " is no BVH file"), ("OFFSET 0 -3 0", "OFFSET 0 -3", " is no BVH file"),
        ("  JOINT hand", "  LIMB hand", "'LIMB' is unknown there"),
        ("  JOINT hand", "  JOINT knee", "joint 'knee' comes twice"),
        ("0 10 0 90 0 90 90", "0 10 0", " is no BVH file"), ("0.5", "0.0", "a positive time"),
        ("0 10 0 90 0 90 90", "0 nan 0 90 0 90 90", "frames of finite numbers"),
        ("Xrotation Yrotation", "Xrotation Wrotation", "'wrotation' is unknown"),
        ("0 90 90\n", "0 90 90\n}", " is no BVH file")))])
def test_a_wrong_file_is_named(tmp_path, read, text, said):
    (tmp_path / "a").write_text(text)
    assert refused(said, read, tmp_path / "a").startswith(str(tmp_path / "a"))
    refused("cannot be read", read, tmp_path / "none")
