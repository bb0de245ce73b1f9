"""Warnings from the first tick of a robot with contacts: why its run may fall, or prove nothing."""

from collections.abc import Iterator

import numpy as np

from hierarchy.problem import Array
from hierarchy.words import some
from scenarios.cell.plants.mjcf import of_drives
from scenarios.cell.plants.torque import inside
from scenarios.cell.robot import doubts
from scenarios.config.sections.plant import TorqueSection
from scenarios.loop.controller import Controller

_FAR_BEYOND = 2.0   # times its limit: an acceleration that is said
_FREE = 0.1         # share of a unit motion that no task holds from which a joint is said
_DEPENDENT = 1e-6   # singular value of rows of length one up to which they depend on each other
_LEVEL = 0.999      # vertical part of the normal of a level surface
_NEARBY = 0.01      # [rad or m] to the posture in which their rank is that of other postures


def footing(controller: Controller) -> Iterator[str]:
    """Yield the warnings; this moves the controller's state."""
    cell = controller.cell
    if cell.contacts is None:
        return
    yield from doubts(cell.scenario, cell.contacts)
    yield from _unlimited(controller)
    if isinstance(cell.scenario.plant, TorqueSection):
        yield from _balanced(controller)
        yield from _unsupported(controller)
    if controller.answered:
        if controller.sent.size:  # there are joints
            yield from _too_fast(controller)
            yield from _held_by_friction(controller)
        yield from _not_held(controller)
        yield from _dependent(controller)


def _balanced(controller: Controller) -> Iterator[str]:
    """Yield which bodies the plant gives another inertia."""
    moments = {body.name: np.linalg.eigvalsh(body.inertia)
               for body in controller.cell.robot.bodies()}
    names = [name for name, (least, middle, most) in moments.items()
             if most > (least + middle) * (1.0 + _DEPENDENT)]
    if names:
        yield (f"no body has the inertia that moves with {some(names)}: the largest principal "
               "moment is more than the sum of the others. The plant has their mean instead")


def _unlimited(controller: Controller) -> Iterator[str]:
    """Yield the joints whose torques are to be limited, by a limit that they lack."""
    robot, limits = controller.cell.robot, controller.cell.scenario.limits
    names = [robot.velocity_names[i] for i in range(robot.actuated, robot.n)
             if not np.isfinite(robot.effort_limit[i])]
    if names and limits is not None and limits.torque:
        yield f"limits.torque does not limit {some(names)}, which have no effort limit"


def _unsupported(controller: Controller) -> Iterator[str]:
    """Yield that the centre of mass is at the start not above the contacts, all on the floor."""
    cell = controller.cell
    state, robot = cell.state, cell.robot
    closed = [one for one in cell.contacts.contacts if one.load(0.0) > 0.0] if cell.contacts else []
    weightless = not np.any(robot.model.gravity.linear)
    if robot.base == "fixed" or weightless or any(_LEVEL > one.axes[2, 2] for one in closed):
        return
    points = [state.position(one.frame) + np.array(one.points) @ state.rotation(one.frame).T
              for one in closed]
    margin = inside(np.concatenate([np.empty((0, 3)), *points])[:, :2], state.centre_of_mass()[:2])
    if np.isnan(margin):
        yield "the contacts span no area, so the robot cannot stand still"
    elif margin < 0.0:
        yield (f"the centre of mass is at the start {-1e3 * margin:.0f} mm outside the polygon of "
               "the contacts, so the robot cannot stand still there")


def _too_fast(controller: Controller) -> Iterator[str]:
    """Yield which joint is to accelerate too fast."""
    robot, limits = controller.cell.robot, controller.cell.tasks.limits
    if limits is None:
        return
    asked = controller.resolution.x[robot.actuated:robot.n]
    limit = limits.limits.acceleration[-len(asked):]  # a base may have limits too
    i = int((np.abs(asked) / limit).argmax())
    if abs(asked[i]) > _FAR_BEYOND * limit[i]:
        unit = robot.velocity_units[robot.actuated + i]
        yield (f"the first tick asks joint {robot.velocity_names[robot.actuated + i]} for "
               f"{asked[i]:.3g} {unit}/s^2, {abs(asked[i]) / limit[i]:.2g} times its limit of "
               f"{limit[i]:g} (limits.acceleration)")


def _held_by_friction(controller: Controller) -> Iterator[str]:
    """Yield that drives as large as the effort limits say would hold the robot by friction."""
    plant, robot = controller.cell.scenario.plant, controller.cell.robot
    if (robot.base == "fixed" or not isinstance(plant, TorqueSection)
            or plant.joint_friction is not None):
        return
    friction = float(np.median(of_drives(robot, "joint_friction", None)[robot.actuated:]))
    most = float(np.abs(controller.sent).max())
    if friction > most:
        yield (f"the friction of the drives, by default {friction:.3g} N m, is more than the "
               f"largest torque of the first tick, {most:.3g} N m: it holds the robot, whatever "
               "is commanded. Unless the file's effort limits are true, set plant.joint_friction, "
               "joint_damping and armature")


def _not_held(controller: Controller) -> Iterator[str]:
    """Yield the joints whose motion no equality determines."""
    robot, h = controller.cell.robot, controller.hierarchy
    moved = h.A[:, :robot.n].any(axis=1)
    rows = _unit(h.A[moved & (h.lower == h.upper)])
    s, directions = np.linalg.svd(rows)[1:]
    free = directions[int((s > _DEPENDENT).sum()):, robot.actuated:robot.n]
    names = [robot.velocity_names[robot.actuated + i]
             for i in np.flatnonzero(np.linalg.norm(free, axis=0) > _FREE)]
    if names:
        yield (f"no task holds {some(names)}: contact forces and limits decide how they move. "
               '[[tasks]] kind = "posture" above "least-force" holds them')


def _dependent(controller: Controller) -> Iterator[str]:
    """Yield that contacts and mechanism have fewer independent rows at the start than nearby."""
    cell, h = controller.cell, controller.hierarchy
    holding = np.isin(np.repeat(h.names, h.sizes), ("mechanism", "physics"))
    order, rest = h.names, np.zeros(cell.robot.n)

    def rank(q: Array) -> int:
        cell.state.move(0.0, q, rest)
        rows = cell.stack.hierarchy(cell.state, order).A[holding]
        return int((np.linalg.svd(_unit(rows), compute_uv=False) > _DEPENDENT).sum())

    q = cell.state.q.copy()
    turned = _NEARBY * np.random.default_rng(0).normal(size=cell.robot.n)
    here, near = rank(q), rank(cell.robot.integrate(q, turned))
    if here < near:
        yield (f"at the start {near - here} of {near} rows that hold the contacts depend on the "
               "others, and nearby they do not, as of parallel legs with five joints: answers "
               "there may be INACCURATE, or large. Turn the feet outward with start.joints")


def _unit(rows: Array) -> Array:
    """Return the rows that are not zero, at length one."""
    length = np.linalg.norm(rows, axis=1)
    return np.asarray(rows[length > 0.0] / length[length > 0.0, None])
