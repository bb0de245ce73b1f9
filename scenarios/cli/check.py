"""`hierarchy check`: a scenario and its first tick, or a robot and a proposed [robot] section."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from math import isfinite
from textwrap import fill
from typing import Any

import numpy as np

from hierarchy import Robot, State, plugins
from hierarchy.errors import UnknownNameError, file_path
from hierarchy.robots import TABLES
from hierarchy.robots.found import remarks
from hierarchy.robots.names import elsewhere, file_of, in_package, is_file_name
from hierarchy.words import counted, some
from scenarios.cli.options import loaded
from scenarios.config import Scenario, ScenarioError, is_shipped, shipped, shipped_groups
from scenarios.config.changes import change_all, parse_changes
from scenarios.config.reading import WANTED, no_scenario
from scenarios.config.sections import Section
from scenarios.config.sections.robot import RobotSection
from scenarios.config.validation import validated
from scenarios.loop.first_tick import FirstTick, first_tick
from solvers import Status

_ROUND = 4     # decimals of proposed positions [m]
_TURNS = 50.0  # [rad] between limits of a joint beyond which they are taken for degrees
_ALIKE = 3     # decimals of heights [m] that are alike
_LEVEL = 0.02  # [m] between frames that are at the same height
_WIDTH, _UNDER = 100, " " * 12  # of a summary of a scenario
_UNITS = {"rad": "rad, rad/s, N m", "m": "m, m/s, N"}


class _OfRobot(Section):
    """The part of a scenario that a robot has."""

    robot: RobotSection


def checked(file: str, changes: list[str] | None) -> tuple[dict[str, Any], str]:
    """Return what there is to say of a scenario or robot, as plain data for JSON and as text."""
    if is_robot(file):
        section, robot = robot_of(file, changes)
        found = robot_data(section, robot)
        return found, robot_in_words(section, robot, found)
    scenario = loaded(file, changes)
    tick = first_tick(scenario)
    return scenario_data(scenario, tick), scenario_in_words(scenario, tick)


def is_robot(text: str) -> bool:
    """Whether the text names a robot; a name that is also a scenario's means the scenario.

    Raises a HierarchyError for what is neither.
    """
    path = file_path("check", text)
    if path.is_dir() or path.suffix == ".py":
        raise no_scenario(text)
    if text.endswith(".toml") or ".toml:" in text or is_shipped(text) or text in shipped_groups():
        return False
    if not (in_package(text) or is_file_name(text) or text in TABLES
            or text in plugins.own("robots")):
        raise UnknownNameError("scenario or robot", text, {*shipped(), *TABLES},
                               f"{elsewhere(text)} {WANTED}")
    return True


def robot_of(model: str, changes: Sequence[str] | None) -> tuple[RobotSection, Robot]:
    """Make the robot of a model with changes "robot.key=value"; raises HierarchyError."""
    from scenarios.cell.robot import make_robot

    data: dict[str, Any] = {"robot": {"model": model}}
    change_all(data, parse_changes(changes or (), what="--set"), _OfRobot)
    if unknown := [key for key in data if key != "robot"]:
        raise ScenarioError(f"--set {unknown[0]}: only keys of [robot] can be set for a robot")
    section = validated(_OfRobot, data, repr(model)).robot
    return section, make_robot(section)


def robot_data(section: RobotSection, robot: Robot) -> dict[str, Any]:
    """Return the summary as plain data for JSON; missing limits are None."""
    return {
        "model": section.model, "base": robot.base, "velocities": robot.n, "positions": robot.nq,
        "mass_kg": float(robot.masses.sum()), "joints": _joints(robot),
        "frames": [name for name in robot.frame_names
                   if name not in ("universe", *robot.joint_names)],
        "end_effector": robot.end_effector, "lowest_frames": _lowest(robot),
        "capsules": [{"joint": _carrier(robot, c.joint), "start": _rounded(c.start),
                      "end": _rounded(c.end), "radius": round(c.radius, _ROUND)}
                     for c in robot.capsules],
        "control_points": [{"joint": _carrier(robot, p.joint), "offset": _rounded(p.offset)}
                           for p in robot.control_points],
        "missing": list(_missing(robot)),
        "coupled": [asdict(one) for one in robot.coupled],
        "loops": [asdict(one) for one in robot.loops],
        "starts": list(robot.starts), "may_touch": [list(pair) for pair in robot.apart]}


def robot_in_words(section: RobotSection, robot: Robot, found: dict[str, Any]) -> str:
    """Return the summary as text, with a [robot] section to paste."""
    of_table = robot.table is not None
    listed = "from its table" if of_table else "proposed"
    end = "as given" if section.end_effector else listed
    points = "as listed" if section.control_points is not None else listed
    links = "as listed" if section.capsules is not None else (
        listed if of_table else "proposed from the collision geometry")
    source = (f"{section.model} ({file_of(section.model)})" if in_package(section.model) else
              "a table of this package" if section.model in TABLES else section.model)
    moving, joint = 0, robot.frame(robot.end_effector).joint
    while joint > (robot.base == "floating"):
        moving, joint = moving + 1, robot.parents[joint]
    said = [
        ("base", f"{robot.base}, {robot.n} velocities, {robot.nq} positions"),
        ("mass", f"{found['mass_kg']:.3g} kg of moving links"),
        ("joints", "\n".join([f"{len(found['joints'])} actuated", *_joint_table(found["joints"])])),
        ("frames", some(found["frames"])),
        ("end effector", f"{robot.end_effector}, {end}; {moving} joints move it"),
        ("lowest frames", f"{some(feet)}; [[contacts]] may be there"
         if (feet := found["lowest_frames"]) else ""),
        ("capsules", f"{len(robot.capsules)}, {links}" if robot.capsules else "none"),
        ("control points", f"{len(robot.control_points)}, {points}"),
        *(("missing", sentence) for sentence in found["missing"]),
        *(("follows", f"{one} (kept by every scenario)") for one in robot.coupled),
        *(("closed chain", f"{one.name}: {' and '.join(one.frames)} have one "
           f"{'pose' if one.rigid else 'origin'}") for one in robot.loops),
        ("keyframes", f"{some(list(robot.starts))}; start.keyframe takes one"
         if robot.starts else ""),
        ("may touch", some([f"{one or 'base'} to {other or 'base'}"
                            for one, other in robot.apart]))]
    lines = [f"{robot.name}: {source}", *(f"  {what:<14}  {text}" for what, text in said if text)]
    lines += [f"Warning: joint {name} may turn from {low:g} to {high:g} rad. Are these degrees?"
              for name, unit, low, high, *_ in map(dict.values, found["joints"])
              if unit == "rad" and None not in (low, high) and high - low > _TURNS]
    return "\n".join([*lines, "", "For a scenario file:", "", paste(section, robot, found)])


def paste(section: RobotSection, robot: Robot, found: dict[str, Any]) -> str:
    """Return the [robot] section for this robot, with all proposed values."""
    values = {"model": section.model, "base": robot.base, "end_effector": robot.end_effector,
              **({"root": section.root} if section.root else {})}
    lines = ["[robot]", *(f"{key} = {_toml(value)}" for key, value in values.items())]
    if section.locked:
        lines.append(f"locked = {_inline({_toml(k): v for k, v in section.locked.items()})}")
    for key in ("control_points", "capsules") if robot.table is None else ():
        rows = [f"    {_inline(row)}," for row in found[key]]
        lines += [f"{key} = [", *rows, "]"] if rows else []
    return "\n".join(lines)


def _inline(row: dict[str, Any]) -> str:
    """Return an inline table of TOML, without values that are None."""
    return "{ " + ", ".join(f"{k} = {_toml(v)}" for k, v in row.items() if v is not None) + " }"


def _toml(value: Any) -> str:
    """Return a string, a number or an array, which TOML writes as JSON does."""
    return json.dumps(value, ensure_ascii=False)


def _joints(robot: Robot) -> list[dict[str, Any]]:
    """Return the names and limits of the actuated joints."""
    limits = dict(zip(("lower", "upper", "velocity", "effort"), (
        *robot.position_limits(), robot.velocity_limit, robot.effort_limit), strict=True))
    return [{"name": robot.velocity_names[i], "unit": robot.velocity_units[i],
             **{key: float(of[i]) if isfinite(of[i]) else None for key, of in limits.items()}}
            for i in range(robot.actuated, robot.n)]


def _joint_table(joints: list[dict[str, Any]]) -> list[str]:
    width = max((len(joint["name"]) for joint in joints), default=0)
    keys = "lower", "upper", "velocity", "effort"
    rows = [("", *keys, ""), *((joint["name"], *(
        "none" if joint[key] is None else f"{joint[key]:.4g}" for key in keys),
        _UNITS[joint["unit"]]) for joint in joints)] if joints else []
    return [f"    {name:{width}}  {'  '.join(f'{cell:>8}' for cell in cells)}  {units}".rstrip()
            for name, *cells, units in rows]


def _missing(robot: Robot) -> list[str]:
    from hierarchy.tasks import Mechanism
    from scenarios.cell.robot import CLOSED

    mechanism = Mechanism(robot)
    gap, where = mechanism.gap(mechanism.closed(robot.rest))
    alike = [joint for joint in _joints(robot) if joint["lower"] == joint["upper"]]
    said = [f"{kind} of {some(names)}" for kind, unlimited in (
        ("position limits", True), ("range between the position limits", False))
            if (names := [one["name"] for one in alike if (one["lower"] is None) == unlimited])]
    if gap > CLOSED:
        said.append(f"a posture near rest that closes the mechanism: {where}: it stays open by "
                    f"{gap:.3g} (m or rad)")
    if not robot.masses.any():
        said.append("masses: centre-of-mass tasks and torque limits are not possible")
    if not robot.capsules:
        said.append("capsules: no self-collision avoidance, and figures show lines; list "
                    "robot.capsules")
    if not robot.control_points:
        said.append("control points: no avoidance; list robot.control_points")
    return list(dict.fromkeys([*robot.missing, *remarks(robot.model), *said]))


def _lowest(robot: Robot) -> list[str]:
    """Return where a floating robot may stand: a frame of each body at the end of a chain.

    They are within 2 cm of the lowest in the robot's own posture, or that of the base if it is
    lowest. A frame at the joint of its body, such as a knee, is not its end if there is another.
    """
    if robot.base == "fixed":
        return []
    state, lowest = State.at(robot, robot.rest), dict[int, tuple[bool, float, int, str]]()
    fixed = {str(frame.name) for frame in robot.model.frames if frame.type.name == "FIXED_JOINT"}
    links = [name for name in robot.frame_names if name not in {*robot.joint_names, *fixed}]
    for name in links:
        frame = robot.frame(name)
        if frame.joint == 1 or (frame.joint > 1 and frame.joint not in robot.parents):
            height = round(float(state.position(frame)[2]), _ALIKE)
            here = frame.joint > 1 and not frame.offset.any(), height, len(name), name
            lowest[frame.joint] = min(here, lowest.get(frame.joint, here))
    base = lowest.pop(1, None)
    floor = min((height for _, height, *_ in lowest.values()), default=np.inf)
    if base is not None and base[1] < floor:
        return [base[-1]]
    return [name for _, height, _, name in lowest.values() if height < floor + _LEVEL]


def _carrier(robot: Robot, joint: int) -> str | None:
    """Return the joint's name as in a section; None for the base."""
    return robot.joint_names[joint - 1] if joint > (robot.base == "floating") else None


def _rounded(place: Any) -> list[float]:
    return [float(value) + 0.0 for value in np.round(place, _ROUND)]


def scenario_data(scenario: Scenario, found: FirstTick) -> dict[str, Any]:
    """Return a scenario and its first tick as plain data for JSON."""
    return {"scenario": scenario.model_dump(mode="json"), "first_tick": {
        "status": None if found.status is None else found.status.name,
        "levels": list(found.levels), "unmet": list(found.unmet),
        "distances_m": found.distances}, "warnings": list(found.warnings)}


def scenario_in_words(scenario: Scenario, found: FirstTick) -> str:
    """Return the summary of a scenario and its first tick as text."""
    named = ": ".join(filter(None, (scenario.name, scenario.title)))
    lines = [named, *_sections(scenario), *_first(found)]
    lines += [fill(f"Warning: {text}.", _WIDTH, subsequent_indent="  ") for text in found.warnings]
    return "\n".join([*lines, "Valid."])


def _first(found: FirstTick) -> Iterator[str]:
    if found.distances:
        yield "  start     " + ", ".join(f"{name} {1e3 * distance:.0f} mm from the nearest obstacle"
                                         for name, distance in found.distances.items())
    if found.status is None:
        yield "  tick 0    not resolved: there is no usable measurement yet"
        return
    solved = "" if found.status is Status.SOLVED else f", {found.status}"
    yield f"  tick 0    {' > '.join(found.levels)}{solved}"
    for line in found.unmet or ("Every level is met.",):
        yield fill(line, _WIDTH, initial_indent=_UNDER, subsequent_indent=f"{_UNDER}  ")


def _sections(scenario: Scenario) -> Iterator[str]:
    control = scenario.control
    yield f"  robot     {scenario.robot.model}"
    yield (f"  control   {control.level} level, {control.ticks} ticks of "
           f"{1e3 * control.period:g} ms")
    yield f"  plant     {scenario.plant.kind}"
    yield f"  resolver  {scenario.make_resolver()!r}"
    if scenario.pointing is not None:
        yield f"  pointing  {scenario.pointing.rows}, cone of {scenario.pointing.alpha_d:g} deg"
    if scenario.avoidance is not None:
        asked = scenario.avoidance
        body, tip = (" and ".join(f"{distance:g}" for distance in thresholds.values())
                     for thresholds in asked.thresholds.values())
        yield (f"  avoidance {asked.kind}, {counted(len(asked.obstacles), 'obstacle')}; within "
               f"{body} m of the body, {tip} m of the end effector")
    if scenario.limits is not None:
        yield (f"  limits    positions and velocities of the robot, {scenario.limits.acceleration} "
               f"rad/s^2, "
               f"{'in the stack' if scenario.limits_in_stack else 'as a guard outside the stack'}")
    for i, task in enumerate(scenario.tasks):
        yield f"  task {i:<4} {task.title}" + (f", {task.kind}" if task.name else "")
