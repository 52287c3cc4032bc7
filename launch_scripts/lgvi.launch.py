"""Starts the nodes of one flight under `ros2 launch`.

ros2 launch launch_scripts/lgvi.launch.py scene:=scenes/inclination_change.toml bag:=/tmp/flight

The node binaries (lgvi_propagator, lgvi_planner, lgvi_recorder) must be on the PATH, as after
`cargo install --path nodes/propagator` and so on. Arguments:

scene             path of the scene file (required)
bag               directory of the bag, which must not exist; empty: nothing is recorded
plan              whether to start the planner (true)
real_time_factor  simulated seconds a second; 0: as fast as possible, without loss (1.0)
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression


def node(name, parameters, remaps=(), condition=None):
    """A node's process; parameters are pairs of a name and the substitutions of its value."""
    command = [name, "--ros-args"]
    for parameter, value in parameters:
        command += ["-p", [parameter, ":=", *value]]
    for remap in remaps:
        command += ["-r", remap]
    return ExecuteProcess(cmd=command, name=name, output="screen", condition=condition)


def generate_launch_description():
    scene = LaunchConfiguration("scene")
    bag = LaunchConfiguration("bag")
    factor = LaunchConfiguration("real_time_factor")
    return LaunchDescription(
        [
            DeclareLaunchArgument("scene", description="path of the scene file"),
            DeclareLaunchArgument("bag", default_value="", description="directory of the bag"),
            DeclareLaunchArgument("plan", default_value="true", description="start the planner"),
            DeclareLaunchArgument(
                "real_time_factor", default_value="1.0", description="simulated seconds a second"
            ),
            node(
                "lgvi_recorder",
                [("output", ["'", bag, "'"]), ("use_sim_time", ["true"])],
                condition=IfCondition(PythonExpression(["'", bag, "' != ''"])),
            ),
            node(
                "lgvi_planner",
                [("scene", ["'", scene, "'"])],
                remaps=["~/state:=/lgvi_propagator/state"],
                condition=IfCondition(LaunchConfiguration("plan")),
            ),
            node(
                "lgvi_propagator",
                [
                    ("scene", ["'", scene, "'"]),
                    ("real_time_factor", [factor]),
                    # A recorded flight begins when the recorder listens.
                    ("await_subscribers", [PythonExpression(["1 if '", bag, "' != '' else 0"])]),
                ],
                remaps=["~/control_sequence:=/lgvi_planner/control_sequence"],
            ),
        ]
    )
