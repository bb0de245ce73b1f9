"""What there is to draw of a run, as arrays that no drawing library is needed for."""

from scenarios.scene.curves import Series, series
from scenarios.scene.drawn import SEPARATION, Moved, Scene, Stage, scene, stage
from scenarios.scene.links import capsules, ends, place

__all__ = ["SEPARATION", "Moved", "Scene", "Series", "Stage", "capsules", "ends", "place", "scene",
           "series", "stage"]
