"""A ROS 2 node that sends joint velocities out of a stack of tasks.

It is tested with stubs in place of ROS 2 only. Read it as a start for a node of your own, and try
that in simulation first.

    python ros2_node.py --ros-args -p urdf:=/path/to/robot.urdf -p end_effector:=tool0

It reads /joint_states, brings the end effector to the last point of /goal
(geometry_msgs/PointStamped in the base frame), and publishes velocities for a
forward_command_controller on /forward_velocity_controller/commands. Joint states that are older
than `stale` seconds or not finite, or an answer that is not verified, send zeros.
"""

import numpy as np
import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from hierarchy.paths import Still
from hierarchy.tasks import JointLimits, Position, Posture, model_rows
from task_hierarchy import Robot, Stack, State, Status, make


class TaskHierarchyNode(Node):
    """Mechanism, joint limits, the end effector's position, the posture at the start."""

    def __init__(self) -> None:
        super().__init__("task_hierarchy")
        urdf = self.declare_parameter("urdf", "").value
        end_effector = self.declare_parameter("end_effector", "").value or None
        self.period = float(self.declare_parameter("period", 0.01).value)
        self.stale = float(self.declare_parameter("stale", 0.05).value)
        self.acceleration = float(self.declare_parameter("acceleration", 5.0).value)
        self.robot = Robot.from_file(urdf, end_effector)
        self.resolver, self.memory = make("hcod"), None
        self.hand = self.robot.frame(self.robot.end_effector)
        self.state = self.stack = self.q = self.read_at = None
        self.sent = np.zeros(self.robot.n)
        self.create_subscription(JointState, "joint_states", self.on_joints,
                                 qos_profile_sensor_data)
        self.create_subscription(PointStamped, "goal", self.on_goal, 10)
        self.commands = self.create_publisher(
            Float64MultiArray, "forward_velocity_controller/commands", 10)
        self.create_timer(self.period, self.tick)

    def on_joints(self, message: JointState) -> None:
        """Keep the joints' positions, in the order of the robot's model."""
        known = dict(zip(message.name, message.position, strict=False))
        missing = [name for name in self.robot.joint_names if name not in known]
        if missing:
            self.get_logger().warning(f"joint states without {', '.join(missing)}",
                                      throttle_duration_sec=5.0)
            return
        read = np.array([known[name] for name in self.robot.joint_names])
        finite = np.isfinite(read).all()
        self.q = (self.robot.configuration(read) if finite
                  else np.full(self.robot.nq, np.nan))  # which `move` refuses
        self.read_at = self.get_clock().now()
        if self.state is None and finite:
            self.state = State.at(self.robot, self.q)
            self.go_to(self.state.position(self.hand))

    def on_goal(self, message: PointStamped) -> None:
        """Go to another point, if it is finite."""
        point = np.array([message.point.x, message.point.y, message.point.z])
        if self.state is not None and np.isfinite(point).all():
            self.go_to(point)

    def go_to(self, point: np.ndarray) -> None:
        """Make a stack whose hand goes to a point [m]."""
        posture = self.q if self.stack is None else self.stack["posture"].target
        self.stack = Stack([*model_rows(self.robot, self.period),
                            JointLimits(self.robot, self.acceleration, self.period),
                            Position(self.hand, Still(point.tolist()), gain=2.0),
                            Posture(tuple(posture))], "velocity")

    def tick(self) -> None:
        """Send the velocities of one period."""
        if self.state is None:
            return
        now = self.get_clock().now()
        old = (now - self.read_at).nanoseconds * 1e-9 > self.stale
        velocity = np.zeros(self.robot.n)
        if not old and self.state.move(now.nanoseconds * 1e-9, self.q, self.sent):
            self.state.commanded = self.sent
            resolution = self.resolver.solve(self.stack.hierarchy(self.state), self.memory)
            self.memory = resolution.memory
            if resolution.status is Status.SOLVED:
                velocity = resolution.x
        self.send(velocity)

    def send(self, velocity: np.ndarray) -> None:
        """Publish joint velocities [rad/s]."""
        self.sent = velocity
        self.commands.publish(Float64MultiArray(data=velocity.tolist()))


def main() -> None:
    """Run the node; zeros are the last thing it sends."""
    rclpy.init()
    node = TaskHierarchyNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.send(np.zeros(node.robot.n))
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
