"""Packages that the comparison of `hierarchy bench peers` has to cope with. Needs numpy only."""

import os

import numpy as np


def posture(scene, asked, speed=1.0):
    """Goes to the posture and knows nothing else: all of its motion is the posture's."""
    wanted, limit = np.array(scene.posture if asked else scene.start), np.array(scene.limit)

    def velocity(t, q, v, goal, rate):
        return speed * np.clip(scene.posture_gain * (wanted - q), -limit, limit)

    return velocity, lambda: None


def refuses(scene, asked):
    """Has no answer, and says so."""
    def velocity(t, q, v, goal, rate):
        raise ValueError("no answer")

    return velocity, None


def lost(scene, asked):
    """Answers with NaN."""
    return lambda t, q, v, goal, rate: np.full(len(q), np.nan), None


def ends(scene, asked, at_nan=False):
    """Takes its process with it, or only where a joint position is NaN."""
    moving, _ = posture(scene, asked)

    def velocity(t, q, v, goal, rate):
        if not at_nan or np.isnan(q).any():
            os._exit(7)
        return moving(t, q, v, goal, rate)

    return velocity, None
