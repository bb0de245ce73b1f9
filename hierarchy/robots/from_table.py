"""Models of robots that are given as tables, and the capsules of their links."""

from collections import Counter
from typing import Any

import numpy as np

from hierarchy.avoidance.body import Capsule, ControlPoint, Vector
from hierarchy.errors import check_name
from hierarchy.problem import Array
from hierarchy.robots.found import Found
from hierarchy.robots.library import pin
from hierarchy.robots.table import Base, DHTable, Link, Table, TreeTable

END_EFFECTOR = "end_effector"
ROOT = "root_joint"
_HERE = (0.0, 0.0, 0.0)


def from_table(table: Table, base: Base | None = None) -> Found:
    """Make the model of a table; `base` overrides that of the table."""
    if isinstance(table, DHTable):
        return _from_chain(table, base or "fixed")
    return _from_tree(table, base or table.base)


def _from_chain(table: DHTable, base: Base) -> Found:
    model = empty(table.name, base)
    root = joint = model.njoints - 1
    placement, links = pin.SE3.Identity(), list[Capsule]()
    for i, d in enumerate(table.d):
        limit = np.deg2rad([table.range[i]])
        joint = add_joint(model, joint, pin.JointModelRZ(), placement, f"joint_{i + 1}",
                          np.array([table.effort[i]]), np.array([table.velocity[i]]), -limit, limit)
        alpha = np.deg2rad(table.alpha[i])
        c, s = np.round([np.cos(alpha), np.sin(alpha)], 15)  # exact for multiples of 90 degrees
        placement = pin.SE3(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]),
                            np.array([table.a[i], 0.0, d]))
        model.appendBodyToJoint(joint, _rod(table, i), pin.SE3.Identity())
        if (end := (table.a[i], 0.0, d)) != _HERE:  # neighbours cover a link of length zero
            links.append(Capsule(f"link {i + 1}", joint, _HERE, end, table.radius))
    model.addFrame(pin.Frame(END_EFFECTOR, joint, placement, pin.FrameType.OP_FRAME))
    return Found(model, END_EFFECTOR, tuple(links), _points(model, table.control_points, root),
                 table=table)


def _from_tree(table: TreeTable, base: Base) -> Found:
    model = empty(table.name, base)
    root = model.njoints - 1
    for joint in table.joints:
        lower, upper = np.deg2rad(joint.range)
        add_joint(model, _index(model, joint.parent, root), _REVOLUTE[joint.axis](),
                  pin.SE3(np.eye(3), np.array(joint.at)), joint.name, np.array([joint.effort]),
                  np.array([joint.velocity]), np.array([lower]), np.array([upper]))
    seen, capsules = Counter[str](), list[Capsule]()
    for name, link in (*((joint.name, joint.link) for joint in table.joints), *table.links):
        index = _index(model, name, root)
        model.appendBodyToJoint(index, _capsule_inertia(link), pin.SE3.Identity())
        if link.radius > 0.0:
            seen[name] += 1
            number = f" {seen[name]}" if seen[name] > 1 else ""
            capsules.append(Capsule(f"{name or 'base'}{number}", index, link.start, link.end,
                                    link.radius))
    for frame in table.frames:
        placement = pin.SE3(_axes_with_z(frame.z_axis), np.array(frame.offset))
        model.addFrame(pin.Frame(frame.name, _index(model, frame.joint, root), placement,
                                 pin.FrameType.OP_FRAME))
    q = np.array(pin.neutral(model))
    if base == "floating":
        q[2] = table.base_height
    q[model.nq - len(table.joints):] = np.deg2rad([joint.rest for joint in table.joints])
    return Found(model, table.end_effector, tuple(capsules),
                 _points(model, table.control_points, root), q, table=table)


def empty(name: str, base: Base) -> Any:
    """Return a model without bodies; its last joint is the floating base, or the world."""
    model = pin.Model()
    model.name = name
    if base == "floating":
        add_joint(model, 0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), ROOT)
    return model


def add_joint(model: Any, parent: int, joint: Any, place: Any, name: str, *limits: Array) -> int:
    """Add a joint and its frame, and return its index; `limits` as pinocchio takes them."""
    index = int(model.addJoint(parent, joint, place, name, *limits))
    model.addJointFrame(index, -1)
    return index


def _points(model: Any, points: tuple[tuple[str, Vector], ...], root: int
            ) -> tuple[ControlPoint, ...]:
    return tuple(ControlPoint(f"{joint} {list(offset)}", _index(model, joint, root),
                              np.array(offset, dtype=float)) for joint, offset in points)


def _index(model: Any, name: str, root: int) -> int:
    if name:  # of another one pinocchio returns an index beyond the end
        check_name(f"joint of table {model.name!r}", name, list(model.names)[1:])
    return int(model.getJointId(name)) if name else root


_REVOLUTE = {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ}


def _capsule_inertia(link: Link) -> Any:
    """Inertia of a uniform cylinder of the capsule's whole length about its own centre."""
    if link.mass == 0.0:
        return pin.Inertia.Zero()
    start, end = np.array(link.start), np.array(link.end)
    segment = end - start
    length = float(np.linalg.norm(segment))
    across = link.mass * (3 * link.radius**2 + (length + 2 * link.radius) ** 2) / 12
    along = link.mass * link.radius**2 / 2
    axis = segment / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    inertia = across * np.eye(3) + (along - across) * np.outer(axis, axis)
    return pin.Inertia(link.mass, (start + end) / 2, inertia)


def _axes_with_z(z_axis: Vector) -> Array:
    """Return a rotation (3, 3) whose third column is `z_axis`; the identity for z itself."""
    z = np.array(z_axis) / np.linalg.norm(z_axis)
    if z[2] > 1.0 - 1e-12:
        return np.eye(3)
    y = np.array([0.0, 1.0, 0.0]) if abs(z[1]) < 0.9 else np.array([0.0, 0.0, 1.0])
    x = np.cross(y, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _rod(table: DHTable, i: int) -> Any:
    """Inertia of a uniform cylinder from the joint to the next origin."""
    length = max(float(np.hypot(table.a[i], table.d[i])), 2 * table.radius)
    across = table.mass[i] * (3 * table.radius**2 + length**2) / 12
    along = table.mass[i] * table.radius**2 / 2
    end = table.a[i], 0.0, table.d[i]
    R = np.eye(3) if end == _HERE else _axes_with_z(end)
    return pin.Inertia(table.mass[i], np.array(end) / 2,
                       R @ np.diag([across, across, along]) @ R.T)
