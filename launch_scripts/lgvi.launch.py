"""Starts the nodes of one flight: `ros2 launch lgvi lgvi.launch.py scene:=… [bag:=…]`; --show-args lists the arguments."""

import os
import sys

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from lgvi_nodes import common_arguments, managed_node, rviz, rviz_argument, typed, value


def nodes(context):
    """The flight's nodes; the recorder first, which also hears their first words then."""
    scene = value(context, "scene")
    bag = value(context, "bag")
    propagator = "lgvi_propagator"
    prefix = value(context, "frame_prefix")
    recorder = {
        "output": bag,
        "frame_prefix": prefix,
        "log_time": value(context, "log_time"),
        # Plans may take long before the first state.
        "await_stamp": True if value(context, "log_time") == "stamp" else None,
    }
    flight = {
        "scene": scene,
        "frame_prefix": prefix,
        "real_time_factor": typed(context, "real_time_factor"),
        # A recorded flight begins when the recorder listens.
        "await_subscribers": 1 if bag else None,
    }
    started = []
    if bag:
        started.append(managed_node(context, "recorder", recorder))
    if value(context, "plan") == "true":
        remappings = [("~/state", f"{propagator}/state")]
        planner = {"scene": scene, "frame_prefix": prefix}
        started.append(managed_node(context, "planner", planner, remappings))
    remappings = [("~/control_sequence", "lgvi_planner/control_sequence")]
    started.append(managed_node(context, "propagator", flight, remappings))
    return started + rviz(context)


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("scene", description="Path of the scene file"),
            DeclareLaunchArgument(
                "bag",
                default_value="",
                description="Directory of the bag, which must not exist; empty: nothing is recorded",
            ),
            DeclareLaunchArgument(
                "log_time",
                # Else a bag would not be the flight's but that of its reception.
                default_value="stamp",
                choices=["stamp", "received"],
                description="What the recorder logs messages at",
            ),
            DeclareLaunchArgument(
                "plan",
                default_value="true",
                choices=["true", "false"],
                description="Start the planner; false: controls come from elsewhere, or never",
            ),
            DeclareLaunchArgument(
                "real_time_factor",
                default_value="",
                description="Simulated seconds a second, at least 0; 0: as fast as possible, without loss",
            ),
            DeclareLaunchArgument(
                "frame_prefix",
                default_value="",
                description="What stands before the names of the flight's frames; empty: the namespace and a slash",
            ),
            rviz_argument(),
            *common_arguments(),
            OpaqueFunction(function=nodes),
        ]
    )
