"""What is drawn of a run: arm, obstacles, paths, cone, stack and curves, as arrays."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance import Measurement, Obstacles
from hierarchy.avoidance.measurement import measure_exactly
from hierarchy.errors import positive, refuse
from hierarchy.jit import bind
from hierarchy.problem import Array
from scenarios.cell.sensors.sensor import make_obstacles, packed_laws
from scenarios.recording import listed
from scenarios.recording.facts import RobotFacts, ends
from scenarios.recording.fate import Fate, Levels, levels_at
from scenarios.recording.recording import Recording
from scenarios.scene.curves import Areas, Series, marks_of, series
from scenarios.scene.pushes import Pushes, pushes

SEPARATION = "separation"  # the task that keeps all points away from all obstacles


@dataclass(frozen=True)
class Moved:
    """Actual and desired position (F, 3) [m] of the point that a task moves; wanted may be None."""

    task: str
    actual: Array
    wanted: Array | None


@dataclass(frozen=True)
class Scene:
    """What is drawn of a run in F frames; J joints, P points, H obstacles. Metres, seconds.

    t, ticks (F,) : time and tick of each frame.
    placements (F, J + 1, 12) : of the joints' frames (of the true joints if recorded), rotation
        column by column, then translation; `ends` turns them into the links.
    points (F, P, 3) : control points, then the end effector.
    nearest (F, P, 3), distance (F, P) : the nearest obstacle point to each, and how far it is, from
        the scenario's geometry even with a camera; NaN and infinite without obstacles.
    active (F,) : the point that the stack keeps away from an obstacle, or -1; under the task
        `separation` the nearest point, in ticks in which one of its rows acts.
    centres (F, H, 3) : of `obstacles`, which has shape, size and rotation.
    axis (F, 3) : the end effector's z axis. desired (F, 3) : its path, or None.
    order (F,) : index into `orders`, which name tasks. switches (S,) : times of changes of it.
    paths : of the points that listed tasks move. levels, pushes : see their classes.
    """

    robot: RobotFacts
    obstacles: Obstacles
    areas: Areas  # (symbol, radius) of the thresholds around an obstacle for control points
    cone: Array | None  # its axis (3,), for the end effector's z axis
    half_angle: float  # [rad] of the cone
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
    pushes: Pushes | None = None

    @property
    def azimuth(self) -> float:
        """Direction [rad] of the view: a robot that branches is seen from the front, along -x."""
        return radians(135.0 if self.robot.is_chain else 40.0)

    @property
    def links(self) -> Array:
        """Start and end of each capsule of the arm in the world: (F, C, 2, 3) [m]."""
        return ends(self.robot.capsules, self.placements)

    @property
    def linked(self) -> NDArray[np.int64]:
        """The point linked with its nearest obstacle: the active one, else the closest, (F,)."""
        return np.where(self.active >= 0, self.active, self.distance.argmin(axis=1))


def scene(recording: Recording, rate: float = 30.0,
          ticks: NDArray[np.int64] | None = None) -> Scene:
    """Return what is drawn of a run at `rate` frames per second, or in the given ticks.

    Raises HierarchyError if nothing was recorded or `rate` is not positive and finite.
    """
    positive("rate [Hz]", rate)
    ticks = _frames(recording, rate) if ticks is None else ticks
    t, scenario, facts = recording["t"][ticks], recording.scenario, recording.facts
    robot, avoidance, pointing = facts.robot, scenario.avoidance, scenario.pointing
    cone = None if pointing is None else np.asarray(pointing.axis) / np.linalg.norm(pointing.axis)
    obstacles = make_obstacles(avoidance.placed if avoidance else ())
    placements = robot.placements(recording.true("q")[ticks])
    z = placements[:, robot.points[-1].joint, :9].reshape(-1, 3, 3).swapaxes(1, 2) @ np.array(
        robot.tool)[:, 2]
    moved = _distances(obstacles, recording, ticks, placements)
    levels = levels_at(recording, ticks)
    pushed = pushes(facts, scenario, t, placements, recording["planned_force"][ticks],
                    recording["com"][ticks] if "com" in recording else None
                    ) if facts.contacts else None
    areas = marks_of(avoidance.thresholds["body"]) if avoidance else ()
    return Scene(robot, obstacles, areas, cone, radians(pointing.alpha_d) if pointing else 0.0,
                 t, ticks, placements, **moved,
                 active=_active(recording, ticks, levels, moved["distance"]), axis=z,
                 desired=recording["desired_position"][ticks]
                 if "desired_position" in recording else None,
                 order=recording["order"].astype(np.int64)[ticks], orders=recording.order_names,
                 paths=tuple(moved_by_tasks(recording, ticks)), levels=levels,
                 series=tuple(series(recording, ticks)),
                 switches=recording["t"][recording.switches()], pushes=pushed)


def _frames(recording: Recording, rate: float) -> NDArray[np.int64]:
    """Return the ticks nearest to the frames' times, including the first and the last tick."""
    finite = np.flatnonzero(np.isfinite(recording.true("q")).all(axis=1))
    refuse(not finite.size, "the recording has no tick: there is nothing to draw")
    t = recording["t"][finite]
    step = max(1.0 / rate, recording.scenario.control.period)
    wanted = np.append(np.arange(t[0], t[-1], step), t[-1])
    after = np.clip(np.searchsorted(t, wanted), 1, max(len(t) - 1, 1)) if len(t) > 1 else [0]
    before = np.maximum(np.asarray(after) - 1, 0)
    nearer = np.where(wanted - t[before] <= t[after] - wanted, before, after)
    return np.unique(finite[nearer])


def _distances(obstacles: Obstacles, recording: Recording, ticks: NDArray[np.int64],
               placements: Array) -> dict[str, Array]:
    """Return points, distances, nearest points and the obstacles' centres, frame by frame."""
    points = recording.facts.robot.points
    seen, now = Measurement(len(points) - 1), np.empty(placements.shape[1:])
    measure = bind(measure_exactly, now, np.array([point.joint for point in points]),
                   np.array([point.offset for point in points]), obstacles.table, packed_laws(),
                   np.zeros(2), seen.arrays)
    frames = []
    offsets = recording.get("obstacle_offset", np.empty((recording.ticks, 0, 3)))
    for k, placed in zip(ticks.tolist(), placements, strict=True):
        now[:] = placed
        obstacles.at(float(recording["t"][k]))
        for h, offset in enumerate(offsets[k]):
            obstacles.shift(h, offset)
        measure()
        away = np.where(np.isfinite(seen.distance), seen.distance, np.nan)[:, None]
        frames.append((seen.points.copy(), seen.points - away * seen.direction,
                       seen.distance.copy(), obstacles.centres.copy()))
    return dict(zip(("points", "nearest", "distance", "centres"),
                    map(np.array, zip(*frames, strict=True)), strict=True))


def _active(recording: Recording, ticks: NDArray[np.int64], levels: Levels,
            distance: Array) -> NDArray[np.int64]:
    if SEPARATION in levels.names:
        fate = levels.fate[:, levels.names.index(SEPARATION)]
        acting = np.isin(fate, (Fate.UNKNOWN, Fate.MET, Fate.MISSED))
        return np.where(acting, distance.argmin(axis=1), -1)
    if "active_control_point" not in recording:
        return np.full(len(ticks), -1)
    return np.maximum(recording["active_control_point"][ticks].astype(np.int64) - 1, -1)


def moved_by_tasks(recording: Recording, ticks: NDArray[np.int64] | slice = slice(None)
                   ) -> Iterator[Moved]:
    """Yield where listed tasks move a point, and want it, at some ticks."""
    for section in recording.scenario.tasks:
        if listed.position_of(section.title) not in recording:
            continue
        actual = recording.true(listed.position_of(section.title))[ticks]
        error = recording.true(listed.error_of(section.title))[ticks]
        yield Moved(section.title, actual, section.wanted(actual, error))
