#!/usr/bin/env python3
"""A ROS 2 Jazzy node on rclpy and Fast DDS whose time is that of /clock: prints it, in nanoseconds, as it changes.

Ends when its input does.
"""

import select
import sys

import rclpy
from rclpy.parameter import Parameter


def input_has_ended():
    readable, _, _ = select.select([sys.stdin], [], [], 0.0)
    return bool(readable) and not sys.stdin.readline()


def main():
    rclpy.init(args=[])
    node = rclpy.create_node("ros2_clock_peer", parameter_overrides=[Parameter("use_sim_time", value=True)])
    said = 0
    while not input_has_ended():
        rclpy.spin_once(node, timeout_sec=0.02)
        if (now := node.get_clock().now().nanoseconds) != said:
            print(now, flush=True)
            said = now


if __name__ == "__main__":
    main()
