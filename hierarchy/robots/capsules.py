"""Capsules around the links of a robot that is given as a table."""

from __future__ import annotations

from collections.abc import Sequence

from hierarchy.avoidance.self_collision import Capsule
from hierarchy.robots.table import Table, TreeTable


def link_capsules(table: Table, foot: float = 0.0, base: int | None = None) -> tuple[Capsule, ...]:
    """Capsules of a robot given as a table; for an arm, each link from its joint to the next.

    Links of length zero are omitted because their neighbours cover them. With `foot` > 0 [m] the
    first capsule of an arm is a column from that far below the base frame up to it. Each touches
    the next. `base` is the index of the joint that moves the base, None for that of the table.
    """
    if isinstance(table, TreeTable):
        return _tree_capsules(table, int(table.base == "floating") if base is None else base)
    first = 1 + (base or 0)
    column = [Capsule("foot", first - 1, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), table.radius)]
    links = [Capsule(f"link {i + 1}", i + first, (0.0, 0.0, 0.0), (a, 0.0, d), table.radius)
             for i, (a, d) in enumerate(zip(table.a, table.d, strict=True)) if (a, d) != (0.0, 0.0)]
    return tuple((column if foot > 0.0 else []) + links)


def _tree_capsules(table: TreeTable, base: int) -> tuple[Capsule, ...]:
    index = {"": base, **{joint.name: base + i for i, joint in enumerate(table.joints, 1)}}
    links = [(name, link) for name, link in
             (*((joint.name, joint.link) for joint in table.joints), *table.links)
             if link.radius > 0.0]
    names = [name or "base" for name, _ in links]
    return tuple(Capsule(_numbered(names, k), index[name], link.start, link.end, link.radius)
                 for k, (name, link) in enumerate(links))


def _numbered(names: Sequence[str], k: int) -> str:
    """The k-th name, numbered from its second occurrence on."""
    before = names[:k].count(names[k])
    return f"{names[k]} {before + 1}" if before else names[k]
