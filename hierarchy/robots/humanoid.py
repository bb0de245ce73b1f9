"""Generic humanoid of the size of Romeo: 30 joints on a floating base, 1.45 m and 40 kg.

Lengths and masses of the segments are shares of height and mass: Drillis and Contini's, as in
D. A. Winter, Biomechanics and Motor Control of Human Movement. Radii, ranges, speeds and torques
of the joints are plausible round numbers and model no particular robot. The base frame is between
the hips, x forward, y left, z up; the soles are at z = 0 of the world in the upright posture.
"""

from __future__ import annotations

from math import cos, radians

from hierarchy.robots.table import Link, TreeFrame, TreeTable, Vector
from hierarchy.robots.table import TreeJoint as Joint

HEIGHT = 1.45  # [m]
MASS = 40.0    # [kg]

_ANKLE, _SHANK, _THIGH = (share * HEIGHT for share in (0.039, 0.246, 0.245))
_HIP = 0.191 / 2 * HEIGHT            # half the distance of the hips
_SHOULDER = 0.259 / 2 * HEIGHT       # half the distance of the shoulders
_TRUNK = (0.818 - 0.530) * HEIGHT    # hips to shoulders
_NECK = (0.870 - 0.530) * HEIGHT     # hips to neck
_EYES = (0.936 - 0.870) * HEIGHT     # neck to eyes
_UPPER_ARM, _FOREARM, _HAND = (share * HEIGHT for share in (0.186, 0.146, 0.108))
_FOOT = 0.152 * HEIGHT               # length of the foot, a quarter of it behind the ankle
_BEND = 25.0                         # [deg] of hips and ankles at rest; the knees bend twice this


def _leg(side: str, left: float) -> tuple[Joint, ...]:
    """Hip yaw, roll, pitch; knee; ankle pitch, roll. `left` is 1 or -1."""
    inward, outward = (-20.0, 45.0) if left > 0 else (-45.0, 20.0)
    toes: Vector = (0.75 * _FOOT - 0.03, 0.0, -_ANKLE + 0.03)
    return (
        Joint(f"{side}_hip_yaw", "", (0.0, left * _HIP, 0.0), "z", (-45, 45), 5.0, 60.0),
        Joint(f"{side}_hip_roll", f"{side}_hip_yaw", _HERE, "x", (inward, outward), 5.0, 90.0),
        Joint(f"{side}_hip_pitch", f"{side}_hip_roll", _HERE, "y", (-100, 30), 6.0, 120.0,
              Link((0.0, 0.0, -_THIGH), 0.065, 0.100 * MASS), -_BEND),
        Joint(f"{side}_knee", f"{side}_hip_pitch", (0.0, 0.0, -_THIGH), "y", (0, 130), 7.0, 120.0,
              Link((0.0, 0.0, -_SHANK), 0.05, 0.0465 * MASS), 2 * _BEND),
        Joint(f"{side}_ankle_pitch", f"{side}_knee", (0.0, 0.0, -_SHANK), "y", (-60, 40), 6.0,
              90.0, rest=-_BEND),
        Joint(f"{side}_ankle_roll", f"{side}_ankle_pitch", _HERE, "x", (-25, 25), 6.0, 60.0,
              Link(toes, 0.03, 0.0145 * MASS, (-0.25 * _FOOT + 0.03, 0.0, toes[2]))),
    )


def _arm(side: str, left: float) -> tuple[Joint, ...]:
    """Shoulder pitch, roll, yaw; elbow; wrist yaw, roll, pitch; straight down at zero."""
    inward, outward = (-20.0, 120.0) if left > 0 else (-120.0, 20.0)
    return (
        Joint(f"{side}_shoulder_pitch", "trunk_pitch", (0.0, left * _SHOULDER, _TRUNK), "y",
              (-160, 80), 5.0, 40.0, rest=15.0),
        Joint(f"{side}_shoulder_roll", f"{side}_shoulder_pitch", _HERE, "x", (inward, outward),
              5.0, 40.0, rest=left * 12.0),
        Joint(f"{side}_shoulder_yaw", f"{side}_shoulder_roll", _HERE, "z", (-100, 100), 6.0, 25.0,
              Link((0.0, 0.0, -_UPPER_ARM), 0.04, 0.028 * MASS)),
        Joint(f"{side}_elbow", f"{side}_shoulder_yaw", (0.0, 0.0, -_UPPER_ARM), "y", (-140, 0),
              6.0, 25.0, rest=-70.0),
        Joint(f"{side}_wrist_yaw", f"{side}_elbow", _HERE, "z", (-120, 120), 8.0, 12.0,
              Link((0.0, 0.0, -_FOREARM), 0.035, 0.016 * MASS)),
        Joint(f"{side}_wrist_roll", f"{side}_wrist_yaw", (0.0, 0.0, -_FOREARM), "x", (-60, 60),
              8.0, 8.0),
        Joint(f"{side}_wrist_pitch", f"{side}_wrist_roll", _HERE, "y", (-70, 70), 8.0, 8.0,
              Link((0.0, 0.0, -0.7 * _HAND), 0.03, 0.006 * MASS)),
    )


_HERE: Vector = (0.0, 0.0, 0.0)


def _head() -> tuple[Joint, ...]:
    """Neck yaw and pitch; the gaze is along x."""
    return (
        Joint("neck_yaw", "trunk_pitch", (0.0, 0.0, _NECK), "z", (-80, 80), 6.0, 12.0),
        Joint("neck_pitch", "neck_yaw", _HERE, "y", (-40, 40), 6.0, 12.0,
              Link((0.0, 0.0, 0.09), 0.08, 0.081 * MASS, (0.0, 0.0, 0.05))),
    )


def _trunk() -> tuple[Joint, ...]:
    """Yaw and pitch just above the hips."""
    return (
        Joint("trunk_yaw", "", _HERE, "z", (-45, 45), 4.0, 90.0),
        Joint("trunk_pitch", "trunk_yaw", _HERE, "y", (-30, 60), 4.0, 120.0,
              Link((0.0, 0.0, _TRUNK - 0.06), 0.11, (0.139 + 0.216) * MASS, (0.0, 0.0, 0.16))),
    )


def _hand_frames() -> tuple[TreeFrame, ...]:
    return tuple(TreeFrame(f"{side}_hand", f"{side}_wrist_pitch", (0.0, 0.0, -0.6 * _HAND),
                           (0.0, 0.0, -1.0)) for side in ("left", "right"))


HUMANOID = TreeTable(
    name="humanoid",
    joints=(*_leg("left", 1.0), *_leg("right", -1.0), *_trunk(),
            *_arm("left", 1.0), *_arm("right", -1.0), *_head()),
    frames=(*(TreeFrame(f"{side}_foot", f"{side}_ankle_roll", (0.0, 0.0, -_ANKLE))
              for side in ("left", "right")),
            *_hand_frames(),
            TreeFrame("gaze", "neck_pitch", (0.1, 0.0, _EYES), (1.0, 0.0, 0.0)),
            TreeFrame("chest", "trunk_pitch", (0.0, 0.0, _TRUNK))),
    end_effector="right_hand",
    links=(("", Link((0.0, _HIP - 0.02, 0.03), 0.075, 0.142 * MASS, (0.0, -_HIP + 0.02, 0.03))),
           ("trunk_pitch", Link((0.0, _SHOULDER - 0.02, _TRUNK), 0.05, 0.0,
                                (0.0, -_SHOULDER + 0.02, _TRUNK)))),
    control_points=tuple((joint, (0.0, 0.0, -share * length)) for side in ("left", "right")
                         for joint, length in ((f"{side}_shoulder_yaw", _UPPER_ARM),
                                               (f"{side}_wrist_yaw", _FOREARM))
                         for share in (0.5, 1.0)),
    base="floating",
    base_height=_ANKLE + (_SHANK + _THIGH) * cos(radians(_BEND)),
)
