"""The robots that are shipped, as tables: plausible round numbers but for the KUKA's geometry.

- `KUKA_LWR`: KUKA LWR IV, base frame at the shoulder (0.3105 m above the foot of the real arm).
  Geometry and position limits: the arm's data sheet, as used in the letter. Velocity limits: the
  data sheet of the LWR 4+ [deg/s]. Torque limits: plausible, not checked against the data sheet.
  Masses: plausible round numbers for a 16 kg arm, not identified.
- `DUAL_ARM`: two arms of seven joints on a rotating torso. The torso's axis is z of the world at
  the origin; the shoulders are 0.25 m to its left (y) and right, 0.9 m up. Arms are 0.3 m and 0.3 m
  long, hands 0.1 m; they hang down at zero.
- `HUMANOID`: 30 joints on a floating base, 1.45 m and 40 kg, of the size of Romeo. Lengths and
  masses of the segments are shares of height and mass: Drillis and Contini's, as in D. A. Winter,
  Biomechanics and Motor Control of Human Movement. The base frame is between the hips, x forward, y
  left, z up; the soles are at z = 0 of the world in the upright posture.
- `QUADRUPED`: 12 joints on a floating base, 15 kg, 0.34 m to the hips. The base frame is in the
  middle of the hips, x forward, y left, z up; the feet are points at z = 0 of the world in the
  posture of the start, each below its hip.
"""

from collections.abc import Iterator
from math import cos, radians
from typing import Any

from hierarchy.robots.table import DHTable, Link, TreeFrame, TreeJoint, TreeTable, Vector

_HERE: Vector = (0.0, 0.0, 0.0)
_SIDES = (("left", 1.0), ("right", -1.0))


def _down(length: float) -> Vector:
    return 0.0, 0.0, -length


def _limb(limb: str, parent: str, *joints: tuple[Any, ...]) -> Iterator[TreeJoint]:
    """Yield joints that carry each other; of each, what a `TreeJoint` has but its parent."""
    for name, *rest in joints:
        yield TreeJoint(f"{limb}_{name}", parent, *rest)
        parent = f"{limb}_{name}"


def _outward(left: float, inward: float, outward: float) -> tuple[float, float]:
    """Return the range of a roll that turns outward, of the left side or of the right one."""
    return (-inward, outward) if left > 0.0 else (-outward, inward)


def _arm_points(upper_arm: float, forearm: float) -> tuple[tuple[str, Vector], ...]:
    """Return the middles and the ends of the upper arms and forearms."""
    return tuple((f"{side}_{joint}", _down(share * length)) for side, _ in _SIDES
                 for joint, length in (("shoulder_yaw", upper_arm), ("wrist_yaw", forearm))
                 for share in (0.5, 1.0))


# [m] The eight points of the letter: 1-4 from the elbow back over half the upper arm, 5-8 from the
# wrist to the elbow. An upper-arm point lies on the axis of joint 3 and a forearm point on that of
# joint 5, which do not move it: each is attached to the previous link, whose y axis is that axis.
_KUKA_UPPER_ARM, _KUKA_FOREARM = 0.4, 0.39
_KUKA_POINTS: tuple[tuple[str, Vector], ...] = (
    *(("joint_2", (0.0, _KUKA_UPPER_ARM - i / 4 * 0.2, 0.0)) for i in range(4)),
    *(("joint_4", (0.0, -(_KUKA_FOREARM - i / 4 * _KUKA_FOREARM), 0.0)) for i in range(4)))

KUKA_LWR = DHTable(
    name="kuka_lwr",
    a=(0.0,) * 7,
    d=(0.0, 0.0, _KUKA_UPPER_ARM, 0.0, _KUKA_FOREARM, 0.0, 0.078),
    alpha=(90.0, -90.0, -90.0, 90.0, 90.0, -90.0, 0.0),
    range=(170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 170.0),
    velocity=tuple(radians(v) for v in (110.0, 110.0, 128.0, 128.0, 204.0, 184.0, 184.0)),
    effort=(176.0, 176.0, 100.0, 100.0, 100.0, 38.0, 38.0),
    mass=(2.7, 2.7, 2.7, 2.7, 1.7, 1.6, 0.3),
    radius=0.06,
    control_points=_KUKA_POINTS,
)


def _arm_of_dual(side: str, left: float) -> Iterator[TreeJoint]:
    return _limb(
        side, "torso",
        ("shoulder_pitch", (0.0, left * 0.25, 0.9), "y", (-170, 90), 3.0, 120.0, Link(), -35.0),
        ("shoulder_roll", _HERE, "x", _outward(left, 30.0, 120.0), 3.0, 120.0, Link(), left * 20.0),
        ("shoulder_yaw", _HERE, "z", (-160, 160), 3.5, 80.0, Link(_down(0.3), 0.055, 3.5)),
        ("elbow", _down(0.3), "y", (-150, 5), 3.5, 80.0, Link(), -75.0),
        ("wrist_yaw", _HERE, "z", (-160, 160), 4.0, 40.0, Link(_down(0.3), 0.05, 2.5)),
        ("wrist_roll", _down(0.3), "x", (-100, 100), 4.0, 30.0),
        ("wrist_pitch", _HERE, "y", (-110, 110), 4.0, 30.0, Link(_down(0.1), 0.04, 1.0), 20.0))


DUAL_ARM = TreeTable(
    name="dual_arm",
    joints=(TreeJoint("torso", "", _HERE, "z", (-120, 120), 2.0, 200.0,
                      Link((0.0, 0.0, 0.85), 0.12, 25.0, (0.0, 0.0, 0.15))),
            *(joint for side in _SIDES for joint in _arm_of_dual(*side))),
    frames=tuple(TreeFrame(f"{side}_hand", f"{side}_wrist_pitch", _down(0.1), (0.0, 0.0, -1.0))
                 for side, _ in _SIDES),
    end_effector="right_hand",
    links=(("torso", Link((0.0, 0.25, 0.9), 0.06, 0.0, (0.0, -0.25, 0.9))),),
    control_points=_arm_points(0.3, 0.3),
)

_HEIGHT, _MASS = 1.45, 40.0          # [m], [kg]
_ANKLE, _SHANK, _THIGH = (share * _HEIGHT for share in (0.039, 0.246, 0.245))
_HIP = 0.191 / 2 * _HEIGHT           # half the distance of the hips
_SHOULDER = 0.259 / 2 * _HEIGHT      # half the distance of the shoulders
_TRUNK = (0.818 - 0.530) * _HEIGHT   # hips to shoulders
_NECK = (0.870 - 0.530) * _HEIGHT    # hips to neck
_EYES = (0.936 - 0.870) * _HEIGHT    # neck to eyes
_UPPER_ARM, _FOREARM, _HAND = (share * _HEIGHT for share in (0.186, 0.146, 0.108))
_FOOT = 0.152 * _HEIGHT              # length of the foot, a quarter of it behind the ankle
_BEND = 25.0                         # [deg] of hips and ankles at rest; the knees bend twice this


def _leg_of_humanoid(side: str, left: float) -> Iterator[TreeJoint]:
    toes: Vector = (0.75 * _FOOT - 0.03, 0.0, -_ANKLE + 0.03)
    sole = Link(toes, 0.03, 0.0145 * _MASS, (-0.25 * _FOOT + 0.03, 0.0, toes[2]))
    return _limb(
        side, "",
        ("hip_yaw", (0.0, left * _HIP, 0.0), "z", (-45, 45), 5.0, 60.0),
        ("hip_roll", _HERE, "x", _outward(left, 20.0, 45.0), 5.0, 90.0),
        ("hip_pitch", _HERE, "y", (-100, 30), 6.0, 120.0,
         Link(_down(_THIGH), 0.065, 0.100 * _MASS), -_BEND),
        ("knee", _down(_THIGH), "y", (0, 130), 7.0, 120.0,
         Link(_down(_SHANK), 0.05, 0.0465 * _MASS), 2 * _BEND),
        ("ankle_pitch", _down(_SHANK), "y", (-60, 40), 6.0, 90.0, Link(), -_BEND),
        ("ankle_roll", _HERE, "x", (-25, 25), 6.0, 60.0, sole))


def _arm_of_humanoid(side: str, left: float) -> Iterator[TreeJoint]:
    shoulder = (0.0, left * _SHOULDER, _TRUNK)
    return _limb(
        side, "trunk_pitch",
        ("shoulder_pitch", shoulder, "y", (-160, 80), 5.0, 40.0, Link(), 15.0),
        ("shoulder_roll", _HERE, "x", _outward(left, 20.0, 120.0), 5.0, 40.0, Link(), left * 12.0),
        ("shoulder_yaw", _HERE, "z", (-100, 100), 6.0, 25.0,
         Link(_down(_UPPER_ARM), 0.04, 0.028 * _MASS)),
        ("elbow", _down(_UPPER_ARM), "y", (-140, 0), 6.0, 25.0, Link(), -70.0),
        ("wrist_yaw", _HERE, "z", (-120, 120), 8.0, 12.0,
         Link(_down(_FOREARM), 0.035, 0.016 * _MASS)),
        ("wrist_roll", _down(_FOREARM), "x", (-60, 60), 8.0, 8.0),
        ("wrist_pitch", _HERE, "y", (-70, 70), 8.0, 8.0,
         Link(_down(0.7 * _HAND), 0.03, 0.006 * _MASS)))


HUMANOID = TreeTable(
    name="humanoid",
    joints=(
        *(joint for side in _SIDES for joint in _leg_of_humanoid(*side)),
        *_limb("trunk", "",  # just above the hips
               ("yaw", _HERE, "z", (-45, 45), 4.0, 90.0),
               ("pitch", _HERE, "y", (-30, 60), 4.0, 120.0,
                Link((0.0, 0.0, _TRUNK - 0.06), 0.11, (0.139 + 0.216) * _MASS, (0.0, 0.0, 0.16)))),
        *(joint for side in _SIDES for joint in _arm_of_humanoid(*side)),
        *_limb("neck", "trunk_pitch",  # the gaze is along x
               ("yaw", (0.0, 0.0, _NECK), "z", (-80, 80), 6.0, 12.0),
               ("pitch", _HERE, "y", (-40, 40), 6.0, 12.0,
                Link((0.0, 0.0, 0.09), 0.08, 0.081 * _MASS, (0.0, 0.0, 0.05))))),
    frames=(*(TreeFrame(f"{side}_foot", f"{side}_ankle_roll", _down(_ANKLE)) for side, _ in _SIDES),
            *(TreeFrame(f"{side}_hand", f"{side}_wrist_pitch", _down(0.6 * _HAND), (0.0, 0.0, -1.0))
              for side, _ in _SIDES),
            TreeFrame("gaze", "neck_pitch", (0.1, 0.0, _EYES), (1.0, 0.0, 0.0)),
            TreeFrame("chest", "trunk_pitch", (0.0, 0.0, _TRUNK))),
    end_effector="right_hand",
    links=(("", Link((0.0, _HIP - 0.02, 0.03), 0.075, 0.142 * _MASS, (0.0, -_HIP + 0.02, 0.03))),
           ("trunk_pitch", Link((0.0, _SHOULDER - 0.02, _TRUNK), 0.05, 0.0,
                                (0.0, -_SHOULDER + 0.02, _TRUNK)))),
    control_points=_arm_points(_UPPER_ARM, _FOREARM),
    base="floating",
    base_height=_ANKLE + (_SHANK + _THIGH) * cos(radians(_BEND)),
)

_LENGTH, _WIDTH = 0.20, 0.07   # [m] from the middle to the hips, forward and to the side
_ROLL = 0.08                   # [m] from the axis of the hip's roll to the plane of the leg
_LEG = 0.22                    # [m] of thigh and of shank, whose radius is 2 cm
_CROUCH = 40.0                 # [deg] of the hips at rest; the knees bend twice this
_LEGS = tuple((f"{side}_{end}", forward, left) for end, forward in (("front", 1.0), ("hind", -1.0))
              for side, left in _SIDES)


def _leg_of_quadruped(leg: str, forward: float, left: float) -> Iterator[TreeJoint]:
    hip, out = (forward * _LENGTH, left * _WIDTH, 0.0), (0.0, left * _ROLL, 0.0)
    return _limb(
        leg, "",
        ("hip_roll", hip, "x", _outward(left, 30.0, 60.0), 15.0, 25.0, Link(out, 0.04, 0.6)),
        ("hip_pitch", out, "y", (-60, 130), 15.0, 25.0, Link(_down(_LEG), 0.03, 0.8), _CROUCH),
        ("knee", _down(_LEG), "y", (-150, -30), 15.0, 40.0,
         Link(_down(_LEG - 0.02), 0.02, 0.2), -2 * _CROUCH))


QUADRUPED = TreeTable(
    name="quadruped",
    joints=tuple(joint for leg in _LEGS for joint in _leg_of_quadruped(*leg)),
    frames=(*(TreeFrame(f"{leg}_foot", f"{leg}_knee", _down(_LEG)) for leg, _, _ in _LEGS),
            TreeFrame("trunk", "", _HERE),
            TreeFrame("head", "", (0.32, 0.0, 0.05), (1.0, 0.0, 0.0))),
    end_effector="head",
    links=(("", Link((_LENGTH, 0.0, 0.02), 0.08, 8.0, (-_LENGTH, 0.0, 0.02))),
           ("", Link((0.28, 0.0, 0.05), 0.05, 0.6, (0.24, 0.0, 0.05)))),
    base="floating",
    base_height=(_LEG + _LEG) * cos(radians(_CROUCH)),
)
