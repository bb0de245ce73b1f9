"""Packages that the comparison of `hierarchy bench peers` has to cope with. Needs numpy only."""

import os

import numpy as np


class Posture:
    """Goes to the posture and knows nothing else: all of its motion is the posture's."""

    package, priorities, rows = "numpy", "none", "none"

    def __init__(self, scene, posture, speed=1.0):
        self.scene, self.wanted = scene, np.array(scene.posture if posture else scene.start)
        self.speed = speed

    def velocity(self, t, q, v, goal, rate):
        limit = np.array(self.scene.limit)
        v = np.clip(self.scene.posture_gain * (self.wanted - q), -limit, limit)
        return self.speed * v

    def resolve(self):
        return None


class Refuses(Posture):
    """Has no answer, and says so."""

    def velocity(self, t, q, v, goal, rate):
        raise ValueError("no answer")


class Lost(Posture):
    """Answers with NaN."""

    def velocity(self, t, q, v, goal, rate):
        return np.full(len(q), np.nan)


class Ends(Posture):
    """Takes its process with it."""

    def velocity(self, t, q, v, goal, rate):
        os._exit(7)


class EndsAfterNan(Posture):
    """The same, but only where a joint position is NaN."""

    def velocity(self, t, q, v, goal, rate):
        if np.isnan(q).any():
            os._exit(7)
        return super().velocity(t, q, v, goal, rate)
