#!/usr/bin/env python3
"""A controller in Python: brings a chaser to a station with on/off thrusters.

    source /opt/ros/jazzy/setup.bash        # nothing of lgvi needs to be built: all messages are standard ones
    export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
    python3 examples/python_ros/thruster_approach.py
    cargo run --release -- run scenes/thruster_approach.toml --await-thrust chaser --control-period 0.5   # another terminal

It asks for mean forces; the propagator makes pulses of them. The flight waits for each answer.
"""

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState

MASS, INERTIA, ARM = 150.0, np.array([30.0, 33.0, 36.0]), 0.6  # kg, kg m^2, m
GOAL = np.array([6.0, 0.0, 0.0])  # m, in the axes of the station
FACING = np.diag([-1.0, -1.0, 1.0])  # attitude of the chaser in these axes: it looks back at the station
# Closed loops: 1/s^2, 1/s.
APPROACH, BRAKE = 0.03**2, 2 * 0.03
STIFFNESS, DAMPING = 0.08**2, 2 * 0.08
# Force and arm of the thrusters by their names. Of two at one place that push in opposite directions, one fires.
PLACES = [(force, side) for force in range(3) for side in (1, 2)]


def unpack(odometry):
    """Position, attitude and velocity in the inertial frame, rate in the body's."""
    pose, twist = odometry.pose.pose, odometry.twist.twist
    w, u = pose.orientation.w, np.array([pose.orientation.x, pose.orientation.y, pose.orientation.z])
    cross = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    attitude = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    position = np.array([pose.position.x, pose.position.y, pose.position.z])
    velocity = attitude @ np.array([twist.linear.x, twist.linear.y, twist.linear.z])
    return position, attitude, velocity, np.array([twist.angular.x, twist.angular.y, twist.angular.z])


def load(station, chaser):
    """Force and moment in the axes of the chaser that bring it to the goal."""
    x0, r0, v0, w0 = unpack(station)
    x, r, v, w = unpack(chaser)
    position = r0.T @ (x - x0)
    velocity = r0.T @ (v - v0) - np.cross(w0, position)
    force = -MASS * (APPROACH * (position - GOAL) + BRAKE * velocity)
    turn = (r0 @ FACING).T @ r
    error = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    moment = -INERTIA * (STIFFNESS * error + DAMPING * (w - r.T @ r0 @ w0))
    return r.T @ (r0 @ force), moment


def thrust(force, moment):
    """Mean force of each thruster, by name."""
    forces = {}
    for axis, side in PLACES:
        # A force along x at y = ARM turns by -ARM about z, and so on in a cycle.
        turning = (-1 if side == 1 else 1) * moment[(axis + 2) % 3] / ARM
        both = 0.5 * (force[axis] + turning)
        for sign, name in ((1, "plus"), (-1, "minus")):
            forces[f"{'xyz'[axis]}_{name}_{side}"] = max(0.0, float(sign * both))
    return forces


class Approach(Node):
    def __init__(self):
        super().__init__("approach")
        self.thrust = self.create_publisher(JointState, "/lgvi_propagator/thrust/chaser", 10)
        self.latest = {}
        for body in ("station", "chaser"):
            topic = f"/lgvi_propagator/odometry/{body}"
            self.create_subscription(Odometry, topic, lambda message, body=body: self.hear(body, message), 1000)

    def hear(self, body, odometry):
        self.latest[body] = odometry
        station, chaser = self.latest.get("station"), self.latest.get("chaser")
        if station and chaser and station.header.stamp == chaser.header.stamp:
            forces = thrust(*load(station, chaser))
            self.thrust.publish(JointState(header=chaser.header, name=list(forces), effort=list(forces.values())))


def main():
    rclpy.init()
    try:
        rclpy.spin(Approach())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
