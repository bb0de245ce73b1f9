"""What there is to draw of a run: the arm, obstacles, paths, cone, stack and curves, as arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import radians
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Capsule, ControlPoint, Obstacles
from hierarchy.problem import Array
from hierarchy.robots import TABLES, DHTable
from scenarios import listed
from scenarios.build import make_obstacles, make_robot, sensed_points
from scenarios.levels import Fate, Levels, judge, order_names
from scenarios.metrics import pointing_angle
from scenarios.sensors import ExactDistances

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from scenarios.recording import Recording

_STICK = 0.08  # radius of a link without capsules, relative to the robot's longest link
_ERRORS = {"m": "positions", "deg": "directions", "rad": "postures"}
_SEPARATION = "separation"  # the task that keeps all points off all obstacles
_SYMBOLS = {r"$\epsilon_1$": "ε₁", r"$\epsilon_2$": "ε₂", r"$\epsilon_{ee}$": "ε_ee",
            r"$d_{min}$": "d_min"}

Areas = tuple[tuple[str, float], ...]


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


@dataclass(frozen=True)
class Series:
    """A quantity over the frames: value, and its extremes since the frame before, (F, C) each.

    A mark is a name and the value of a line to compare with. `logarithmic` says on which scale it
    is best drawn.
    """

    name: str
    unit: str
    labels: tuple[str, ...]
    value: Array
    low: Array
    high: Array
    marks: Areas = ()
    logarithmic: bool = False


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
    levels : what became of each task, see scenarios.levels.
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
    foot = scenario.sensor.foot if isinstance(TABLES.get(robot.name), DHTable) else 0.0
    links = capsules(robot, foot)
    axis = None if pointing is None else np.asarray(pointing.axis) / np.linalg.norm(pointing.axis)
    return Stage(robot, links, sensed_points(robot),
                 make_obstacles(avoidance.placed if avoidance else ()),
                 _areas(avoidance.thresholds if avoidance else {}),
                 _areas(avoidance.tip_thresholds if avoidance else {}),
                 axis, radians(pointing.alpha_d) if pointing else 0.0,
                 -foot if foot else _lowest(robot, links))


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


def capsules(robot: Robot, foot: float = 0.0) -> tuple[Capsule, ...]:
    """Return a robot's links, sticks from joint to joint where it has no capsules.

    With `foot` > 0 [m] the first is the column from there below the base up to it.
    """
    links = robot.capsules or _sticks(robot)
    if foot == 0.0 or robot.base == "floating" or not links:
        return links
    return (Capsule("foot", 0, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), links[0].radius), *links)


def _sticks(robot: Robot) -> tuple[Capsule, ...]:
    end = robot.frame(robot.end_effector)
    sticks = [(body.name, body.parent, body.position) for body in robot.bodies()]
    sticks = [stick for stick in (*sticks, (end.name, end.joint, end.offset))
              if np.linalg.norm(stick[2]) > 0.0]
    radius = _STICK * max((float(np.linalg.norm(stick[2])) for stick in sticks), default=0.0)
    return tuple(Capsule(name, joint, (0.0, 0.0, 0.0), (float(x), float(y), float(z)), radius)
                 for name, joint, (x, y, z) in sticks)


def _lowest(robot: Robot, links: Sequence[Capsule]) -> float:
    """Height [m] of what is lowest of a robot at rest, or of its base."""
    low = ends(links, robot.state(robot.rest).placements)[..., 2].min(axis=-1, initial=0.0)
    return float((low - [link.radius for link in links]).min(initial=0.0))


def ends(links: Sequence[Capsule], placements: Array) -> Array:
    """Return start and end of each capsule in the world: (..., C, 2, 3) [m].

    placements (..., J + 1, 12), as in a State.
    """
    joints = np.array([link.joint for link in links], dtype=np.int64)
    return np.stack([place(placements, joints, [getattr(link, side) for link in links])
                     for side in ("start", "end")], axis=-2)


def place(placements: Array, joints: Any, offsets: Any) -> Array:
    """Return the world positions (..., K, 3) [m] of offsets (K, 3) in the frames of joints (K,)."""
    rows = placements[..., np.asarray(joints, dtype=np.int64), :]
    columns = rows[..., :9].reshape(*rows.shape[:-1], 3, 3)
    turned = np.einsum("...kci,kc->...ki", columns, np.reshape(offsets, (-1, 3)))
    return np.asarray(turned + rows[..., 9:])


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
    if _SEPARATION in levels.names:
        fate = levels.fate[:, levels.names.index(_SEPARATION)]
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


def _areas(thresholds: dict[str, float]) -> Areas:
    return tuple((_SYMBOLS.get(name, name.strip("$")), radius)
                 for name, radius in thresholds.items())


def series(recording: Recording, ticks: NDArray[np.int64]) -> Iterator[Series]:
    """Yield the curves that a recording has the signals for, at some ticks."""
    scenario = recording.scenario
    if "position_error" in recording:
        error = 1e3 * np.linalg.norm(recording["position_error"], axis=1)
        yield _sampled("Distance from the path", "mm", ("end effector",), error, ticks,
                       logarithmic=True)
    if "pointing_error" in recording and scenario.pointing is not None:
        yield _sampled("Angle to the cone's axis", "deg", ("end effector",),
                       pointing_angle(recording), ticks, (("α_d", scenario.pointing.alpha_d),))
    for name, signal in (("Body to the nearest obstacle", "minimal_distance"),
                         ("End effector to the nearest obstacle", "ee_distance")):
        if signal in recording and scenario.avoidance is not None:
            at = (scenario.avoidance.thresholds if signal == "minimal_distance"
                  else scenario.avoidance.tip_thresholds)
            yield _sampled(name, "m", (name.partition(" to ")[0].lower(),), recording[signal],
                           ticks, _areas(at))
    yield from _task_errors(recording, ticks)
    joints = tuple(f"joint {j + 1}" for j in range(recording["v"].shape[1]))
    yield _sampled("Joint speeds", "rad/s", joints, recording["v"], ticks)


def _task_errors(recording: Recording, ticks: NDArray[np.int64]) -> Iterator[Series]:
    """Errors of listed tasks, one series for each unit."""
    if not getattr(recording.scenario, "tasks", ()):
        return
    found: dict[str, dict[str, Array]] = {}
    for section, unit, error in listed.errors(recording):
        found.setdefault(unit, {})[section.title] = error
    for unit, errors in found.items():
        yield _sampled(f"Errors of tasks, {_ERRORS[unit]}", unit, tuple(errors),
                       np.column_stack(list(errors.values())), ticks)


def _sampled(name: str, unit: str, labels: tuple[str, ...], values: Array,
             ticks: NDArray[np.int64], marks: Areas = (), logarithmic: bool = False) -> Series:
    values = values.reshape(len(values), -1)
    first = np.concatenate(([0], ticks[:-1] + 1))  # so no peak between two frames is lost
    upto = values[:ticks[-1] + 1]
    return Series(name, unit, labels, values[ticks], np.fmin.reduceat(upto, first, axis=0),
                  np.fmax.reduceat(upto, first, axis=0), marks, logarithmic)
