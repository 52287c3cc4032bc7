"""Starts one node with its parameter file: `ros2 launch lgvi node.launch.py node:=propagator params_file:=…`."""

import os
import sys

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lgvi_nodes import common_arguments, managed_node, value


def nodes(context):
    return [managed_node(context, value(context, "node"), name=value(context, "name"))]


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "node",
                choices=["propagator", "planner", "recorder", "player"],
                description="Which node",
            ),
            DeclareLaunchArgument(
                "name", default_value="", description="The node's name; empty: lgvi_ and its kind"
            ),
            *common_arguments(),
            OpaqueFunction(function=nodes),
        ]
    )
