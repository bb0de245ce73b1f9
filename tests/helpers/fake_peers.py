"""Packages that the comparison of `hierarchy bench peers` has to cope with. Needs numpy only."""

import os

import numpy as np


def posture(scene, asked):
    """Goes to the posture and knows nothing else: all of its motion is the posture's."""
    wanted, limit = np.array(scene.posture if asked else scene.start), np.array(scene.limit)
    return (lambda t, q, *_: np.clip(scene.posture_gain * (wanted - q), -limit, limit),
            lambda: None)


def lost(scene, asked):
    """Answers with NaN."""
    return lambda t, q, v, goal, rate: np.full(len(q), np.nan), None


def ends(scene, asked):
    """Takes its process with it."""
    return lambda *_: os._exit(7), None
