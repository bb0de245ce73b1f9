"""Obstacles, distances to them, and the repulsion from them (eqs. 22-27, 31)."""

from hierarchy.avoidance.body import Capsule, ControlPoint, pairs_of_chain
from hierarchy.avoidance.laws import Barrier, Repulsion
from hierarchy.avoidance.measurement import Measurement, Pairs, SurveillanceAreas, measure_pairs
from hierarchy.avoidance.obstacles import Obstacle, Obstacles

__all__ = ["Barrier", "Capsule", "ControlPoint", "Measurement", "Obstacle", "Obstacles", "Pairs",
           "Repulsion", "SurveillanceAreas", "measure_pairs", "pairs_of_chain"]
