"""A pendulum as URDF, with its joint's type and limit to be filled in."""

URDF = """<robot name="pendulum">
  <link name="base"/>
  <link name="arm"><inertial><mass value="1"/><origin xyz="0 0 -0.5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="hand"/>
  <joint name="hinge" type="{kind}"><parent link="base"/><child link="arm"/>
    <axis xyz="0 1 0"/>{limit}</joint>
  <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/>
    <origin xyz="0 0 -1"/></joint>
</robot>"""
LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="10"/>'
