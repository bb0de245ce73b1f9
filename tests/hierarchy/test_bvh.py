"""BVH files: positions of joints by hand, and what is wrong in a file."""

import numpy as np
import pytest

from hierarchy import HierarchyError
from hierarchy.paths import read_bvh

TEXT = """HIERARCHY
ROOT hips
{
  OFFSET 1 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0 -2 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -3 0
    }
  }
  JOINT hand
  {
    OFFSET 4 0 0
    CHANNELS 0
  }
}
MOTION
Frames: 2
Frame Time: 0.5
0 0 0 0 0 0 0
0 10 0 90 0 90 90
"""


def test_turns_follow_the_order_of_the_channels(tmp_path):
    motion = read_bvh(written(tmp_path, TEXT))
    np.testing.assert_array_equal(motion.times, [0.0, 0.5])
    expected = {"hips": ([1, 0, 0], [1, 10, 0]), "knee": ([1, -2, 0], [3, 10, 0]),
                # Rz(90) Ry(90) takes x to -z and y to -x; the knee's turn takes -y to -z.
                "knee end": ([1, -5, 0], [3, 7, 0]), "hand": ([5, 0, 0], [1, 10, -4])}
    assert set(motion.positions) == set(expected)
    for name, places in expected.items():
        np.testing.assert_allclose(motion.positions[name], places, atol=1e-12, err_msg=name)


@pytest.mark.parametrize(("old", "new", "said"), [
    ("MOTION", "", "is no BVH file"), ("OFFSET 0 -3 0", "OFFSET 0 -3", "is no BVH file"),
    ("  JOINT hand", "  LIMB hand", "'LIMB' is unknown there"),
    ("0 10 0 90 0 90 90", "0 10 0", "is no BVH file"), ("0.5", "0.0", "a positive time"),
    ("0 10 0 90 0 90 90", "0 nan 0 90 0 90 90", "frames of finite numbers"),
    ("Xrotation Yrotation", "Xrotation Wrotation", "'wrotation' is unknown"),
    ("0 90 90\n", "0 90 90\n}", "is no BVH file")])
def test_a_wrong_file_is_named(tmp_path, old, new, said):
    file = written(tmp_path, TEXT.replace(old, new, 1))
    with pytest.raises(HierarchyError, match=said) as error:
        read_bvh(file)
    assert str(file) in str(error.value)
    with pytest.raises(HierarchyError, match="cannot be read"):
        read_bvh(tmp_path / "none.bvh")


def written(folder, text):
    (folder / "motion.bvh").write_text(text)
    return folder / "motion.bvh"
