#!/usr/bin/env python3
"""A controller in Python: turns a satellite by 90° with its reaction wheels.

    source /opt/ros/jazzy/setup.bash        # nothing of lgvi needs to be built: all messages are standard ones
    export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
    python3 examples/python_ros/wheel_slew.py
    cargo run --release -- run scenes/wheel_slew.toml --await-wheels satellite --control-period 0.1     # in another terminal

The flight waits for each answer: it does not matter how long the controller takes.
"""

from math import sqrt

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState

BODY = "satellite"
INERTIA = [0.35, 0.3, 0.2]  # kg m^2
AXES = {"wheel_1": (1, 0, 1), "wheel_2": (0, 1, 1), "wheel_3": (-1, 0, 1), "wheel_4": (0, -1, 1)}  # times 1/sqrt(2)
TARGET = (sqrt(0.5), 0.0, sqrt(0.5), 0.0)  # w, x, y, z: a quarter turn about the y axis
STIFFNESS, DAMPING = 0.1, 0.5  # of the closed loop: 1/s^2, 1/s


def error(attitude):
    """Twice the vector part of TARGET^-1 attitude, for the shorter way."""
    w, x, y, z = attitude.w, attitude.x, attitude.y, attitude.z
    a, b, c, d = TARGET[0], -TARGET[1], -TARGET[2], -TARGET[3]
    scalar = a * w - b * x - c * y - d * z
    vector = (a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w)
    return [2 * part if scalar >= 0 else -2 * part for part in vector]


class Slew(Node):
    def __init__(self):
        super().__init__("slew")
        self.torque = self.create_publisher(JointState, f"/lgvi_propagator/wheel_torque/{BODY}", 10)
        self.create_subscription(Odometry, f"/lgvi_propagator/odometry/{BODY}", self.answer, 1000)

    def answer(self, odometry):
        rate = odometry.twist.twist.angular
        wanted = [
            -inertia * (STIFFNESS * turn + DAMPING * rate)
            for inertia, turn, rate in zip(INERTIA, error(odometry.pose.pose.orientation), (rate.x, rate.y, rate.z))
        ]
        # The least torques t with A t = -wanted, where A has the axes as columns: A A^T = diag(1, 1, 2).
        x, y, z = wanted[0], wanted[1], wanted[2] / 2
        message = JointState(header=odometry.header, name=list(AXES))
        message.effort = [-(a * x + b * y + c * z) / sqrt(2) for a, b, c in AXES.values()]
        self.torque.publish(message)


def main():
    rclpy.init()
    try:
        rclpy.spin(Slew())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
