#!/usr/bin/env python3
"""A controller in Python: reads the odometry of a body and answers each message with a wrench that stops the rotation.

    source /opt/ros/jazzy/setup.bash        # nothing of lgvi needs to be built: all messages are standard ones
    export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
    python3 examples/python_ros/detumble_live.py
    cargo run --release -- run scenes/free_body.toml --await-wrench body --control-period 0.1     # in another terminal

The flight waits for each answer: it does not matter how long the controller takes.
"""

import rclpy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

BODY = "body"
GAIN = 0.5  # N m s


class Detumble(Node):
    def __init__(self):
        super().__init__("detumble")
        self.wrench = self.create_publisher(WrenchStamped, f"/lgvi_propagator/wrench/{BODY}", 10)
        self.create_subscription(Odometry, f"/lgvi_propagator/odometry/{BODY}", self.answer, 1000)

    def answer(self, odometry):
        # The stamp says which state it answers, the frame that torques are in the axes of the body.
        message = WrenchStamped(header=odometry.header)
        message.header.frame_id = odometry.child_frame_id
        rate = odometry.twist.twist.angular
        torque = message.wrench.torque
        torque.x, torque.y, torque.z = -GAIN * rate.x, -GAIN * rate.y, -GAIN * rate.z
        self.wrench.publish(message)


def main():
    rclpy.init()
    try:
        rclpy.spin(Detumble())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
