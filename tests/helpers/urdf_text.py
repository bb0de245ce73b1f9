"""URDF files as text, and robots of them."""

from hierarchy import Robot

LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="3"/>'
INERTIAL = """<inertial><origin xyz="0.1 0.2 0.3"/><mass value="2"/>
  <inertia ixx="0.3" iyy="0.4" izz="0.5" ixy="0.01" ixz="0.02" iyz="0.03"/></inertial>"""


def joint(name, kind, parent, child, inside=LIMIT, axis="0 1 0", origin=""):
    axis = f'<axis xyz="{axis}"/>' if axis else ""
    return (f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f"{origin}{axis}{inside}</joint>")


def link(name, inside=INERTIAL):
    return f'<link name="{name}">{inside}</link>'


def placed(xyz, rpy="0 0 0"):
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def shape(geometry, xyz="0 0 0"):
    return f"<collision>{placed(xyz)}<geometry>{geometry}</geometry></collision>"


def urdf(*parts):
    return '<robot name="r">' + "".join(parts) + "</robot>"


def loaded(folder, *parts, end_effector=None, **options):
    """Return the robot of a URDF file that is written into a folder."""
    (folder / "r.urdf").write_text(urdf(*parts))
    return Robot.load(folder / "r.urdf", end_effector, **options)
