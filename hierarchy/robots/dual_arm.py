"""Generic robot with two arms of seven joints on a rotating torso: 15 joints, plausible numbers.

The torso's axis is z of the world at the origin; the shoulders are 0.25 m to its left (y) and
right, 0.9 m up. Arms are 0.3 m and 0.3 m long, hands 0.1 m; they hang down at zero. It models no
particular robot.
"""

from __future__ import annotations

from hierarchy.robots.table import Link, TreeFrame, TreeJoint, TreeTable, Vector

_SHOULDER: Vector = (0.0, 0.25, 0.9)
_UPPER_ARM, _FOREARM, _HAND = 0.3, 0.3, 0.1  # [m]
_HERE: Vector = (0.0, 0.0, 0.0)


def _arm(side: str, left: float) -> tuple[TreeJoint, ...]:
    """Shoulder pitch, roll, yaw; elbow; wrist yaw, roll, pitch; `left` is 1 or -1."""
    inward, outward = (-30.0, 120.0) if left > 0 else (-120.0, 30.0)
    shoulder = (_SHOULDER[0], left * _SHOULDER[1], _SHOULDER[2])

    def name(joint: str) -> str:
        return f"{side}_{joint}"

    return (
        TreeJoint(name("shoulder_pitch"), "torso", shoulder, "y", (-170, 90), 3.0, 120.0,
                  rest=-35.0),
        TreeJoint(name("shoulder_roll"), name("shoulder_pitch"), _HERE, "x", (inward, outward), 3.0,
                  120.0, rest=left * 20.0),
        TreeJoint(name("shoulder_yaw"), name("shoulder_roll"), _HERE, "z", (-160, 160), 3.5, 80.0,
                  Link((0.0, 0.0, -_UPPER_ARM), 0.055, 3.5)),
        TreeJoint(name("elbow"), name("shoulder_yaw"), (0.0, 0.0, -_UPPER_ARM), "y", (-150, 5),
                  3.5, 80.0, rest=-75.0),
        TreeJoint(name("wrist_yaw"), name("elbow"), _HERE, "z", (-160, 160), 4.0, 40.0,
                  Link((0.0, 0.0, -_FOREARM), 0.05, 2.5)),
        TreeJoint(name("wrist_roll"), name("wrist_yaw"), (0.0, 0.0, -_FOREARM), "x", (-100, 100),
                  4.0, 30.0),
        TreeJoint(name("wrist_pitch"), name("wrist_roll"), _HERE, "y", (-110, 110), 4.0, 30.0,
                  Link((0.0, 0.0, -_HAND), 0.04, 1.0), rest=20.0),
    )


DUAL_ARM = TreeTable(
    name="dual_arm",
    joints=(TreeJoint("torso", "", _HERE, "z", (-120, 120), 2.0, 200.0,
                      Link((0.0, 0.0, 0.85), 0.12, 25.0, (0.0, 0.0, 0.15))),
            *_arm("left", 1.0), *_arm("right", -1.0)),
    frames=tuple(TreeFrame(f"{side}_hand", f"{side}_wrist_pitch", (0.0, 0.0, -_HAND),
                           (0.0, 0.0, -1.0)) for side in ("left", "right")),
    end_effector="right_hand",
    links=(("torso", Link((0.0, 0.25, 0.9), 0.06, 0.0, (0.0, -0.25, 0.9))),),
    control_points=tuple((f"{side}_{joint}", (0.0, 0.0, -share * length))
                         for side in ("left", "right")
                         for joint, length in (("shoulder_yaw", _UPPER_ARM),
                                               ("wrist_yaw", _FOREARM))
                         for share in (0.5, 1.0)),
)
