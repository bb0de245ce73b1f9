"""What is drawn of a run, as arrays, independent of any drawing library."""

from scenarios.recording.facts import capsules, ends, placed_points
from scenarios.scene.curves import Series, series
from scenarios.scene.drawn import SEPARATION, Moved, Scene, Stage, scene, stage

__all__ = ["SEPARATION", "Moved", "Scene", "Series", "Stage", "capsules", "ends", "placed_points",
           "scene", "series", "stage"]
