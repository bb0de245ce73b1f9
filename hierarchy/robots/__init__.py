"""Sources of robots: our tables, URDF and MJCF files, packages of such files.

Besides `hierarchy.robot` and `hierarchy.state` only the readers here call pinocchio; they return
`Found`.
"""

from hierarchy.plugins import register
from hierarchy.robots.shipped import DUAL_ARM, HUMANOID, KUKA_LWR, QUADRUPED
from hierarchy.robots.table import DHTable, Link, Table, TreeFrame, TreeJoint, TreeTable

TABLES: dict[str, Table] = {table.name: table
                            for table in (KUKA_LWR, DUAL_ARM, HUMANOID, QUADRUPED)}
for _table in TABLES.values():
    register("robots", _table.name, shipped=True)(_table)

__all__ = ["DUAL_ARM", "HUMANOID", "KUKA_LWR", "QUADRUPED", "TABLES", "DHTable", "Link", "Table",
           "TreeFrame", "TreeJoint", "TreeTable"]
