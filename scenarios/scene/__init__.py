"""What is drawn of a run, as arrays, independent of any drawing library."""

from scenarios.recording.facts import capsules, ends, placed_points
from scenarios.scene.curves import Series, series
from scenarios.scene.drawn import (
    SEPARATION,
    Moved,
    Scene,
    Stage,
    frames_at,
    moved_by_tasks,
    scene,
    stage,
)

__all__ = ["SEPARATION", "Moved", "Scene", "Series", "Stage", "capsules", "ends", "frames_at",
           "moved_by_tasks", "placed_points", "scene", "series", "stage"]
