"""A ROS 2 node that listens to odometry, on whatever host it is.

Prints, as JSON, how many nanoseconds lie between the stamps of neighboring messages (each once, in order), and the nodes
that it has seen, when it has received as many messages as it is told to.
"""

import argparse
import json

import rclpy
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("topic")
    arguments.add_argument("--count", type=int, required=True)
    arguments = arguments.parse_args()

    rclpy.init()
    node = rclpy.create_node("listener")
    stamps = []

    def receive(message):
        stamps.append(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)
        if len(stamps) == 1:
            print("hears", flush=True)

    node.create_subscription(Odometry, arguments.topic, receive, QoSProfile(depth=1000))
    while len(stamps) < arguments.count:
        rclpy.spin_once(node)
    nodes = [f"{namespace.rstrip('/')}/{name}" for name, namespace in node.get_node_names_and_namespaces()]
    steps = {after - before for before, after in zip(stamps, stamps[1:])}
    print(json.dumps({"nodes": sorted(nodes), "steps": sorted(steps)}))
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
