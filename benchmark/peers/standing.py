"""The scene `stand`: a whole tick of inverse dynamics of a humanoid on two feet, and its quality.

Every answer is judged by our model, and from its accelerations, torques and wrenches alone.
"""

import tempfile
from dataclasses import asdict
from itertools import product
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from benchmark.packages import OWN, PLACO, TSID
from benchmark.peers.adapters.hierarchy import TASKS, robot_of, stack_of
from benchmark.peers.compare import ABOUT, TICK, Log, measure, times, turns
from benchmark.peers.scenes import Stand
from benchmark.peers.urdf import urdf
from benchmark.report import Column, Report, Row, Section, Table, power, whole
from hierarchy import Robot, Stack, State
from hierarchy.paths import Ellipse, Still
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.tasks import CentreOfMass, Pose, Position, Posture, Together
from solvers import make

QUESTIONS = "benchmark.peers.scenes:Standing"
TICKS = 1000
BASE = 6              # velocities of the floating base
_SWAY = 0.01, 0.04    # [m] of the centre of mass, forward and sideways
_HAND = 0.05          # [m]
_RATE = 2 * np.pi     # [rad/s]
_SOLE = 0.055         # [m] from the foot's frame forward to the middle of the sole
_NOISE = 1e-4, 1e-3   # standard deviation of q [rad, m] and v [rad/s, m/s], as from sensors
_WEIGHTS = "2 levels, weights"

ENTRANTS = (
    OWN.peer("stand", "hcod", "7 strict levels", resolver="hcod"),
    OWN.peer("stand", "weighted", _WEIGHTS, resolver="weighted"),
    TSID.peer("stand", "tsid fast", _WEIGHTS, solver="SolverHQuadProgFast"),
    TSID.peer("stand", "tsid", _WEIGHTS, solver="SolverHQuadProg"),
    PLACO.peer("stand", "placo", _WEIGHTS),
)
NOTES = """\
tick: kinematics, dynamics, rows, solve, torques, from Python [us]. solve: the solve alone, where \
it can be called alone. dynamics: largest residual of the equations of motion [N, N m]. contact: \
of the soles' rest [m/s^2]. torque: beyond a limit [N m]. friction: wrench of a sole that its \
corners cannot push [N]. missed: norm of a task's rows [m/s^2, rad/s^2]."""
_COLUMNS = (*TICK, *(Column(key, f"{key} max", power)
                      for key in ("dynamics", "contact", "torque", "friction")),
            Column("fail", "failed", whole))
_MISSES = [Column("\n".join((*task.split(), of)), f"{task} {of}", "{:.2g}".format)
           for task in TASKS for of in ("median", "max")]


def run() -> Report:
    """Ask all entrants at the same states, and judge their answers by our model.

    They take turns until each has been asked TICKS times, after one turn over all states, which
    compiles, fills caches and is not counted.
    """
    with tempfile.TemporaryDirectory() as temporary:
        scene = make_scene(Path(temporary))
        states = followed(scene, TICKS)
        asked = {key: values.tolist() for key, values in states.items()}
        of = Judge(scene, states)
        rows, missing = measure(ENTRANTS, QUESTIONS, [("open", asdict(scene), asked),
                                                      *turns(TICKS, TICKS, 250, 20)],
                                lambda log, _: judge(log, of))
    title = "One tick of inverse dynamics of a humanoid on two feet"
    tables = [Table(title, rows, _COLUMNS), Table(
        "Missed by each task", [row for row in rows if "posture max" in row], _MISSES),
              Table("The packages", rows, ABOUT)]
    return Report("Inverse dynamics beside other packages", [Section("", tables, NOTES)],
                  {"stand": rows}, missing, failed=bool(missing))


def make_scene(folder: Path) -> Stand:
    """Return the scene, and write its robot into the folder."""
    table = Robot.named("humanoid")
    feet = [table.frame(f"{side}_foot") for side in ("left", "right")]
    soles = [Frame(f"{foot.name[:-5]}_sole", foot.joint,
                   foot.placed([_SOLE, 0.0, 0.0]), foot.rotation) for foot in feet]
    hands = [table.frame(f"{side}_hand") for side in ("left", "right")]
    file = folder / "humanoid.urdf"
    file.write_text(urdf(table, [*soles, *hands]))
    names = [frame.name for frame in hands]
    robot = Robot.from_file(file, names[1], base="floating", shapes=False)
    order = [table.coordinate_names.index(name) for name in robot.joint_names[1:]]
    rest = np.concatenate([table.rest[:7], table.rest[order]])
    state = State.at(robot, rest)
    com = state.centre_of_mass()
    circles = [(com, (_SWAY[0], 0.0, 0.0), (0.0, _SWAY[1], 0.0)), *(
        (state.position(robot.frame(name)), (_HAND, 0.0, 0.0), (0.0, 0.0, _HAND))
        for name in names)]
    return Stand(str(file), robot.joint_names[1:], [sole.name for sole in soles], names,
                 rest.tolist(), rest[7:].tolist(), robot.effort_limit[6:].tolist(),
                 [((at - cosine).tolist(), cosine, sine, _RATE) for at, cosine, sine in circles])


def followed(scene: Stand, ticks: int) -> dict[str, Array]:
    """Return t, q, v of each tick of a robot that follows the circles, with noise.

    Whether its soles can push as they would have to or not: no entrant is asked where the answers
    of another led.
    """
    robot = robot_of(scene)
    state, resolver = State.at(robot, scene.rest), make("hcod")
    com, *hands = (Ellipse(*circle) for circle in scene.circles)
    feet = [Pose(frame, Still(tuple(state.position(frame))), state.rotation(frame), name=frame.name)
            for frame in map(robot.frame, scene.soles)]
    tasks = [Position(robot.frame(name), path, name=name)
             for name, path in zip(scene.hands, hands, strict=True)]
    stack = Stack([Together(feet, "feet"), CentreOfMass(robot, com), *tasks,
                   Posture(tuple(scene.posture))], "velocity")
    noise = np.random.default_rng(16).normal(size=(2, ticks, robot.n))
    kept: dict[str, list[Array]] = {"t": [], "q": [], "v": []}
    for k in range(ticks):
        v = resolver.solve(stack.hierarchy(state)).x
        kept["t"].append(np.array(state.t))
        kept["q"].append(robot.integrate(state.q, _NOISE[0] * noise[0, k]))
        kept["v"].append(v + _NOISE[1] * noise[1, k])
        state.move((k + 1) * scene.period, robot.integrate(state.q, scene.period * v), v)
    return {key: np.array(values) for key, values in kept.items()}


class Judge:
    """Residuals of answers, with the model and tasks of our own stack."""

    def __init__(self, scene: Stand, states: dict[str, Array]) -> None:
        self.scene, self.states, self.robot = scene, states, robot_of(scene)
        self.state = State.at(self.robot, scene.rest)
        self.stack, self.contacts = stack_of(scene, self.robot, self.state)
        self.soles = [Pose(contact.frame, Still((0.0, 0.0, 0.0)), np.eye(3))
                      for contact in self.contacts.contacts]

    def residuals(self, tick: int, a: Array, torques: Array, wrenches: Array) -> dict[str, float]:
        """Return how far an answer at a state is from physics and limits, and misses each task.

        dynamics [N m, N]: of the equations of motion. contact [m/s^2, rad/s^2]: of the soles' rest.
        torque [N m]: beyond a limit. friction [N]: of a sole's wrench (moments over the sole's half
        length) from what its corners can push inside their pyramids, which stand on the sole or, as
        ours, on the floor. The tasks [m/s^2, rad/s^2]: norm of what is missed.
        """
        scene, states, state = self.scene, self.states, self.state
        state.move(float(states["t"][tick]), states["q"][tick], states["v"][tick])
        effort = state.mass_matrix() @ a + state.bias_effort()
        effort[BASE:] -= torques
        for sole, wrench in zip(self.soles, wrenches, strict=True):
            effort -= sole.jacobian(state).T @ wrench
        h = self.stack.hierarchy(state)
        missed = h.A[:, :len(a)] @ a - h.lower  # of rows of accelerations, which are equalities
        return {"dynamics": float(np.abs(effort).max()),
                "contact": float(np.abs(missed[BASE:h.offsets[1]]).max()),
                "torque": max(float((np.abs(torques) - scene.torque).max()), 0.0),
                "friction": max(self._outside(i, wrench) for i, wrench in enumerate(wrenches)),
                **{task: float(np.linalg.norm(missed[h.offsets[k]:h.offsets[k + 1]]))
                   for k, task in enumerate(h.names) if task in TASKS}}

    def _outside(self, i: int, wrench: Array) -> float:
        """Return how far a wrench is from the edges of the pyramids at the corners of a sole."""
        mu, half = self.scene.friction, self.scene.half[0]
        sole = self.state.rotation(self.contacts.contacts[i].frame)
        found = []
        for axes in (sole, np.eye(3)):
            edges = np.array([[x, y, 1.0] for x, y in product((mu, -mu), repeat=2)]) @ axes.T
            pushes = np.array([np.concatenate([edge, np.cross(corner, edge) / half])
                               for corner in self.scene.corners @ sole.T for edge in edges]).T
            found.append(nnls(pushes, np.concatenate([wrench[:3], wrench[3:] / half]))[1])
        return float(min(found))


def judge(log: Log, of: Judge) -> Row:
    """Return times of an entrant, and median and largest of each residual over the states."""
    answered = np.flatnonzero(np.logical_not(log["failed"]))
    once = answered[np.unique(log["state"][answered], return_index=True)[1]]
    found = [of.residuals(int(log["state"][i]), log["a"][i], log["torques"][i],
                          log["wrenches"][i]) for i in once]
    row = times(log)
    for key in found[0] if found else ():
        values = [one[key] for one in found]
        row[f"{key} median"], row[f"{key} max"] = float(np.median(values)), float(max(values))
    return row
