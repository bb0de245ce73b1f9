"""Generic quadruped of the size of a dog: 12 joints on a floating base, 15 kg, 0.34 m to the hips.

Lengths, masses, ranges, speeds and torques are plausible round numbers and model no particular
robot. The base frame is in the middle of the hips, x forward, y left, z up; the feet are points at
z = 0 of the world in the posture of the start, each below its hip.
"""

from __future__ import annotations

from math import cos, radians

from hierarchy.robots.table import Link, TreeFrame, TreeTable, Vector
from hierarchy.robots.table import TreeJoint as Joint

_LENGTH, _WIDTH = 0.20, 0.07   # [m] from the middle to the hips, forward and to the side
_HIP = 0.08                    # [m] from the axis of the hip's roll to the plane of the leg
_THIGH = _SHANK = 0.22         # [m]
_BEND = 40.0                   # [deg] of the hips at rest; the knees bend twice this
_RADIUS = 0.02                 # [m] of thigh and shank
_LEGS = tuple((f"{side}_{end}", forward, left) for end, forward in (("front", 1.0), ("hind", -1.0))
              for side, left in (("left", 1.0), ("right", -1.0)))


def _leg(leg: str, forward: float, left: float) -> tuple[Joint, ...]:
    """Hip roll, hip pitch, knee; `forward` and `left` are 1 or -1."""
    out, along = (0.0, left * _HIP, 0.0), _THIGH - _RADIUS
    roll = (-30.0, 60.0) if left > 0 else (-60.0, 30.0)
    return (
        Joint(f"{leg}_hip_roll", "", (forward * _LENGTH, left * _WIDTH, 0.0), "x", roll, 15.0,
              25.0, Link(out, 0.04, 0.6)),
        Joint(f"{leg}_hip_pitch", f"{leg}_hip_roll", out, "y", (-60, 130), 15.0, 25.0,
              Link((0.0, 0.0, -_THIGH), 0.03, 0.8), _BEND),
        Joint(f"{leg}_knee", f"{leg}_hip_pitch", (0.0, 0.0, -_THIGH), "y", (-150, -30), 15.0,
              40.0, Link((0.0, 0.0, -along), _RADIUS, 0.2), -2 * _BEND),
    )


_FOOT: Vector = (0.0, 0.0, -_SHANK)

QUADRUPED = TreeTable(
    name="quadruped",
    joints=tuple(joint for leg in _LEGS for joint in _leg(*leg)),
    frames=(*(TreeFrame(f"{leg}_foot", f"{leg}_knee", _FOOT) for leg, _, _ in _LEGS),
            TreeFrame("trunk", "", (0.0, 0.0, 0.0)),
            TreeFrame("head", "", (0.32, 0.0, 0.05), (1.0, 0.0, 0.0))),
    end_effector="head",
    links=(("", Link((_LENGTH, 0.0, 0.02), 0.08, 8.0, (-_LENGTH, 0.0, 0.02))),
           ("", Link((0.28, 0.0, 0.05), 0.05, 0.6, (0.24, 0.0, 0.05)))),
    base="floating",
    base_height=(_THIGH + _SHANK) * cos(radians(_BEND)),
)
