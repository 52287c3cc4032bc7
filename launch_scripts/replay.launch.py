"""Replays a bag: `ros2 launch lgvi replay.launch.py bag:=…`; --show-args lists the arguments."""

import os
import sys

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lgvi_nodes import SWITCH, common_arguments, managed_node, rviz, rviz_argument, typed, value


# Arguments that are parameters of the player, and what they are.
PARAMETERS = {
    "rate": "Recorded seconds a second, at least 0; 0: as fast as possible, without loss",
    "start_offset": "Begin so many seconds after the bag's first message",
    "duration": "Play for so many recorded seconds",
    "until": "End so many seconds after the bag's first message",
    "topics": "Topics to play, as ['/tf', '/odometry']; others are left out",
    "exclude_topics": "Topics to leave out, as ['/tf', '/odometry']",
    "await_subscribers": "Hold until every topic has so many subscribers",
}
SWITCHES = {
    "loop": "Begin anew at the end",
    "start_paused": "Begin with a pause, until ~/resume is called",
    "clock": "Publish /clock at the recorded times",
}
PATTERNS = {
    "regex": "Play topics whose names contain this regular expression",
    "exclude_regex": "Leave out topics whose names contain this regular expression",
}


def nodes(context):
    player = {name: value(context, name) for name in ("bag", *PATTERNS)}
    player |= {name: typed(context, name) for name in (*PARAMETERS, *SWITCHES)}
    return [*rviz(context), managed_node(context, "player", player)]


def argument(name, description, choices=None):
    return DeclareLaunchArgument(name, default_value="", choices=choices, description=description)


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="The bag's directory, or its MCAP file"),
            *(argument(*item) for item in (*PARAMETERS.items(), *PATTERNS.items())),
            *(argument(*item, choices=SWITCH) for item in SWITCHES.items()),
            rviz_argument(),
            *common_arguments(),
            OpaqueFunction(function=nodes),
        ]
    )
