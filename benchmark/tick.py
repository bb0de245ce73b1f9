"""Time of a whole tick of `ellipse`: sense, allocate, rows, resolve, integrate, record."""

from time import perf_counter
from typing import Any

import numpy as np

from benchmark.report import TIMES, Column, Report, Row, Section, Table, whole
from benchmark.timing import one_core, times_of
from hierarchy import HierarchyError, State
from hierarchy.allocation import allocate
from hierarchy.problem import Array
from hierarchy.robot import Frame
from scenarios.cell.build import Cell, build
from scenarios.config import Scenario, load
from scenarios.loop.simulation import uninterrupted
from scenarios.recording.recording import Recording

SPECS = ("tpm-published", "tpm", "recursive", "augmented")
PARTS = ("kinematics", "rows", "resolve", "act and record")
LEAD_IN = 50       # ticks at the start of a run that do not count: cold caches
_ROUNDS = 5        # runs of each candidate, which take turns
_AGREE = 1e-7      # [rad/s^2] tolerance between compiled and plain commands
_COLUMNS = (*TIMES, *(Column(head, f"{part}_us") for head, part in zip(
    ("kinem.", "rows", "resolve", "act+rec"), PARTS, strict=True)),
    Column("failed", "failures", whole), Column("faster", "times_faster_than_plain"))
_SAID = ("Parts: medians of kinematics, rows of the tasks, resolver, plant and recorder (act+rec). "
         "failed: ticks without an answer. faster: times as fast as plain numpy.")


def run() -> Report:
    """Time every tick of the letter's run under each resolver, and the plain numpy tick.

    The plain tick is asked at the states of the run, and must command the same.
    """
    scenario, rows = load("ellipse"), list[Row]()
    path, specs = uninterrupted(scenario), [scenario.with_resolver(spec) for spec in SPECS]
    with one_core():
        runs = [[_times(uninterrupted(one)) for one in specs] for _ in range(_ROUNDS + 1)]
    for spec, *own in zip(SPECS, *runs[1:], strict=True):  # the first compiles and fills caches
        times = np.concatenate(own)
        parts = {f"{part}_us": float(np.nanmedian(some)) for part, some in zip(
            PARTS, times.T, strict=False)}
        rows.append({"tick": spec, **parts, **_of_ticks(times[:, -1])})
    rows.append({"tick": "plain numpy", **_of_ticks(1e6 * _plain(scenario, path))})
    for row in rows:
        row["times_faster_than_plain"] = rows[-1]["median_us"] / row["median_us"]
    title = "One control tick of ellipse, microseconds, one core, warm kernels"
    return Report("The control tick", [Section("", [Table(title, rows, _COLUMNS, "tick")], _SAID)],
                  {"tick": rows})


def _of_ticks(times: Array) -> Row:
    """Return the row of times [us] of ticks: those answered, and how many are not."""
    answered = times[~np.isnan(times)]
    return {"ticks": len(times), "failures": len(times) - len(answered), **times_of(1e3 * answered)}


def _times(run: Recording) -> Array:
    """Return the times [us] of PARTS and the whole tick, (T, 5); NaN without an answer."""
    parts = [run[f"time_{part}"] for part in ("kinematics", "rows", "resolve", "tick")]
    times = 1e6 * np.column_stack([*parts[:3], parts[3] - sum(parts[:3]), parts[3]])
    times[run["status"] != 0] = np.nan
    return times[LEAD_IN:]


def _plain(scenario: Scenario, path: Recording) -> Array:
    """Return the times [s] of the plain tick along a run, whose commands it must repeat."""
    tick, times = PlainTick(scenario, build(scenario)), np.empty(path.ticks)
    with one_core():
        for k, (t, q, v, a) in enumerate(zip(*(path[key] for key in ("t", "q", "v", "a")),
                                             strict=True)):
            start = perf_counter()
            found = tick.step(t, q, v)
            times[k] = perf_counter() - start
            if np.abs(found - a).max() > _AGREE:
                raise AssertionError(f"tick {k}: compiled and plain commands differ by "
                                     f"{np.abs(found - a).max()}")
    return times[LEAD_IN:]


class PlainTick:
    """The tick of `ellipse` in plain numpy, which the compiled tick replaces.

    It has the same kinematics call, tasks, order and TPM (plain QR, damped pivots), so the commands
    must agree. `log` collects the signals of a recording.
    """

    def __init__(self, scenario: Scenario, cell: Cell) -> None:
        sensor, tasks = cell.sensor, cell.tasks
        if not (sensor and tasks.areas and tasks.position and tasks.pointing):
            raise HierarchyError("the plain tick needs all tasks of `ellipse`")
        self.areas, self.position, self.pointing = tasks.areas, tasks.position, tasks.pointing
        self.obstacles, self.frame = sensor.obstacles.centres, tasks.position.frame
        self.points = [Frame(point.name, point.joint, point.offset, np.eye(3))
                       for point in cell.robot.control_points]
        self.state, self.period, self.log = cell.state, scenario.control.period, list[Any]()

    def step(self, t: float, q: Array, v: Array) -> Array:
        """Sense, allocate, stack, resolve, integrate, record; return the acceleration."""
        state = self.state
        state.move(t, q, v)
        points = [state.position(point) for point in self.points]
        gaps = [np.linalg.norm(point - self.obstacles, axis=1) for point in points]
        nearest = [float(gap.min()) for gap in gaps]
        k = int(np.argmin(nearest))
        p = state.position(self.frame)
        J, dJ = jacobians(state, self.frame.joint, p)
        end_gaps = np.linalg.norm(p - self.obstacles, axis=1)
        z_e = state.rotation(self.frame)[:, 2]
        z_d = self.pointing.z_d
        cone = float(self.pointing.cos_alpha_d - z_d @ z_e)
        order, repulsion = allocate(nearest[k], float(end_gaps.min()), cone, self.areas)

        rows = {}
        p_d, dp_d, ddp_d = self.position.path(t)
        target = ddp_d + 20.0 * (dp_d - J @ v) + 40.0 * (p_d - p) - dJ @ v
        if repulsion:
            j = int(np.argmin(end_gaps))
            target = target + _magnitude(end_gaps[j], 5.0, 0.1, 10.0, 1.5) * (
                p - self.obstacles[j]) / end_gaps[j]
        rows["position"] = J, target
        if "pointing" in order:
            w = state.J[3:] @ v
            arm = np.cross(z_e, z_d)
            J_rp = arm @ state.J[3:]
            drift = (np.cross(np.cross(w, z_e), z_d) @ state.J[3:] + arm @ state.dJ[3:]) @ v
            rows["pointing"] = J_rp[None], np.array([5.0 * cone - 2.0 * J_rp @ v - drift])
        if "avoidance" in order:
            j = int(np.argmin(gaps[k]))
            r = (points[k] - self.obstacles[j]) / nearest[k]
            J_c, dJ_c = jacobians(state, self.points[k].joint, points[k])
            magnitude = _magnitude(nearest[k], 0.15, 0.15, 2.0, 3.0)
            rows["avoidance"] = (r @ J_c)[None], np.array([magnitude - r @ dJ_c @ v])
        a = _published_tpm([rows[name] for name in order], -5.0 * v)

        q = q + v * self.period + a * self.period**2 / 2
        self.log.append((t, q, v + a * self.period, a, p, p_d, cone, nearest, order))
        return a


def jacobians(state: State, joint: int, p: Array) -> tuple[Array, Array]:
    """Return J (3, n) of the point that a joint's body has at p (3,) [m], and its derivative."""
    mask = state.supports[joint]
    J = (state.J[:3] + np.cross(state.J[3:].T, p).T) * mask
    dJ = (state.dJ[:3] + np.cross(state.dJ[3:].T, p).T
          + np.cross(state.J[3:].T, J @ state.v).T) * mask
    return J, dJ


def _magnitude(distance: float, maximum: float, reach: float, shape: float, scale: float) -> float:
    return float(maximum / (1.0 + np.exp((distance * scale / reach - 1.0) * shape)))


def _published_tpm(levels: list[tuple[Array, Array]], reference: Array) -> Array:
    J = np.vstack([J for J, _ in levels])
    b = np.concatenate([b for _, b in levels])
    _, R = np.linalg.qr(J.T)
    F, first = R.copy(), 0
    for J_i, _ in levels:
        rows = slice(first, first + len(J_i))
        F[rows] = _damped_inverse(R[rows, rows]) @ F[rows]
        F[:first] -= F[:first, rows] @ F[rows]
        first = rows.stop
    return np.asarray(np.linalg.pinv(J) @ (F.T @ b - J @ reference) + reference)


def _damped_inverse(R: Array) -> Array:
    smallest = np.linalg.svd(R, compute_uv=False)[-1]
    if smallest >= 0.1:
        return np.asarray(np.linalg.inv(R))
    damping = (1.0 - (smallest / 0.1) ** 2) * 0.05**2
    return np.asarray(R.T @ np.linalg.inv(R @ R.T + damping * np.eye(len(R))))
