"""Where a robot's model comes from: our tables, URDF and MJCF files, packages of such files.

Beside `hierarchy.robot` the only modules that call pinocchio; `Found` is what they give it.
"""
