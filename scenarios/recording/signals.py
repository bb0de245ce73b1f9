"""The signals of a run: arrays by name, in SI units, row k from tick k.

Row k of `q` and `v` is the state before the command of tick k, so row 0 is the start; `a` is the
acceleration that this command means. T ticks, n velocities, c commands (n, or at level "torque" the
actuated joints), K control points, N tasks, P contact points, C contacts, H obstacles.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from hierarchy import plugins
from hierarchy.errors import expect, refuse
from hierarchy.records import check_fields

OTHER = "/other"  # the topic of what has no other
_DRAWN = "/tf", "/scene", "/events"  # topics of what Foxglove draws
_TAKEN = "orders", "fault", "events", "tasks", "file", "allow_pickle"  # in files, and by numpy


@dataclass(frozen=True)
class Signal:
    """One signal: name, unit, shape, what it is, and the topic that carries it in an MCAP file.

    A name that ends in "*" stands for one signal of each task. Units per joint are "joint", which
    is rad or m, and "joint/s", "joint/s^2"; "command" depends on `control.level`. Signals whose
    shape does not begin with T are constant in a run. A plugin adds one with
    `register("signals", NAME)(Signal(NAME, ...))`.
    """

    name: str
    unit: str
    shape: str
    text: str
    topic: str = OTHER

    def __post_init__(self) -> None:
        what = f"signal {self.name!r}"
        check_fields(self, what)
        refuse(not re.fullmatch(r"[a-zA-Z]\w*\*?", self.name) or self.name in _TAKEN, f"{what}: "
               f'a name has letters, digits and "_", begins with a letter, and is none of '
               f"{', '.join(_TAKEN)}")
        refuse(not re.fullmatch(r"/\w+", self.topic) or self.topic in _DRAWN, f"{what}: topic = "
               f"{self.topic!r}: expected / and a word, none of {', '.join(_DRAWN)}")

    @property
    def constant(self) -> bool:
        """Whether it has one value for the whole run."""
        return self.shape[1:2] != "T"


def known(name: str) -> Signal | None:
    """Return the signal of a name, None if there is none; HierarchyError for what is no Signal."""
    found = plugins.find("signals", name) or next(
        (signal for key, signal in plugins.known("signals").items()
         if key[-1:] == "*" and name.startswith(key[:-1])), None)
    if found is not None:
        expect(f"signals: {name!r}", found, Signal, "register a Signal")
        refuse(found.name != name and found.name[-1] != "*",
               f"signals: {name!r} is registered with a Signal called {found.name!r}")
    return found


def check_shapes(signals: Mapping[str, NDArray[Any]], **sizes: int) -> None:
    """Raise a HierarchyError for a signal that is not an array of numbers of its shape.

    `sizes` are those of letters that are known; each other has one size in all signals, but m.
    """
    for name, values in signals.items():
        of, given = known(name), values.shape
        letters = re.findall(r"\w+", of.shape) if of else []
        of_letter = dict(zip(letters, given, strict=False))
        expected = tuple(int(letter) if letter.isdigit() else of_letter.get(letter, -1)
                         if letter == "m" else sizes.setdefault(letter, of_letter.get(letter, -1))
                         for letter in letters)
        kinds = "iuf" if of and of.unit else "biuf"
        refuse(of and (given != expected or values.dtype.kind not in kinds), f"signal {name!r}: "
               f"{values.dtype} of shape {given}, expected numbers of shape {expected}")


def described() -> str:
    """Return a line for each signal: name, shape, unit and what it is."""
    return "\n".join(f"{one.name.replace('*', 'NAME')} : {one.shape}"
                     f"{f' [{one.unit}]' if one.unit else ''} {one.text}"
                     for one in plugins.known("signals").values() if isinstance(one, Signal))


_JOINTS, _END, _DISTANCES = "/joints", "/end_effector", "/distances"
_STACK, _TIMES = "/stack", "/times"
_TABLE = (
    Signal("t", "s", "(T,)", "time at the start of the tick"),
    Signal("q", "joint", "(T, nq)", "positions as the controller knew them", _JOINTS),
    Signal("v", "joint/s", "(T, n)", "velocities as the controller knew them", _JOINTS),
    Signal("a", "joint/s^2", "(T, n)", "accelerations that the command means", _JOINTS),
    Signal("command", "command", "(T, c)", "as sent: velocities or accelerations, or at level "
           "\"torque\" the torques of the actuated joints", _JOINTS),
    Signal("true_q", "joint", "(T, nq)", "true positions, where measurement or physics make them "
           "differ from q", _JOINTS),
    Signal("true_v", "joint/s", "(T, n)", "true velocities, as true_q", _JOINTS),
    Signal("ee_position", "m", "(T, 3)", "the end effector", _END),
    Signal("desired_position", "m", "(T, 3)", "the path of [position]", _END),
    Signal("position_error", "m", "(T, 3)", "desired_position minus ee_position", _END),
    Signal("true_ee_position", "m", "(T, 3)", "the end effector at true_q", _END),
    Signal("pointing_error", "", "(T,)", "cos(alpha_d) - cos(alpha), positive outside the cone",
           _END),
    Signal("true_pointing_error", "", "(T,)", "pointing_error at true_q", _END),
    Signal("control_point_distance", "m", "(T, K)", "to the nearest obstacle", _DISTANCES),
    Signal("minimal_distance", "m", "(T,)", "smallest distance of a control point, eq. (31)",
           _DISTANCES),
    Signal("ee_distance", "m", "(T,)", "of the end effector to the nearest obstacle", _DISTANCES),
    Signal("active_control_point", "", "(T,)", "number 1 to K of the point whose avoidance is in "
           "the stack, or -1", _DISTANCES),
    Signal("true_control_point_distance", "m", "(T, K)", "of the true arm and obstacles, where a "
           "camera or measured joints make them differ", _DISTANCES),
    Signal("true_minimal_distance", "m", "(T,)", "as true_control_point_distance", _DISTANCES),
    Signal("true_ee_distance", "m", "(T,)", "as true_control_point_distance", _DISTANCES),
    Signal("order", "", "(T,)", "index into `orders`", _STACK),
    Signal("status", "", "(T,)", "value of solvers.Status", _STACK),
    Signal("iterations", "", "(T,)", "of the resolver", _STACK),
    Signal("transition", "", "(T,)", "weight of the present stack's answer in the command, where "
           "stacks are blended", _STACK),
    Signal("pointing_active", "", "(T,)", "whether the pointing task was in the stack", _STACK),
    Signal("repulsion_active", "", "(T,)", "whether eq. (30) was in force", _STACK),
    Signal("active_set", "", "(T,)", "number of the set of acting inequality rows, from 0 as they "
           "first occur, -1 where unknown; present if the resolver reports it", _STACK),
    Signal("time_kinematics", "s", "(T,)", "of computation", _TIMES),
    Signal("time_rows", "s", "(T,)", "of computation, with sensing and allocation", _TIMES),
    Signal("time_resolve", "s", "(T,)", "of computation, with the rows of former stacks where "
           "stacks are blended", _TIMES),
    Signal("time_tick", "s", "(T,)", "of computation of the whole tick, with the plant's step",
           _TIMES),
    Signal("task_error_*", "", "(T, m)", "error of a task of [[tasks]], as the task defines it; "
           "\"_\" for a space in its name"),
    Signal("task_position_*", "m", "(T, 3)", "the point or centre of mass that the task moves"),
    Signal("true_task_error_*", "", "(T, m)", "task_error_NAME at true_q"),
    Signal("true_task_position_*", "m", "(T, 3)", "task_position_NAME at true_q"),
    Signal("planned_acceleration", "joint/s^2", "(T, n)", "the answer at level \"torque\", NaN "
           "where there was none"),
    Signal("planned_force", "N", "(T, P, 3)", "on each contact point in world axes, as "
           "planned_acceleration"),
    Signal("com", "m", "(T, 3)", "true centre of mass, from a plant with torque motors at the last "
           "step of the simulation in the tick, as the next five"),
    Signal("push", "N", "(T, 3)", "from outside"),
    Signal("floor_force", "N", "(T, C, 3)", "on each contact in world axes"),
    Signal("slip", "m", "(T, C)", "along the floor since the contact touched down"),
    Signal("pressure_margin", "m", "(T, C)", "of the centre of pressure from the nearest edge of "
           "the sole, NaN without load"),
    Signal("support_margin", "m", "(T,)", "of com inside the support polygon, the hull of the "
           "loaded contacts, from above"),
    Signal("contacts", "", "(T,)", "largest number of contacts between arm and obstacles at once "
           "in the tick's period, from a plant with physics"),
    Signal("contact_depth", "m", "(T,)", "as contacts"),
    Signal("contact_force", "N", "(T,)", "as contacts"),
    Signal("certified", "", "(T,)", "whether x is the undamped answer, in a certified run"),
    Signal("moved_by_lower", "m", "(T,)", "see scenarios.loop.audit.Strictness"),
    Signal("level_fate", "", "(T, N)", "value of scenarios.recording.fate.Fate of each of the "
           "`task_names` under the command that was sent"),
    Signal("level_violation", "", "(T, N)", "Euclidean norm of the violation of its rows, in their "
           "unit, NaN where the task is absent or its fate unknown"),
    Signal("saturated", "", "(T, n)", "-1 or 1 where a joint is at the lower or upper side of its "
           "limits' box of commands, else 0"),
    Signal("obstacle_offset", "m", "(T, H, 3)", "by which obstacles were dragged off their places "
           "in a live run"),
    Signal("changed", "", "(T,)", "whether obstacles or settings differ from the scenario in a "
           "live run"),
    Signal("joint_lower", "", "(nq,)", "limit of the robot, infinite where it has none"),
    Signal("joint_upper", "", "(nq,)", "limit of the robot, infinite where it has none"),
    Signal("velocity_limit", "", "(n,)", "limit in use, infinite where there is none"),
    Signal("torque_limit", "", "(c,)", "limit in use of the actuated joints, at level \"torque\""),
)
for _signal in _TABLE:
    plugins.register("signals", _signal.name, shipped=True)(_signal)
__doc__ = f"{__doc__}\n{described()}"
