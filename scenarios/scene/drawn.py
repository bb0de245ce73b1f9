"""What there is to draw of a run: the arm, obstacles, paths, cone, stack and curves, as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import radians
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Capsule, ControlPoint, Obstacles
from hierarchy.problem import Array
from hierarchy.robots import DHTable
from scenarios.cell.obstacles import make_obstacles
from scenarios.cell.robot import make_robot, sensed_points
from scenarios.cell.sensors import ExactDistances
from scenarios.loop import listed
from scenarios.loop.fate import Fate
from scenarios.scene.curves import Areas, Series, marks_of, series
from scenarios.scene.levels import Levels, judge, order_names
from scenarios.scene.links import capsules, ends, lowest

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from scenarios.loop.recording import Recording

SEPARATION = "separation"  # the task that keeps all points off all obstacles


@dataclass(frozen=True)
class Stage:
    """What stays the same while a scenario runs.

    capsules of the links, in the frames of their joints; points are the robot's control points and
    then its end effector; areas and tip_areas are (symbol, radius [m]) around an obstacle at which
    something changes for a control point and for the end effector; axis (3,) that the end
    effector's z axis shall have, within half_angle [rad], or None; floor is its height [m].
    """

    robot: Robot
    capsules: tuple[Capsule, ...]
    points: tuple[ControlPoint, ...]
    obstacles: Obstacles
    areas: Areas
    tip_areas: Areas
    axis: Array | None
    half_angle: float
    floor: float

    @property
    def azimuth(self) -> float:
        """Where to look from [rad]: a robot that branches is looked at from before, along -x."""
        parents = self.robot.parents[1:]
        chain = self.robot.base == "fixed" and parents == tuple(range(len(parents)))
        return radians(135.0 if chain else 40.0)


@dataclass(frozen=True)
class Moved:
    """Where the point was that a task moves (F, 3) [m], and where it was wanted, or None."""

    task: str
    actual: Array
    wanted: Array | None


@dataclass(frozen=True)
class Scene:
    """What is drawn of a run, in F frames; J joints, P points, H obstacles. Metres, seconds.

    stage : what stays the same.
    t (F,) and ticks (F,), the tick that each frame shows.
    placements (F, J + 1, 12) : of the joints' frames, rotation column by column, then translation;
        of the true joints where the recording knows them. `ends` turns them into the links.
    points (F, P, 3) : control points, then the end effector.
    nearest (F, P, 3) : the point on an obstacle that is nearest to each, and distance (F, P) to it,
        from the scenario's geometry, also where the controller saw a camera's; NaN and infinite
        without obstacles.
    active (F,) : the point that the stack keeps away from an obstacle, or -1. Under the task
        `separation` it is the nearest point, in ticks in which one of its rows acts.
    centres (F, H, 3) : of the obstacles; shape, size and rotation are in `stage.obstacles`.
    axis (F, 3) : the end effector's z axis. desired (F, 3) : its path, or None.
    order (F,) : index into `orders`, whose entries name tasks, most important first.
    paths : of what the scenario's listed tasks move.
    levels : what became of each task, see scenarios.scene.levels.
    series : curves. switches (S,) : when the order changed.
    """

    stage: Stage
    t: Array
    ticks: NDArray[np.int64]
    placements: Array
    points: Array
    nearest: Array
    distance: Array
    active: NDArray[np.int64]
    centres: Array
    axis: Array
    desired: Array | None
    order: NDArray[np.int64]
    orders: tuple[tuple[str, ...], ...]
    paths: tuple[Moved, ...]
    levels: Levels
    series: tuple[Series, ...]
    switches: Array

    @property
    def traced(self) -> Array:
        """Where the end effector was: (F, 3) [m]."""
        return np.asarray(self.points[:, -1])

    @property
    def links(self) -> Array:
        """Start and end of each capsule of the arm in the world: (F, C, 2, 3) [m]."""
        return ends(self.stage.capsules, self.placements)

    @property
    def linked(self) -> NDArray[np.int64]:
        """The point to link with its nearest obstacle, the active one or else the closest: (F,)."""
        return np.where(self.active >= 0, self.active, self.distance.argmin(axis=1))


def stage(scenario: Scenario) -> Stage:
    """Return what there is to draw of a scenario before it runs."""
    robot, avoidance, pointing = make_robot(scenario.robot), scenario.avoidance, scenario.pointing
    foot = scenario.sensor.foot if isinstance(robot.table, DHTable) else 0.0
    links = capsules(robot, foot)
    axis = None if pointing is None else np.asarray(pointing.axis) / np.linalg.norm(pointing.axis)
    return Stage(robot, links, sensed_points(robot),
                 make_obstacles(avoidance.placed if avoidance else ()),
                 marks_of(avoidance.thresholds if avoidance else {}),
                 marks_of(avoidance.tip_thresholds if avoidance else {}),
                 axis, radians(pointing.alpha_d) if pointing else 0.0,
                 -foot if foot else lowest(robot, links))


def scene(recording: Recording, rate: float = 30.0) -> Scene:
    """Return what there is to draw of a run, in `rate` frames a second [Hz].

    Raises HierarchyError if nothing was recorded, or `rate` is not positive.
    """
    if not 0.0 < rate < np.inf:
        raise HierarchyError(f"rate = {rate} Hz must be positive and finite")
    ticks = _frames(recording, rate)
    fixed, t = stage(recording.scenario), recording["t"][ticks]
    order = recording["order"].astype(np.int64)
    moved = _moved(fixed, recording, ticks)
    levels = judge(recording, ticks)
    return Scene(fixed, t, ticks, **moved,
                 active=_active(recording, ticks, levels, moved["distance"]),
                 desired=recording["desired_position"][ticks]
                 if "desired_position" in recording else None,
                 order=order[ticks], orders=order_names(recording),
                 paths=tuple(_paths(recording, ticks)), levels=levels,
                 series=tuple(series(recording, ticks)),
                 switches=recording["t"][recording.switches()])


def _frames(recording: Recording, rate: float) -> NDArray[np.int64]:
    """The ticks nearest to the frames' times, the first and the last tick among them."""
    finite = np.flatnonzero(np.isfinite(_joints(recording)).all(axis=1))
    if not finite.size:
        raise HierarchyError("the recording has no tick: there is nothing to draw")
    t = recording["t"][finite]
    wanted = np.append(np.arange(t[0], t[-1], 1.0 / rate), t[-1])
    after = np.clip(np.searchsorted(t, wanted), 1, max(len(t) - 1, 1)) if len(t) > 1 else [0]
    before = np.maximum(np.asarray(after) - 1, 0)
    nearer = np.where(wanted - t[before] <= t[after] - wanted, before, after)
    return np.unique(finite[nearer])


def _joints(recording: Recording) -> Array:
    return np.asarray(recording["true_q" if "true_q" in recording else "q"])


def _moved(fixed: Stage, recording: Recording, ticks: NDArray[np.int64]) -> dict[str, Array]:
    """What follows from the joints at each tick."""
    robot, q = fixed.robot, _joints(recording)
    state, at_rest, sensor = State(robot), np.zeros(robot.n), ExactDistances(robot, fixed.obstacles)
    seen, tip = sensor.measurement, robot.frame(robot.end_effector)
    frames: dict[str, list[Array]] = {name: [] for name in (
        "placements", "points", "nearest", "distance", "centres", "axis")}
    offsets = recording.signals.get("obstacle_offset", np.empty((recording.ticks, 0, 3)))
    for k in ticks:
        state.move(float(recording["t"][k]), q[k], at_rest)
        for h, offset in enumerate(offsets[k]):
            fixed.obstacles.shift(h, offset)
        sensor.measure(state)
        away = np.where(np.isfinite(seen.distance), seen.distance, np.nan)[:, None]
        now = (state.placements, seen.points, seen.points - away * seen.direction, seen.distance,
               fixed.obstacles.centres, state.rotation(tip)[:, 2])
        for kept, value in zip(frames.values(), now, strict=True):
            kept.append(value.copy())
    return {name: np.array(kept) for name, kept in frames.items()}


def _active(recording: Recording, ticks: NDArray[np.int64], levels: Levels,
            distance: Array) -> NDArray[np.int64]:
    if SEPARATION in levels.names:
        fate = levels.fate[:, levels.names.index(SEPARATION)]
        acting = np.isin(fate, (Fate.UNKNOWN, Fate.MET, Fate.MISSED))
        return np.where(acting, distance.argmin(axis=1), -1)
    if "active_control_point" not in recording:
        return np.full(len(ticks), -1)
    return np.maximum(recording["active_control_point"][ticks].astype(np.int64) - 1, -1)


def _paths(recording: Recording, ticks: NDArray[np.int64]) -> Iterator[Moved]:
    for section in getattr(recording.scenario, "tasks", ()):
        if listed.position_of(section.title) not in recording:
            continue
        actual = recording[listed.position_of(section.title)][ticks]
        error = recording[listed.error_of(section.title)][ticks]
        at_a_point = section.kind in ("position", "pose")
        yield Moved(section.title, actual, actual + error[:, :3] if at_a_point else None)
