"""From `avoidance.obstacles` to the obstacles of a scene."""

from __future__ import annotations

import numpy as np

from hierarchy.avoidance import Obstacle, Obstacles
from scenarios.config.avoidance import ObstacleSection


def make_obstacles(sections: tuple[ObstacleSection, ...]) -> Obstacles:
    """Make the scene's obstacles, numbered from 1 in messages."""
    return Obstacles([_obstacle(i, section) for i, section in enumerate(sections, 1)])


def _obstacle(number: int, section: ObstacleSection) -> Obstacle:
    path = None if section.path is None else section.path.make()
    size = {"point": (), "sphere": (section.radius,),
            "capsule": (section.radius, section.half_length),
            "box": section.half_lengths}[section.shape]
    return Obstacle(section.shape, section.centre or (0.0, 0.0, 0.0),
                    tuple(float(s) for s in size or () if s is not None),
                    np.array(section.rotation), path, f"obstacle {number}")
