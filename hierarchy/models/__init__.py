"""Where a robot's model comes from: our tables, URDF and MJCF files, packages of such files.

Beside `hierarchy.robot` the only modules that call pinocchio. `Found` is what each of them gives.
"""

from hierarchy.models.files import read_file
from hierarchy.models.found import Found
from hierarchy.models.names import PACKAGES, file_of, in_package
from hierarchy.models.points import points_along_chain, proposed_end_effector
from hierarchy.models.tables import from_table

__all__ = ["PACKAGES", "Found", "file_of", "from_table", "in_package", "points_along_chain",
           "proposed_end_effector", "read_file"]
