"""KUKA LWR IV, base frame at the shoulder (0.3105 m above the foot of the real arm).

Geometry and position limits: the arm's data sheet, as used in the letter. Velocity limits: the
data sheet of the LWR 4+ [deg/s]. Torque limits: plausible, not checked against the data sheet.
Masses: plausible round numbers for a 16 kg arm, not identified.
"""

from __future__ import annotations

from math import radians

from hierarchy.robots.table import DHTable

_UPPER_ARM = 0.4   # shoulder to elbow [m]
_FOREARM = 0.39    # elbow to wrist [m]


def _letters_eight_points() -> tuple[tuple[str, tuple[float, float, float]], ...]:
    """Points 1-4 from the elbow back over half the upper arm, 5-8 from the wrist to the elbow.

    An upper-arm point lies on the axis of joint 3 and a forearm point on that of joint 5, which
    do not move it: each is attached to the previous link, whose y axis is that axis.
    """
    upper = [_UPPER_ARM - i / 4 * 0.2 for i in range(4)]
    fore = [_FOREARM - i / 4 * _FOREARM for i in range(4)]
    return (*(("joint_2", (0.0, h, 0.0)) for h in upper),
            *(("joint_4", (0.0, -h, 0.0)) for h in fore))


KUKA_LWR = DHTable(
    name="kuka_lwr",
    a=(0.0,) * 7,
    d=(0.0, 0.0, _UPPER_ARM, 0.0, _FOREARM, 0.0, 0.078),
    alpha=(90.0, -90.0, -90.0, 90.0, 90.0, -90.0, 0.0),
    range=(170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 170.0),
    velocity=tuple(radians(v) for v in (110.0, 110.0, 128.0, 128.0, 204.0, 184.0, 184.0)),
    effort=(176.0, 176.0, 100.0, 100.0, 100.0, 38.0, 38.0),
    mass=(2.7, 2.7, 2.7, 2.7, 1.7, 1.6, 0.3),
    radius=0.06,
    control_points=_letters_eight_points(),
)
