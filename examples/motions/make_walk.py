"""Write walk.bvh: a stick figure of 1.70 m that walks 4 steps, made by the formulas below.

python examples/motions/make_walk.py
"""

from pathlib import Path

import numpy as np

THIGH, SHANK, ANKLE, HIP, FPS = 42.0, 42.0, 8.0, 9.0, 60   # [cm], [1/s]
CYCLE, STRIDE, LIFT, STANCE, CYCLES = 1.2, 90.0, 10.0, 0.6, 2  # [s], [cm], share of a cycle
HEIGHT = 86.0  # of the hips [cm]
JOINTS = f"""ROOT Hips 0 0 0 : Xposition Yposition Zposition
 JOINT LeftUpLeg {HIP} 0 0 : Xrotation
  JOINT LeftLeg 0 {-THIGH} 0 : Xrotation
   JOINT LeftFoot 0 {-SHANK} 0 : Xrotation
    End Site 0 {-ANKLE} 12
 JOINT RightUpLeg {-HIP} 0 0 : Xrotation
  JOINT RightLeg 0 {-THIGH} 0 : Xrotation
   JOINT RightFoot 0 {-SHANK} 0 : Xrotation
    End Site 0 {-ANKLE} 12
 JOINT Chest 0 48 0 : Yrotation
  JOINT LeftArm 18 0 0 : Xrotation
   JOINT LeftForeArm 0 -30 0 : Xrotation
    End Site 0 -38 0
  JOINT RightArm -18 0 0 : Xrotation
   JOINT RightForeArm 0 -30 0 : Xrotation
    End Site 0 -38 0
  JOINT Head 0 12 0 : Yrotation
    End Site 0 20 0"""


def foot(phase):
    """Return how far forward [cm] and how high [cm] a foot is: at rest, then a quintic swing."""
    steps, share = np.divmod(phase, 1.0)
    s = np.clip((share - STANCE) / (1.0 - STANCE), 0.0, 1.0)
    return STRIDE * (steps + s**3 * (10 - 15 * s + 6 * s * s)), 64 * LIFT * (s * (1 - s)) ** 3


def leg(phase, hips):
    """Return the angles [deg] of hip, knee and ankle that put the foot, kept level, there."""
    forward, up = foot(phase)
    z, y = forward - hips, up + ANKLE - HEIGHT
    reach = np.hypot(z, y)
    knee = np.arccos((THIGH**2 + SHANK**2 - reach**2) / (2 * THIGH * SHANK))
    hip = -np.arctan2(z, -y) - np.arcsin(np.sin(knee) * SHANK / reach)
    return np.degrees([hip, np.pi - knee, -hip - np.pi + knee])


def main():
    """Write the file beside this one."""
    t = np.arange(round(CYCLES * CYCLE * FPS) + 1) / FPS
    phase = t / CYCLE
    hips = STRIDE * phase - STRIDE * STANCE / 2
    swing = 25.0 * np.sin(2 * np.pi * phase)
    zero = np.zeros_like(t)
    rows = [zero, zero + HEIGHT, hips, *leg(phase, hips), *leg(phase + 0.5, hips + STRIDE / 2),
            0.2 * swing, swing, zero - 20.0, -swing, zero - 20.0, zero]
    text, closing = "HIERARCHY\n", []
    for line in JOINTS.splitlines():
        depth, words = len(line) - len(line.lstrip()), line.split()
        while len(closing) > depth:
            text += closing.pop() + "}\n"
        at = words.index(":") if ":" in words else len(words)
        channels = f"\n{' ' * depth} CHANNELS {len(words) - at - 1} {' '.join(words[at + 1:])}"
        text += (f"{' ' * depth}{' '.join(words[:2])}\n{' ' * depth}{{\n"
                 f"{' ' * depth} OFFSET {' '.join(words[2:at])}{channels * (at < len(words))}\n")
        closing.append(" " * depth)
    text += "".join(space + "}\n" for space in reversed(closing))
    text += f"MOTION\nFrames: {len(t)}\nFrame Time: {1 / FPS:.8f}\n"
    text += "".join(" ".join(f"{x:.4f}" for x in row) + "\n" for row in np.array(rows).T)
    (Path(__file__).parent / "walk.bvh").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
