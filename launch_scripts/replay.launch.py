"""Replays a bag: `ros2 launch lgvi replay.launch.py bag:=…`; --show-args lists the arguments."""

import os
import sys

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lgvi_nodes import common_arguments, managed_node, rviz, rviz_argument, typed, value


def nodes(context):
    player = {
        "bag": value(context, "bag"),
        "rate": typed(context, "rate"),
        "clock": typed(context, "clock"),
        "await_subscribers": typed(context, "await_subscribers"),
    }
    return [*rviz(context), managed_node(context, "player", player)]


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="The bag's directory, or its MCAP file"),
            DeclareLaunchArgument(
                "rate",
                default_value="",
                description="Recorded seconds a second, at least 0; 0: as fast as possible, without loss",
            ),
            DeclareLaunchArgument(
                "clock",
                default_value="",
                choices=["", "true", "false"],
                description="Publish /clock at the recorded times",
            ),
            DeclareLaunchArgument(
                "await_subscribers",
                default_value="",
                description="Hold until every topic has so many subscribers",
            ),
            rviz_argument(),
            *common_arguments(),
            OpaqueFunction(function=nodes),
        ]
    )
