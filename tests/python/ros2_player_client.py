#!/usr/bin/env python3
"""A ROS 2 Jazzy node on rclpy and Fast DDS that calls the services of a player, of a bag that begins at a time.

    ros2_player_client.py /lgvi_player <nanoseconds>

Prints what was answered as JSON, and stops the player.
"""

import json
import sys
import time

import rclpy
from builtin_interfaces.msg import Time
from rosbag2_interfaces.srv import Burst, GetRate, IsPaused, PlayNext, Seek, SetRate, Stop

player, start = sys.argv[1], int(sys.argv[2])
rclpy.init(args=[])
node = rclpy.create_node("ros2_player_client")

SERVICES = {
    "is_paused": IsPaused,
    "burst": Burst,
    "play_next": PlayNext,
    "seek": Seek,
    "set_rate": SetRate,
    "get_rate": GetRate,
    "stop": Stop,
}
clients = {name: node.create_client(kind, f"{player}/{name}") for name, kind in SERVICES.items()}


def call(service, **request):
    client = clients[service]
    if not client.wait_for_service(timeout_sec=30):
        sys.exit(f"{service} is not there")
    future = client.call_async(SERVICES[service].Request(**request))
    rclpy.spin_until_future_complete(node, future, timeout_sec=30)
    if not future.done():
        sys.exit(f"{service} does not answer")
    return future.result()


def after(milliseconds):
    nanoseconds = start + milliseconds * 1_000_000
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


answers = {"is_paused": call("is_paused").paused}
# The player awaits subscribers first.
end = time.monotonic() + 30
while not (burst := call("burst", num_messages=4).actually_burst) and time.monotonic() < end:
    time.sleep(0.05)
answers["burst"] = burst
answers["play_next"] = call("play_next").success
answers["seek"] = call("seek", time=after(700)).success
answers["seek_beyond"] = call("seek", time=after(1000)).success
call("play_next")
answers["set_rate_0"] = call("set_rate", rate=0.0).success
answers["set_rate"] = call("set_rate", rate=2.0).success
answers["get_rate"] = call("get_rate").rate
print(json.dumps(answers))
call("stop")
