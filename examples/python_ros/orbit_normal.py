#!/usr/bin/env python3
"""An ordinary ROS 2 node in Python: publishes the normal of the spacecraft's orbit, and logs its inclination.

    source /opt/ros/jazzy/setup.bash        # nothing of lgvi needs to be built: all messages are standard ones
    export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
    python3 examples/python_ros/orbit_normal.py
    cargo run --release -- run scenes/inclination_change.toml --real-time-factor 0.2        # in another terminal
"""

import math

import rclpy
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rotated(q, v):
    """v turned from the body into the inertial frame: v + 2 w (u × v) + 2 u × (u × v), q = (u, w)."""
    u = [q.x, q.y, q.z]
    t = cross(u, v)
    s = cross(u, t)
    return [v[i] + 2.0 * (q.w * t[i] + s[i]) for i in range(3)]


class OrbitNormal(Node):
    def __init__(self):
        super().__init__("orbit_normal")
        # What the propagator offers, so that nothing is lost and a late start sees the flight from its beginning.
        complete = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.normal = self.create_publisher(Vector3Stamped, "~/normal", complete)
        self.create_subscription(Odometry, "/lgvi_propagator/odometry/spacecraft", self.publish_normal, complete)

    def publish_normal(self, odometry):
        x, v = odometry.pose.pose.position, odometry.twist.twist.linear  # inertial, body frame
        momentum = cross([x.x, x.y, x.z], rotated(odometry.pose.pose.orientation, [v.x, v.y, v.z]))
        length = math.hypot(*momentum)
        message = Vector3Stamped(header=odometry.header)
        message.vector.x, message.vector.y, message.vector.z = (component / length for component in momentum)
        self.normal.publish(message)
        self.get_logger().info(f"inclination {math.degrees(math.acos(message.vector.z)):.3f}°")


def main():
    rclpy.init()
    try:
        rclpy.spin(OrbitNormal())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
